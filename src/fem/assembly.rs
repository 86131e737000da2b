//! Assembly of the stiffness of the free dofs, and of the forces that prescribed displacements exert on them.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::dofs::Dofs;
use super::element::{packed_len, stiffness};
use super::foundation::FaceStiffness;
use super::integration::Unsound;
use super::regions::Regions;
use super::solids::Rules;
use super::spec::HexFormulation;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linalg::ordering::NodeGraph;
use crate::linalg::sparse::SymmetricSparse;
use crate::mesh::{CellRef, Mesh};

/// Elements computed side by side before they are added up: bounds the memory of their stiffnesses (14 MB of hex27).
const BATCH: usize = 512;

/// What an element's stiffness needs besides its nodes.
#[derive(Clone, Copy)]
pub(super) struct Elements<'a> {
    pub mesh: &'a Mesh,
    pub regions: &'a Regions,
    pub rules: &'a Rules,
    pub formulation: HexFormulation,
}

impl Elements<'_> {
    /// Number of elements.
    pub fn n(&self) -> usize {
        self.regions.cells.len()
    }

    /// Coordinates of the nodes of a cell.
    pub fn points(&self, cell: CellRef) -> Vec<[f64; 3]> {
        self.mesh.cell_nodes(cell).iter().map(|&node| self.mesh.points[node]).collect()
    }

    /// Stiffness tensor of the element `i`, global axes.
    pub fn material(&self, i: usize) -> Matrix6<f64> {
        self.regions.stiffness(i)
    }

    /// Stiffness of the element `i`, lower triangle by rows.
    pub fn packed_stiffness(&self, i: usize) -> Result<Vec<f64>> {
        interrupt::check()?;
        let cell = self.regions.cells[i];
        let kind = self.mesh.kind(cell);
        let mut packed = vec![0.0; packed_len(kind)];
        stiffness(kind, &self.points(cell), &self.material(i), self.formulation, self.rules, &mut packed)
            .map_err(|unsound| self.unsound(cell, unsound))?;
        Ok(packed)
    }

    /// The error of an element that has no stiffness.
    pub fn unsound(&self, cell: CellRef, unsound: Unsound) -> Error {
        let mesh = self.mesh;
        let element = format!("element {} ({}) of {}", mesh.tag(cell), mesh.kind(cell).name(), mesh.source);
        Error::input(match unsound {
            Unsound::Jacobian(det) => format!(
                "{element} is inverted or degenerate: its Jacobian is {det:.3e}, it must be positive; mend the mesh (node \
                 order, collapsed or overlapping nodes)"
            ),
            Unsound::Modes => format!(
                "the enhanced strains of {element} have no positive definite stiffness, although its shape is sound: the \
                 constants of its material differ by too many powers of ten; mend them, or take `element` = \
                 \"{}\" or elements of second order",
                HexFormulation::Standard.name()
            ),
        })
    }
}

/// K of the free dofs, `foundations` included, and the right-hand side -K_fc ū of the prescribed ones, `[n_free]`.
///
/// Elements are computed in parallel and added in their order, into a pattern that `graph`, in which the nodes of each
/// element are connected, gives beforehand: the same bits for any number of threads.
///
/// # Errors
/// If an element is inverted or degenerate.
pub(super) fn assemble(
    elements: Elements,
    foundations: &[FaceStiffness],
    (dofs, graph): (&Dofs, &NodeGraph),
) -> Result<(SymmetricSparse, Vec<f64>)> {
    let mut matrix = pattern(dofs, graph);
    let mut rhs = vec![0.0; dofs.n_free()];
    for start in (0..elements.n()).step_by(BATCH) {
        let end = (start + BATCH).min(elements.n());
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
    interrupt::check()?;
    Ok((matrix, rhs))
}

/// Number of entries that the stiffness of the free dofs stores.
pub(super) fn n_stored(dofs: &Dofs, graph: &NodeGraph) -> usize {
    let of_node = |&node: &usize| {
        let beside: usize = later(graph, node).map(|other| rows_of(dofs, other).count()).sum();
        let own = rows_of(dofs, node).count();
        own * (own + 1) / 2 + own * beside
    };
    dofs.nodes.iter().map(of_node).sum()
}

fn rows_of(dofs: &Dofs, node: usize) -> impl Iterator<Item = usize> {
    (3 * node..3 * node + 3).filter_map(|dof| dofs.row(dof))
}

fn later(graph: &NodeGraph, node: usize) -> impl Iterator<Item = usize> {
    graph.neighbours(node).iter().copied().filter(move |&other| other > node)
}

/// The matrix of zeros that couples the free dofs of each node with those of its neighbours.
fn pattern(dofs: &Dofs, graph: &NodeGraph) -> SymmetricSparse {
    let mut offsets = Vec::with_capacity(dofs.n_free() + 1);
    offsets.push(0);
    let mut rows = Vec::with_capacity(n_stored(dofs, graph));
    let mut beside: Vec<usize> = Vec::new();
    for &node in &dofs.nodes {
        beside.clear();
        beside.extend(later(graph, node).flat_map(|other| rows_of(dofs, other)));
        beside.sort_unstable();
        for column in rows_of(dofs, node) {
            rows.extend(rows_of(dofs, node).filter(|&row| row >= column));
            rows.extend_from_slice(&beside);
            offsets.push(rows.len());
        }
    }
    SymmetricSparse::zeros(offsets, rows)
}

fn scatter(nodes: &[usize], packed: &[f64], dofs: &Dofs, matrix: &mut SymmetricSparse, rhs: &mut [f64]) {
    let global: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
    let mut k = 0;
    for (p, &i) in global.iter().enumerate() {
        for (q, &j) in global[..=p].iter().enumerate() {
            let value = packed[k];
            k += 1;
            match (dofs.row(i), dofs.row(j)) {
                // A node that stands twice in a collapsed element meets itself off the diagonal: both halves count.
                (Some(r), Some(s)) if r == s && p != q => matrix.add(r, s, 2.0 * value),
                (Some(r), Some(s)) => matrix.add(r, s, value),
                (Some(r), None) => rhs[r] -= value * dofs.prescribed(j).unwrap_or(0.0),
                (None, Some(s)) => rhs[s] -= value * dofs.prescribed(i).unwrap_or(0.0),
                (None, None) => {}
            }
        }
    }
}
