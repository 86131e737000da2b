//! How far half-spaces whose surfaces are meshed are from exact ones, for `summary.json`.

use crate::body::Truncation;
use crate::error::warning;

/// Difference from the exact half-space from which on a result is in doubt.
const MAX_RELIABLE_DIFFERENCE: f64 = 0.02;

/// A half-space whose surface is meshed, beside the exact one.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TruncationRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Number of elements.
    pub elements: usize,
    /// Mean normal displacement of the frame by uniform pressure on it, by the elements.
    pub compliance: f64,
    /// The same of the exact half-space.
    pub exact_compliance: f64,
    /// Norm of what the works of uniform tractions on the displacements by one another differ by, over that of the exact ones.
    pub difference: f64,
    /// Relative residual of equations computed afresh.
    pub residual: f64,
}

impl TruncationRecord {
    /// Of body `index` (0 or 1).
    pub fn new(index: usize, truncation: &Truncation) -> Self {
        let [compliance, exact_compliance] = truncation.compliance;
        let Truncation { n_elements: elements, difference, residual, .. } = *truncation;
        Self { body: index + 1, elements, compliance, exact_compliance, difference, residual }
    }

    /// What the user should know of it.
    pub fn accuracy_warning(&self) -> Option<String> {
        (self.difference > MAX_RELIABLE_DIFFERENCE).then(|| {
            warning(&format!(
                "the meshed surface of the half-space body{} differs from an exact one by {:.1} % under uniform tractions on the frame: mesh it farther out \
                 (`truncated`), or leave that key out for the exact half-space",
                self.body,
                100.0 * self.difference
            ))
        })
    }
}
