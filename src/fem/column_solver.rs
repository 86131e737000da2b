//! Solves K u = f of one body for many right-hand sides, and computes the forces of prescribed displacements.

use rayon::prelude::*;

use super::condensation_method::CondensationMethod;
use super::condensed::iterative;
use super::loads::FaceLoad;
use super::model::FeModel;
use super::spec::FoundationStiffness;
use crate::error::{Context, Result};
use crate::linalg::cholesky::SymmetricSolver;
use crate::linalg::dense::try_zeroed;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::CellRef;

const COLUMNS_PER_SOLVE: usize = 32;

/// Solver of K u = f for many right-hand sides. It uses one factorisation, or conjugate gradients if the factor does
/// not fit into memory.
pub struct ColumnSolver {
    solver: Box<dyn SymmetricSolver>,
    n_free: usize,
    method: CondensationMethod,
}

impl ColumnSolver {
    /// Creates the solver of a model within the limit `memory`.
    ///
    /// # Errors
    /// If K is singular, the factorisation fails its check, or memory does not suffice.
    pub fn new(model: &FeModel, memory: &MemoryLimit) -> Result<Self> {
        let build = || {
            let analysis = model.analyse(&[])?;
            let method = analysis.choose_method(model, memory)?;
            let solver: Box<dyn SymmetricSolver> = match method {
                CondensationMethod::Factorisation => Box::new(analysis.factorise(model)?),
                CondensationMethod::ConjugateGradients(_) => Box::new(iterative(model)?),
            };
            Ok(Self { solver, n_free: model.n_free(), method })
        };
        build().context(|| model.name().to_owned())
    }

    /// Replaces each force vector f in `columns` by the solution u of K u = f. `columns` are forces on the free dofs,
    /// `[n_columns, n_free]`.
    ///
    /// # Errors
    /// If the solution does not converge, or memory does not suffice.
    pub fn solve(&self, columns: &mut [f64]) -> Result<()> {
        let solve = |batch: &mut [f64]| self.solver.solve_in_place(batch, batch.len() / self.n_free);
        let batch = COLUMNS_PER_SOLVE * self.n_free;
        match self.method {
            // A solve with the factor uses one thread, so the batches run in parallel.
            CondensationMethod::Factorisation => columns.par_chunks_mut(batch).try_for_each(solve),
            CondensationMethod::ConjugateGradients(_) => columns.chunks_mut(batch).try_for_each(solve),
        }
    }
}

/// Forces due to displacements of the prescribed dofs while all free dofs are fixed.
pub struct PrescribedDisplacementForces {
    /// Forces on the free dofs, N, `[n_columns, n_free]`.
    pub on_free_dofs: Vec<f64>,
    /// Forces on the prescribed dofs, N, `[n_columns, n_prescribed]`.
    pub on_prescribed_dofs: Vec<f64>,
}

impl FeModel {
    /// Prescribed dofs in ascending order; component c of node i is dof 3 i + c.
    pub fn prescribed_dofs(&self) -> Vec<usize> {
        let dofs = self.dof_map().solid_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
        dofs.filter(|&dof| self.dof_map().prescribed(dof).is_some()).collect()
    }

    /// Faces on foundations: the solid, the index of its face, and the foundation stiffness.
    pub fn faces_on_foundations(&self) -> impl Iterator<Item = (CellRef, usize, FoundationStiffness)> + '_ {
        self.foundations().iter().filter_map(|stiffness| match stiffness.face.load {
            FaceLoad::Foundation(bedding) => Some((stiffness.face.owner, stiffness.face.local_face, bedding)),
            FaceLoad::Pressure(_) | FaceLoad::Traction(_) => None,
        })
    }

    /// Forces K_fb g on the free dofs f and K_bb g on the prescribed dofs b, for displacements g of the dofs b, mm,
    /// `[n_columns, n_prescribed]`. `prescribed` must list all dofs of [`Self::prescribed_dofs`]. K includes
    /// foundations. The values that the model prescribes at the dofs b are not used.
    ///
    /// # Errors
    /// If memory does not suffice, or the run is cancelled.
    pub fn forces_of_prescribed_displacements(
        &self,
        prescribed: &[usize],
        displacement: &[f64],
    ) -> Result<PrescribedDisplacementForces> {
        let (n, n_free) = (prescribed.len(), self.n_free());
        let columns = displacement.len().checked_div(n).unwrap_or(0);
        let mut forces = PrescribedDisplacementForces {
            on_free_dofs: try_zeroed(columns * n_free)?,
            on_prescribed_dofs: try_zeroed(columns * n)?,
        };
        let mut place = vec![usize::MAX; 3 * self.mesh().n_points()];
        prescribed.iter().enumerate().for_each(|(i, &dof)| place[dof] = i);
        let mut add = |nodes: &[usize], packed: &[f64]| {
            let dofs: Vec<usize> = nodes.iter().flat_map(|&node| 3 * node..3 * node + 3).collect();
            let held: Vec<usize> = (0..dofs.len()).filter(|&i| place[dofs[i]] != usize::MAX).collect();
            for &j in &held {
                let from = place[dofs[j]];
                for (i, &dof) in dofs.iter().enumerate() {
                    let (row, column) = (i.max(j), i.min(j));
                    let entry = packed[row * (row + 1) / 2 + column];
                    match self.dof_map().row(dof) {
                        Some(row) => (0..columns).for_each(|c| {
                            forces.on_free_dofs[c * n_free + row] += entry * displacement[c * n + from];
                        }),
                        None => (0..columns).for_each(|c| {
                            forces.on_prescribed_dofs[c * n + place[dof]] +=
                                entry * displacement[c * n + from];
                        }),
                    }
                }
            }
        };
        let elements = self.elements();
        for i in 0..elements.n_elements() {
            let nodes = elements.mesh.cell_nodes(self.regions().cells()[i]);
            let held = |&node: &usize| (0..3).any(|c| place[3 * node + c] != usize::MAX);
            if nodes.iter().any(held) {
                add(nodes, &elements.packed_stiffness(i)?);
            }
        }
        self.foundations().iter().for_each(|face| add(&face.nodes, &face.packed));
        Ok(forces)
    }
}
