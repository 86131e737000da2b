//! Symbolic analysis of a condensation: memory and operations, known before any numerical factorisation.

use super::condensation_method::{CondensationMethod, iterative_peak_bytes};
use super::model::FeModel;
use crate::error::{Context, Result};
use crate::linalg::cholesky::{CholeskyFactor, SymbolicCholesky};
use crate::linalg::memory::MemoryLimit;
use crate::linalg::ordering::nested_dissection;

/// Memory assumed for the buffers of dense matrix products, bytes.
const PRODUCT_BUFFER_BYTES: usize = 16_000_000;

/// Structure and cost of the factorisation of a body's stiffness for given contact nodes.
pub struct SymbolicAnalysis {
    contact_nodes: Vec<usize>,
    n_contact_dofs: usize,
    n_free: usize,
    model_bytes: usize,
    symbolic: SymbolicCholesky,
}

impl FeModel {
    /// Orders the free dofs, with the dofs of `contact_nodes` last, and computes the structure and the cost of the Cholesky factor.
    ///
    /// # Errors
    /// If a contact node is given twice or belongs to no solid; if memory does not suffice.
    pub fn analyse(&self, contact_nodes: &[usize]) -> Result<SymbolicAnalysis> {
        self.check_contact_nodes(contact_nodes).context(|| self.name().to_owned())?;
        let order = nested_dissection(self.graph(), &self.dof_map().solid_nodes, contact_nodes)
            .context(|| self.name().to_owned())?
            .into_iter()
            .flat_map(|node| (3 * node..3 * node + 3).filter_map(|dof| self.dof_map().row(dof)))
            .collect();
        SymbolicAnalysis::new(self, contact_nodes, order).context(|| self.name().to_owned())
    }
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

    /// Number of entries of the factor, including zeros inside supernodes.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.n_factor_entries()
    }

    /// Floating-point operations of the factorisation and of the flexibility of the contact nodes.
    pub fn flops(&self) -> f64 {
        self.symbolic.flops() + 2.0 / 3.0 * (self.n_contact_dofs as f64).powi(3)
    }

    /// Estimated peak memory of the factorisation and the flexibility, including the model, bytes. The estimate does not depend on
    /// the number of threads.
    pub fn factorisation_peak_bytes(&self) -> usize {
        let values = self.factor_bytes();
        let products = PRODUCT_BUFFER_BYTES.min(values / 4);
        let workspace = self.symbolic.memory_bytes() - values;
        self.model_bytes + values + products + workspace.max(self.symbolic.trailing_inverse_bytes())
    }

    fn factor_bytes(&self) -> usize {
        8 * self.symbolic.n_values()
    }

    /// Chooses a factorisation if it fits into `memory`, conjugate gradients otherwise.
    ///
    /// # Errors
    /// If no method fits (kind `Resources`); the message gives the bytes needed and allowed.
    pub fn choose_method(&self, model: &FeModel, memory: &MemoryLimit) -> Result<CondensationMethod> {
        CondensationMethod::choose(model, self.n_contact_dofs, self.factorisation_peak_bytes(), memory)
    }

    /// Peak memory of the condensation by `method`, and memory of the condensed body, bytes.
    pub fn peak_and_resident_bytes(&self, model: &FeModel, method: CondensationMethod) -> [usize; 2] {
        let peak = match method {
            CondensationMethod::Factorisation => self.factorisation_peak_bytes(),
            CondensationMethod::ConjugateGradients(_) => iterative_peak_bytes(model, self.n_contact_dofs),
        };
        let flexibility = flexibility_bytes(self.contact_nodes.len());
        [peak, self.model_bytes + self.solver_bytes(model, method) + flexibility]
    }

    pub(super) fn solver_bytes(&self, model: &FeModel, method: CondensationMethod) -> usize {
        match method {
            CondensationMethod::Factorisation => self.factor_bytes(),
            CondensationMethod::ConjugateGradients(_) => iterative_peak_bytes(model, 0) - self.model_bytes,
        }
    }

    pub(super) fn n_values(&self) -> usize {
        self.symbolic.n_values()
    }

    /// Restores the factor from its stored values. `None` if the restored factor fails the residual check.
    pub(super) fn restore(self, model: &FeModel, values: Vec<f64>) -> Result<Option<CholeskyFactor>> {
        self.symbolic.from_values(model.stiffness(), values)
    }

    pub(super) fn factorise(self, model: &FeModel) -> Result<CholeskyFactor> {
        self.symbolic.factorise(model.stiffness(), |row| model.describe_row(row))
    }
}

/// Memory of the flexibility of `n_nodes` contact nodes and of its packed copy, bytes.
pub fn flexibility_bytes(n_nodes: usize) -> usize {
    12 * 9 * n_nodes * n_nodes
}
