//! Checkpoints, from which runs resume.

use serde::{Deserialize, Serialize};

use crate::evolution::controls::{ActiveControls, LoadPath};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::given_warnings::GivenWarnings;
use crate::evolution::predictor::Predictor;
use crate::evolution::records::{FrettingLoop, IncrementRecord};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state::RunState;

/// Complete state of a run between two records.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct RunCheckpoint {
    pub(super) step_index: usize,
    pub(super) progress: StepProgress,
    pub(super) state: RunState,
    pub(super) controls: ActiveControls,
    pub(super) formed_cells: Vec<Vec<usize>>,
    pub(super) records: Vec<IncrementRecord>,
    pub(super) warnings: Vec<String>,
    pub(super) given_warnings: GivenWarnings,
    pub(super) timings: Vec<(String, f64)>,
    pub(super) fretting_loops: Vec<FrettingLoop>,
    /// Work of jumps that were not taken on earlier, smaller frames.
    pub(super) discarded_work: SolveWork,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum StepProgress {
    NotStarted,
    Monotone(Box<MonotoneProgress>),
    WearStep(Box<WearStepState>),
}

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

    /// Wear depth of both bodies, `[N]`, mm.
    pub fn wear_depth(&self) -> &[f64] {
        &self.state.wear_depth
    }

    /// Number of cells of the frame.
    pub fn n_cells(&self) -> usize {
        self.state.wear_depth.len()
    }
}
