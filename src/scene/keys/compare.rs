//! `[compare]`: the variants that `orthowear compare` computes.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::{BoundaryElement, Element, NearField};

/// The variants that `orthowear compare` computes, and how bodies are meshed in them; other commands only check it.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Compare {
    /// What body 1 and body 2 are in each variant: FE, BE, HS (half-space), THS (a truncated one) or rigid, like "FE-BE". The others are compared with the
    /// first. Default: the scene as it is, FE-FE, BE-BE, FE-BE and HS-HS.
    #[schemars(with = "Vec<String>", length(min = 1))]
    pub variants: Option<Vec<String>>,
    /// How body 1 is meshed where it is not of the kind that it has.
    pub body1: Others,
    /// The same of body 2.
    pub body2: Others,
}

/// Other descriptions of a meshed body.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Others {
    /// Of boundary elements, for a body of kind "fe".
    pub be: OtherBe,
    /// Of finite elements, for a body of kind "be".
    pub fe: OtherFe,
}

/// A body of finite elements as one of boundary elements.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OtherBe {
    /// Mesh file with the groups of the body's own: a closed surface, or solids, whose skin is taken; the skin of its own mesh if absent.
    #[schemars(with = "String")]
    pub mesh: Option<String>,
    /// How displacement and traction vary over an element; default "linear".
    pub element: BoundaryElement,
}

/// A body of boundary elements as one of finite elements.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OtherFe {
    /// Mesh file of its solids with the groups of the body's own mesh; that one if absent and if it has solids.
    #[schemars(with = "String")]
    pub mesh: Option<String>,
    /// Formulation of 8-node hexahedra, or a kind of element that the mesh must contain.
    #[schemars(with = "Element")]
    pub element: Option<Element>,
    /// Where the near field of the contact is computed.
    pub near_field: NearField,
}
