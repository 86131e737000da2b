//! Meshes of solids and surfaces with physical groups.

use crate::element::ElementKind;

/// All cells of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// Their kind.
    pub kind: ElementKind,
    /// Node indices (0-based, into [`Mesh::points`]), `[n_cells, kind.n_nodes()]` row by row, gmsh's node order.
    pub nodes: Vec<usize>,
    /// The file's own element numbers, `[n_cells]` (for messages).
    pub tags: Vec<u64>,
}

/// A cell: block and index in the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CellRef {
    /// Index into [`Mesh::blocks`].
    pub block: usize,
    /// Index of the cell in its block.
    pub cell: usize,
}

/// A named set of cells of one dimension.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalGroup {
    /// Its name, or its tag in decimal where the file gives none.
    pub name: String,
    /// Dimension of its cells.
    pub dim: usize,
    /// The file's tag.
    pub tag: i64,
    /// Its cells.
    pub cells: Vec<CellRef>,
}

/// Points, cells by kind, physical groups.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Where it came from (file name, or "structured"), for messages.
    pub source: String,
    /// Coordinates, `[n_points, 3]`, in the scene's length unit.
    pub points: Vec<[f64; 3]>,
    /// Cells by kind.
    pub blocks: Vec<Block>,
    /// Physical groups.
    pub groups: Vec<PhysicalGroup>,
}
