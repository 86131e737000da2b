/// Kind of a mesh cell, with gmsh's node order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum ElementKind {
    Point1,
    Line2,
    Line3,
    Tri3,
    Tri6,
    Quad4,
    Quad8,
    Quad9,
    Tet4,
    Tet10,
    Hex8,
    Hex20,
    Hex27,
    Wedge6,
    Wedge15,
    Wedge18,
    Pyramid5,
    Pyramid13,
    Pyramid14,
}

struct Facts {
    dim: usize,
    corners: usize,
    nodes: usize,
    gmsh: u32,
    vtk: u8,
    name: &'static str,
}

const fn facts(dim: usize, corners: usize, nodes: usize, gmsh: u32, vtk: u8, name: &'static str) -> Facts {
    Facts { dim, corners, nodes, gmsh, vtk, name }
}

impl ElementKind {
    /// All element kinds.
    pub const ALL: [Self; 19] = [
        Self::Point1,
        Self::Line2,
        Self::Line3,
        Self::Tri3,
        Self::Tri6,
        Self::Quad4,
        Self::Quad8,
        Self::Quad9,
        Self::Tet4,
        Self::Tet10,
        Self::Hex8,
        Self::Hex20,
        Self::Hex27,
        Self::Wedge6,
        Self::Wedge15,
        Self::Wedge18,
        Self::Pyramid5,
        Self::Pyramid13,
        Self::Pyramid14,
    ];

    const fn facts(self) -> Facts {
        match self {
            Self::Point1 => facts(0, 1, 1, 15, 1, "point"),
            Self::Line2 => facts(1, 2, 2, 1, 3, "line2"),
            Self::Line3 => facts(1, 2, 3, 8, 21, "line3"),
            Self::Tri3 => facts(2, 3, 3, 2, 5, "tri3"),
            Self::Tri6 => facts(2, 3, 6, 9, 22, "tri6"),
            Self::Quad4 => facts(2, 4, 4, 3, 9, "quad4"),
            Self::Quad8 => facts(2, 4, 8, 16, 23, "quad8"),
            Self::Quad9 => facts(2, 4, 9, 10, 28, "quad9"),
            Self::Tet4 => facts(3, 4, 4, 4, 10, "tet4"),
            Self::Tet10 => facts(3, 4, 10, 11, 24, "tet10"),
            Self::Hex8 => facts(3, 8, 8, 5, 12, "hex8"),
            Self::Hex20 => facts(3, 8, 20, 17, 25, "hex20"),
            Self::Hex27 => facts(3, 8, 27, 12, 29, "hex27"),
            Self::Wedge6 => facts(3, 6, 6, 6, 13, "wedge6"),
            Self::Wedge15 => facts(3, 6, 15, 18, 26, "wedge15"),
            Self::Wedge18 => facts(3, 6, 18, 13, 32, "wedge18"),
            Self::Pyramid5 => facts(3, 5, 5, 7, 14, "pyramid5"),
            Self::Pyramid13 => facts(3, 5, 13, 19, 27, "pyramid13"),
            Self::Pyramid14 => facts(3, 5, 14, 14, 27, "pyramid14"),
        }
    }

    /// Dimension of the cell: 0 point, 1 line, 2 surface, 3 solid.
    pub const fn dim(self) -> usize {
        self.facts().dim
    }

    /// Number of nodes.
    pub const fn n_nodes(self) -> usize {
        self.facts().nodes
    }

    /// Number of corner nodes, which come first in the node order.
    pub const fn n_corners(self) -> usize {
        self.facts().corners
    }

    /// Element type number in .msh files.
    pub const fn gmsh_code(self) -> u32 {
        self.facts().gmsh
    }

    /// Kind of an element type number in .msh files; `None` for other types, such as elements of order 3.
    pub fn from_gmsh_code(code: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.gmsh_code() == code)
    }

    /// Cell type of VTK. VTK has no 14-node pyramid, so this kind is written as a 13-node pyramid.
    pub const fn vtk_code(self) -> u8 {
        self.facts().vtk
    }

    /// Name in lower case with the number of nodes ("hex8").
    pub const fn name(self) -> &'static str {
        self.facts().name
    }
}
