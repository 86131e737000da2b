//! Reference nodes and shape functions of the solids, by kind.

use super::{
    ElementKind, Hex8, Hex20, Hex27, Pyramid5, Pyramid13, Pyramid14, ShapeFunctions, Tet4, Tet10, Wedge6,
    Wedge15, Wedge18,
};

macro_rules! solids {
    ($($element:ident),*) => {
        impl ElementKind {
            /// Reference coordinates of the nodes of a solid, `[n_nodes]`; empty for points, lines and surfaces.
            pub fn reference_nodes(self) -> Vec<[f64; 3]> {
                match self {
                    $(Self::$element => $element::NODES.to_vec(),)*
                    _ => Vec::new(),
                }
            }

            /// Values of the shape functions of a solid at the reference coordinates `xi`, `[n_nodes]`; empty for points,
            /// lines and surfaces.
            pub fn shape_values(self, xi: [f64; 3]) -> Vec<f64> {
                match self {
                    $(Self::$element => $element::values(xi).to_vec(),)*
                    _ => Vec::new(),
                }
            }

            /// Derivatives of the shape functions with respect to the reference coordinates at `xi`, `[n_nodes]`; empty for points,
            /// lines and surfaces.
            pub fn shape_gradients(self, xi: [f64; 3]) -> Vec<[f64; 3]> {
                match self {
                    $(Self::$element => $element::gradients(xi).to_vec(),)*
                    _ => Vec::new(),
                }
            }
        }
    };
}

solids!(Hex8, Hex20, Hex27, Tet4, Tet10, Wedge6, Wedge15, Wedge18, Pyramid5, Pyramid13, Pyramid14);
