//! Run in progress: model, state, results so far and rollback point.
//!
//! A run can end early for these reasons:
//!
//! | early end ([`RunEnd`]) | decided in | outcome | what follows |
//! |---|---|---|---|
//! | interrupted | `increment_record`, `monotone`, `fretting::loops` | `Interrupted` | `orthowear run --resume` |
//! | diverged | `increment_record`, after shorter trials of a jump | `NotConverged` | nothing |
//! | contact at the edge of the frame | `fretting::next_jump` | [`FRAME_EDGE`] | [`Suspended::FrameEdge`] |
//! | rebuild requested by the observer | before steps and jumps | unchanged | [`Suspended::Rebuild`] |
//!
//! Contact at the edge ends a run only in a jump of a step that began with contact inside the frame. Otherwise contact
//! at the edge causes a warning. Errors end a run without a result. If the solver of a body detects an interruption,
//! the run also ends with an error, but reports its checkpoint first.

use crate::contact::SolverOptions;
use crate::error::{Error, ErrorKind, Result};
use crate::evolution::checkpoint::{RunCheckpoint, StepProgress};
use crate::evolution::controls::ActiveControls;
use crate::evolution::given_warnings::{GivenWarnings, StepWarning};
use crate::evolution::model::PreparedModel;
use crate::evolution::observer::{CheckpointEvent, Observer};
use crate::evolution::records::{Divergence, FrameState, FrettingLoop, IncrementRecord, Outcome};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state::RunState;
use crate::evolution::step::{Cycles, Step};
use crate::omitted::OmittedWork;

/// Outcome of a run that ends before a jump in which wear brings the contact to the edge of the frame.
pub const FRAME_EDGE: Outcome = Outcome::NotConverged(Divergence::FrameEdge);

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum RunEnd {
    Interrupted,
    Diverged(Divergence),
    /// The next jump would bring the contact to the edge of the frame, so this jump is discarded. Contains the solver
    /// work on this jump.
    FrameEdge(SolveWork),
    Rebuild,
}

pub(super) enum Stop {
    End(RunEnd),
    Error(Error),
}

impl From<RunEnd> for Stop {
    fn from(end: RunEnd) -> Self {
        Self::End(end)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

pub(super) type Advance<T = ()> = std::result::Result<T, Stop>;

/// Result of a run.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// One record per increment or jump.
    pub records: Vec<IncrementRecord>,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Work that was omitted because the results do not need it.
    pub skipped: Vec<OmittedWork>,
    /// Warnings and notes for the user.
    pub warnings: Vec<String>,
    /// Seconds per stage.
    pub timings: Vec<(String, f64)>,
    /// Fretting cycles at the start and the end of wear steps, if the observer requests them.
    pub fretting_loops: Vec<FrettingLoop>,
    /// Fields at the end.
    pub state: FrameState,
    /// State from which the run resumes after a change of the model. `None` if the run does not resume.
    pub suspended: Option<Suspended>,
}

/// State of a run that ends early and resumes after a change of the model ([`RunCheckpoint::transfer_to`]).
#[derive(Debug, Clone)]
pub enum Suspended {
    /// Contact reaches the edge of the frame: the run resumes on a larger frame.
    FrameEdge(Box<RunCheckpoint>),
    /// The observer requested other operators ([`Observer::wants_rebuild`]).
    Rebuild(Box<RunCheckpoint>),
}

impl Suspended {
    /// The checkpoint from which the run resumes.
    pub fn into_checkpoint(self) -> RunCheckpoint {
        match self {
            Self::FrameEdge(checkpoint) | Self::Rebuild(checkpoint) => *checkpoint,
        }
    }
}

impl RunResult {
    /// Adds a warning.
    pub fn with_warning(mut self, warning: String) -> Self {
        self.warnings.push(warning);
        self
    }

    /// Result of this run after `error`. An interruption keeps the results so far.
    ///
    /// # Errors
    /// Any other error.
    pub fn ended_by(self, error: Error) -> Result<Self> {
        match error.kind() {
            ErrorKind::Interrupted => Ok(Self { outcome: Outcome::Interrupted, ..self }),
            _ => Err(error),
        }
    }
}

pub(super) struct Run<'a> {
    pub(super) observer: &'a mut dyn Observer,
    pub(super) prepared: PreparedModel<'a>,
    pub(super) options: SolverOptions,
    pub(super) steps: &'a [Step],
    pub(super) step_index: usize,
    pub(super) progress: StepProgress,
    pub(super) state: RunState,
    pub(super) controls: ActiveControls,
    pub(super) result: RunResult,
    pub(super) given_warnings: GivenWarnings,
    pub(super) rollback_point: RollbackPoint,
    /// Solver work on jumps that were discarded because the frame was too small. The record of the next jump includes
    /// this work.
    pub(super) discarded_work: SolveWork,
}

/// Rollback point, from which checkpoints resume: state of the run and lengths of its lists.
pub(super) struct RollbackPoint {
    pub(super) state: RunState,
    pub(super) held: ActiveControls,
    pub(super) formed: usize,
    pub(super) records: usize,
    pub(super) warnings: usize,
    pub(super) skipped: usize,
    pub(super) given_warnings: usize,
    pub(super) loops: usize,
}

impl<'a> Run<'a> {
    pub(super) fn step(&self) -> &'a Step {
        &self.steps[self.step_index]
    }

    /// Cycles of the current step, which must be a wear step.
    pub(super) fn cycles(&self) -> &'a Cycles {
        self.step().kind.cycles().expect("a wear step has cycles")
    }

    pub(super) fn warn_once(&mut self, kind: StepWarning, text: impl FnOnce(&Self) -> String) {
        if self.is_first_in_step(kind) {
            let text = text(self);
            self.result.warnings.push(text);
        }
    }

    /// Records a warning. Returns whether it is the first one of its kind in the current step. All load points of a history count
    /// as one step.
    pub(super) fn is_first_in_step(&mut self, kind: StepWarning) -> bool {
        let name = &self.step().name;
        let step = self.steps.iter().position(|step| step.name == *name).unwrap_or(self.step_index);
        self.given_warnings.is_first(step, kind)
    }

    /// Ends the run early: sets the outcome or the suspended state, and reports a checkpoint.
    pub(super) fn end(&mut self, end: RunEnd) -> Result<()> {
        match end {
            RunEnd::Interrupted => self.result.outcome = Outcome::Interrupted,
            RunEnd::Diverged(reason) => self.result.outcome = Outcome::NotConverged(reason),
            RunEnd::FrameEdge(untaken_work) => {
                self.result.outcome = FRAME_EDGE;
                let mut checkpoint = self.checkpoint();
                checkpoint.discarded_work += untaken_work;
                self.result.suspended = Some(Suspended::FrameEdge(Box::new(checkpoint)));
            }
            RunEnd::Rebuild => {
                self.result.suspended = Some(Suspended::Rebuild(Box::new(self.checkpoint())));
            }
        }
        self.report_checkpoint(match end {
            RunEnd::Interrupted | RunEnd::Diverged(_) => CheckpointEvent::Aborted,
            RunEnd::FrameEdge(_) | RunEnd::Rebuild => CheckpointEvent::Suspended,
        })
    }

    pub(super) fn record_rollback_point(&mut self, moment: CheckpointEvent) -> Result<()> {
        self.set_rollback_point();
        self.report_checkpoint(moment)
    }

    pub(super) fn set_rollback_point(&mut self) {
        self.rollback_point.state.clone_from(&self.state);
        self.rollback_point.held = self.controls;
        self.rollback_point.formed = self.prepared.formed_cells().len();
        self.rollback_point.records = self.result.records.len();
        self.rollback_point.warnings = self.result.warnings.len();
        self.rollback_point.skipped = self.result.skipped.len();
        self.rollback_point.given_warnings = self.given_warnings.len();
        self.rollback_point.loops = self.result.fretting_loops.len();
    }

    pub(super) fn report_checkpoint(&mut self, moment: CheckpointEvent) -> Result<()> {
        let (observer, checkpoint) = self.observer_and_checkpoint();
        observer.on_checkpoint(moment, &checkpoint)
    }

    pub(super) fn checkpoint(&mut self) -> RunCheckpoint {
        self.observer_and_checkpoint().1()
    }

    /// The observer, and a function that creates a checkpoint while the observer is borrowed.
    pub(super) fn observer_and_checkpoint(&mut self) -> (&mut dyn Observer, impl Fn() -> RunCheckpoint) {
        // All fields are named. A new field therefore does not compile until the code states whether a checkpoint
        // needs it.
        let Self {
            observer,
            prepared,
            options: _,
            steps: _,
            step_index,
            progress,
            state: _,
            controls: _,
            result,
            given_warnings,
            rollback_point,
            discarded_work,
        } = self;
        let RunResult {
            records,
            outcome: _,
            skipped,
            warnings,
            timings,
            fretting_loops,
            state: _,
            suspended: _,
        } = result;
        let checkpoint = || {
            let mut formed_cells = prepared.formed_cells();
            formed_cells.truncate(rollback_point.formed);
            RunCheckpoint {
                step_index: *step_index,
                progress: progress.clone(),
                state: rollback_point.state.clone(),
                controls: rollback_point.held,
                formed_cells,
                records: records[..rollback_point.records].to_vec(),
                warnings: warnings[..rollback_point.warnings].to_vec(),
                skipped: skipped[..rollback_point.skipped].to_vec(),
                given_warnings: given_warnings.first(rollback_point.given_warnings),
                timings: timings.clone(),
                fretting_loops: fretting_loops[..rollback_point.loops].to_vec(),
                discarded_work: *discarded_work,
            }
        };
        (*observer, checkpoint)
    }

    pub(super) fn restore(&mut self, snapshot: RunCheckpoint) -> Result<()> {
        let (n, steps) = (self.prepared.n(), self.steps);
        if snapshot.state.load_amplitudes.len() != self.prepared.model.loads.len() {
            return Err(Error::input(
                "the checkpoint and the scene have different numbers of loads of the bodies",
            ));
        }
        if snapshot.n_cells() != n || snapshot.step_index > steps.len() {
            return Err(Error::input(format!(
                "the checkpoint has {} cells and is in step {}, but the scene has {n} cells and {} steps",
                snapshot.n_cells(),
                snapshot.step_index + 1,
                steps.len()
            )));
        }
        let RunCheckpoint {
            step_index,
            progress,
            state,
            controls,
            formed_cells,
            records,
            warnings,
            skipped,
            given_warnings,
            timings,
            fretting_loops,
            discarded_work,
        } = snapshot;
        let is_wear_step = steps.get(step_index).map(|step| step.kind.cycles().is_some());
        let fits = match progress {
            StepProgress::NotStarted => true,
            StepProgress::Monotone(_) => is_wear_step == Some(false),
            StepProgress::WearStep(_) => is_wear_step == Some(true),
        };
        if !fits {
            return Err(Error::input(format!(
                "the checkpoint lies within step {}, but this step of the scene is of another kind (cycles or sliding instead of increments, or the reverse). The run cannot resume with these steps; start it from the beginning",
                step_index + 1
            )));
        }
        for cells in &formed_cells {
            self.prepared.form_flexibility(cells)?;
        }
        self.prepared.apply_loads(&state.load_amplitudes);
        (self.step_index, self.progress, self.state, self.controls) = (step_index, progress, state, controls);
        (self.result.records, self.result.warnings, self.result.timings) = (records, warnings, timings);
        (self.result.fretting_loops, self.discarded_work) = (fretting_loops, discarded_work);
        self.given_warnings = given_warnings;
        let new: Vec<OmittedWork> =
            skipped.into_iter().filter(|work| !self.result.skipped.contains(work)).collect();
        self.result.skipped.extend(new);
        self.set_rollback_point();
        Ok(())
    }
}
