//! Shape functions of the faces of solids, by kind.

use super::{ElementKind, Quad4, Quad8, Quad9, ShapeFunctions, Tri3, Tri6};

/// Largest number of nodes of a face.
pub const MAX_FACE_NODES: usize = 9;

macro_rules! surfaces {
    ($($element:ident, $n:literal;)*) => {
        impl ElementKind {
            /// Values of the shape functions of a surface at `xi`. Entries beyond the nodes of the surface are 0. For
            /// kinds that are not surfaces, all entries are 0.
            pub fn face_values(self, xi: [f64; 2]) -> [f64; MAX_FACE_NODES] {
                let mut all = [0.0; MAX_FACE_NODES];
                match self {
                    $(Self::$element => all[..$n].copy_from_slice(&$element::values(xi)),)*
                    _ => {}
                }
                all
            }

            /// Derivatives with respect to the reference coordinates at `xi`, with zeros as in [`Self::face_values`].
            pub fn face_gradients(self, xi: [f64; 2]) -> [[f64; 2]; MAX_FACE_NODES] {
                let mut all = [[0.0; 2]; MAX_FACE_NODES];
                match self {
                    $(Self::$element => all[..$n].copy_from_slice(&$element::gradients(xi)),)*
                    _ => {}
                }
                all
            }

            /// Reference coordinates of the nodes of a surface, corners first; empty for kinds that are not surfaces.
            pub fn face_reference_nodes(self) -> &'static [[f64; 2]] {
                match self {
                    $(Self::$element => &<$element as ShapeFunctions<$n, 2>>::NODES,)*
                    _ => &[],
                }
            }

            /// Area of the reference element of a surface.
            pub fn face_reference_area(self) -> f64 {
                if self.n_corners() == 3 { 0.5 } else { 4.0 }
            }
        }
    };
}

surfaces! {
    Tri3, 3;
    Tri6, 6;
    Quad4, 4;
    Quad8, 8;
    Quad9, 9;
}
