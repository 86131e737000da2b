//! Condensation of meshed bodies in `summary.json`.

use crate::fem::{CondensationMethod, CondensedBody};

/// Condensation of a body to its contact nodes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CondensationRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Method: "factorisation" or "conjugate-gradients".
    pub method: &'static str,
    /// Whether the flexibility was read from the cache.
    pub cached: bool,
    /// Relative residual of a check of the factorisation. With conjugate gradients: largest relative residual of the
    /// solved columns.
    pub residual: f64,
    /// Largest number of conjugate-gradient iterations of a column of the flexibility in this run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<usize>,
    /// Reason for not factorising the stiffness matrix.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Peak memory of a factorisation, including the finite-element model, bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub needed_bytes: Option<usize>,
    /// Memory available to the body, bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub allowed_bytes: Option<u64>,
}

impl CondensationRecord {
    /// Creates the record of body `index` (0 or 1).
    pub fn new(index: usize, body: &CondensedBody) -> Self {
        let origin = body.origin();
        let shortage = match origin.method {
            CondensationMethod::Factorisation => None,
            CondensationMethod::ConjugateGradients(shortage) => Some(shortage),
        };
        Self {
            body: index + 1,
            method: origin.method.name(),
            cached: origin.cached,
            residual: body.residual(),
            iterations: (origin.iterations > 0).then_some(origin.iterations),
            reason: shortage.map(|shortage| shortage.to_string()),
            needed_bytes: shortage.map(|shortage| shortage.needed_bytes),
            allowed_bytes: shortage.map(|shortage| shortage.allowed_bytes),
        }
    }

    /// Note that the body is condensed without a factorisation, with the reason.
    pub fn note(&self) -> Option<String> {
        let reason = self.reason.as_ref()?;
        Some(format!("body{} is condensed by conjugate gradients, because {reason}", self.body))
    }
}
