//! Steps of fretting cycles and of steady sliding, taken in jumps (docs/theory-wear.md).

use std::time::Instant;

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::contact::solver::Stop;
use crate::contact::{End, NormalControl, SlipReference, TangentialControl};
use crate::error::{Error, Result};

use super::control::{Held, Loads, Path};
use super::increments::{Stage, entry};
use super::jump::Jump;
use super::jump_control::JumpControl;
use super::resolved::Resolved;
use super::ring::{Course, Ring};
use super::snapshot::Within;
use super::step::{
    CycleMotion, Cycles, Integrator, JumpRecord, Jumps, Moment, Normal, Observer, Outcome, Spin, Step,
    StrokeEnd,
};
use super::tried::Tried;
use super::{FRAME_EDGE, Run, state};

/// Worn depth over the approach that the first controlled jump aims at.
const FIRST: f64 = 0.05;

/// Worn depth over the approach below which errors do not count.
const NEGLIGIBLE: f64 = 1e-3;

/// Cells, or share of the radius of the contact, that the rims of contact and stick zone may move by in a controlled jump.
const CELLS: f64 = 2.0;
const SHARE: f64 = 0.05;

/// Share of the longest stable jump that controlled explicit ones may have.
const STABLE: f64 = 0.9;

/// Largest pressure over that at the start of the step from which on nothing wears at a fixed approach: the rest of the overlap is as
/// small, and below it pressures drown in the rounding of the gap.
const WORN_OUT: f64 = 1e-6;

/// Tries that a controlled jump may be too long for.
const TRIES: usize = 12;

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
    control: JumpControl,
    /// Entries of the step.
    entries: usize,
    /// Longest stable jump of an explicit integrator.
    pub critical: Option<f64>,
    /// Largest pressure at the start of the step.
    peak: f64,
    /// Contact was at the rim of the frame from the start.
    touched: bool,
    /// Cycles and distance before the step.
    before: (u64, f64),
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

/// Why a controlled jump is taken again, shorter.
enum Refusal {
    /// Its error, as a multiple of what is allowed.
    Error(f64),
    /// Something else.
    Other,
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
            }
            self.within = Within::Cycles(Box::new(cycling));
        }
        while let Within::Cycles(mut cycling) = std::mem::replace(&mut self.within, Within::Start) {
            if cycling.done >= cycles.count {
                if observer.wants_loops() {
                    self.resolve_loop(step, cycles, &cycling, observer)?;
                }
                self.held.normal = cycling.path.end.normal;
                if let (Way::Round(course), false) = (&cycling.way, last) {
                    self.return_to_center(step, course, observer)?;
                }
                return Ok(());
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

    /// The first strokes and the rates before the first jump; `None` where something does not converge.
    fn begin(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        observer: &mut dyn Observer,
    ) -> Result<Option<Cycling>> {
        let clock = Instant::now();
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

    /// Takes one more jump.
    fn next_jump(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &mut Cycling,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let clock = Instant::now();
        if self.is_worn_out(step, cycling) {
            return self.rest(step, cycles, cycling, clock, observer);
        }
        self.follow_path(step, cycles, cycling, observer)?;
        let (mut tries, mut spent) = (0, [0; 3]);
        loop {
            let (length, shortest) = cycling.next_length(cycles);
            let before = Tried::of(cycling);
            let radii = self.radii(cycling);
            let part = |done: f64| done / cycles.count;
            let stage = Stage { name: &step.name, from: part(cycling.done), to: part(cycling.done + length) };
            let integrator = cycles.integrator;
            let mut jump = self.integrate(step, (cycles, integrator, length), cycling, (observer, &stage))?;
            if let (Jumps::Tolerance(tolerance), true) = (cycles.jumps, length > shortest && tries < TRIES)
                && jump.report.stop != Stop::Interrupted
                && let Some(refusal) = self.refusal((cycles, tolerance, length), (radii, cycling), &jump)
            {
                let report = &jump.report;
                let now = [jump.solves, report.iterations, report.applications];
                spent.iter_mut().zip(now).for_each(|(sum, now)| *sum += now);
                tries += 1;
                before.put(cycling);
                match refusal {
                    Refusal::Error(ratio) => cycling.control.reject(length, ratio),
                    Refusal::Other => cycling.control.halve(length),
                }
                continue;
            }
            if jump.overshot {
                let wasted = [jump.solves, jump.report.iterations, jump.report.applications];
                before.put(cycling);
                let euler = (cycles, Integrator::BackwardEuler, length);
                jump = self.integrate(step, euler, cycling, (observer, &stage))?;
                jump.burden(wasted);
                self.result.warnings.push(format!(
                    "step \"{}\" ({}): the jump of {length} cycles is too long for the second-order integrator, which \
                     would wear past the end of contact; backward Euler took it: more jumps give a better answer",
                    step.name,
                    cycling.entries + 1
                ));
            }
            jump.burden(spent);
            // The first strokes have no entry of their own.
            jump.burden(std::mem::take(&mut cycling.ring.spent));
            if let Jumps::Tolerance(tolerance) = cycles.jumps {
                let ratio = self.error_ratio((cycles, tolerance, length), &jump);
                cycling.control.accept(length, ratio);
            }
            if jump.converged() && jump.at_rim && !cycling.touched {
                self.outgrow(step, cycling, &jump, length);
                return Ok(());
            }
            return self.record_jump(step, cycles, (cycling, &jump), (length, tries, clock), observer);
        }
    }

    /// Whether wear at a fixed approach has taken nearly all that the bodies overlap by.
    fn is_worn_out(&self, step: &Step, cycling: &Cycling) -> bool {
        let still = matches!(self.held.normal, Normal::Approach(_)) && step.normal.is_none();
        still && cycling.peak_pressure() <= WORN_OUT * cycling.peak
    }

    /// The cycles that are left, in which nothing wears any more.
    fn rest(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &mut Cycling,
        clock: Instant,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let length = cycles.count - cycling.done;
        self.result.warnings.push(format!(
            "step \"{}\": wear has taken all but a millionth of the pressure at this approach: nothing is left for the other {length}",
            step.name
        ));
        // A run that is taken up here has not evaluated its ends yet.
        let worn = self.state.worn.clone();
        self.ends_problem(step, cycling, &worn, cycling.reported_end()).evaluate(&mut cycling.ring.it);
        let jump = Jump::new(self.prepared.n());
        self.record_jump(step, cycles, (cycling, &jump), (length, 0, clock), observer)
    }

    /// Estimated error of a jump over what is allowed.
    fn error_ratio(&self, (cycles, tolerance, length): (&Cycles, f64, f64), jump: &Jump) -> f64 {
        if jump.depth_error == 0.0 {
            return 0.0;
        }
        let deepest = |more: f64| {
            let depths = self.state.worn.iter().zip(&jump.worn);
            depths.map(|(worn, by)| worn + more * by).fold(0.0, f64::max)
        };
        let (before, after) = (deepest(0.0), deepest(1.0));
        let negligible = NEGLIGIBLE * (self.prepared.first_touch - self.state.rigid[2]).abs();
        let all = after + negligible;
        let share = 0.5 * ((after - before) / all + length / cycles.count);
        jump.depth_error / (tolerance * all * cycles.integrator.share_of_error(share))
    }

    /// Why a controlled jump is too long, if it is.
    fn refusal(
        &self,
        jumped: (&Cycles, f64, f64),
        ([contact, stick], after): ([f64; 2], &Cycling),
        jump: &Jump,
    ) -> Option<Refusal> {
        if !jump.converged() || jump.overshot {
            return Some(Refusal::Other);
        }
        let ratio = self.error_ratio(jumped, jump);
        if ratio > 1.0 {
            return Some(Refusal::Error(ratio));
        }
        let [new_contact, new_stick] = self.radii(after);
        let areas = &self.prepared.model.frame.areas;
        let side = (areas.iter().sum::<f64>() / areas.len() as f64).sqrt();
        let most = (CELLS * side).max(SHARE * contact);
        (new_contact - contact > most || (new_stick - stick).abs() > most).then_some(Refusal::Other)
    }

    /// Radii of the circles that are as large as the contact at any end, and as the cells that stick through the cycle.
    fn radii(&self, cycling: &Cycling) -> [f64; 2] {
        let areas = &self.prepared.model.frame.areas;
        let touching = self.touching(&cycling.ring.it);
        let radius = |sum: f64| (sum / std::f64::consts::PI).sqrt();
        let sum =
            |counts: &dyn Fn(usize) -> bool| (0..areas.len()).filter(|&i| counts(i)).map(|i| areas[i]).sum();
        [radius(sum(&|i| touching[i])), radius(sum(&|i| touching[i] && cycling.ring.stuck[i]))]
    }

    /// Ends the run before a jump that brings the contact to the rim of the frame, beyond which it would be cut off.
    fn outgrow(&mut self, step: &Step, cycling: &Cycling, jump: &Jump, length: f64) {
        self.lost = [jump.solves, jump.report.iterations, jump.report.applications];
        self.result.outcome = FRAME_EDGE;
        let unit = if matches!(cycling.way, Way::Round(_)) { "cycles" } else { "of the sliding distance" };
        self.result.warnings.push(format!(
            "step \"{}\" ({}): wear brings the contact to the edge of the frame between {} and {} {unit}; that jump is not taken, for \
             what lies beyond would be cut off",
            step.name,
            cycling.entries + 1,
            cycling.done,
            cycling.done + length
        ));
    }

    /// Takes what a jump did into the state, and hands out its entry.
    pub(super) fn record_jump(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (cycling, jump): (&mut Cycling, &Jump),
        (length, rejected, clock): (f64, usize, Instant),
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let number = cycling.entries + 1;
        if jump.converged() {
            cycling.done += length;
            cycling.entries += 1;
            if cycles.count - cycling.done < 1e-9 * cycles.count {
                cycling.done = cycles.count;
            }
            match cycling.way {
                Way::Round(_) => self.state.cycles_done = cycling.before.0 + cycling.done.round() as u64,
                Way::Along(_) => self.state.distance_slid = cycling.before.1 + cycling.done,
            }
            self.state.worn.iter_mut().zip(&jump.worn).for_each(|(worn, by)| *worn += by);
            self.state.dissipation += jump.dissipation;
            if step.wear {
                self.state.wear_by(jump.dissipation, step.friction);
            }
            let errors = self.state.depth_errors.iter_mut().zip(&jump.error);
            errors.for_each(|(sum, error)| *sum += error.abs());
            self.state.volume_error += jump.volume_error;
        }
        let half = match &cycling.way {
            Way::Round(course) => course.half(),
            Way::Along(_) => 0,
        };
        let it = &cycling.ring.it;
        let worn = self.state.worn.clone();
        let problem = self.ends_problem(step, cycling, &worn, cycling.reported_end());
        let ends = [0, half].map(|end| state::resultants(&self.prepared, &problem, it, end));
        let mean = |value: fn(&StrokeEnd) -> f64| 0.5 * (value(&ends[0]) + value(&ends[1]));
        let approach = 0.5 * [0, half].map(|end| self.prepared.approach(it, end)).iter().sum::<f64>();
        let balance = state::energy_balance(&self.prepared, &self.state, it, half);
        let fields = state::frame_state(&problem, it, 0, &worn);
        drop(problem);
        self.state.take(it, half);
        let values = StrokeEnd {
            shift: [0, 1].map(|k| 0.5 * (ends[0].shift[k] + ends[1].shift[k])),
            rotation: [0, 1].map(|k| 0.5 * (ends[0].rotation[k] + ends[1].rotation[k])),
            twist: mean(|e| e.twist),
            normal_force: mean(|e| e.normal_force),
            contact_area: mean(|e| e.contact_area),
            stick_area: mean(|e| e.stick_area),
            peak_pressure: mean(|e| e.peak_pressure),
            ..ends[0]
        };
        let mut record = entry(&step.name, number, approach, &values);
        record.contact_touches_edge = state::touches_edge(&self.prepared, it);
        record.certificate = state::certificate(&jump.checks, approach, balance);
        record.seconds = clock.elapsed().as_secs_f64();
        record.stroke_ends = matches!(cycling.way, Way::Round(_)).then_some(ends);
        record.jump = Some(JumpRecord {
            length,
            solves: jump.solves,
            rejected,
            depth_error: jump.depth_error,
            volume_error: jump.volume_error,
            critical_length: cycling.critical,
            resolved: cycling
                .resolved
                .as_ref()
                .filter(|resolved| resolved.fresh)
                .map(|resolved| resolved.increments),
        });
        if let Some(resolved) = &mut cycling.resolved {
            resolved.fresh = false;
        }
        self.finish(&mut record, &jump.report, (&jump.checks, self.options.tolerance));
        self.hint_at_spin(step);
        self.deliver(record, fields, observer)
    }

    /// Tells of a spin moment that the cycles inherit, where they found no answer: slip all over the contact reverses from
    /// end to end, and the moment of its friction with it.
    pub(super) fn hint_at_spin(&mut self, step: &Step) {
        let Spin::Moment(moment) = self.held.spin else { return };
        if moment != 0.0 && self.result.outcome == Outcome::NotConverged("iterations") {
            self.result.warnings.push(format!(
                "step \"{}\": a spin moment of {moment} is still held while body 2 goes to and fro. If all of the contact slides, \
                 friction there and back has opposite moments and cannot carry the same one at both ends: prescribe `twist`, \
                 or a spin_moment of zero, in a step before, or take a smaller amplitude",
                step.name
            ));
        }
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

    /// Largest pressure at any end.
    fn peak_pressure(&self) -> f64 {
        let n = self.rate.len();
        let pressures = self.ring.it.hatted.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
        pressures.copied().fold(0.0, f64::max)
    }

    /// Refuses explicit jumps that are longer than is stable.
    pub(super) fn refuse_unstable(&self, step: &Step, cycles: &Cycles) -> Result<()> {
        let (Some(critical), Jumps::Number(jumps), false) =
            (self.critical, cycles.jumps, cycles.beyond_critical)
        else {
            return Ok(());
        };
        let length = cycles.count / jumps as f64;
        if length <= critical {
            return Ok(());
        }
        Err(Error::input(format!(
            "step \"{}\": explicit jumps of {length} cycles are unstable: pressures would swing from cell to cell from {critical:.4e} \
             on, 2 λ_min(S_nn) / D. Take {} jumps or more, or leave `jumps` out (they are then as short as is stable), or an implicit \
             integrator; wear.beyond_critical = true takes them all the same",
            step.name,
            (cycles.count / critical * (1.0 - 1e-9)).ceil()
        )))
    }

    /// Length of the next jump, and the shortest that can be.
    fn next_length(&self, cycles: &Cycles) -> (f64, f64) {
        let whole = matches!(self.way, Way::Round(_));
        match cycles.jumps {
            Jumps::Tolerance(_) => {
                let unit = if whole { 1.0 } else { 0.0 };
                let mut control = self.control;
                if let (Some(critical), false) = (self.critical, cycles.beyond_critical) {
                    control.limit(STABLE * critical);
                }
                (control.length(cycles.count - self.done, unit), unit.max(1e-9 * cycles.count))
            }
            Jumps::Number(jumps) => {
                let part = |k: usize| cycles.count * k as f64 / jumps as f64;
                let done = |k: usize| if whole { part(k).round() } else { part(k) };
                let length = done(self.entries + 1) - done(self.entries);
                (length, length)
            }
        }
    }
}
