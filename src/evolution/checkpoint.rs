//! What a run goes on from after it was broken off.

use serde::{Deserialize, Serialize};

use crate::evolution::controls::ActiveControls;
use crate::evolution::fretting::wear_step::WearStepState;
use crate::evolution::monotone::MonotoneProgress;
use crate::evolution::records::{FrettingLoop, IncrementRecord};
use crate::evolution::state::RunState;

/// Everything that the rest of a run follows from, between two entries.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunCheckpoint {
    pub(super) step_index: usize,
    pub(super) progress: StepProgress,
    pub(super) state: RunState,
    pub(super) controls: ActiveControls,
    /// Cells whose flexibility the run had formed, by the times it did.
    pub(super) formed_cells: Vec<Vec<usize>>,
    pub(super) records: Vec<IncrementRecord>,
    pub(super) warnings: Vec<String>,
    pub(super) timings: Vec<(String, f64)>,
    pub(super) fretting_loops: Vec<FrettingLoop>,
    /// Solves, iterations and operator applications on earlier, smaller frames that are in no entry yet.
    #[serde(default)]
    pub(super) discarded_work: [usize; 3],
}

/// How far a step has come.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum StepProgress {
    /// It has not begun.
    NotStarted,
    /// Some of its increments are done.
    Monotone(Box<MonotoneProgress>),
    /// Some of its cycles are done.
    WearStep(Box<WearStepState>),
}

impl RunCheckpoint {
    /// The entries so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Adds to what the user should know.
    pub fn add_warning(&mut self, note: String) {
        self.warnings.push(note);
    }

    /// Adds solves, iterations and operator applications of a jump that was not taken to those of the next one.
    pub(super) fn add_discarded_work(&mut self, work: [usize; 3]) {
        self.discarded_work.iter_mut().zip(work).for_each(|(sum, work)| *sum += work);
    }

    /// Depth that the bodies have lost, both of them, `[N]`, mm.
    pub fn wear_depth(&self) -> &[f64] {
        &self.state.wear_depth
    }

    /// Number of cells of the frame.
    pub fn n_cells(&self) -> usize {
        self.state.wear_depth.len()
    }
}
