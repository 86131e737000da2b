//! Specification of a finite-element body: mesh, materials, supports, loads.

use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::material::RegionMaterial;
use crate::mesh::Mesh;

/// Strain formulation of 8-node hexahedra.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum HexFormulation {
    /// Nine enhanced strain modes, condensed in the element. No locking in bending.
    #[default]
    Enhanced,
    /// Displacement interpolation only. Far too stiff in bending; for comparison.
    Standard,
    /// Mean dilatation of the element, B-bar. No locking in nearly incompressible material.
    MeanDilatation,
}

impl HexFormulation {
    /// Every formulation.
    pub const ALL: [Self; 3] = [Self::Enhanced, Self::Standard, Self::MeanDilatation];

    /// Name of the formulation in scenes.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Enhanced => "hex8-eas",
            Self::Standard => "hex8",
            Self::MeanDilatation => "hex8-bbar",
        }
    }
}

/// Prescribed displacement of the nodes of a group.
#[derive(Debug, Clone, PartialEq)]
pub struct Support {
    /// Physical group of points, lines, surfaces or volumes.
    pub group: String,
    /// Whether the components x, y, z are prescribed.
    pub components: [bool; 3],
    /// Displacements at the origin of the global axes, mm.
    pub value: [f64; 3],
    /// Displacement gradient, one row per component, derivatives along x, y, z. The prescribed displacement at x is
    /// `value + gradient x`.
    pub gradient: [[f64; 3]; 3],
}

/// Stiffness of a foundation.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum FoundationStiffness {
    /// Stiffness along the normal of the surface.
    Normal(f64),
    /// Stiffnesses along x, y, z.
    Components([f64; 3]),
}

impl FoundationStiffness {
    /// Stiffness values, N/mm3.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Normal(k) => std::slice::from_ref(k),
            Self::Components(k) => k,
        }
    }

    /// Stiffness of the foundation of a face with the area vector `area` (mm²), `[3, 3]`, N/mm.
    pub(crate) fn over_area(self, area: &Vector3<f64>) -> Matrix3<f64> {
        match self {
            Self::Normal(k) => area * area.transpose() * (k / area.norm()),
            Self::Components(k) => Matrix3::from_diagonal(&Vector3::from(k)) * area.norm(),
        }
    }
}

/// Elastic (Winkler) foundation of a surface group.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Foundation {
    /// Physical group of surfaces.
    pub group: String,
    /// Stiffness (force per area and displacement): one number along the surface normal, or three along x, y, z.
    pub stiffness: FoundationStiffness,
}

/// Specification of a finite-element body.
#[derive(Debug, Clone)]
pub struct FeSpec {
    /// Name of the body in messages ("body1").
    pub name: String,
    /// Mesh of the body; all solid cells belong to the body.
    pub mesh: Arc<Mesh>,
    /// Material of each physical group of volumes; `None` selects all cells outside the named regions.
    pub regions: Vec<(Option<String>, RegionMaterial)>,
    /// Formulation of the 8-node hexahedra.
    pub formulation: HexFormulation,
    /// Supports and prescribed displacements.
    pub supports: Vec<Support>,
    /// Elastic foundations.
    pub foundations: Vec<Foundation>,
    /// Pressure on surface groups, MPa, positive into the body.
    pub pressures: Vec<(String, f64)>,
    /// Tractions on surface groups, global axes, MPa.
    pub tractions: Vec<(String, [f64; 3])>,
    /// Force per volume, global axes, N/mm3.
    pub body_force: [f64; 3],
    /// Uniform change of temperature, K.
    pub temperature_change: f64,
}
