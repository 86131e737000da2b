//! Main loop of a simulation: load steps, fretting cycles and wear jumps.
//!
//! [`run`] computes the steps of a [`Model`] in order. Each increment of a monotone step is one contact problem, whose
//! slip refers to the end of the previous increment (docs/theory-contact.md). A step of fretting or steady sliding
//! consists of wear jumps over many cycles or a distance (see `fretting`).

mod balance;
mod checkpoint;
mod controls;
mod few_contact_cells;
mod field_measures;
mod fretting;
mod given_warnings;
mod increment_record;
mod increment_solve;
mod model;
mod large_sliding;
mod monotone;
mod no_contact;
pub mod omitted;
pub mod observer;
mod predictor;
pub mod records;
mod rolling;
mod run;
mod solve_work;
mod state;
pub mod step;
mod step_controller;
mod transfer;
mod warnings;

use std::time::Instant;

use crate::contact::SolverOptions;
use crate::error::{ErrorKind, Result};
pub use crate::evolution::checkpoint::RunCheckpoint;
use crate::evolution::checkpoint::StepProgress;
use crate::evolution::controls::ActiveControls;
use crate::evolution::few_contact_cells::few_contact_cells_warning;
use crate::evolution::given_warnings::GivenWarnings;
pub use crate::evolution::model::Model;
use crate::evolution::model::PreparedModel;
use crate::evolution::observer::{CheckpointEvent, Observer};
use crate::evolution::omitted::{OperatorOmissions, omitted_contact_work};
use crate::evolution::records::{FrameState, Outcome};
pub use crate::evolution::run::{FRAME_EDGE, RunResult, Suspended};
use crate::evolution::run::{RollbackPoint, Run, RunEnd, Stop};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state::RunState;
use crate::evolution::step::{Normal, Step, StepKind};
pub use crate::evolution::transfer::PreviousModel;
use crate::evolution::warnings::{large_friction_warning, path_dependence_warning};

/// Runs the steps in order. `from` is the checkpoint of an earlier run from which the run resumes.
///
/// [`RunResult::outcome`] and [`RunResult::suspended`] state whether the run ends early.
///
/// # Errors
/// If the model, a step or `from` is invalid, a body cannot be solved, or memory does not suffice. If pressures underflow, a number
/// becomes non-finite, or the observer cannot write.
pub fn run(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    from: Option<RunCheckpoint>,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    // Runs on a thread of the pool, because any other thread would pass each parallel loop to the pool and wait.
    rayon::scope(|_| run_on_this_thread(model, steps, options, from, observer))
}

fn run_on_this_thread(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    from: Option<RunCheckpoint>,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    let started = Instant::now();
    let prepared = PreparedModel::new(model, steps)?;
    let state = RunState::undeformed(&prepared);
    let mut result = RunResult {
        records: Vec::new(),
        outcome: Outcome::Converged,
        skipped: omitted_contact_work(
            &model.friction,
            &model.wear,
            steps,
            options,
            OperatorOmissions::of(model, options),
        ),
        warnings: Vec::new(),
        timings: vec![("scales".to_owned(), started.elapsed().as_secs_f64())],
        fretting_loops: Vec::new(),
        state: FrameState::default(),
        suspended: None,
    };
    if prepared.ellipse.is_some() {
        result.warnings.extend(path_dependence_warning(&model.friction, steps));
        result.warnings.extend(large_friction_warning(prepared.ellipse, model.flexibility.as_ref()));
    }
    // If a body is unconstrained along n, the first normal control is a force of 0. Only the loads of the bodies then
    // press the surfaces together.
    let normal = if prepared.normal_is_free() { Normal::Force(0.0) } else { Normal::Approach(0.0) };
    let controls = ActiveControls::at_rest(normal);
    let rollback_point = RollbackPoint {
        state: state.clone(),
        held: controls,
        formed: 0,
        records: 0,
        warnings: result.warnings.len(),
        skipped: result.skipped.len(),
        given_warnings: 0,
        loops: 0,
    };
    let mut run = Run {
        observer,
        prepared,
        options: *options,
        steps,
        step_index: 0,
        progress: StepProgress::NotStarted,
        state,
        controls,
        result,
        given_warnings: GivenWarnings::default(),
        rollback_point,
        discarded_work: SolveWork::default(),
    };
    if let Some(snapshot) = from {
        run.restore(snapshot)?;
    }
    if let Err(error) = run.run_steps() {
        // The solver of a body may detect the interrupt signal before the contact solver does.
        if error.kind() == ErrorKind::Interrupted {
            run.report_checkpoint(CheckpointEvent::Aborted)?;
        }
        return Err(error);
    }
    Ok(run.result)
}

impl Run<'_> {
    /// Warns at the end of a step, or of the last load point of a history, if too few cells resolve the contact.
    fn warn_of_few_contact_cells(&mut self) {
        let name = &self.step().name;
        if self.steps.get(self.step_index + 1).is_some_and(|next| next.name == *name) {
            return;
        }
        let records = &self.result.records;
        let n_records = records.iter().rev().take_while(|record| record.name == *name).count();
        let frame = &self.prepared.model.frame;
        let pressures = &self.state.tractions[2 * frame.n_cells()..];
        let note = few_contact_cells_warning(frame, &records[records.len() - n_records..], pressures);
        self.result.warnings.extend(note);
    }

    fn run_steps(&mut self) -> Result<()> {
        while let Some(step) = self.steps.get(self.step_index) {
            let started = Instant::now();
            if matches!(self.progress, StepProgress::NotStarted)
                && self.observer.wants_rebuild(&self.state.wear_depth)
            {
                return self.end(RunEnd::Rebuild);
            }
            self.prepared.apply_cyclic_loads(step);
            let advanced = match &step.kind {
                StepKind::Monotone => self.run_increments(),
                StepKind::Rolling(_) => self.run_rolling_step(),
                StepKind::Fretting { .. } | StepKind::Sliding { .. } => self.run_wear_step(),
            };
            if let Err(Stop::Error(error)) = advanced {
                return Err(error);
            }
            self.result.timings.push((step.name.clone(), started.elapsed().as_secs_f64()));
            if let Err(Stop::End(end)) = advanced {
                return self.end(end);
            }
            self.warn_of_few_contact_cells();
            self.step_index += 1;
            self.progress = StepProgress::NotStarted;
            self.record_rollback_point(CheckpointEvent::StepEnd)?;
        }
        Ok(())
    }
}
