//! Keys of a scene file. Their doc comments are the descriptions in the JSON Schema.
//!
//! Angles are in degrees in these types, and in radians in the [plan](super::plan::Plan).

pub mod accuracy;
pub mod body;
pub mod compare;
pub mod direction;
pub mod frame;
pub mod laws;
pub mod material;
pub mod solver;
pub mod step;
pub mod strength;

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::output::summary::Units;

/// A scene: two bodies, a contact frame, laws of friction and wear, and the steps of loading.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(dead_code, reason = "it is the schema: sections are read one by one, so that all mistakes are found")]
pub struct Scene {
    /// Title, shown with the results.
    #[serde(default)]
    pub title: String,
    /// Names of the units of the scene. The units must be consistent; nothing is converted.
    #[serde(default)]
    pub units: Units,
    /// Materials by name.
    #[serde(default)]
    pub materials: BTreeMap<String, material::Material>,
    /// Lower body; its contact face has the outward normal n = +z.
    pub body1: body::Body,
    /// Upper body; `approach`, `shift` and rotations move it.
    pub body2: body::Body,
    /// Contact frame: the cells on which contact may occur.
    pub frame: frame::Frame,
    /// Initial gap between the undeformed surfaces.
    pub gap: frame::Gap,
    /// Friction law; none if absent.
    #[serde(default)]
    #[schemars(extend("default" = { "law": "none" }))]
    pub friction: laws::Friction,
    /// Wear law; none if absent.
    #[serde(default)]
    #[schemars(extend("default" = { "law": "none" }))]
    pub wear: laws::Wear,
    /// Load steps, in order.
    #[schemars(length(min = 1))]
    pub steps: Vec<step::Step>,
    /// Solver settings: method, tolerances, memory.
    #[serde(default)]
    pub solver: solver::Solver,
    /// Files to write in addition to summary.json and history.csv.
    #[serde(default)]
    pub output: solver::Output,
    /// Target relative error, e.g. 1e-3. Cells, increments and wear jumps are refined until the estimated error is
    /// below it.
    pub accuracy: Option<accuracy::Accuracy>,
    /// Variants of the scene for `orthowear compare`.
    #[serde(default)]
    pub compare: compare::Compare,
}
