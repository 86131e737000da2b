//! What condensing a body will take, known before any number is computed.

use super::method::{Method, iterative_bytes};
use super::model::FeModel;
use crate::error::Result;
use crate::linalg::factor::{CholeskyFactor, SymbolicFactor};
use crate::linalg::memory::MemoryLimit;

/// Threads whose workspace an estimate of memory counts: beyond these the factorisation takes no more. The estimate
/// decides the method, which must not depend on the threads at hand.
const THREADS: usize = 16;

/// What factorising a body for some contact nodes will take.
pub struct Analysis {
    contact_nodes: Vec<usize>,
    n_trailing: usize,
    n_free: usize,
    model_bytes: usize,
    symbolic: SymbolicFactor,
}

impl Analysis {
    pub(super) fn new(model: &FeModel, contact_nodes: &[usize], order: Vec<usize>) -> Result<Self> {
        let n_trailing = model.contact_rows(contact_nodes).len();
        Ok(Self {
            contact_nodes: contact_nodes.to_vec(),
            n_trailing,
            n_free: model.n_free(),
            model_bytes: model.memory_bytes(),
            symbolic: SymbolicFactor::new(model.stiffness(), &order, n_trailing)?,
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
    pub fn n_trailing(&self) -> usize {
        self.n_trailing
    }

    /// Number of entries of the factor.
    pub fn factor_entries(&self) -> usize {
        self.symbolic.n_stored()
    }

    /// Floating-point operations of factor and flexibility.
    pub fn flops(&self) -> f64 {
        self.symbolic.flops() + 2.0 / 3.0 * (self.n_trailing as f64).powi(3)
    }

    /// Bytes taken at the peak by a factorisation: the assembled body, the factor, and the larger of its workspace and
    /// the three dense matrices of the contact dofs. The same whatever the number of threads.
    pub fn memory_bytes(&self) -> usize {
        let factor = 8 * self.factor_entries();
        let workspace = self.symbolic.memory_bytes_with(THREADS) - factor;
        let rest = workspace.max(24 * self.n_trailing * self.n_trailing);
        self.model_bytes + factor + rest
    }

    /// How the body is condensed within `memory`.
    ///
    /// # Errors
    /// If no method fits (kind `Resources`), with the bytes needed and allowed.
    pub fn method(&self, model: &FeModel, memory: &MemoryLimit) -> Result<Method> {
        Method::choose(model, self.n_trailing, self.memory_bytes(), memory)
    }

    /// Bytes at the peak and in the end of a body condensed by `method`.
    pub fn bytes_by(&self, model: &FeModel, method: Method) -> [usize; 2] {
        let peak = match method {
            Method::Factorisation => self.memory_bytes(),
            Method::ConjugateGradients(_) => iterative_bytes(model, self.n_trailing),
        };
        let flexibility = flexibility_bytes(self.contact_nodes.len());
        [peak, self.model_bytes + self.solver_bytes(model, method) + flexibility]
    }

    /// Bytes of what solves the systems.
    pub(super) fn solver_bytes(&self, model: &FeModel, method: Method) -> usize {
        match method {
            // With its workspace: what an entry of the cache knows, too.
            Method::Factorisation => self.memory_bytes() - self.model_bytes,
            Method::ConjugateGradients(_) => iterative_bytes(model, 0) - self.model_bytes,
        }
    }

    /// Number of values that the factor is stored in.
    pub(super) fn n_values(&self) -> usize {
        self.symbolic.n_values()
    }

    /// The factor from its stored values; `None` if they do not pass its check.
    pub(super) fn restore(self, model: &FeModel, values: Vec<f64>) -> Result<Option<CholeskyFactor>> {
        self.symbolic.restore(model.stiffness(), values)
    }

    pub(super) fn factorise(self, model: &FeModel) -> Result<CholeskyFactor> {
        self.symbolic.factorise(model.stiffness(), |row| model.row_name(row))
    }
}

/// Bytes of a flexibility of `n_nodes` contact nodes and of the packed copy in use.
pub fn flexibility_bytes(n_nodes: usize) -> usize {
    16 * 9 * n_nodes * n_nodes
}
