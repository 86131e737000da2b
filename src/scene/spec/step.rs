//! `[[steps]]`.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Deserialize;

use super::frame::{Positive, PositiveCount};

/// Load step. Its values are totals since the initial state, reached at the end of the step. They change linearly over
/// the step.
///
/// Quantities that the step does not name keep their previous values.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Step {
    /// Name in the results; default "step N".
    pub name: Option<String>,
    /// Approach (rigid-body indentation depth): motion of body 2 towards body 1. Excludes `normal_force`.
    ///
    /// 0 is the first touch of the undeformed surfaces.
    pub approach: Option<f64>,
    /// Normal force, compression positive. Excludes `approach`.
    #[schemars(range(min = 0))]
    pub normal_force: Option<f64>,
    /// Tangential displacement of body 2. Excludes `tangential_force`.
    pub shift: Option<Shift>,
    /// Tangential force on body 1 along the frame's x, y; needs friction. Excludes `shift`.
    pub tangential_force: Option<[f64; 2]>,
    /// Rotation of body 2 about the axes x and y through the frame's centre, degrees (small rotations). Excludes
    /// `moment`.
    pub rotation: Option<[f64; 2]>,
    /// Moments on body 1 about the axes x and y through the frame's centre; body 2 rotates freely. Excludes `rotation`.
    pub moment: Option<[f64; 2]>,
    /// Rotation of body 2 about the normal through the frame's centre, degrees (small rotations). Excludes `spin_moment`.
    pub twist: Option<f64>,
    /// Moment on body 1 about the normal through the frame's centre. Excludes `twist`.
    pub spin_moment: Option<f64>,
    /// Amplitudes of named loads of the bodies at the end of the step. An amplitude is a factor on the value of its
    /// load.
    ///
    /// In the first step, loads without an amplitude here reach amplitude 1.
    #[serde(default)]
    pub loads: BTreeMap<String, f64>,
    /// Load history from a CSV file, instead of other loads and motions. The loads change linearly from row to row.
    pub history: Option<LoadHistory>,
    /// Number of equal increments (with `history`: per row), default 1. With friction the result depends on this number
    /// (load path).
    #[serde(default = "super::frame::one")]
    pub increments: PositiveCount,
    /// Whether friction acts in this step.
    #[serde(default = "super::frame::yes")]
    pub friction: bool,
    /// Whether wear acts in this step.
    #[serde(default = "super::frame::yes")]
    pub wear: bool,
    /// Fretting cycles about the position at the start of the step.
    pub cycles: Option<Cycles>,
    /// Steady sliding of body 2 over body 1.
    pub sliding: Option<Sliding>,
    /// Steady rolling under the loads of the previous steps. The creepages grow linearly over the increments.
    pub rolling: Option<Rolling>,
}

/// Steady rolling: the contact zone moves over both bodies. Each increment is a steady state.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rolling {
    /// Direction in which the contact moves over the bodies, from the frame's x towards its y: 0, 90, 180 or 270 degrees.
    #[serde(default)]
    pub direction: f64,
    /// Creepages: rigid slip of body 2 over body 1 per rolled distance, along the rolling direction and to its left.
    #[serde(default)]
    pub creepage: [f64; 2],
    /// Spin creepage: rotation of body 2 relative to body 1 about n (from x towards y) per rolled distance, radians per length.
    #[serde(default)]
    pub spin: f64,
    /// Rolled distance, by which wear volume and dissipation grow.
    #[serde(default)]
    #[schemars(range(min = 0))]
    pub distance: f64,
}

/// Tangential displacement of body 2.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shift {
    /// Length of the displacement.
    pub distance: f64,
    /// Direction from the frame's x towards its y, degrees.
    #[serde(default)]
    pub angle: f64,
}

/// Load points from a CSV file.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoadHistory {
    /// CSV file, relative to the scene file: one row per load point, in order. Lines that begin with # are ignored.
    pub file: String,
    /// Quantity in each column; "-" ignores a column. Default: the names in the first line of the file.
    ///
    /// Quantities are "approach", "normal_force", "shift_x", "shift_y", "tangential_x", "tangential_y", "rotation_x",
    /// "rotation_y", "moment_x", "moment_y", "twist", "spin_moment", and the names of loads of the bodies. Columns of
    /// loads contain amplitudes.
    pub columns: Option<Vec<String>>,
}

/// Prescribed quantity in a column of a load history. Values are in the units of the scene, angles in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum LoadColumn {
    Approach,
    NormalForce,
    ShiftX,
    ShiftY,
    TangentialX,
    TangentialY,
    RotationX,
    RotationY,
    MomentX,
    MomentY,
    Twist,
    SpinMoment,
    Ignored,
}

impl LoadColumn {
    /// Number of variants.
    pub const COUNT: usize = 13;

    const NAMES: [(Self, &'static str); Self::COUNT] = [
        (Self::Approach, "approach"),
        (Self::NormalForce, "normal_force"),
        (Self::ShiftX, "shift_x"),
        (Self::ShiftY, "shift_y"),
        (Self::TangentialX, "tangential_x"),
        (Self::TangentialY, "tangential_y"),
        (Self::RotationX, "rotation_x"),
        (Self::RotationY, "rotation_y"),
        (Self::MomentX, "moment_x"),
        (Self::MomentY, "moment_y"),
        (Self::Twist, "twist"),
        (Self::SpinMoment, "spin_moment"),
        (Self::Ignored, "-"),
    ];

    /// Name of the column in files.
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize].1
    }

    /// Finds the column with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(_, known)| *known == name).map(|(column, _)| *column)
    }

    /// Names of all columns except "-".
    pub fn names() -> impl Iterator<Item = &'static str> {
        Self::NAMES[..Self::COUNT - 1].iter().map(|(_, name)| *name)
    }
}

/// Fretting cycles about the position at the start of the step.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cycles {
    /// Number of cycles.
    #[schemars(range(min = 1))]
    pub count: u64,
    /// Displacement amplitude (±) of body 2. Excludes `force_amplitude`.
    pub amplitude: Option<Positive>,
    /// Amplitude (±) of the tangential force on body 1; needs friction. Excludes `amplitude`.
    pub force_amplitude: Option<Positive>,
    /// Second semi-axis of an elliptic path, perpendicular to `angle`. Needs `path = "ellipse"`.
    ///
    /// The semi-axis is a displacement with `amplitude`, and a force with `force_amplitude`.
    pub amplitude2: Option<Positive>,
    /// Direction from the frame's x towards its y, degrees.
    #[serde(default)]
    pub angle: f64,
    /// Amplitudes of named loads of the bodies that vary in phase with the stroke, about their values at the start of
    /// the step.
    ///
    /// On an ellipse these loads follow the first semi-axis. Without `amplitude` and `force_amplitude` only these loads
    /// vary.
    #[serde(default)]
    pub loads: BTreeMap<String, f64>,
    /// Number of equal wear jumps over the cycles; default: controlled by the estimated error (`wear.tolerance`).
    pub jumps: Option<PositiveCount>,
    /// Number of increments per stroke (half cycle), or "auto". Default: as "auto", with corrections only where needed.
    ///
    /// "auto" computes a stroke in 1 increment (ellipse: 8). Cycles resolved in more increments correct the wear;
    /// `wear.tolerance` sets their increments. The default omits this correction while the whole contact slips and the
    /// wear volumes with more increments agree within the tolerance. A number above 1 (ellipse: above 8) corrects the
    /// wear by resolved cycles with this number of increments. With any other number, one resolved cycle at the start
    /// of the step only measures the error.
    pub increments: Option<StrokeIncrements>,
    /// Path of a cycle: "line" (default) or "ellipse".
    #[serde(default)]
    pub path: CyclePath,
}

/// Increments per stroke.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(untagged)]
#[schemars(inline)]
pub enum StrokeIncrements {
    /// Number of increments.
    Given(PositiveCount),
    /// Increments that `wear.tolerance` requires.
    Automatic(AutoKeyword),
}

/// Keyword for increments that follow from the tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(inline)]
pub enum AutoKeyword {
    /// As many increments as `wear.tolerance` requires.
    Auto,
}

/// Steady sliding of body 2 over body 1. The contact zone stays in place on the frame and wears.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sliding {
    /// Sliding distance.
    pub distance: Positive,
    /// Direction from the frame's x towards its y, degrees.
    #[serde(default)]
    pub angle: f64,
    /// Number of equal wear jumps over the distance; default: controlled by the estimated error (`wear.tolerance`).
    pub jumps: Option<PositiveCount>,
}

/// Path of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CyclePath {
    /// Straight line, back and forth.
    #[default]
    Line,
    /// Ellipse. The path starts at +amplitude along `angle` and turns to the left.
    Ellipse,
}
