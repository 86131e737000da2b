//! Near fields of meshed bodies in `summary.json`.

use crate::body::hybrid::{AppliedLoadError, Indicators};

/// Near field of a body: method and quality.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NearFieldRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// "half-space" or "mesh".
    pub near_field: &'static str,
    /// Reason for the near field of the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Largest height of the curvature correction of the body's flat faces, mm, for a gap between meshes.
    #[serde(rename = "bow", skip_serializing_if = "Option::is_none")]
    pub max_face_deviation: Option<f64>,
    /// Estimated errors of the surface displacement under the frame due to loads and prescribed displacements of the body itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_error: Option<AppliedLoadError>,
    /// Quality indicators of the half-space correction, also if the correction was rejected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indicators: Option<Indicators>,
}
