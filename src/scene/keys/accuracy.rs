//! `accuracy`: how accurate results shall be.

use schemars::JsonSchema;
use serde::Deserialize;

/// How accurate results shall be: cells, increments and jumps are chosen by runs that get finer.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "accuracy is a number, or a table with `relative`")]
#[schemars(inline)]
pub enum Accuracy {
    /// Relative error of all that can be asked for.
    Number(#[schemars(extend("exclusiveMinimum" = 0), range(max = 0.1))] f64),
    /// The same as a text like "1e-3".
    Text(String),
    /// Relative error of some results.
    Table(Wanted),
}

/// Which results shall be accurate, and what is left as the scene has it.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    /// Relative error.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 0.1))]
    pub relative: f64,
    /// The results at the end of each step; all of them if absent.
    #[schemars(with = "Vec<Quantity>", length(min = 1))]
    #[serde(default)]
    pub of: Option<Vec<Quantity>>,
    /// What stays as the scene has it.
    #[serde(default)]
    pub keep: Vec<Knob>,
}

/// A result that can be asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    /// The force, and where it is prescribed the motion that it causes.
    Load,
    /// The largest pressure.
    PeakPressure,
    /// The worn volume.
    WornVolume,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, serde::Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Knob {
    /// Cells of a grid frame.
    Cells,
    /// Increments of the steps.
    Increments,
    /// Jumps over fretting cycles, or the tolerance that decides on them.
    Jumps,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Load, Self::PeakPressure, Self::WornVolume];

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Load => "load",
            Self::PeakPressure => "peak pressure",
            Self::WornVolume => "worn volume",
        }
    }
}

impl Knob {
    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Self::Cells => "cells",
            Self::Increments => "increments",
            Self::Jumps => "jumps",
        }
    }
}
