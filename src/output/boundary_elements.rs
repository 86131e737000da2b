//! Boundary-element bodies in `summary.json`.

use crate::body::BeBody;
use crate::error::Warning;

const MAX_RELIABLE_ASYMMETRY: f64 = 0.02;

/// Condensation of a boundary-element body to its contact nodes.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct BoundaryElementRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Number of elements.
    pub elements: usize,
    /// Interpolation over an element: "constant", "linear" or "quadratic".
    pub interpolation: &'static str,
    /// Number of unknowns.
    pub unknowns: usize,
    /// Asymmetry of the flexibility under constant and linear tractions ([`BeBody::asymmetry`]).
    pub asymmetry: f64,
    /// Error of the tabulated kernels, relative to their largest values; 0 for closed forms.
    pub kernel_error: f64,
    /// Largest residual of the equations that are checked after the solution, relative to the largest sum of magnitudes
    /// of the terms of an equation.
    pub residual: f64,
    /// Form of the equations: "dense" or "compressed".
    pub equations: &'static str,
    /// Compression, for compressed equations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compression: Option<CompressionRecord>,
}

/// Compression of the equations.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CompressionRecord {
    /// Tolerance of the compressed blocks.
    pub tolerance: f64,
    /// Largest number of matrix-vector products for one right-hand side.
    pub iterations: usize,
    /// Memory of the matrix and its approximate inverse, bytes.
    pub bytes: usize,
}

impl BoundaryElementRecord {
    /// Creates the record of body `index` (0 or 1).
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

    /// Warning if the asymmetry makes the displacements uncertain.
    pub fn accuracy_warning(&self) -> Option<Warning> {
        (self.asymmetry > MAX_RELIABLE_ASYMMETRY).then(|| {
            Warning::uncertain(&format!(
                "the flexibility matrix of the boundary-element body{} is unsymmetric by {:.1} %, so the displacements are uncertain. The boundary elements are too large compared with their distances from each other, or too strongly curved. Use smaller elements, or a higher order (`element`)",
                self.body,
                100.0 * self.asymmetry
            ))
        })
    }
}
