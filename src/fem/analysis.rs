//! What condensing a body will take, known before any number is computed.

use super::condensation_method::{CondensationMethod, iterative_peak_bytes};
use super::model::FeModel;
use crate::error::Result;
use crate::linalg::cholesky::{CholeskyFactor, SymbolicCholesky};
use crate::linalg::memory::MemoryLimit;

/// Bytes of the buffers of dense products that large supernodes touch: 15 to 17 MB were found of the 67 MB that are asked for.
const PRODUCT_BUFFER_BYTES: usize = 16_000_000;

/// What factorising a body for some contact nodes will take.
pub struct SymbolicAnalysis {
    contact_nodes: Vec<usize>,
    n_contact_dofs: usize,
    n_free: usize,
    model_bytes: usize,
    symbolic: SymbolicCholesky,
}

impl SymbolicAnalysis {
    pub(super) fn new(model: &FeModel, contact_nodes: &[usize], order: Vec<usize>) -> Result<Self> {
        let n_contact_dofs = model.contact_rows(contact_nodes).len();
        Ok(Self {
            contact_nodes: contact_nodes.to_vec(),
            n_contact_dofs,
            n_free: model.n_free(),
            model_bytes: model.resident_bytes(),
            symbolic: SymbolicCholesky::new(model.stiffness(), &order, n_contact_dofs)?,
        })
    }

    pub(super) fn contact_nodes(&self) -> &[usize] {
        &self.contact_nodes
    }

    /// Number of free dofs.
    pub fn n_free(&self) -> usize {
        self.n_free
    }

    /// Number of free contact dofs.
    pub fn n_contact_dofs(&self) -> usize {
        self.n_contact_dofs
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.n_factor_entries()
    }

    /// Floating-point operations of factor and flexibility.
    pub fn flops(&self) -> f64 {
        self.symbolic.flops() + 2.0 / 3.0 * (self.n_contact_dofs as f64).powi(3)
    }

    /// Bytes taken at the peak by a factorisation: the assembled body, the factor, and the larger of its workspace and
    /// the dense matrices of the contact dofs. The same for any number of threads.
    pub fn factorisation_peak_bytes(&self) -> usize {
        let values = self.factor_bytes();
        // The part of the buffers of dense products that is touched.
        let products = PRODUCT_BUFFER_BYTES.min(values / 4);
        let workspace = self.symbolic.memory_bytes() - values;
        self.model_bytes + values + products + workspace.max(self.symbolic.trailing_inverse_bytes())
    }

    /// Bytes of the stored values of the factor.
    fn factor_bytes(&self) -> usize {
        8 * self.symbolic.n_values()
    }

    /// How the body is condensed within `memory`.
    ///
    /// # Errors
    /// If no method fits (kind `Resources`), with the bytes needed and allowed.
    pub fn choose_method(&self, model: &FeModel, memory: &MemoryLimit) -> Result<CondensationMethod> {
        CondensationMethod::choose(model, self.n_contact_dofs, self.factorisation_peak_bytes(), memory)
    }

    /// Bytes at the peak and in the end of a body condensed by `method`.
    pub fn peak_and_resident_bytes(&self, model: &FeModel, method: CondensationMethod) -> [usize; 2] {
        let peak = match method {
            CondensationMethod::Factorisation => self.factorisation_peak_bytes(),
            CondensationMethod::ConjugateGradients(_) => iterative_peak_bytes(model, self.n_contact_dofs),
        };
        let flexibility = flexibility_bytes(self.contact_nodes.len());
        [peak, self.model_bytes + self.solver_bytes(model, method) + flexibility]
    }

    /// Bytes of what solves the systems.
    pub(super) fn solver_bytes(&self, model: &FeModel, method: CondensationMethod) -> usize {
        match method {
            CondensationMethod::Factorisation => self.factor_bytes(),
            CondensationMethod::ConjugateGradients(_) => iterative_peak_bytes(model, 0) - self.model_bytes,
        }
    }

    /// Number of values that the factor is stored in.
    pub(super) fn n_values(&self) -> usize {
        self.symbolic.n_values()
    }

    /// The factor from its stored values; `None` if they do not pass its check.
    pub(super) fn restore(self, model: &FeModel, values: Vec<f64>) -> Result<Option<CholeskyFactor>> {
        self.symbolic.from_values(model.stiffness(), values)
    }

    pub(super) fn factorise(self, model: &FeModel) -> Result<CholeskyFactor> {
        self.symbolic.factorise(model.stiffness(), |row| model.describe_row(row))
    }
}

/// Bytes of a flexibility of `n_nodes` contact nodes and of the packed triangle in use.
pub fn flexibility_bytes(n_nodes: usize) -> usize {
    12 * 9 * n_nodes * n_nodes
}
