//! Tables of the element kinds: faces of the solids in gmsh's node numbers, and VTK's node order.
//!
//! # Source
//! gmsh reference manual, "Node ordering"; VTK file formats, cell types.

use super::ElementKind::{self, Quad4, Quad8, Quad9, Tri3, Tri6};

type Face = (ElementKind, &'static [usize]);

impl ElementKind {
    /// Node order of VTK: node `i` of the VTK cell is node `vtk_order()[i]` in gmsh's order (13 entries for the 14-node pyramid).
    pub fn vtk_order(self) -> &'static [usize] {
        match self {
            Self::Tet10 => TET10_VTK,
            Self::Hex20 => HEX20_VTK,
            Self::Hex27 => HEX27_VTK,
            Self::Wedge15 => WEDGE15_VTK,
            Self::Wedge18 => WEDGE18_VTK,
            Self::Pyramid13 | Self::Pyramid14 => PYRAMID13_VTK,
            _ => &IDENTITY[..self.n_nodes()],
        }
    }

    /// Faces of a solid: for each face its kind, and its nodes in gmsh's order as indices into the nodes of the solid. Normals
    /// point outward for a positive Jacobian. Empty for points, lines and surfaces.
    pub const fn local_faces(self) -> &'static [(ElementKind, &'static [usize])] {
        match self {
            Self::Tet4 => TET4_FACES,
            Self::Tet10 => TET10_FACES,
            Self::Hex8 => HEX8_FACES,
            Self::Hex20 => HEX20_FACES,
            Self::Hex27 => HEX27_FACES,
            Self::Wedge6 => WEDGE6_FACES,
            Self::Wedge15 => WEDGE15_FACES,
            Self::Wedge18 => WEDGE18_FACES,
            Self::Pyramid5 => PYRAMID5_FACES,
            Self::Pyramid13 => PYRAMID13_FACES,
            Self::Pyramid14 => PYRAMID14_FACES,
            _ => &[],
        }
    }
}

const TET4_FACES: &[Face] = &[(Tri3, &[0, 2, 1]), (Tri3, &[0, 1, 3]), (Tri3, &[0, 3, 2]), (Tri3, &[1, 2, 3])];
const TET10_FACES: &[Face] = &[
    (Tri6, &[0, 2, 1, 6, 5, 4]),
    (Tri6, &[0, 1, 3, 4, 9, 7]),
    (Tri6, &[0, 3, 2, 7, 8, 6]),
    (Tri6, &[1, 2, 3, 5, 8, 9]),
];
const HEX8_FACES: &[Face] = &[
    (Quad4, &[0, 3, 2, 1]),
    (Quad4, &[0, 1, 5, 4]),
    (Quad4, &[0, 4, 7, 3]),
    (Quad4, &[1, 2, 6, 5]),
    (Quad4, &[2, 3, 7, 6]),
    (Quad4, &[4, 5, 6, 7]),
];
const HEX20_FACES: &[Face] = &[
    (Quad8, &[0, 3, 2, 1, 9, 13, 11, 8]),
    (Quad8, &[0, 1, 5, 4, 8, 12, 16, 10]),
    (Quad8, &[0, 4, 7, 3, 10, 17, 15, 9]),
    (Quad8, &[1, 2, 6, 5, 11, 14, 18, 12]),
    (Quad8, &[2, 3, 7, 6, 13, 15, 19, 14]),
    (Quad8, &[4, 5, 6, 7, 16, 18, 19, 17]),
];
const HEX27_FACES: &[Face] = &[
    (Quad9, &[0, 3, 2, 1, 9, 13, 11, 8, 20]),
    (Quad9, &[0, 1, 5, 4, 8, 12, 16, 10, 21]),
    (Quad9, &[0, 4, 7, 3, 10, 17, 15, 9, 22]),
    (Quad9, &[1, 2, 6, 5, 11, 14, 18, 12, 23]),
    (Quad9, &[2, 3, 7, 6, 13, 15, 19, 14, 24]),
    (Quad9, &[4, 5, 6, 7, 16, 18, 19, 17, 25]),
];
const WEDGE6_FACES: &[Face] = &[
    (Tri3, &[0, 2, 1]),
    (Tri3, &[3, 4, 5]),
    (Quad4, &[0, 1, 4, 3]),
    (Quad4, &[0, 3, 5, 2]),
    (Quad4, &[1, 2, 5, 4]),
];
const WEDGE15_FACES: &[Face] = &[
    (Tri6, &[0, 2, 1, 7, 9, 6]),
    (Tri6, &[3, 4, 5, 12, 14, 13]),
    (Quad8, &[0, 1, 4, 3, 6, 10, 12, 8]),
    (Quad8, &[0, 3, 5, 2, 8, 13, 11, 7]),
    (Quad8, &[1, 2, 5, 4, 9, 11, 14, 10]),
];
const WEDGE18_FACES: &[Face] = &[
    (Tri6, &[0, 2, 1, 7, 9, 6]),
    (Tri6, &[3, 4, 5, 12, 14, 13]),
    (Quad9, &[0, 1, 4, 3, 6, 10, 12, 8, 15]),
    (Quad9, &[0, 3, 5, 2, 8, 13, 11, 7, 16]),
    (Quad9, &[1, 2, 5, 4, 9, 11, 14, 10, 17]),
];
const PYRAMID5_FACES: &[Face] =
    &[(Quad4, &[0, 3, 2, 1]), (Tri3, &[0, 1, 4]), (Tri3, &[3, 0, 4]), (Tri3, &[1, 2, 4]), (Tri3, &[2, 3, 4])];
const PYRAMID13_FACES: &[Face] = &[
    (Quad8, &[0, 3, 2, 1, 6, 10, 8, 5]),
    (Tri6, &[0, 1, 4, 5, 9, 7]),
    (Tri6, &[3, 0, 4, 6, 7, 12]),
    (Tri6, &[1, 2, 4, 8, 11, 9]),
    (Tri6, &[2, 3, 4, 10, 12, 11]),
];
const PYRAMID14_FACES: &[Face] = &[
    (Quad9, &[0, 3, 2, 1, 6, 10, 8, 5, 13]),
    (Tri6, &[0, 1, 4, 5, 9, 7]),
    (Tri6, &[3, 0, 4, 6, 7, 12]),
    (Tri6, &[1, 2, 4, 8, 11, 9]),
    (Tri6, &[2, 3, 4, 10, 12, 11]),
];

const IDENTITY: [usize; 9] = [0, 1, 2, 3, 4, 5, 6, 7, 8];
const TET10_VTK: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 9, 8];
const HEX20_VTK: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15];
const HEX27_VTK: &[usize] =
    &[0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15, 22, 23, 21, 24, 20, 25, 26];
const WEDGE15_VTK: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11];
const WEDGE18_VTK: &[usize] = &[0, 1, 2, 3, 4, 5, 6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16];
const PYRAMID13_VTK: &[usize] = &[0, 1, 2, 3, 4, 5, 8, 10, 6, 7, 9, 11, 12];
