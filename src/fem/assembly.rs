//! Assembly of the stiffness of the free dofs, and of the forces of prescribed displacements on these dofs.

use rayon::prelude::*;

use super::dof_map::DofMap;
use super::element_kernels::{element_stiffness, packed_len};
use super::element_materials::ElementMaterials;
use super::element_rules::RuleSet;
use super::foundation::FoundationFace;
use super::integration_points::ElementDefect;
use super::spec::HexFormulation;
use crate::cancel;
use crate::error::{Error, Result};
use crate::linalg::ordering::NodeGraph;
use crate::linalg::sparse::SymmetricSparse;
use crate::mesh::{CellRef, Mesh};

/// Number of elements per parallel batch. It limits the memory of the element stiffnesses.
const ELEMENTS_PER_BATCH: usize = 512;

#[derive(Clone, Copy)]
pub(super) struct ElementContext<'a> {
    pub mesh: &'a Mesh,
    pub regions: &'a ElementMaterials,
    pub rules: &'a RuleSet,
    pub formulation: HexFormulation,
}

impl ElementContext<'_> {
    pub fn n_elements(&self) -> usize {
        self.regions.cells.len()
    }

    pub fn node_coordinates(&self, cell: CellRef) -> Vec<[f64; 3]> {
        self.mesh.cell_nodes(cell).iter().map(|&node| self.mesh.points[node]).collect()
    }

    /// Stiffness of element `i` as a packed lower triangle, row by row.
    pub fn packed_stiffness(&self, i: usize) -> Result<Vec<f64>> {
        cancel::check()?;
        let cell = self.regions.cells[i];
        let kind = self.mesh.kind(cell);
        let mut packed = vec![0.0; packed_len(kind)];
        element_stiffness(
            kind,
            &self.node_coordinates(cell),
            &self.regions.stiffness(i),
            self.formulation,
            self.rules,
            &mut packed,
        )
        .map_err(|unsound| self.defect_error(cell, unsound))?;
        Ok(packed)
    }

    pub fn defect_error(&self, cell: CellRef, unsound: ElementDefect) -> Error {
        let mesh = self.mesh;
        let element = format!("element {} ({}) of {}", mesh.tag(cell), mesh.kind(cell).name(), mesh.source);
        Error::input(match unsound {
            ElementDefect::NonpositiveJacobian(det) => format!(
                "{element} is inverted or degenerate: its Jacobian is {det:.3e}, but it must be positive. Fix the mesh (node order, collapsed or overlapping nodes)"
            ),
            ElementDefect::IndefiniteEnhancedModes => format!(
                "the enhanced strains of {element} have no positive definite stiffness, although its shape is valid: the constants of its material differ by too many powers of ten. Correct them, or use `element` = \"{}\" or second-order elements",
                HexFormulation::Standard.name()
            ),
        })
    }
}

/// Assembles the stiffness K_ff of the free dofs f, and the forces -K_fc ū on these dofs, `[n_free]`. ū are the displacements
/// prescribed at the dofs c. K includes `foundations`.
///
/// Elements are added in their order, so that the result has the same bits for any number of threads.
///
/// # Errors
/// If an element is inverted or degenerate, or its enhanced strains have no positive definite stiffness. If the run is cancelled.
pub(super) fn assemble(
    elements: ElementContext,
    foundations: &[FoundationFace],
    dofs: &DofMap,
    graph: &NodeGraph,
) -> Result<(SymmetricSparse, Vec<f64>)> {
    let mut matrix = pattern(dofs, graph);
    let mut rhs = vec![0.0; dofs.n_free()];
    for start in (0..elements.n_elements()).step_by(ELEMENTS_PER_BATCH) {
        let end = (start + ELEMENTS_PER_BATCH).min(elements.n_elements());
        let batch: Vec<Result<Vec<f64>>> =
            (start..end).into_par_iter().map(|i| elements.packed_stiffness(i)).collect();
        for (i, packed) in (start..end).zip(batch) {
            let nodes = elements.mesh.cell_nodes(elements.regions.cells[i]);
            scatter(nodes, &packed?, dofs, &mut matrix, &mut rhs);
        }
    }
    for face in foundations {
        scatter(&face.nodes, &face.packed, dofs, &mut matrix, &mut rhs);
    }
    cancel::check()?;
    Ok((matrix, rhs))
}

pub(super) fn n_stiffness_entries(dofs: &DofMap, graph: &NodeGraph) -> usize {
    let of_node = |&node: &usize| {
        let beside: usize = later_neighbours(graph, node).map(|other| rows_of(dofs, other).count()).sum();
        let own = rows_of(dofs, node).count();
        own * (own + 1) / 2 + own * beside
    };
    dofs.solid_nodes.iter().map(of_node).sum()
}

fn rows_of(dofs: &DofMap, node: usize) -> impl Iterator<Item = usize> {
    (3 * node..3 * node + 3).filter_map(|dof| dofs.row(dof))
}

fn later_neighbours(graph: &NodeGraph, node: usize) -> impl Iterator<Item = usize> {
    graph.neighbours(node).iter().copied().filter(move |&other| other > node)
}

/// Zero matrix with an entry for each pair of free dofs of one node or of neighbouring nodes.
fn pattern(dofs: &DofMap, graph: &NodeGraph) -> SymmetricSparse {
    let mut offsets = Vec::with_capacity(dofs.n_free() + 1);
    offsets.push(0);
    let mut rows = Vec::with_capacity(n_stiffness_entries(dofs, graph));
    let mut beside: Vec<usize> = Vec::new();
    for &node in &dofs.solid_nodes {
        beside.clear();
        beside.extend(later_neighbours(graph, node).flat_map(|other| rows_of(dofs, other)));
        beside.sort_unstable();
        for column in rows_of(dofs, node) {
            rows.extend(rows_of(dofs, node).filter(|&row| row >= column));
            rows.extend_from_slice(&beside);
            offsets.push(rows.len());
        }
    }
    SymmetricSparse::from_pattern(offsets, rows)
}

fn scatter(nodes: &[usize], packed: &[f64], dofs: &DofMap, matrix: &mut SymmetricSparse, rhs: &mut [f64]) {
    let global: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
    let mut k = 0;
    for (p, &i) in global.iter().enumerate() {
        for &j in &global[..=p] {
            let value = packed[k];
            k += 1;
            match (dofs.row(i), dofs.row(j)) {
                (Some(r), Some(s)) => matrix.add(r, s, value),
                (Some(r), None) => rhs[r] -= value * dofs.prescribed(j).unwrap_or(0.0),
                (None, Some(s)) => rhs[s] -= value * dofs.prescribed(i).unwrap_or(0.0),
                (None, None) => {}
            }
        }
    }
}
