//! Where the near fields of meshed bodies were computed, for `summary.json`.

use crate::body::hybrid::{AppliedLoadError, Indicators};

/// Where the near field of a body was computed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NearFieldRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// "half-space" or "mesh".
    pub near_field: &'static str,
    /// Why it was the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The most by which its flat faces are bowed in the gap of the meshes, mm.
    #[serde(rename = "bow", skip_serializing_if = "Option::is_none")]
    pub max_face_deviation: Option<f64>,
    /// Estimated errors of the displacement of its surface under the frame by loads and prescribed displacements of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_error: Option<AppliedLoadError>,
    /// How good the correction of the half-space is, or was found not to be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indicators: Option<Indicators>,
}
