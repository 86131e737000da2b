//! A body condensed to its contact nodes: F_cc = (K⁻¹)_cc from the trailing block of the factor.
//!
//! With the contact dofs ordered last, K = L Lᵀ gives K_cc - K_ci K_ii⁻¹ K_ic = L_cc L_ccᵀ, the Schur complement, without
//! any back-substitution; its inverse is the flexibility of the contact nodes.

use super::model::FeModel;
use crate::error::Result;
use crate::linalg::dense::SymmetricDense;
use crate::linalg::factor::{CholeskyFactor, SymbolicFactor, SymmetricFactor};

/// What factorising a body for some contact nodes will take.
pub struct Analysis {
    contact_nodes: Vec<usize>,
    n_trailing: usize,
    n_free: usize,
    matrix_bytes: usize,
    symbolic: SymbolicFactor,
}

impl Analysis {
    pub(super) fn new(model: &FeModel, contact_nodes: &[usize], order: Vec<usize>) -> Result<Self> {
        let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
        Ok(Self {
            contact_nodes: contact_nodes.to_vec(),
            n_trailing: dofs.filter(|&dof| model.dofs().row(dof).is_some()).count(),
            n_free: model.n_free(),
            matrix_bytes: 16 * model.stiffness().n_stored(),
            symbolic: SymbolicFactor::new(model.stiffness(), &order)?,
        })
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.n_stored()
    }

    /// Bytes taken at the peak: the matrix, its factor, and the larger of the factorisation's workspace and the three
    /// dense matrices of the contact dofs.
    pub fn memory_bytes(&self) -> usize {
        let factor = 8 * self.factor_entries();
        let workspace = self.symbolic.memory_bytes() - factor;
        self.matrix_bytes + factor + workspace.max(24 * self.n_trailing * self.n_trailing)
    }
}

/// A factorised body with the flexibility of its contact nodes.
pub struct CondensedBody {
    model: FeModel,
    contact_nodes: Vec<usize>,
    factor: CholeskyFactor,
    flexibility: SymmetricDense,
    free_displacement: Vec<[f64; 3]>,
}

impl CondensedBody {
    pub(super) fn new(model: FeModel, analysis: Analysis) -> Result<Self> {
        let Analysis { contact_nodes, n_trailing, symbolic, .. } = analysis;
        let factor = symbolic.factorise(model.stiffness(), |row| model.row_name(row))?;
        let trailing = factor.trailing_inverse(n_trailing)?;
        let mut flexibility = with_prescribed_rows(&model, &contact_nodes, trailing)?;
        if let Some(floating) = model.floating() {
            let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
            let rows: Vec<Option<usize>> = dofs.map(|dof| model.dofs().row(dof)).collect();
            floating.centre(&mut flexibility, &rows, |rhs| factor.solve_in_place(rhs, 1))?;
        }
        let free_displacement = if model.is_loaded() {
            let mut rhs = model.load_vector();
            solve_in_place(&model, &factor, &mut rhs)?;
            model.expand(&rhs)
        } else {
            vec![[0.0; 3]; model.mesh().n_points()]
        };
        Ok(Self { model, contact_nodes, factor, flexibility, free_displacement })
    }

    /// The model it was condensed from.
    pub fn model(&self) -> &FeModel {
        &self.model
    }

    /// The contact nodes, mesh indices, `[n_c]`.
    pub fn contact_nodes(&self) -> &[usize] {
        &self.contact_nodes
    }

    /// Displacement of the contact nodes by forces on them, global axes, mm/N, `[3 n_c, 3 n_c]`, component c of contact
    /// node i at 3 i + c; rows of prescribed dofs are zero.
    pub fn flexibility(&self) -> &SymmetricDense {
        &self.flexibility
    }

    /// Takes the flexibility out, leaving an empty one: it is the largest dense matrix.
    pub fn take_flexibility(&mut self) -> SymmetricDense {
        std::mem::take(&mut self.flexibility)
    }

    /// Displacement of all mesh nodes by the body's own loads and prescribed displacements, global axes, mm,
    /// `[n_points]`; zero where there are none, and at points on no solid.
    pub fn free_displacement(&self) -> &[[f64; 3]] {
        &self.free_displacement
    }

    /// Relative residual of the factorisation's check.
    pub fn residual(&self) -> f64 {
        self.factor.residual()
    }

    /// Displacement of all mesh nodes, global axes, mm, `[n_points]`, by the body's own loads and the contact forces
    /// `[3 n_c]`, N, global axes, in the order of [`Self::flexibility`]. One back-substitution. A body that floats is
    /// left where its mean motion is zero, without the share of the forces that would move it as a whole.
    ///
    /// # Errors
    /// If memory for the workspace does not suffice.
    ///
    /// # Panics
    /// If there are not 3 n_c forces.
    pub fn solve(&self, contact_forces: &[f64]) -> Result<Vec<[f64; 3]>> {
        assert_eq!(contact_forces.len(), 3 * self.contact_nodes.len(), "three forces per contact node");
        let mut rhs = self.model.load_vector();
        for (force, &node) in contact_forces.chunks_exact(3).zip(&self.contact_nodes) {
            for (component, value) in force.iter().enumerate() {
                if let Some(row) = self.model.free_dof(node, component) {
                    rhs[row] += value;
                }
            }
        }
        solve_in_place(&self.model, &self.factor, &mut rhs)?;
        Ok(self.model.expand(&rhs))
    }
}

/// Displacement of the free dofs by forces on them, `[n_free]`, in place; of a body that floats by the generalised
/// inverse.
fn solve_in_place(model: &FeModel, factor: &CholeskyFactor, rhs: &mut [f64]) -> Result<()> {
    match model.floating() {
        Some(floating) => floating.solve(rhs, |rhs| factor.solve_in_place(rhs, 1)),
        None => factor.solve_in_place(rhs, 1),
    }
}

/// The flexibility of the free contact dofs spread over all contact dofs, zero where prescribed.
fn with_prescribed_rows(
    model: &FeModel,
    contact_nodes: &[usize],
    trailing: SymmetricDense,
) -> Result<SymmetricDense> {
    let dofs = contact_nodes.iter().flat_map(|&node| 3 * node..3 * node + 3);
    let free: Vec<usize> = dofs
        .enumerate()
        .filter(|&(_, dof)| model.dofs().row(dof).is_some())
        .map(|(contact_dof, _)| contact_dof)
        .collect();
    let n = 3 * contact_nodes.len();
    if free.len() == n {
        return Ok(trailing);
    }
    let mut full = SymmetricDense::zeros(n)?;
    for (i, &row) in free.iter().enumerate() {
        for (&column, value) in free.iter().zip(trailing.row(i)) {
            full.values_mut()[row * n + column] = *value;
        }
    }
    Ok(full)
}
