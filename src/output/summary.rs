//! Summary of a run, written as `summary.json` whatever the outcome.

use std::time::Instant;

use serde::ser::{Serialize, SerializeMap, Serializer};
use serde_json::Value;

use crate::error::{Error, ErrorKind, Result, Warning};
use crate::evolution::records::{Divergence, FrettingLoop, IncrementRecord, Outcome};
use crate::frame::Grid;
use crate::omitted::OmittedWork;
use crate::output::accuracy::AccuracyRecord;
use crate::output::body_peaks::BodyRecord;
use crate::output::boundary_elements::BoundaryElementRecord;
use crate::output::condensation::CondensationRecord;
use crate::output::near_field::NearFieldRecord;
use crate::output::truncation::TruncationRecord;

/// Names of the units of length and force; the unit of stress is force per length squared.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Units {
    /// Name of the unit of length.
    pub length: String,
    /// Name of the unit of force.
    pub force: String,
}

impl Units {
    /// Name of the unit of stress: MPa for N and mm.
    pub fn stress(&self) -> String {
        match (self.force.as_str(), self.length.as_str()) {
            ("N", "mm") => "MPa".to_owned(),
            ("N", "m") => "Pa".to_owned(),
            (force, length) => format!("{force}/{length}^{{2}}"),
        }
    }

    /// Unit of the quantity that has the name `key` in scenes or entries, in the notation of figures ("mm^{3}"). Empty
    /// for keys without a unit, such as counts and words.
    pub fn of_key(&self, key: &str) -> String {
        let Self { length, force } = self;
        match key {
            "position"
            | "centre"
            | "approach"
            | "distance"
            | "amplitude"
            | "amplitude2"
            | "half_width"
            | "center"
            | "radius"
            | "radii"
            | "semi_axes"
            | "offset"
            | "shift"
            | "max_wear_depth"
            | "max_wear_depth_error"
            | "wear_depth_error"
            | "thickness"
            | "bottom"
            | "distance_slid"
            | "truncated"
            | "vertices"
            | "spacing"
            | "bow"
            | "depth_error" => length.clone(),
            "normal_force" | "tangential_force" | "force_amplitude" => force.clone(),
            "von_mises" | "sigma_tangential" | "E" | "E1" | "E2" | "E3" | "G12" | "G13" | "G23" | "Xt"
            | "Xc" | "Yt" | "Yc" | "Zt" | "Zc" | "S12" | "S13" | "S23" | "yield" | "peak_pressure" => {
                self.stress()
            }
            "moment" | "spin_moment" | "dissipation" => format!("{force} {length}"),
            "contact_area" | "stick_area" => format!("{length}^{{2}}"),
            "worn_volume"
            | "worn_volume_by_body"
            | "worn_volume_by_energy"
            | "worn_volume_error"
            | "worn_volume_error_by_source"
            | "volume_error" => format!("{length}^{{3}}"),
            "i" | "i1" | "i2" | "i_L" | "i_T" | "i_N" | "k" => format!("{length}^{{3}}/({force} {length})"),
            "tilt" | "azimuth" | "angle" | "rotation" | "twist" | "slope" | "direction" => {
                "degrees".to_owned()
            }
            "seconds" => "s".to_owned(),
            _ => String::new(),
        }
    }
}

impl Default for Units {
    fn default() -> Self {
        Self { length: "mm".into(), force: "N".into() }
    }
}

/// Outcome of a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Status {
    /// All steps converged.
    Converged,
    /// A step did not converge, or the run ended for another reason that [`Summary::reason`] names.
    NotConverged,
    /// The run could not continue: wrong input, insufficient resources, or an unexpected failure.
    #[default]
    Failed,
    /// The run was cancelled, for example by a signal.
    Interrupted,
}

impl Status {
    /// All statuses.
    pub const ALL: [Self; 4] = [Self::Converged, Self::NotConverged, Self::Failed, Self::Interrupted];
}

/// Seconds by stage, in the order of first use. Serialised as a JSON object.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Timings(Vec<(String, f64)>);

impl Timings {
    /// Adds `seconds` to `stage`.
    pub fn add(&mut self, stage: &str, seconds: f64) {
        match self.0.iter_mut().find(|(name, _)| name == stage) {
            Some((_, sum)) => *sum += seconds,
            None => self.0.push((stage.to_owned(), seconds)),
        }
    }

    /// Runs `work` and adds its duration to `stage`.
    pub fn measure<T>(&mut self, stage: &str, work: impl FnOnce() -> T) -> T {
        let start = Instant::now();
        let result = work();
        self.add(stage, start.elapsed().as_secs_f64());
        result
    }

    /// Seconds of `stage` so far.
    pub fn of(&self, stage: &str) -> f64 {
        self.iter().find(|(name, _)| *name == stage).map_or(0.0, |(_, seconds)| seconds)
    }

    /// Total of all stages, seconds.
    pub fn sum(&self) -> f64 {
        self.iter().map(|(_, seconds)| seconds).sum()
    }

    /// Stages with their seconds.
    pub fn iter(&self) -> impl Iterator<Item = (&str, f64)> {
        self.0.iter().map(|(stage, seconds)| (stage.as_str(), *seconds))
    }
}

impl Serialize for Timings {
    fn serialize<S: Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (stage, seconds) in &self.0 {
            map.serialize_entry(stage, seconds)?;
        }
        map.end()
    }
}

/// Size of a grid frame.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct FrameRecord {
    /// Half of the side lengths along x, y.
    pub half_width: [f64; 2],
    /// Numbers of cells along x, y.
    pub cells: [usize; 2],
}

impl From<&Grid> for FrameRecord {
    fn from(grid: &Grid) -> Self {
        Self { half_width: grid.half_width(), cells: grid.cells }
    }
}

/// Results and outcome of a run: the fields of `summary.json` (docs/results.md).
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Name of the program.
    pub program: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Title of the run; empty if the scene could not be read.
    pub title: String,
    /// SHA-256 of the scene file and its overrides, hexadecimal; empty if the file could not be read.
    pub scene_sha256: String,
    /// Scene as read, including overrides; `None` if it could not be read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene: Option<Value>,
    /// Units of all values.
    pub units: Units,
    /// Outcome of the run.
    pub status: Status,
    /// Reason if not converged.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<Divergence>,
    /// Message of the error that ended the run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Exit code of the program for `error`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exit_code: Option<u8>,
    /// Frame at the end, if it is a grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<FrameRecord>,
    /// Number of updates of the meshes of worn bodies, if `wear.move_mesh` is set.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh_moves: Option<usize>,
    /// One entry per increment or cycle jump, in order.
    pub steps: Vec<IncrementRecord>,
    /// Peaks of stress, failure indices and estimated error of the bodies, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<BodyRecord>,
    /// Work that was omitted because the scene did not need it.
    pub skipped: Vec<OmittedWork>,
    /// Fretting loops of resolved cycles, if requested.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub loops: Vec<FrettingLoop>,
    /// Condensation of the meshed bodies to their contact nodes.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub condensation: Vec<CondensationRecord>,
    /// Boundary-element bodies.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boundary_elements: Vec<BoundaryElementRecord>,
    /// Half-spaces with a meshed surface.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub truncations: Vec<TruncationRecord>,
    /// Near fields of the meshed bodies, with the quality of the half-space corrections.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub near_fields: Vec<NearFieldRecord>,
    /// Requested and reached accuracy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<AccuracyRecord>,
    /// Seconds by stage.
    pub timings: Timings,
    /// Peak resident memory of the process, bytes (0 if unknown).
    pub peak_memory_bytes: u64,
    /// Warnings.
    pub warnings: Vec<Warning>,
    /// Names of the result files of this run, without the summary.
    pub files: Vec<String>,
}

impl Summary {
    /// Creates an empty summary; its status is `failed` until an outcome is set.
    pub fn new(title: &str, scene_sha256: &str, units: Units) -> Self {
        Self {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            title: title.to_owned(),
            scene_sha256: scene_sha256.to_owned(),
            units,
            ..Self::default()
        }
    }

    /// Sets the status with its reason or error from `outcome`.
    pub fn set_outcome(&mut self, outcome: &Result<Outcome>) {
        (self.reason, self.error, self.exit_code) = (None, None, None);
        match outcome {
            Ok(Outcome::Converged) => self.status = Status::Converged,
            Ok(Outcome::NotConverged(reason)) => {
                self.status = Status::NotConverged;
                self.reason = Some(*reason);
            }
            Ok(Outcome::Interrupted) => self.status = Status::Interrupted,
            Err(error) => self.set_failure(error),
        }
    }

    /// Sets status and error of a run that ended with `error`.
    pub fn set_failure(&mut self, error: &Error) {
        if error.kind() == ErrorKind::Interrupted {
            (self.status, self.reason, self.error, self.exit_code) = (Status::Interrupted, None, None, None);
            return;
        }
        let not_converged = error.kind() == ErrorKind::NotConverged;
        self.status = if not_converged { Status::NotConverged } else { Status::Failed };
        self.reason = not_converged.then_some(Divergence::LinearSolver);
        (self.error, self.exit_code) = (Some(error.to_string()), Some(error.exit_code()));
    }

    /// Checks that all numbers are finite, and returns the JSON text in any case. If a number is not finite, the text has the
    /// status `failed` and a further warning.
    ///
    /// # Errors
    /// If a number is not finite (kind `Numerical`).
    pub fn to_json(&self) -> (Result<()>, String) {
        let mut value = self.value();
        let Some(place) = first_null(&value, "") else { return (Ok(()), pretty(&value)) };
        let error =
            Error::numerical(format!("{place} is not a finite number: the results cannot be trusted"));
        let mut failed = self.clone();
        if failed.status != Status::Failed {
            failed.set_failure(&error);
        }
        failed.warnings.push(Warning::note(error.message()));
        value = failed.value();
        (Err(error), pretty(&value))
    }

    fn value(&self) -> Value {
        serde_json::to_value(self).expect("strings and numbers under string keys always serialise")
    }
}

fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).expect("a JSON value always serialises") + "\n"
}

/// Path of the first `null`, which stands for a number that is not finite.
fn first_null(value: &Value, path: &str) -> Option<String> {
    match value {
        Value::Null => Some(path.trim_start_matches('.').to_owned()),
        Value::Array(items) => {
            items.iter().enumerate().find_map(|(i, item)| first_null(item, &format!("{path}[{i}]")))
        }
        Value::Object(fields) => {
            fields.iter().find_map(|(key, item)| first_null(item, &format!("{path}.{key}")))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn summary() -> Summary {
        let mut summary = Summary::new("title", "00ff", Units::default());
        summary.steps.push(IncrementRecord { name: "indent".into(), increment: 1, ..Default::default() });
        summary.timings.add("mesh", 1.0);
        summary.timings.add("contact", 2.0);
        summary.timings.add("mesh", 0.5);
        summary
    }

    /// Truth: docs/results.md documents every field of the summary, its entries and certificates.
    #[test]
    fn json_has_the_documented_fields() {
        let mut summary = summary();
        summary.set_outcome(&Ok(Outcome::NotConverged(Divergence::GrossSliding)));
        summary.frame = Some(FrameRecord { half_width: [1.0, 2.0], cells: [3, 4] });
        summary.mesh_moves = Some(1);
        summary.scene = Some(Value::Object(serde_json::Map::new()));
        let (outcome, text) = summary.to_json();
        outcome.unwrap();
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["status"], "not-converged");
        assert_eq!(value["reason"], "gross-sliding");
        assert_eq!(value["units"], serde_json::json!({"length": "mm", "force": "N"}));
        assert_eq!(value["timings"], serde_json::json!({"mesh": 1.5, "contact": 2.0}));
        let keys = |v: &Value| v.as_object().unwrap().keys().cloned().collect::<Vec<_>>();
        let documented = include_str!("../../docs/results.md");
        let entry = &value["steps"][0];
        for key in keys(&value).iter().chain(&keys(entry)).chain(&keys(&entry["certificate"])) {
            assert!(documented.contains(&format!("`{key}`")), "docs/results.md does not explain `{key}`");
        }
    }

    /// Truth: a value that is not finite is an error; the written summary is `failed` and names the value.
    #[test]
    fn not_a_number_is_a_failure() {
        let mut summary = summary();
        summary.set_outcome(&Ok(Outcome::Converged));
        summary.steps[0].tangential_force[1] = f64::NAN;
        let (outcome, text) = summary.to_json();
        let message = outcome.unwrap_err().to_string();
        assert!(message.contains("steps[0].tangential_force[1]"), "{message}");
        let value: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(value["status"], "failed");
        assert!(value["error"].as_str().unwrap().contains("tangential_force"));
    }

    /// Truth (docs/results.md): an unsolved linear system counts as non-convergence, with exit code 3.
    #[test]
    fn a_linear_solver_that_does_not_converge() {
        let (mut summary, error) = (summary(), Error::not_converged("too slow"));
        summary.set_outcome(&Err(error.clone()));
        assert_eq!((summary.status, summary.reason), (Status::NotConverged, Some(Divergence::LinearSolver)));
        assert_eq!((summary.error.as_deref(), error.exit_code()), (Some("too slow"), 3));
    }

    /// Truth: a new outcome replaces the status, reason, error and exit code of the earlier outcome.
    #[test]
    fn an_error_clears_the_reason() {
        let mut summary = summary();
        summary.set_outcome(&Ok(Outcome::NotConverged(Divergence::Iterations)));
        summary.set_outcome(&Err(Error::resources("disk full")));
        assert_eq!((summary.status, summary.reason), (Status::Failed, None));
        assert_eq!((summary.error.as_deref(), summary.exit_code), (Some("disk full"), Some(4)));
        summary.set_outcome(&Ok(Outcome::Converged));
        assert_eq!((summary.error, summary.exit_code), (None, None));
    }
}
