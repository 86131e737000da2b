//! Meshes of solids and surfaces with physical groups.

pub mod closed_surface;
pub mod faces;
pub mod gmsh;
mod groups;
pub mod quality;
pub mod self_intersection;
pub mod size_field;
#[cfg(test)]
#[path = "../../tests/fixtures/structured.rs"]
pub mod structured;

use crate::element::ElementKind;

/// All cells of one kind.
#[derive(Debug, Clone, PartialEq)]
pub struct CellBlock {
    /// Their kind.
    pub kind: ElementKind,
    /// Node indices (0-based, into [`Mesh::points`]), `[n_cells, kind.n_nodes()]` row by row, gmsh's node order.
    pub nodes: Vec<usize>,
    /// The file's own element numbers, `[n_cells]` (for messages).
    pub tags: Vec<u64>,
}

impl CellBlock {
    /// Number of its cells.
    pub fn n_cells(&self) -> usize {
        self.tags.len()
    }

    /// Nodes of its cell `cell`, `[kind.n_nodes()]`.
    pub fn cell_nodes(&self, cell: usize) -> &[usize] {
        let n = self.kind.n_nodes();
        &self.nodes[cell * n..(cell + 1) * n]
    }
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

/// Values given element by element in the mesh file.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementField {
    /// Its name.
    pub name: String,
    /// Number of components of a value.
    pub n_components: usize,
    /// The file's element numbers, `[n]`.
    pub elements: Vec<u64>,
    /// The values, `[n, n_components]`.
    pub values: Vec<f64>,
}

/// Points, cells by kind, physical groups.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Where it came from (file name, or "structured"), for messages.
    pub source: String,
    /// Coordinates, `[n_points, 3]`, in the scene's length unit.
    pub points: Vec<[f64; 3]>,
    /// Cells by kind.
    pub blocks: Vec<CellBlock>,
    /// Physical groups.
    pub groups: Vec<PhysicalGroup>,
    /// Fields of its elements.
    pub fields: Vec<ElementField>,
    /// What the reader mended or left out.
    pub warnings: Vec<String>,
}

impl Mesh {
    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.points.len()
    }

    /// Kind of a cell.
    pub fn kind(&self, cell: CellRef) -> ElementKind {
        self.blocks[cell.block].kind
    }

    /// Node indices of a cell, `[kind.n_nodes()]`, gmsh's order.
    pub fn cell_nodes(&self, cell: CellRef) -> &[usize] {
        self.blocks[cell.block].cell_nodes(cell.cell)
    }

    /// The file's number of a cell (for messages).
    pub fn tag(&self, cell: CellRef) -> u64 {
        self.blocks[cell.block].tags[cell.cell]
    }

    /// All cells of dimension `dim`, block by block.
    pub fn cells(&self, dim: usize) -> impl Iterator<Item = CellRef> + '_ {
        self.blocks
            .iter()
            .enumerate()
            .filter(move |(_, block)| block.kind.dim() == dim)
            .flat_map(|(i, block)| (0..block.n_cells()).map(move |cell| CellRef { block: i, cell }))
    }

    /// All solid cells, block by block.
    pub fn volume_cells(&self) -> impl Iterator<Item = CellRef> + '_ {
        self.cells(3)
    }

    /// Place of a solid cell in [`Self::volume_cells`].
    pub fn volume_index(&self, cell: CellRef) -> usize {
        let before = self.blocks[..cell.block].iter().filter(|block| block.kind.dim() == 3);
        before.map(CellBlock::n_cells).sum::<usize>() + cell.cell
    }
}
