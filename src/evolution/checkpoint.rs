//! Checkpoints from which runs resume.

use serde::{Deserialize, Serialize};

use crate::evolution::controls::{ActiveControls, LoadPath};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::given_warnings::GivenWarnings;
use crate::evolution::predictor::Predictor;
use crate::evolution::records::{FrettingLoop, IncrementRecord};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state::RunState;
use crate::omitted::OmittedWork;

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
    pub(super) skipped: Vec<OmittedWork>,
    pub(super) given_warnings: GivenWarnings,
    pub(super) timings: Vec<(String, f64)>,
    pub(super) fretting_loops: Vec<FrettingLoop>,
    /// Solver work on jumps that were discarded because the frame was too small.
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
    /// Amplitudes of the loads of the bodies at the start and at the end of the step.
    pub(super) load_amplitudes: [Vec<f64>; 2],
    pub(super) increments_done: usize,
    pub(super) predictor: Predictor,
}

impl MonotoneProgress {
    /// Amplitudes of the loads of the bodies at `fraction` (0 to 1) of the step. At 1, these are exactly the amplitudes
    /// at the end of the step.
    pub(super) fn amplitudes_at(&self, fraction: f64) -> Vec<f64> {
        let [start, end] = &self.load_amplitudes;
        let between = |(from, to): (&f64, &f64)| {
            if fraction == 1.0 { *to } else { from + fraction * (to - from) }
        };
        start.iter().zip(end).map(between).collect()
    }
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
