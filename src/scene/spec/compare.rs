//! `[compare]`: the variants that `orthowear compare` computes.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::{Element, NearField};
use crate::bem::finite::Interpolation;

/// Variants of the scene for `orthowear compare`, and the meshes of their bodies. Other commands only check them.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Compare {
    /// Models of body 1 and body 2 in each variant, e.g. "FE-BE"; the first variant is the reference.
    ///
    /// FE: finite elements, BE: boundary elements, HS: half-space, THS: truncated half-space, rigid. Default: the scene
    /// as written, FE-FE, BE-BE, FE-BE and HS-HS. In the last four variants, rigid bodies and exact half-spaces keep
    /// their models.
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
    /// Boundary-element model of the body, if its kind is "fe".
    pub be: AlternativeBe,
    /// Finite-element model of the body, if its kind is "be".
    pub fe: AlternativeFe,
}

/// Boundary-element model of a finite-element body.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlternativeBe {
    /// Mesh file with the same groups: a closed surface, or a volume whose surface is used. Default: surface of the body's mesh.
    pub mesh: Option<String>,
    /// Interpolation of displacement and traction on an element; default "linear".
    pub element: Interpolation,
}

/// Finite-element model of a boundary-element body.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AlternativeFe {
    /// Volume mesh file with the same groups. Default: the body's mesh, if it is a volume mesh.
    pub mesh: Option<String>,
    /// Formulation of 8-node hexahedra: "hex8-eas" (default), "hex8" or "hex8-bbar".
    ///
    /// Other names do not select a formulation. They only check that the mesh contains elements of the named type.
    pub element: Option<Element>,
    /// Model near the contact: "auto" (default), "half-space" or "mesh"; see `near_field` of a finite-element body.
    pub near_field: NearField,
}
