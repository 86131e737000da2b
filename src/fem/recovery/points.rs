//! The points at which stress is recovered: the nodes, doubled where two materials meet.

use crate::fem::assembly::Elements;
use crate::mesh::faces::border_faces;

/// The nodes of the solids, once for each material that meets there, so that stress may jump across the border.
#[derive(Debug, Clone, PartialEq)]
pub struct RecoveryPoints {
    /// Mesh node of each point, ascending, `[n_points]`.
    pub node: Vec<usize>,
    /// Points of the solid cells, one cell after the other (gmsh's node order), cells as in
    /// [`crate::mesh::Mesh::volume_cells`].
    pub cell_points: Vec<usize>,
    /// Start of each cell in `cell_points`, and its end, `[n_cells + 1]`.
    pub offsets: Vec<usize>,
}

impl RecoveryPoints {
    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.node.len()
    }

    /// Number of solid cells.
    pub fn n_cells(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Points of a cell, in the order of its nodes.
    pub fn of_cell(&self, cell: usize) -> &[usize] {
        &self.cell_points[self.offsets[cell]..self.offsets[cell + 1]]
    }

    pub(super) fn new(elements: Elements, class: &[usize]) -> Self {
        let cells = || elements.regions.cells.iter().map(|&cell| elements.mesh.cell_nodes(cell));
        let mut pairs: Vec<(usize, usize)> =
            cells().zip(class).flat_map(|(nodes, &class)| nodes.iter().map(move |&n| (n, class))).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let index = |node: usize, class: usize| {
            pairs.binary_search(&(node, class)).expect("every node of every cell is listed")
        };
        let mut offsets = vec![0];
        let mut cell_points = Vec::new();
        for (nodes, &class) in cells().zip(class) {
            cell_points.extend(nodes.iter().map(|&node| index(node, class)));
            offsets.push(cell_points.len());
        }
        Self { node: pairs.into_iter().map(|(node, _)| node).collect(), cell_points, offsets }
    }
}

/// Which elements have the same stiffness: stress is smooth within a class, not across two. The class is the first
/// region of that stiffness, `[n_cells]`.
pub(super) fn classes(elements: Elements) -> Vec<usize> {
    let stiffness = &elements.regions.stiffness;
    let first: Vec<usize> = (0..stiffness.len())
        .map(|i| (0..i).find(|&j| stiffness[j] == stiffness[i]).unwrap_or(i))
        .collect();
    elements.regions.region.iter().map(|&region| first[region]).collect()
}

/// How points and elements hang together, for patches.
pub(super) struct Topology {
    /// Cells at each point, ascending, `[n_points]`.
    pub cells_at: Vec<Vec<usize>>,
    /// Whether a point is a corner of a cell, `[n_points]`.
    pub vertex: Vec<bool>,
    /// Whether a point is on the border of its material, `[n_points]`.
    pub border: Vec<bool>,
}

impl Topology {
    pub fn new(elements: Elements, class: &[usize], points: &RecoveryPoints) -> Self {
        let n = points.n_points();
        let mut topology =
            Self { cells_at: vec![Vec::new(); n], vertex: vec![false; n], border: vec![false; n] };
        for (i, &cell) in elements.regions.cells.iter().enumerate() {
            let corners = elements.mesh.kind(cell).n_corners();
            for (local, &point) in points.of_cell(i).iter().enumerate() {
                topology.cells_at[point].push(i);
                topology.vertex[point] |= local < corners;
            }
        }
        for (i, local_face) in border_faces(elements.mesh, class) {
            let kind = elements.mesh.kind(elements.regions.cells[i]);
            for &local in kind.local_faces()[local_face].1 {
                topology.border[points.of_cell(i)[local]] = true;
            }
        }
        topology.cells_at.iter_mut().for_each(Vec::dedup);
        topology
    }
}
