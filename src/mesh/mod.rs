//! Meshes of solids and surfaces: a [`Mesh`] has points, cells by kind ([`CellBlock`]) and physical groups ([`PhysicalGroup`]).

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
    /// Element kind of the cells.
    pub kind: ElementKind,
    /// Indices into [`Mesh::points`], `[n_cells, kind.n_nodes()]` row by row, gmsh's node order.
    pub nodes: Vec<usize>,
    /// Numbers of the elements in the mesh file, `[n_cells]`, for messages.
    pub tags: Vec<u64>,
}

impl CellBlock {
    /// Number of cells.
    pub fn n_cells(&self) -> usize {
        self.tags.len()
    }

    /// Nodes of a cell, `[kind.n_nodes()]`.
    pub fn cell_nodes(&self, cell: usize) -> &[usize] {
        let n = self.kind.n_nodes();
        &self.nodes[cell * n..(cell + 1) * n]
    }
}

/// Reference to a cell: block, and index in the block.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct CellRef {
    /// Index into [`Mesh::blocks`].
    pub block: usize,
    /// Index of the cell in its block.
    pub cell: usize,
}

/// Named set of cells of one dimension.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalGroup {
    /// Name; the tag in decimal if the file gives no name.
    pub name: String,
    /// Dimension of the cells.
    pub dim: usize,
    /// Tag in the file.
    pub tag: i64,
    /// Cells of the group.
    pub cells: Vec<CellRef>,
}

/// Field with values per element, from the mesh file.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementField {
    /// Name of the field.
    pub name: String,
    /// Number of components per value.
    pub n_components: usize,
    /// Numbers of the elements in the mesh file, `[n]`.
    pub elements: Vec<u64>,
    /// Values, `[n, n_components]`.
    pub values: Vec<f64>,
}

/// Mesh: points, cells by kind, physical groups.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    /// Source of the mesh (file name, or "structured"), for messages.
    pub source: String,
    /// Coordinates, `[n_points, 3]`, in the scene's length unit.
    pub points: Vec<[f64; 3]>,
    /// Cells by kind.
    pub blocks: Vec<CellBlock>,
    /// Physical groups.
    pub groups: Vec<PhysicalGroup>,
    /// Fields with values per element.
    pub fields: Vec<ElementField>,
    /// Warnings of the reader, for example about ignored nodes.
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

    /// Nodes of a cell, `[kind.n_nodes()]`, gmsh's order.
    pub fn cell_nodes(&self, cell: CellRef) -> &[usize] {
        self.blocks[cell.block].cell_nodes(cell.cell)
    }

    /// Number of the cell in the mesh file, for messages.
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

    /// Index of a solid cell in [`Self::volume_cells`].
    pub fn volume_index(&self, cell: CellRef) -> usize {
        let before = self.blocks[..cell.block].iter().filter(|block| block.kind.dim() == 3);
        before.map(CellBlock::n_cells).sum::<usize>() + cell.cell
    }
}
