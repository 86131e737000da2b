//! Condensation method, chosen by the available memory: factorisation or conjugate gradients.

use super::model::FeModel;
use crate::error::Result;
use crate::linalg::memory::{MemoryLimit, format_bytes};
use crate::linalg::two_level::TwoLevelSolver;

/// Method that solves the linear systems of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CondensationMethod {
    /// Factorisation of the stiffness matrix.
    #[default]
    Factorisation,
    /// Conjugate gradients, because a factorisation does not fit into memory.
    ConjugateGradients(MemoryShortfall),
}

/// Memory needed and allowed for a factorisation that does not fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MemoryShortfall {
    /// Peak memory of the factorisation, including the model, bytes.
    pub needed_bytes: usize,
    /// Memory available, bytes.
    pub allowed_bytes: u64,
}

impl std::fmt::Display for MemoryShortfall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { needed_bytes, allowed_bytes } = self;
        write!(
            f,
            "a factorisation would need {} ({needed_bytes} bytes), but only {} ({allowed_bytes} bytes) are allowed",
            format_bytes(*needed_bytes as u128),
            format_bytes(u128::from(*allowed_bytes))
        )
    }
}

impl CondensationMethod {
    /// Chooses a factorisation if `needed_bytes` fit into `memory`, conjugate gradients otherwise. `n_trailing` is the number of
    /// free contact dofs.
    ///
    /// # Errors
    /// If conjugate gradients do not fit either (kind `Resources`).
    pub(super) fn choose(
        model: &FeModel,
        n_trailing: usize,
        needed_bytes: usize,
        memory: &MemoryLimit,
    ) -> Result<Self> {
        if memory.allows(needed_bytes as u128) {
            return Ok(Self::Factorisation);
        }
        let what = format!(
            "condensing {} unknowns to {n_trailing} under the frame by conjugate gradients (a factorisation would need {})",
            model.n_free(),
            format_bytes(needed_bytes as u128)
        );
        let mend = "use a coarser mesh, or a smaller frame";
        memory.ensure_available(iterative_peak_bytes(model, n_trailing) as u128, &what, mend)?;
        let allowed_bytes = memory.remaining().unwrap_or(u64::MAX);
        Ok(Self::ConjugateGradients(MemoryShortfall { needed_bytes, allowed_bytes }))
    }

    /// Name of the method in results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Factorisation => "factorisation",
            Self::ConjugateGradients(_) => "conjugate-gradients",
        }
    }
}

/// Peak memory of the condensation of a body to `n_trailing` contact dofs by conjugate gradients, bytes.
pub(super) fn iterative_peak_bytes(model: &FeModel, n_trailing: usize) -> usize {
    let n_batches = n_trailing.div_ceil(TwoLevelSolver::rhs_per_batch());
    let solver = TwoLevelSolver::memory_bytes(model.stiffness().n_stored(), model.n_nodes(), n_batches);
    model.resident_bytes() + solver + 16 * n_trailing * n_trailing
}
