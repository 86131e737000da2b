//! Half-spaces with a meshed surface, compared with exact half-spaces, in `summary.json`.

use crate::body::Truncation;
use crate::error::Warning;

const MAX_RELIABLE_DIFFERENCE: f64 = 0.02;

/// Half-space with a meshed surface, compared with the exact half-space.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct TruncationRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Number of elements.
    pub elements: usize,
    /// Mean normal displacement of the frame under uniform unit pressure, for the meshed surface.
    pub compliance: f64,
    /// Mean normal displacement of the frame under uniform unit pressure, for the exact half-space.
    pub exact_compliance: f64,
    /// Relative error |W - W_exact| / |W_exact| of the meshed surface. W_ab is the work of a uniform unit traction
    /// along a on the displacements due to a uniform unit traction along b.
    pub difference: f64,
    /// Largest residual of the equations that are checked after the solution, relative to the largest sum of magnitudes
    /// of the terms of an equation.
    pub residual: f64,
}

impl TruncationRecord {
    /// Creates the record of body `index` (0 or 1).
    pub fn new(index: usize, truncation: &Truncation) -> Self {
        let [compliance, exact_compliance] = truncation.compliance;
        let Truncation { n_elements: elements, difference, residual, .. } = *truncation;
        Self { body: index + 1, elements, compliance, exact_compliance, difference, residual }
    }

    /// Warning if the difference from the exact half-space is too large.
    pub fn accuracy_warning(&self) -> Option<Warning> {
        (self.difference > MAX_RELIABLE_DIFFERENCE).then(|| {
            Warning::uncertain(&format!(
                "the compliance of the truncated half-space body{} differs by {:.1} % from the exact half-space under uniform tractions on the frame. Increase `truncated` to mesh a larger surface, or remove it to use the exact half-space",
                self.body,
                100.0 * self.difference
            ))
        })
    }
}
