//! Assembly of the stiffness of the free dofs, and of the forces that prescribed displacements exert on them.

use nalgebra::Matrix6;
use rayon::prelude::*;

use super::dofs::Dofs;
use super::element::{packed_len, stiffness};
use super::foundation::FaceStiffness;
use super::integration::Inverted;
use super::regions::Regions;
use super::solids::Rules;
use super::spec::HexFormulation;
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linalg::sparse::{SymmetricSparse, SymmetricTriplets};
use crate::mesh::{CellRef, Mesh};

/// Elements computed side by side before they are added up: bounds the memory of their stiffnesses.
const BATCH: usize = 4096;

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

    fn packed_stiffness(&self, i: usize) -> Result<Vec<f64>> {
        interrupt::check()?;
        let cell = self.regions.cells[i];
        let kind = self.mesh.kind(cell);
        let mut packed = vec![0.0; packed_len(kind)];
        stiffness(kind, &self.points(cell), &self.material(i), self.formulation, self.rules, &mut packed)
            .map_err(|inverted| self.inverted(cell, inverted))?;
        Ok(packed)
    }

    /// The error of an inverted element.
    pub fn inverted(&self, cell: CellRef, inverted: Inverted) -> Error {
        Error::input(format!(
            "element {} ({}) of {} is inverted or degenerate: its Jacobian is {:.3e}, it must be positive; mend the \
             mesh (node order, collapsed or overlapping nodes)",
            self.mesh.tag(cell),
            self.mesh.kind(cell).name(),
            self.mesh.source,
            inverted.0
        ))
    }
}

/// K of the free dofs, `foundations` included, and the right-hand side -K_fc ū of the prescribed ones, `[n_free]`.
///
/// Elements are computed in parallel and added in their order: the same bits for any number of threads.
///
/// # Errors
/// If an element is inverted or degenerate.
pub(super) fn assemble(
    elements: Elements,
    foundations: &[FaceStiffness],
    dofs: &Dofs,
) -> Result<(SymmetricSparse, Vec<f64>)> {
    let entries: usize =
        elements.regions.cells.iter().map(|&cell| packed_len(elements.mesh.kind(cell))).sum();
    let mut triplets = SymmetricTriplets::new(dofs.n_free(), entries);
    let mut rhs = vec![0.0; dofs.n_free()];
    for start in (0..elements.n()).step_by(BATCH) {
        let end = (start + BATCH).min(elements.n());
        let batch: Vec<Result<Vec<f64>>> =
            (start..end).into_par_iter().map(|i| elements.packed_stiffness(i)).collect();
        for (i, packed) in (start..end).zip(batch) {
            let nodes = elements.mesh.cell_nodes(elements.regions.cells[i]);
            scatter(nodes, &packed?, dofs, &mut triplets, &mut rhs);
        }
    }
    for face in foundations {
        scatter(&face.nodes, &face.packed, dofs, &mut triplets, &mut rhs);
    }
    interrupt::check()?;
    Ok((triplets.build(), rhs))
}

fn scatter(nodes: &[usize], packed: &[f64], dofs: &Dofs, triplets: &mut SymmetricTriplets, rhs: &mut [f64]) {
    let global: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
    let mut k = 0;
    for (p, &i) in global.iter().enumerate() {
        for (q, &j) in global[..=p].iter().enumerate() {
            let value = packed[k];
            k += 1;
            match (dofs.row(i), dofs.row(j)) {
                // A node that stands twice in a collapsed element meets itself off the diagonal: both halves count.
                (Some(r), Some(s)) if r == s && p != q => triplets.add(r, s, 2.0 * value),
                (Some(r), Some(s)) => triplets.add(r, s, value),
                (Some(r), None) => rhs[r] -= value * dofs.prescribed(j).unwrap_or(0.0),
                (None, Some(s)) => rhs[s] -= value * dofs.prescribed(i).unwrap_or(0.0),
                (None, None) => {}
            }
        }
    }
}
