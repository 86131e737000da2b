//! Keys of a study file. Their doc comments are the descriptions in its JSON Schema.

use schemars::JsonSchema;
use serde::Deserialize;

/// Study: a scene, the values that vary, and the results collected from the runs.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyFile {
    /// Scene of the study, with title and conditions.
    pub study: StudyKeys,
    /// Axes of the study: the values that vary. All combinations are run, except those that `require` omits.
    #[schemars(length(min = 1))]
    pub axes: Vec<AxisKeys>,
    /// Sampling of the axes that have a `sample`.
    pub sample: Option<SampleKeys>,
    /// Results collected from the runs.
    #[serde(default)]
    pub output: OutputKeys,
}

/// Scene of the study, with title and conditions.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StudyKeys {
    /// Title, shown with the results; default: the title of the scene.
    #[serde(default)]
    pub title: String,
    /// Scene file, relative to the study file.
    pub scene: String,
    /// Comparisons of axes and numbers that each run must satisfy, e.g. "tilt + 'sliding angle' <= 120"; other combinations are
    /// omitted.
    #[serde(default)]
    pub require: Vec<String>,
    /// Without effect: every run is computed. In earlier versions, `true` obtained symmetry-equivalent runs from each other.
    pub symmetry: Option<bool>,
}

/// Axis of the study.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxisKeys {
    /// Name in tables, plots and folders; default: the last part of the first key.
    #[serde(default)]
    pub name: String,
    /// Keys of the scene that the axis sets together, dotted as for --set: "body1.fibre.tilt", "steps.indent.approach".
    #[schemars(length(min = 1))]
    pub keys: Vec<String>,
    /// Values of the axis. With several `keys`, each value is a list with one entry per key.
    #[serde(default)]
    #[schemars(length(min = 1))]
    pub values: Vec<serde_json::Value>,
    /// Evenly spaced numbers, instead of `values`; for an axis with one key.
    pub range: Option<Range>,
    /// Range to sample, instead of `values`. All axes with a `sample` form one axis "sample", spread by the table `sample`.
    pub sample: Option<SampledRange>,
    /// Name shared by axes that vary together, value by value. They form one axis of that name.
    #[serde(default)]
    pub zip: String,
}

/// Evenly spaced numbers from `from` to `to`, both included, given by `count` or `step`.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Range {
    /// First number.
    pub from: f64,
    /// Last number.
    pub to: f64,
    /// Number of values.
    #[schemars(range(min = 2, max = 10_000))]
    pub count: Option<usize>,
    /// Difference between successive numbers.
    pub step: Option<f64>,
    /// Spacing of the numbers: "linear" (equal differences, default) or "log" (equal ratios).
    #[serde(default)]
    pub spacing: Spacing,
}

/// Sampling of the axes that have a `sample`.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampleKeys {
    /// Sampling method: "sobol" (default) or "latin-hypercube".
    #[serde(default)]
    pub method: SampleMethod,
    /// Number of sample points.
    #[schemars(range(min = 1, max = 10_000))]
    pub count: usize,
    /// Seed of the random numbers; the same seed gives the same points.
    #[serde(default)]
    #[schemars(range(max = 4_294_967_295_u32))]
    pub seed: u32,
}

/// Sampling method.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SampleMethod {
    /// Sobol sequence, scrambled by Owen's method: the points are spread evenly over all ranges together. A power of two for
    /// `count` is best.
    ///
    /// A larger `count` with the same seed begins with the same points.
    #[default]
    Sobol,
    /// Latin hypercube: one point in each of `count` equal parts of every range.
    LatinHypercube,
}

/// Range from which numbers are sampled.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SampledRange {
    /// First end of the range.
    pub from: f64,
    /// Second end of the range.
    pub to: f64,
    /// Distribution over the range: "linear" (uniform, default) or "log" (uniform in the logarithm).
    #[serde(default)]
    pub spacing: Spacing,
}

/// Spacing of numbers in a range.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Spacing {
    /// Equal differences; samples are uniform.
    #[default]
    Linear,
    /// Equal ratios; samples are uniform in the logarithm.
    Log,
}

/// Results collected from the runs.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputKeys {
    /// Results at the end of a step, e.g. "fretting.worn_volume" or "shift.tangential_force.0".
    ///
    /// Default: forces, contact area, peak pressure and wear volume of the last step.
    pub collect: Vec<String>,
    /// Results during a step, over the cycles, the sliding distance, or otherwise the increments.
    pub curves: Vec<String>,
}
