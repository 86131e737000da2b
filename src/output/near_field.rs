//! Near fields of meshed bodies in `summary.json`.

use crate::body::hybrid::{AppliedLoadError, Indicators};

/// Near field of a body: method and quality.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct NearFieldRecord {
    /// The body, 1 or 2.
    pub body: usize,
    /// Method of the near field: "half-space" or "mesh".
    pub near_field: &'static str,
    /// Reason why the mesh, and not a half-space, determines the near field.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Largest curvature correction of the body's flat contact faces, mm. `None` if no face is corrected, if the gap
    /// does not come from the meshes, or for the near field "mesh".
    #[serde(rename = "bow", skip_serializing_if = "Option::is_none")]
    pub max_face_deviation: Option<f64>,
    /// Estimated errors of the contact surface's displacement due to the body's own loads and prescribed displacements.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_error: Option<AppliedLoadError>,
    /// Quality indicators of the half-space correction. They are also present if the correction was rejected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indicators: Option<Indicators>,
}
