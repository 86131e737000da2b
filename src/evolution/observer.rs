//! Observer of a run.

use crate::evolution::checkpoint::RunCheckpoint;
use crate::evolution::records::{FrameState, IncrementRecord};
use crate::frame::ContactFrame;

/// Reason for a checkpoint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CheckpointEvent {
    /// A record was completed.
    Entry,
    /// A step ended.
    StepEnd,
    /// The run is interrupted, or did not converge.
    Aborted,
    /// The run ends, and can resume with other operators.
    Suspended,
}

/// Receives progress, records and checkpoints of a run.
pub trait Observer: Send {
    /// Called during a stage with its name, the fraction done in 0..=1, and the current natural residual.
    fn progress(&mut self, _stage: &str, _fraction: f64, _residual: Option<f64>) {}

    /// Called with the frame before its first increment, at least at the start of the run and after each change of the
    /// frame.
    fn on_frame(&mut self, _frame: &ContactFrame) {}

    /// Called after every recorded increment or jump.
    ///
    /// # Errors
    /// If results cannot be written; the run stops.
    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> crate::error::Result<()>;

    /// Called at each point from which the run can resume: after a converged record, at the end of a step, and at an
    /// early end of the run. `checkpoint` creates the checkpoint.
    ///
    /// # Errors
    /// If the checkpoint cannot be written; the run stops.
    fn on_checkpoint(
        &mut self,
        _moment: CheckpointEvent,
        _checkpoint: &dyn Fn() -> RunCheckpoint,
    ) -> crate::error::Result<()> {
        Ok(())
    }

    /// Returns whether the run should stop, so that the caller can rebuild the operators. `_wear_depth` is the wear
    /// depth of both bodies, `[N]`, mm. Called before each step, and before jumps of a step in progress.
    fn wants_rebuild(&self, _wear_depth: &[f64]) -> bool {
        false
    }

    /// Returns whether the run must stop. Called between iterations.
    fn cancelled(&self) -> bool {
        false
    }

    /// Returns whether the run records loops of force against displacement for fretting cycles.
    fn wants_loops(&self) -> bool {
        false
    }

    /// Returns whether the observer needs the tangential gap in runs without friction.
    fn wants_tangential_gap(&self) -> bool {
        true
    }
}
