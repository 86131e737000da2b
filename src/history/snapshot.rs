//! What a run goes on from after it was broken off.

use serde::{Deserialize, Serialize};

use super::control::Held;
use super::cycling::Cycling;
use super::increments::Ramp;
use super::record::{FrettingLoop, IncrementRecord};
use super::state::State;

/// Everything that the rest of a run follows from, between two entries.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Snapshot {
    pub(super) step: usize,
    pub(super) within: Within,
    pub(super) state: State,
    pub(super) held: Held,
    /// Cells whose flexibility the run had formed, by the times it did.
    pub(super) formed: Vec<Vec<usize>>,
    #[serde(with = "as_text")]
    pub(super) records: Vec<IncrementRecord>,
    pub(super) warnings: Vec<String>,
    pub(super) timings: Vec<(String, f64)>,
    pub(super) loops: Vec<FrettingLoop>,
}

/// How far a step has come.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Within {
    /// It has not begun.
    Start,
    /// Some of its increments are done.
    Increments(Box<Ramp>),
    /// Some of its cycles are done.
    Cycles(Box<Cycling>),
}

impl Snapshot {
    /// Number of finished steps.
    pub fn n_steps(&self) -> usize {
        self.step
    }

    /// Names of the steps so far.
    pub fn step_names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.records.iter().map(|record| record.name.as_str()).collect();
        names.dedup();
        names
    }

    /// Seconds by stage.
    pub fn timings(&self) -> &[(String, f64)] {
        &self.timings
    }

    /// For a run that did not spend the time itself.
    pub fn without_timings(self) -> Self {
        Self { timings: Vec::new(), ..self }
    }

    /// The entries so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Adds to what the user should know.
    pub fn tell(&mut self, note: String) {
        self.warnings.push(note);
    }

    /// Adds solves, iterations and operator applications of a jump that was not taken to those of the next one.
    pub(super) fn burden(&mut self, lost: [usize; 3]) {
        if let Within::Cycles(cycling) = &mut self.within {
            cycling.ring.spent.iter_mut().zip(lost).for_each(|(sum, lost)| *sum += lost);
        }
    }

    /// Depth that the bodies have lost, both of them, `[N]`, mm.
    pub fn worn(&self) -> &[f64] {
        &self.state.worn
    }

    /// Number of cells of the frame.
    pub fn n_cells(&self) -> usize {
        self.state.worn.len()
    }
}

/// Entries as JSON, in which fields may be absent.
mod as_text {
    use serde::de::Error as _;
    use serde::ser::Error as _;
    use serde::{Deserialize, Deserializer, Serializer};

    use super::IncrementRecord;

    pub fn serialize<S: Serializer>(records: &[IncrementRecord], serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&serde_json::to_string(records).map_err(S::Error::custom)?)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<IncrementRecord>, D::Error> {
        serde_json::from_str(&String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}
