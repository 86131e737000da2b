//! How bodies of boundary elements were solved, for `summary.json`.

use crate::body::BeBody;
use crate::error::warning;

/// Asymmetry of a flexibility from which on its elements are in doubt.
const MAX_RELIABLE_ASYMMETRY: f64 = 0.02;

/// How a body of boundary elements was condensed to its nodes under the frame.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BoundaryElementRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Number of elements.
    pub elements: usize,
    /// "constant", "linear" or "quadratic".
    pub interpolation: &'static str,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Asymmetry of the flexibility under constant and linear tractions ([`BeBody::asymmetry`]).
    pub asymmetry: f64,
    /// Error of the tabulated kernels, over their largest values.
    pub kernel_error: f64,
    /// Relative residual of equations computed afresh.
    pub residual: f64,
    /// "dense" or "compressed".
    pub equations: &'static str,
    /// Of compressed equations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compression: Option<CompressionRecord>,
}

/// How equations were compressed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CompressionRecord {
    /// Tolerance of the blocks.
    pub tolerance: f64,
    /// Most products with the matrix for a right side.
    pub iterations: usize,
    /// Bytes of the matrix and its approximate inverse.
    pub bytes: usize,
}

impl BoundaryElementRecord {
    /// Of body `index` (0 or 1).
    pub fn new(index: usize, body: &BeBody) -> Self {
        Self {
            body: index + 1,
            elements: body.n_elements(),
            interpolation: body.interpolation().name(),
            unknowns: body.n_unknowns(),
            asymmetry: body.asymmetry(),
            kernel_error: body.kernel_error(),
            residual: body.residual(),
            equations: if body.compression().is_some() { "compressed" } else { "dense" },
            compression: body.compression().map(|report| CompressionRecord {
                tolerance: report.tolerance,
                iterations: report.iterations,
                bytes: report.bytes,
            }),
        }
    }

    /// What the user should know of it.
    pub fn accuracy_warning(&self) -> Option<String> {
        (self.asymmetry > MAX_RELIABLE_ASYMMETRY).then(|| {
            warning(&format!(
                "the flexibility of body{} of boundary elements is not symmetric by {:.1} %: its elements are too large beside their distances or bend \
                 too much; take smaller ones, or of higher order (`element`)",
                self.body,
                100.0 * self.asymmetry
            ))
        })
    }
}
