//! `accuracy`: required accuracy of the results.

use schemars::JsonSchema;
use serde::Deserialize;

/// Target relative error. Cells, increments and wear jumps are refined until the estimated errors of the results are
/// below it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum Accuracy {
    /// Target relative error of all results that have an error estimate.
    Number(#[schemars(extend("exclusiveMinimum" = 0), range(max = 0.1))] f64),
    /// Target relative error of selected results.
    Table(AccuracyTable),
}

/// Target accuracy of selected results, and the parameters that are not refined.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AccuracyTable {
    /// Target relative error, e.g. 1e-3.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 0.1))]
    pub relative: f64,
    /// Results that must reach the accuracy at the end of each step; default: all.
    #[schemars(length(min = 1))]
    pub of: Option<Vec<AccuracyQuantity>>,
    /// Parameters that are not refined but kept as given in the scene.
    #[serde(default)]
    pub keep: Vec<RefinementParameter>,
}

/// A result with an error estimate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AccuracyQuantity {
    /// Contact forces. Along directions with a prescribed force: approach or tangential displacement.
    Load,
    /// Peak pressure.
    PeakPressure,
    /// Wear volume.
    WornVolume,
}

/// A parameter that can be refined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RefinementParameter {
    /// Cells of a grid frame.
    Cells,
    /// Increments of the steps.
    Increments,
    /// Number of wear jumps over fretting cycles or sliding, or the tolerance that controls their length.
    Jumps,
}

impl AccuracyQuantity {
    /// All quantities.
    pub const ALL: [Self; 3] = [Self::Load, Self::PeakPressure, Self::WornVolume];

    /// Name of the quantity in scene files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::PeakPressure => "peak_pressure",
            Self::WornVolume => "worn_volume",
        }
    }

    /// Name of the quantity in messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::PeakPressure => "peak pressure",
            Self::WornVolume => "worn volume",
        }
    }
}

impl RefinementParameter {
    /// Name of the parameter in messages.
    pub fn label(self) -> &'static str {
        match self {
            Self::Cells => "cells",
            Self::Increments => "increments",
            Self::Jumps => "jumps",
        }
    }
}
