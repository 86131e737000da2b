//! Steps of fretting cycles and of steady sliding, taken in jumps (docs/theory-wear.md).

use std::time::Instant;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::contact::{End, NormalControl, SlipReference, TangentialControl};
use crate::error::Result;

use super::control::{Held, Loads, Path};
use super::jump_control::JumpControl;
use super::record::{Moment, Observer, Outcome};
use super::resolved::Resolved;
use super::ring::{Course, Ring};
use super::snapshot::Within;
use super::step::{CycleMotion, Cycles, Jumps, Step};
use super::tried::Tried;
use super::{Run, state};

/// Worn depth over the approach that the first controlled jump aims at.
const FIRST: f64 = 0.05;

/// Tolerance of jumps over that of contact solutions below which the latter make the error.
const SOLVED: f64 = 10.0;

/// A step of cycles or steady sliding in progress.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Cycling {
    pub ring: Ring,
    pub way: Way,
    /// Cycles of this step, or mm of sliding, that are done.
    pub done: f64,
    /// Wear per cycle or mm at the worn depth of the state, `[N]`.
    pub rate: Vec<f64>,
    /// Dissipation per cycle or mm there.
    pub power: f64,
    /// A resolved cycle, where strokes are resolved now and then.
    pub resolved: Option<Resolved>,
    /// What is prescribed besides the cycles, from the start of the step to its end.
    pub path: Path,
    pub control: JumpControl,
    /// Entries of the step.
    pub entries: usize,
    /// Longest stable jump of an explicit integrator.
    pub critical: Option<f64>,
    /// Largest pressure at the start of the step.
    pub peak: f64,
    /// Contact was at the rim of the frame from the start.
    pub touched: bool,
    /// Cycles and distance before the step.
    pub before: (u64, f64),
    /// Rates and ends are those of other operators.
    #[serde(default)]
    pub stale: bool,
}

/// What the slip of a cycle follows from.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Way {
    /// The ends of a closed path.
    Round(Course),
    /// Slip per mm of steady sliding, `[2, N]`.
    Along(Vec<f64>),
}

impl Run<'_> {
    /// Runs the jumps of a step of fretting cycles or steady sliding that are left.
    pub(super) fn cycles(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        last: bool,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        if matches!(self.within, Within::Start)
            && let Some(cycling) = self.begin(step, cycles, observer)?
        {
            if observer.wants_loops() {
                self.resolve_loop(step, cycles, &cycling, observer)?;
                if self.result.outcome != Outcome::Converged {
                    return Ok(());
                }
            }
            self.within = Within::Cycles(Box::new(cycling));
        }
        while let Within::Cycles(mut cycling) = std::mem::replace(&mut self.within, Within::Start) {
            if cycling.done >= cycles.count {
                let ended = self.end_cycles(step, cycles, (&cycling, last), observer);
                // Broken off here, the run is taken up after the last jump.
                if ended.is_err() || self.result.outcome != Outcome::Converged {
                    self.within = Within::Cycles(cycling);
                }
                return ended;
            }
            if cycling.entries > 0 && observer.is_outdated(&self.state.worn) {
                self.within = Within::Cycles(cycling);
                self.outdated = true;
                return Ok(());
            }
            if cycling.stale {
                let evaluated = self.evaluate_anew(step, cycles, &mut cycling, observer);
                if !matches!(evaluated, Ok(true)) {
                    self.within = Within::Cycles(cycling);
                    return evaluated.map(|_| ());
                }
            }
            let (before, control, spent) = (Tried::of(&cycling), cycling.control, cycling.ring.spent);
            let resolved = cycling.resolved.clone();
            let jumped = self.next_jump(step, cycles, &mut cycling, observer);
            // A body may hear of an interrupt itself: the run is taken up from before the jump, too.
            if jumped.is_err() || self.result.outcome != Outcome::Converged {
                // Before its first entry the step begins anew, from the state before it.
                if cycling.entries > 0 {
                    before.put(&mut cycling);
                    (cycling.control, cycling.ring.spent, cycling.resolved) = (control, spent, resolved);
                    self.within = Within::Cycles(cycling);
                }
                return jumped;
            }
            self.within = Within::Cycles(cycling);
            self.keep(Moment::Entry, observer)?;
        }
        Ok(())
    }

    /// What follows the last jump: the loop there, if it is wanted, and the way back to the centre for the steps that come.
    fn end_cycles(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (cycling, last): (&Cycling, bool),
        observer: &mut dyn Observer,
    ) -> Result<()> {
        if observer.wants_loops() {
            self.resolve_loop(step, cycles, cycling, observer)?;
        }
        self.held.normal = cycling.path.end.normal;
        if let (Way::Round(course), false, Outcome::Converged) = (&cycling.way, last, &self.result.outcome) {
            self.return_to_center(step, course, observer)?;
        }
        Ok(())
    }

    /// The first strokes and the rates before the first jump; `None` where something does not converge.
    fn begin(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        observer: &mut dyn Observer,
    ) -> Result<Option<Cycling>> {
        let clock = Instant::now();
        if let Jumps::Tolerance(tolerance) = cycles.jumps
            && tolerance < SOLVED * self.options.tolerance
        {
            self.result.warnings.push(format!(
                "step \"{}\": wear.tolerance = {tolerance:e} is finer than contacts are solved (solver.tolerance = {:e}): jumps get shorter \
                 without getting better",
                step.name, self.options.tolerance
            ));
        }
        let (center, n) = (self.state.rigid, self.prepared.n());
        let path = self.path(step);
        let ([x, y, _], _) = self.prepared.resultants(&self.state.tractions);
        let shift = [center[0], center[1]];
        let (ring, way) = match &cycles.motion {
            CycleMotion::Closed(closed) => {
                let course = Course::new(closed, shift, [x, y]);
                let ring = Ring::new(n, &course, center);
                (ring, Way::Round(course))
            }
            CycleMotion::Sliding { angle } => {
                let mut ring = Ring::still(n, center);
                ring.it.floating.fill(self.state.floating);
                (ring, Way::Along(self.slip_per_length(*angle)))
            }
        };
        let mut cycling = Cycling {
            ring,
            way,
            done: 0.0,
            rate: vec![0.0; n],
            power: 0.0,
            resolved: None,
            path,
            control: JumpControl::new(cycles.count, cycles.integrator.order()),
            entries: 0,
            critical: None,
            peak: 0.0,
            touched: false,
            before: (self.state.cycles_done, self.state.distance_slid),
            stale: false,
        };
        if let Way::Round(course) = &cycling.way {
            let (loads, _) = self.loads_in_cycles(step, &cycling, 0.0);
            self.first_strokes(step, (course, loads), &mut cycling.ring, observer)?;
            if self.result.outcome != Outcome::Converged {
                return Ok(None);
            }
        }
        if !self.evaluate(step, cycles, (&mut cycling, clock), observer)? {
            return Ok(None);
        }
        self.follow_path(step, cycles, &mut cycling, observer)?;
        cycling.touched = state::touches_edge(&self.prepared, &cycling.ring.it);
        cycling.peak = cycling.peak_pressure();
        cycling.refuse_unstable(step, cycles)?;
        let fastest = cycling.rate.iter().copied().fold(0.0, f64::max);
        if fastest > 0.0 {
            let first = FIRST * self.prepared.approach(&cycling.ring.it, 0).abs() / fastest;
            cycling.control = JumpControl::new(first.min(cycles.count), cycles.integrator.order());
        }
        Ok(Some(cycling))
    }

    /// Slip of each cell per mm that body 2 slides along a direction, `[2, N]`.
    fn slip_per_length(&self, angle: f64) -> Vec<f64> {
        let n = self.prepared.n();
        let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let mut slip = vec![0.0; 2 * n];
        for i in 0..n {
            let local = self.prepared.rigid_axes.as_ref().map_or(along, |axes| axes[i] * along);
            (slip[i], slip[n + i]) = (local.x, local.y);
        }
        slip
    }

    /// Loads at the part `at` of a step, and the normal motion of body 2 where that is prescribed.
    pub(super) fn loads_in_cycles(&self, step: &Step, cycling: &Cycling, at: f64) -> (Loads, Option<f64>) {
        let turn = self.prepared.turn(&self.state.floating);
        let controls = cycling.path.at(at, (self.state.rigid, turn));
        let mut loads = self.carried(step, controls.loads);
        loads.tangential = TangentialControl::Shift;
        if matches!(cycling.way, Way::Along(_)) {
            loads.moment[2] = None;
        }
        (loads, (loads.normal == NormalControl::Approach).then_some(controls.rigid[2]))
    }

    /// Brings body 2 back to the centre of the cycles for the steps that follow.
    fn return_to_center(&mut self, step: &Step, course: &Course, observer: &mut dyn Observer) -> Result<()> {
        let rigid = [course.center[0], course.center[1], self.state.rigid[2]];
        let loads = self.carried(step, self.held.loads_at_shift());
        let (loads, tangential) = course.back(loads);
        self.held = Held { tangential, ..self.held };
        self.stroke_to(step, (loads, rigid), observer)?;
        Ok(())
    }
}

impl Cycling {
    /// What `done` counts.
    pub fn unit(&self) -> &'static str {
        if matches!(self.way, Way::Round(_)) { "cycles" } else { "of the sliding distance" }
    }

    /// Dissipation of a cycle over that by the slip from end to end.
    pub fn power_factor(&self) -> f64 {
        self.resolved.as_ref().map_or(1.0, |resolved| resolved.power_factor)
    }

    /// An end as it is reported: nothing is prescribed any more, and slip is what it was solved with.
    pub fn reported_end(&self) -> End {
        End {
            normal: NormalControl::Approach,
            tangential: TangentialControl::Shift,
            balance: None,
            lifted: None,
            reference: match &self.way {
                Way::Round(_) => self.ring.reference(),
                Way::Along(slip) => SlipReference::Given(slip.clone()),
            },
        }
    }
}
