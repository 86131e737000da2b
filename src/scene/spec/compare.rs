//! `[compare]`: the variants that `orthowear compare` computes.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::{Element, NearField};
use crate::bem::finite::Interpolation;

/// The variants that `orthowear compare` computes, and how bodies are meshed in them; other commands only check it.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Compare {
    /// Models of body 1 and body 2 in each variant, e.g. "FE-BE": FE (finite elements), BE (boundary elements), HS
    /// (half-space), THS (truncated half-space) or rigid. The first variant is the reference. Default: the scene as
    /// written, FE-FE, BE-BE, FE-BE and HS-HS.
    #[schemars(length(min = 1))]
    pub variants: Option<Vec<String>>,
    /// Mesh and elements of body 1 in variants that replace its `kind`.
    pub body1: AlternativeModels,
    /// Mesh and elements of body 2 in variants that replace its `kind`.
    pub body2: AlternativeModels,
}

/// Mesh and elements of a meshed body in variants that replace its `kind`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlternativeModels {
    /// As a boundary-element body, if its kind is "fe".
    pub be: AlternativeBe,
    /// As a finite-element body, if its kind is "be".
    pub fe: AlternativeFe,
}

/// A finite-element body modelled with boundary elements.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlternativeBe {
    /// Mesh file with the same group names: a closed surface mesh, or a volume mesh, whose boundary surface is used. Default: the boundary surface of the body's mesh.
    pub mesh: Option<String>,
    /// Interpolation of displacement and traction on an element; default "linear".
    pub element: Interpolation,
}

/// A boundary-element body modelled with finite elements.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlternativeFe {
    /// Volume mesh file with the same group names. Default: the body's mesh, if it is a volume mesh.
    pub mesh: Option<String>,
    /// Formulation of 8-node hexahedra: "hex8-eas" (default), "hex8" or "hex8-bbar". Any other name only checks that the mesh contains elements of
    /// that type.
    pub element: Option<Element>,
    /// Model near the contact, as `near_field` of a finite-element body.
    pub near_field: NearField,
}
