//! The next jump: how long it is, and whether it is taken.

use std::time::Instant;

use crate::contact::solver::Stop;
use crate::error::{Error, Result};

use super::Run;
use super::cycling::{Cycling, Way};
use super::increments::Stage;
use super::jump::Jump;
use super::record::Observer;
use super::step::{Cycles, Integrator, Jumps, Normal, Step};
use super::tried::Tried;

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

/// Iterations of a stage after which a shorter jump is tried, where there is one.
const IMPATIENT: usize = 2000;

/// Why a controlled jump is taken again, shorter.
enum Refusal {
    /// Its error, as a multiple of what is allowed.
    Error(f64),
    /// Something else.
    Other,
}

impl Run<'_> {
    /// Takes one more jump.
    pub(super) fn next_jump(
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
            if let Some(resolved) = &mut cycling.resolved {
                resolved.aim(cycling.done, length);
            }
            let before = Tried::of(cycling);
            let radii = self.radii(cycling);
            let part = |done: f64| done / cycles.count;
            let stage = Stage { name: &step.name, from: part(cycling.done), to: part(cycling.done + length) };
            let integrator = cycles.integrator;
            let shorter_ones =
                matches!(cycles.jumps, Jumps::Tolerance(_)) && length > shortest && tries < TRIES;
            let patience = self.options.max_iterations;
            if shorter_ones {
                self.options.max_iterations = patience.min(IMPATIENT);
            }
            let jump = self.integrate(step, (cycles, integrator, length), cycling, (observer, &stage));
            self.options.max_iterations = patience;
            let mut jump = jump?;
            if let (Jumps::Tolerance(tolerance), true) = (cycles.jumps, shorter_ones)
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
                    "step \"{}\" ({}): the jump of {length} {} is too long for the second-order integrator, which \
                     would wear past the end of contact; backward Euler took it: more jumps give a better answer",
                    step.name,
                    cycling.entries + 1,
                    cycling.unit()
                ));
            }
            jump.burden(spent);
            // The first strokes have no entry of their own.
            jump.burden(std::mem::take(&mut cycling.ring.spent));
            self.warn_of_unstable(step, cycling, length);
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

    /// Says, once a step, that explicit jumps are longer than is stable.
    fn warn_of_unstable(&mut self, step: &Step, cycling: &Cycling, length: f64) {
        if let Some(critical) = cycling.critical
            && length > critical * (1.0 + 1e-9)
            && cycling.entries == 0
        {
            self.result.warnings.push(format!(
                "step \"{}\": explicit jumps of {length} {} are longer than is stable ({critical:.4e}): pressures and wear swing from \
                 cell to cell, and mean nothing",
                step.name,
                cycling.unit()
            ));
        }
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
}

impl Cycling {
    /// Largest pressure at any end.
    pub(super) fn peak_pressure(&self) -> f64 {
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
            "step \"{}\": explicit jumps of {length} {} are unstable: pressures would swing from cell to cell from {critical:.4e} \
             on, 2 λ_min(S_nn) / D. Take {} jumps or more, or leave `jumps` out (they are then as short as is stable), or an implicit \
             integrator; wear.beyond_critical = true takes them all the same",
            step.name,
            self.unit(),
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
