//! Checkpoints, from which an interrupted run resumes.

use serde::{Deserialize, Serialize};

use crate::evolution::controls::{ActiveControls, LoadPath};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::given_warnings::GivenWarnings;
use crate::evolution::predictor::Predictor;
use crate::evolution::records::{FrettingLoop, IncrementRecord};
use crate::evolution::state::RunState;

/// Complete state of a run between two records.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunCheckpoint {
    pub(super) step_index: usize,
    pub(super) progress: StepProgress,
    pub(super) state: RunState,
    pub(super) controls: ActiveControls,
    /// Groups of cells whose flexibility the run had formed, in order.
    pub(super) formed_cells: Vec<Vec<usize>>,
    pub(super) records: Vec<IncrementRecord>,
    pub(super) warnings: Vec<String>,
    #[serde(default)]
    pub(super) given_warnings: GivenWarnings,
    pub(super) timings: Vec<(String, f64)>,
    pub(super) fretting_loops: Vec<FrettingLoop>,
    /// Numbers of solves, iterations and operator applications of jumps that were not taken on earlier, smaller frames. The next
    /// record of a jump includes them.
    #[serde(default)]
    pub(super) discarded_work: [usize; 3],
}

/// Progress of a step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum StepProgress {
    /// The step has not begun.
    NotStarted,
    /// Some increments are done.
    Monotone(Box<MonotoneProgress>),
    /// Some cycles are done.
    WearStep(Box<WearStepState>),
}

/// Progress of a monotone step.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct MonotoneProgress {
    pub(super) load_path: LoadPath,
    pub(super) increments_done: usize,
    pub(super) predictor: Predictor,
}

impl RunCheckpoint {
    /// Records so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Adds a warning for the user.
    pub fn add_warning(&mut self, note: String) {
        self.warnings.push(note);
    }

    /// Adds the work of a jump that was not taken: solves, iterations and operator applications. The record of the next jump
    /// includes this work.
    pub(super) fn add_discarded_work(&mut self, work: [usize; 3]) {
        self.discarded_work.iter_mut().zip(work).for_each(|(sum, work)| *sum += work);
    }

    /// Wear depth of both bodies, `[N]`, mm.
    pub fn wear_depth(&self) -> &[f64] {
        &self.state.wear_depth
    }

    /// Number of cells of the frame.
    pub fn n_cells(&self) -> usize {
        self.state.wear_depth.len()
    }
}
