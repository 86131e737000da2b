//! Load steps, fretting cycles and cycle jumps: the main loop of a simulation.
//!
//! [`run`] computes the steps of a [`Model`] in order. A monotone step consists of increments. Each increment is one contact
//! problem, whose slip refers to the end of the previous increment (docs/theory-contact.md). A wear step consists of jumps over
//! many cycles (see `fretting`). A [`records::Observer`] receives progress, records and checkpoints.

mod balance;
mod checkpoint;
mod controls;
mod few_contact_cells;
mod fretting;
mod model;
mod large_sliding;
mod monotone;
mod no_contact;
pub mod omitted;
mod predictor;
pub mod records;
mod rolling;
mod state;
pub mod step;
mod step_controller;
mod transfer;
mod wear_integrator;

use std::time::Instant;

use crate::contact::SolverOptions;
use crate::error::{Error, ErrorKind, Result};
pub use crate::evolution::checkpoint::RunCheckpoint;
use crate::evolution::checkpoint::StepProgress;
use crate::evolution::controls::ActiveControls;
use crate::evolution::few_contact_cells::few_contact_cells_warning;
pub use crate::evolution::model::Model;
use crate::evolution::model::PreparedModel;
use crate::evolution::omitted::{OperatorOmissions, omitted_contact_work, quoted_names};
use crate::evolution::records::{
    CheckpointEvent, FrameState, FrettingLoop, IncrementRecord, Observer, Outcome,
};
use crate::evolution::state::RunState;
use crate::evolution::step::{Cycles, Normal, Step};
pub use crate::evolution::transfer::PreviousModel;
use crate::flexibility::Flexibility;
use crate::laws::friction::{FrictionEllipse, FrictionLaw};
use crate::omitted::OmittedWork;

/// Outcome of a run that ends before a jump in which wear brings the contact to the edge of the frame.
pub const FRAME_EDGE: Outcome = Outcome::NotConverged("frame-edge");

/// Result of a run.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// One record per increment or jump.
    pub records: Vec<IncrementRecord>,
    /// Outcome of the run.
    pub outcome: Outcome,
    /// Work that was omitted because the scene does not need it.
    pub skipped: Vec<OmittedWork>,
    /// Warnings and notes for the user.
    pub warnings: Vec<String>,
    /// Seconds per stage.
    pub timings: Vec<(String, f64)>,
    /// Fretting cycles at the start and the end of wear steps, if the observer requests them.
    pub fretting_loops: Vec<FrettingLoop>,
    /// Fields at the end.
    pub state: FrameState,
    /// Checkpoint of a run that ends with [`FRAME_EDGE`], from which it resumes on a larger frame ([`RunCheckpoint::transfer_to`]).
    pub frame_edge_checkpoint: Option<Box<RunCheckpoint>>,
    /// Checkpoint of a run that the observer ends ([`Observer::wants_rebuild`]), from which it resumes with other operators.
    pub rebuild_checkpoint: Option<Box<RunCheckpoint>>,
}

/// Run in progress: model, state and results so far.
struct Run<'a> {
    observer: &'a mut dyn Observer,
    prepared: PreparedModel<'a>,
    options: SolverOptions,
    steps: &'a [Step],
    /// Current step and its progress.
    step_index: usize,
    progress: StepProgress,
    state: RunState,
    controls: ActiveControls,
    result: RunResult,
    /// Rollback point at the end of the last record.
    rollback_point: RollbackPoint,
    /// Solves, iterations and operator applications on earlier, smaller frames that are not in any record yet.
    discarded_work: [usize; 3],
    /// Solves, iterations and operator applications of the jump in which contact reached the edge of the present frame.
    untaken_jump_work: [usize; 3],
    /// Whether the observer requested the end of the run before the next jump.
    rebuild_requested: bool,
}

/// State of the run and lengths of its lists at the end of the last record.
struct RollbackPoint {
    state: RunState,
    held: ActiveControls,
    formed: usize,
    records: usize,
    warnings: usize,
    loops: usize,
}

/// Runs the steps in order, starting from the checkpoint `from` of an earlier run if there is one.
///
/// A step that does not converge ends the run; its state is kept, with [`Outcome::NotConverged`].
///
/// # Errors
/// If the model is inconsistent, `from` belongs to another model, a number becomes non-finite, or the observer cannot write.
pub fn run(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    from: Option<RunCheckpoint>,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    // Runs on a thread of the pool. Any other thread would pass each parallel loop to the pool and wait.
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
            (options, OperatorOmissions::of(model, options)),
        ),
        warnings: Vec::new(),
        timings: vec![("scales".to_owned(), started.elapsed().as_secs_f64())],
        fretting_loops: Vec::new(),
        state: FrameState::default(),
        frame_edge_checkpoint: None,
        rebuild_checkpoint: None,
    };
    if prepared.ellipse.is_some() {
        result.warnings.extend(path_dependence_warning(&model.friction, steps));
        result.warnings.extend(large_friction_warning(prepared.ellipse, model.flexibility.as_ref()));
    }
    // A body that is unconstrained along n is pressed by its own loads until a force is prescribed.
    let normal = if prepared.normal_is_free() { Normal::Force(0.0) } else { Normal::Approach(0.0) };
    let controls = ActiveControls::at_rest(normal);
    let rollback_point = RollbackPoint {
        state: state.clone(),
        held: controls,
        formed: 0,
        records: 0,
        warnings: result.warnings.len(),
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
        rollback_point,
        discarded_work: [0; 3],
        untaken_jump_work: [0; 3],
        rebuild_requested: false,
    };
    if let Some(snapshot) = from {
        run.restore(snapshot)?;
    }
    if let Err(error) = run.run_steps() {
        // A body may detect the interrupt signal before the solver does.
        if error.kind() == ErrorKind::Interrupted {
            run.report_checkpoint(CheckpointEvent::Aborted)?;
        }
        return Err(error);
    }
    Ok(run.result)
}

impl<'a> Run<'a> {
    fn step(&self) -> &'a Step {
        &self.steps[self.step_index]
    }

    /// Cycles of the current step, which must be a wear step.
    fn cycles(&self) -> &'a Cycles {
        self.step().cycles.as_ref().expect("a wear step has cycles")
    }

    /// Runs the remaining steps.
    fn run_steps(&mut self) -> Result<()> {
        while let Some(step) = self.steps.get(self.step_index) {
            let started = Instant::now();
            if matches!(self.progress, StepProgress::NotStarted)
                && self.observer.wants_rebuild(&self.state.wear_depth)
            {
                return self.suspend_for_rebuild();
            }
            match &step.cycles {
                None => self.run_monotone_step()?,
                Some(_) => self.run_wear_step()?,
            }
            self.result.timings.push((step.name.clone(), started.elapsed().as_secs_f64()));
            if self.rebuild_requested {
                return self.suspend_for_rebuild();
            }
            if self.result.outcome == FRAME_EDGE {
                self.report_checkpoint(CheckpointEvent::Suspended)?;
                let mut snapshot = self.checkpoint();
                snapshot.add_discarded_work(self.untaken_jump_work);
                self.result.frame_edge_checkpoint = Some(Box::new(snapshot));
                return Ok(());
            }
            if self.result.outcome != Outcome::Converged {
                return self.report_checkpoint(CheckpointEvent::Aborted);
            }
            let of_step = |record: &&IncrementRecord| record.name == step.name;
            let before = self.result.records.iter().rev().take_while(of_step).count();
            let records = &self.result.records[self.result.records.len() - before..];
            let frame = &self.prepared.model.frame;
            let pressures = &self.state.tractions[2 * frame.n_cells()..];
            self.result.warnings.extend(few_contact_cells_warning(frame, records, pressures));
            self.step_index += 1;
            self.progress = StepProgress::NotStarted;
            self.record_rollback_point(CheckpointEvent::StepEnd)?;
        }
        Ok(())
    }

    /// Ends the run at a point where it can resume with other operators.
    fn suspend_for_rebuild(&mut self) -> Result<()> {
        self.report_checkpoint(CheckpointEvent::Suspended)?;
        self.result.rebuild_checkpoint = Some(Box::new(self.checkpoint()));
        Ok(())
    }

    /// Makes the present state the rollback point and reports a checkpoint.
    fn record_rollback_point(&mut self, moment: CheckpointEvent) -> Result<()> {
        self.set_rollback_point();
        self.report_checkpoint(moment)
    }

    /// Makes the present state the rollback point.
    fn set_rollback_point(&mut self) {
        self.rollback_point.state.clone_from(&self.state);
        self.rollback_point.held = self.controls;
        self.rollback_point.formed = self.prepared.formed_cells().len();
        self.rollback_point.records = self.result.records.len();
        self.rollback_point.warnings = self.result.warnings.len();
        self.rollback_point.loops = self.result.fretting_loops.len();
    }

    /// Notifies the observer that the run can resume from the rollback point.
    fn report_checkpoint(&mut self, moment: CheckpointEvent) -> Result<()> {
        let (observer, checkpoint) = self.observer_and_checkpoint();
        observer.on_checkpoint(moment, &checkpoint)
    }

    /// Checkpoint of the rollback point.
    fn checkpoint(&mut self) -> RunCheckpoint {
        self.observer_and_checkpoint().1()
    }

    /// The observer, and a function that creates a checkpoint while the observer is borrowed.
    fn observer_and_checkpoint(&mut self) -> (&mut dyn Observer, impl Fn() -> RunCheckpoint) {
        // All fields are named, so that a new field does not compile until it is clear whether a checkpoint needs it.
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
            rollback_point,
            discarded_work,
            untaken_jump_work: _,
            rebuild_requested: _,
        } = self;
        let RunResult {
            records,
            outcome: _,
            skipped: _,
            warnings,
            timings,
            fretting_loops,
            state: _,
            frame_edge_checkpoint: _,
            rebuild_checkpoint: _,
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
                timings: timings.clone(),
                fretting_loops: fretting_loops[..rollback_point.loops].to_vec(),
                discarded_work: *discarded_work,
            }
        };
        (*observer, checkpoint)
    }

    /// Resumes from the checkpoint of an earlier run.
    fn restore(&mut self, snapshot: RunCheckpoint) -> Result<()> {
        let (n, steps) = (self.prepared.n(), self.steps);
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
            timings,
            fretting_loops,
            discarded_work,
        } = snapshot;
        let is_wear_step = steps.get(step_index).map(|step| step.cycles.is_some());
        let fits = match progress {
            StepProgress::NotStarted => true,
            StepProgress::Monotone(_) => is_wear_step == Some(false),
            StepProgress::WearStep(_) => is_wear_step == Some(true),
        };
        if !fits {
            return Err(Error::input(format!(
                "the checkpoint lies within step {}, whose kind differs from that step of the scene: one has cycles or sliding, the other increments. The run cannot resume with these steps; start it from the beginning",
                step_index + 1
            )));
        }
        for cells in &formed_cells {
            self.prepared.form_flexibility(cells)?;
        }
        (self.step_index, self.progress, self.state, self.controls) = (step_index, progress, state, controls);
        (self.result.records, self.result.warnings, self.result.timings) = (records, warnings, timings);
        (self.result.fretting_loops, self.discarded_work) = (fretting_loops, discarded_work);
        self.set_rollback_point();
        Ok(())
    }
}

/// Friction coefficient from which friction counts as large.
const LARGE_FRICTION_COEFFICIENT: f64 = 1.0;

/// Warning that large friction may admit several solutions (Klarbring 1990: "Examples of non-uniqueness and non-existence of
/// solutions to quasistatic contact problems with friction"). `None` for coefficients below [`LARGE_FRICTION_COEFFICIENT`]. `None`
/// also if tangential tractions do not change the pressures, because the solution is then unique.
fn large_friction_warning(ellipse: Option<FrictionEllipse>, operator: &dyn Flexibility) -> Option<String> {
    let mu = ellipse.map(|ellipse| ellipse.mu[0].max(ellipse.mu[1]))?;
    (mu >= LARGE_FRICTION_COEFFICIENT && operator.couples_normal_tangential()).then(|| {
        format!(
            "the friction coefficient {mu} is large, and tangential tractions change the pressures: the contact may have several solutions, and the start and the load path select one. Check whether more increments, or solver.skip = false, give the same result"
        )
    })
}

/// Warning about frictional steps in one increment, because the number of increments is part of the load path.
fn path_dependence_warning(friction: &FrictionLaw, steps: &[Step]) -> Option<String> {
    // A history prescribes its load path, and a steady state does not depend on the path.
    let by_path =
        |step: &&Step| step.cycles.is_none() && step.history_row.is_none() && step.rolling.is_none();
    let frictional = steps.iter().filter(|step| step.friction).filter(by_path);
    let single: Vec<&str> =
        frictional.filter(|step| step.increments == 1).map(|step| step.name.as_str()).collect();
    let tilted = match friction {
        FrictionLaw::Frp { tilt, .. } if *tilt != 0.0 => " for tilted fibres",
        _ => "",
    };
    let (which, these) = match single.as_slice() {
        [] => return None,
        [name] => (format!("step \"{name}\" has one increment"), "this step"),
        _ => (format!("steps {} have one increment each", quoted_names(&single)), "these steps"),
    };
    Some(format!(
        "friction depends on the load path, but {which}. More increments may change the tangential force by a few percent{tilted}. To check, compare with `increments = 4` in {these}"
    ))
}
