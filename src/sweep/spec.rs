//! Keys of a study file. Their doc comments are the descriptions in its JSON Schema.

use schemars::JsonSchema;
use serde::Deserialize;

/// A study: a scene, the values that vary, and what is collected from the runs.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// What is studied.
    pub study: StudyKeys,
    /// The values that vary; every value of one axis is combined with every value of the others, where `require` leaves out none.
    #[schemars(length(min = 1))]
    pub axes: Vec<AxisKeys>,
    /// How axes with a `sample` are sampled together.
    pub sample: Option<SampleKeys>,
    /// What is collected from the runs.
    #[serde(default)]
    pub output: OutputKeys,
}

/// What is studied.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyKeys {
    /// Title, shown with the results; that of the scene if absent.
    #[serde(default)]
    pub title: String,
    /// Scene file, relative to the study file.
    pub scene: String,
    /// Comparisons that each run has to meet, of names of axes and numbers: "tilt + 'sliding angle' <= 120"; others are left out.
    #[serde(default)]
    pub require: Vec<String>,
    /// Without effect: every run is computed. Earlier versions obtained symmetry-equivalent runs from each other where this was true.
    pub symmetry: Option<bool>,
}

/// An axis of the study.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisKeys {
    /// Name in tables and plots; the last part of the first key if absent.
    #[serde(default)]
    pub name: String,
    /// Keys of the scene that the axis sets together, dotted as for --set: "body1.fibre.tilt", "steps.indent.approach".
    #[schemars(length(min = 1))]
    pub keys: Vec<String>,
    /// The values; with several keys each value is a list of one for each key.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub values: Vec<serde_json::Value>,
    /// Evenly spaced numbers in place of values.
    pub range: Option<Range>,
    /// A range to take numbers from at random: all axes that are sampled make one axis "sample", whose points `sample` spreads over their ranges.
    pub sample: Option<SampledRange>,
    /// Axes with the same word here go together, value by value, and are one axis of that name.
    #[serde(default)]
    pub zip: String,
}

/// Evenly spaced numbers, both ends included; by their number or by the step.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// First number.
    pub from: f64,
    /// Last number.
    pub to: f64,
    /// How many numbers.
    #[schemars(range(min = 2, max = 10_000))]
    pub count: Option<usize>,
    /// Difference from one to the next.
    pub step: Option<f64>,
    /// Even differences, or even ratios.
    #[serde(default)]
    pub spacing: Spacing,
}

/// How a sample is taken.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleKeys {
    /// How its points are spread.
    #[serde(default)]
    pub method: SampleMethod,
    /// Number of points.
    #[schemars(range(min = 1, max = 10_000))]
    pub count: usize,
    /// Other seeds give other points; the same one the same.
    #[serde(default)]
    #[schemars(range(max = 4_294_967_295_u32))]
    pub seed: u32,
}

/// How the points of a sample are spread.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleMethod {
    /// A Sobol sequence, scrambled by Owen's method: evenly in all ranges together, best with a power of two for `count`; more points with the same seed begin
    /// with the same ones.
    #[default]
    Sobol,
    /// One point in each of `count` equal parts of every range.
    LatinHypercube,
}

/// A range that is sampled.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampledRange {
    /// Least number.
    pub from: f64,
    /// Largest number.
    pub to: f64,
    /// Evenly, or evenly by ratios.
    #[serde(default)]
    pub spacing: Spacing,
}

/// How the numbers of a range are spaced.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Spacing {
    /// Even differences.
    #[default]
    Linear,
    /// Even ratios.
    Log,
}

/// What is collected from the runs.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputKeys {
    /// Numbers of the last entry of a step: "fretting.worn_volume", "shift.tangential_force.0"; some of the last step if absent.
    pub collect: Vec<String>,
    /// Numbers of all entries of a step, over the cycles or, without cycles, the increments.
    pub curves: Vec<String>,
}
