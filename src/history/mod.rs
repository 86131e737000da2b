//! Load steps, cycles and cycle jumps: the main loop.
//!
//! A run goes through the steps in order. A step is a number of increments, each one contact problem whose slip is
//! measured from the end of the increment before (docs/theory-contact.md), or a number of cycle jumps (see `cycling`).
//! Progress, output and checkpoints hang on an [`record::Observer`].

mod balance;
mod control;
mod critical;
mod cycling;
mod evaluate;
mod increments;
mod jump;
mod jump_control;
mod jump_entry;
pub mod image;
pub mod ledger;
mod loops;
mod model;
mod predictor;
mod onto;
mod next_jump;
mod open;
mod resolved;
mod ring;
mod rolling;
mod snapshot;
mod state;
pub mod record;
pub mod step;
mod tried;

use std::time::Instant;

pub use model::Model;
pub use onto::Before;
pub use snapshot::Snapshot;

use crate::contact::SolverOptions;
use crate::error::{Error, Kind, Result};
use crate::friction::{FrictionEllipse, FrictionLaw};
use crate::linalg::operator::Flexibility;
use crate::skip::Skipped;
use control::Held;
use ledger::{OperatorSkips, skipped_by_contact};
use model::Prepared;
use record::{FrameState, FrettingLoop, IncrementRecord, Moment, Observer, Outcome};
use snapshot::Within;
use state::State;
use step::{Normal, Step};

/// How a run ends before a jump in which wear brings the contact to the edge of the frame.
pub const FRAME_EDGE: Outcome = Outcome::NotConverged("frame-edge");

/// What a run leaves.
#[derive(Debug, Clone)]
pub struct RunResult {
    /// One record per increment or jump.
    pub records: Vec<IncrementRecord>,
    /// How it ended.
    pub outcome: Outcome,
    /// Work not done because the scene did not need it.
    pub skipped: Vec<Skipped>,
    /// What the user should know.
    pub warnings: Vec<String>,
    /// Seconds per stage.
    pub timings: Vec<(String, f64)>,
    /// Fretting cycles at the start and the end of steps of cycles, where the observer wants them.
    pub loops: Vec<FrettingLoop>,
    /// Fields at the end.
    pub state: FrameState,
    /// Where the run ends with [`FRAME_EDGE`]: what it can be taken up from on a larger frame ([`Snapshot::onto`]).
    pub outgrown: Option<Box<Snapshot>>,
    /// Where the run ends because the observer wants it ([`Observer::is_outdated`]): what it can be taken up from with other
    /// operators.
    pub outdated: Option<Box<Snapshot>>,
}

/// A run in progress: the model, the state, and what is collected.
struct Run<'a> {
    prepared: Prepared<'a>,
    options: SolverOptions,
    /// The step in progress, and how far it has come.
    step: usize,
    within: Within,
    state: State,
    held: Held,
    result: RunResult,
    /// What the run would be taken up from at the end of the last entry.
    safe: Safe,
    /// Solves, iterations and operator applications of a jump that was not taken since contact outgrew the frame in it.
    lost: [usize; 3],
    /// The observer wants the run to end before the next jump.
    outdated: bool,
}

/// What later increments change of a run, as it was at the end of the last entry.
struct Safe {
    state: State,
    held: Held,
    formed: usize,
    records: usize,
    warnings: usize,
    loops: usize,
}

/// Runs the steps one after the other.
///
/// A step that does not converge ends the run with its state kept and [`Outcome::NotConverged`].
///
/// # Errors
/// If the model is inconsistent, a number becomes non-finite, or the observer cannot write.
pub fn run(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    run_from(model, steps, options, None, observer)
}

/// As [`run`], from where an earlier run was broken off.
///
/// # Errors
/// As [`run`], and if `from` belongs to another model.
pub fn run_from(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    from: Option<Snapshot>,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    // On a thread of the pool: another one would hand over every parallel loop and sleep until it is done.
    rayon::scope(|_| run_on_this_thread(model, steps, options, from, observer))
}

fn run_on_this_thread(
    model: &Model,
    steps: &[Step],
    options: &SolverOptions,
    from: Option<Snapshot>,
    observer: &mut dyn Observer,
) -> Result<RunResult> {
    let started = Instant::now();
    let prepared = Prepared::new(model, steps)?;
    let state = State::undeformed(&prepared);
    let mut result = RunResult {
        records: Vec::new(),
        outcome: Outcome::Converged,
        skipped: skipped_by_contact(
            &model.friction,
            &model.wear,
            steps,
            (options, OperatorSkips::of(model, options)),
        ),
        warnings: Vec::new(),
        timings: vec![("scales".to_owned(), started.elapsed().as_secs_f64())],
        loops: Vec::new(),
        state: FrameState::default(),
        outgrown: None,
        outdated: None,
    };
    if prepared.ellipse.is_some() {
        result.warnings.extend(path_dependence(&model.friction, steps));
        result.warnings.extend(large_friction(prepared.ellipse, model.flexibility.as_ref()));
    }
    // A body that floats along n is pressed by its own loads until a force is prescribed.
    let normal = if prepared.normal_is_free() { Normal::Force(0.0) } else { Normal::Approach(0.0) };
    let held = Held::at_rest(normal);
    let safe =
        Safe { state: state.clone(), held, formed: 0, records: 0, warnings: result.warnings.len(), loops: 0 };
    let (within, lost, outdated) = (Within::Start, [0; 3], false);
    let mut run =
        Run { prepared, options: *options, step: 0, within, state, held, result, safe, lost, outdated };
    if let Some(snapshot) = from {
        run.take_up(snapshot, steps.len())?;
    }
    if let Err(error) = run.steps(steps, observer) {
        // A body may hear of the signal before the solver does.
        if error.kind() == Kind::Interrupted {
            observer.keep(Moment::Broken, &|| run.snapshot())?;
        }
        return Err(error);
    }
    Ok(run.result)
}

/// What all of the steps decide from the first increment on: runs on one model whose first steps and outlook are the same are the same up to
/// the end of these steps, to the last bit, if they do not end there.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Outlook {
    friction: bool,
    turns: bool,
    path_dependence: Option<String>,
}

impl Outlook {
    /// That of `steps`.
    pub fn of(friction: &FrictionLaw, steps: &[Step]) -> Self {
        Self {
            friction: steps.iter().any(|step| step.friction),
            turns: steps.iter().any(|step| step.tilt.is_some() || step.spin.is_some()),
            path_dependence: path_dependence(friction, steps),
        }
    }
}

impl Run<'_> {
    /// Runs the steps that are left.
    fn steps(&mut self, steps: &[Step], observer: &mut dyn Observer) -> Result<()> {
        while let Some(step) = steps.get(self.step) {
            let started = Instant::now();
            if matches!(self.within, Within::Start) && observer.is_outdated(&self.state.worn) {
                return self.hand_on(observer);
            }
            match &step.cycles {
                None => self.increments(step, observer)?,
                Some(cycles) => self.cycles(step, cycles, self.step + 1 == steps.len(), observer)?,
            }
            self.result.timings.push((step.name.clone(), started.elapsed().as_secs_f64()));
            if self.outdated {
                return self.hand_on(observer);
            }
            if self.result.outcome == FRAME_EDGE {
                observer.keep(Moment::HandedOn, &|| self.snapshot())?;
                let mut snapshot = self.snapshot();
                snapshot.burden(self.lost);
                self.result.outgrown = Some(Box::new(snapshot));
                return Ok(());
            }
            if self.result.outcome != Outcome::Converged {
                return observer.keep(Moment::Broken, &|| self.snapshot());
            }
            self.step += 1;
            self.within = Within::Start;
            self.keep(Moment::StepEnd, observer)?;
        }
        Ok(())
    }

    /// Ends the run where it can be taken up with other operators.
    fn hand_on(&mut self, observer: &mut dyn Observer) -> Result<()> {
        observer.keep(Moment::HandedOn, &|| self.snapshot())?;
        self.result.outdated = Some(Box::new(self.snapshot()));
        Ok(())
    }

    /// Notes that the run can be taken up from here, and tells the observer.
    fn keep(&mut self, moment: Moment, observer: &mut dyn Observer) -> Result<()> {
        self.safe.state.clone_from(&self.state);
        self.safe.held = self.held;
        self.safe.formed = self.prepared.formed().len();
        self.safe.records = self.result.records.len();
        self.safe.warnings = self.result.warnings.len();
        self.safe.loops = self.result.loops.len();
        observer.keep(moment, &|| self.snapshot())
    }

    /// What the run can be taken up from.
    fn snapshot(&self) -> Snapshot {
        // Every field is named: one that is added does not compile until it is decided whether the run follows from it.
        let Self {
            prepared,
            options: _,
            step,
            within,
            state: _,
            held: _,
            result,
            safe,
            lost: _,
            outdated: _,
        } = self;
        let RunResult {
            records,
            outcome: _,
            skipped: _,
            warnings,
            timings,
            loops,
            state: _,
            outgrown: _,
            outdated: _,
        } = result;
        let mut formed = prepared.formed();
        formed.truncate(safe.formed);
        Snapshot {
            step: *step,
            within: within.clone(),
            state: safe.state.clone(),
            held: safe.held,
            formed,
            records: records[..safe.records].to_vec(),
            warnings: warnings[..safe.warnings].to_vec(),
            timings: timings.clone(),
            loops: loops[..safe.loops].to_vec(),
        }
    }

    /// Goes on from where an earlier run was broken off.
    fn take_up(&mut self, snapshot: Snapshot, steps: usize) -> Result<()> {
        let n = self.prepared.n();
        if snapshot.n_cells() != n || snapshot.step > steps {
            return Err(Error::input(format!(
                "the state to go on from has {} cells and is in step {}, the scene has {n} cells and {steps} steps",
                snapshot.n_cells(),
                snapshot.step + 1
            )));
        }
        for cells in &snapshot.formed {
            self.prepared.form(cells)?;
        }
        let Snapshot { step, within, state, held, formed, records, warnings, timings, loops } = snapshot;
        self.safe.formed = formed.len();
        (self.safe.records, self.safe.warnings, self.safe.loops) =
            (records.len(), warnings.len(), loops.len());
        (self.safe.state, self.safe.held) = (state.clone(), held);
        (self.step, self.within, self.state, self.held) = (step, within, state, held);
        (self.result.records, self.result.warnings, self.result.timings) = (records, warnings, timings);
        self.result.loops = loops;
        Ok(())
    }
}

/// Friction coefficient from which a contact is told to be a case of large friction.
const LARGE_FRICTION: f64 = 1.0;

/// A note where friction may be too large for one answer only (Klarbring 1990: "Examples of non-uniqueness and
/// non-existence of solutions to quasistatic contact problems with friction"): it has to act on the pressures, or there
/// is one however large it is.
fn large_friction(ellipse: Option<FrictionEllipse>, operator: &dyn Flexibility) -> Option<String> {
    let mu = ellipse.map(|ellipse| ellipse.mu[0].max(ellipse.mu[1]))?;
    (mu >= LARGE_FRICTION && operator.couples_normal_tangential()).then(|| {
        format!(
            "the friction coefficient {mu} is large, and tractions in the surface change the pressures: such a contact may have several \
             answers, of which the start and the load path pick one; see whether more increments, or solver.skip = false, give the same"
        )
    })
}

/// With friction the number of increments is part of the load path.
fn path_dependence(friction: &FrictionLaw, steps: &[Step]) -> Option<String> {
    // A history says its path; a steady state has none.
    let by_path = |step: &&Step| step.cycles.is_none() && step.row.is_none() && step.rolling.is_none();
    let frictional = steps.iter().filter(|step| step.friction).filter(by_path);
    let single: Vec<&str> =
        frictional.filter(|step| step.increments == 1).map(|step| step.name.as_str()).collect();
    let tilted = match friction {
        FrictionLaw::Frp { tilt, .. } if *tilt != 0.0 => " for tilted fibres",
        _ => "",
    };
    (!single.is_empty()).then(|| {
        format!(
            "friction depends on the load path: step {} is taken in one increment; more increments may move the \
             tangential force by a few percent{tilted}",
            single.join(", ")
        )
    })
}
