//! Where the near fields of meshed bodies were computed, for `summary.json`.

use crate::body::hybrid::Indicators;

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
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bow: Option<f64>,
    /// How far loads and prescribed displacements of its own curve the surface under the frame within the flat faces of its mesh,
    /// which the contact takes as they are, mm.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_sag: Option<f64>,
    /// How good the correction of the half-space is, or was found not to be.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub indicators: Option<Indicators>,
}
