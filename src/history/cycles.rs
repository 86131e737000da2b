//! Fretting cycles taken in jumps (docs/theory-wear.md).
//!
//! A jump of ΔN cycles integrates dw/dN = F(w), F = p₊|s₊|_i + p₋|s₋|_i, with the two stroke ends P₊, P₋ solved
//! together: the slip of a stroke is the difference of the tangential gaps at its ends (elastic recovery included),
//! and the wear of the stage is implicit in both. Cells that stick through the whole cycle keep the tangential gap
//! they stuck at.

use std::time::Instant;

use crate::contact::certificate::StateChecks;
use crate::contact::solver::{SolveReport, Stop};
use crate::contact::{End, Iterate, NormalControl, SlipReference, TangentialControl};
use crate::error::Result;

use super::control::Held;
use super::increments::{Laws, Stage, entry, problem, solve_and_check};
use super::step::{Cycles, Integrator, Observer, Outcome, Spin, Step, StrokeEnd, Tangential};
use super::strokes::{Stroke, settled};
use super::{Run, state};

/// γ of the L-stable two-stage SDIRK method.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;

/// Solutions of a stage with strokes between them to find the cells that stick, at most.
const STICK_PASSES: usize = 8;

/// Share of the contact that a stage of SDIRK2 may lose before its jump counts as too long: wear widens contacts, and
/// only single cells at the rim come and go.
const MOST_LOST: f64 = 0.05;

/// Sums over the stages of a jump.
struct Jump {
    /// Iterations and applications of all stages; stop and residual of the last.
    report: SolveReport,
    /// The worst checks of the stages.
    checks: StateChecks,
    dissipation: f64,
    /// The second stage of SDIRK2 wore past the end of contact.
    overshot: bool,
}

impl Default for Jump {
    fn default() -> Self {
        let report = SolveReport { stop: Stop::Converged, residual: 0.0, ..SolveReport::default() };
        let checks = StateChecks { min_gap: f64::INFINITY, ..StateChecks::default() };
        Self { report, checks, dissipation: 0.0, overshot: false }
    }
}

impl Jump {
    /// Takes over what one more solution says.
    fn add(&mut self, report: &SolveReport) {
        self.report = SolveReport {
            iterations: self.report.iterations + report.iterations,
            applications: self.report.applications + report.applications,
            ..report.clone()
        };
    }
}

impl Run<'_> {
    /// Runs the jumps of a step of fretting cycles.
    pub(super) fn cycles(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        last: bool,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let center = self.state.rigid;
        let mut clock = Instant::now();
        let mut stroke = self.first_strokes(step, cycles, center, observer)?;
        if self.result.outcome != Outcome::Converged {
            return Ok(());
        }
        let touched = state::touches_edge(&self.prepared, &stroke.it);
        let before = self.state.cycles_done;
        for jump in 0..cycles.jumps {
            let done = |k: usize| (cycles.count as f64 * k as f64 / cycles.jumps as f64).round();
            let size = done(jump + 1) - done(jump);
            let count = cycles.jumps as f64;
            let stage = Stage { name: &step.name, from: jump as f64 / count, to: (jump + 1) as f64 / count };
            let mut summed = self.jump(step, cycles, size, &mut stroke, observer, &stage)?;
            // The first strokes have no entry of their own.
            summed.report.iterations += std::mem::take(&mut stroke.spent[0]);
            summed.report.applications += std::mem::take(&mut stroke.spent[1]);
            if summed.report.stop == Stop::Converged {
                self.state.cycles_done = before + done(jump + 1) as u64;
                self.state.dissipation += summed.dissipation;
            }
            if summed.overshot {
                self.result.warnings.push(format!(
                    "step \"{}\" ({}): the jump of {size} cycles is too long for the second-order integrator, which \
                     would wear past the end of contact; backward Euler took it: more jumps give a better answer",
                    step.name,
                    jump + 1
                ));
            }
            self.record_jump(step, (jump + 1, touched), &stroke, &summed, clock, observer)?;
            clock = Instant::now();
            if self.result.outcome != Outcome::Converged {
                return Ok(());
            }
        }
        if !last {
            self.return_to_center(step, center, observer)?;
        }
        Ok(())
    }

    /// Integrates the wear over `size` cycles; the worn depth of the state and the stroke follow.
    ///
    /// The explicit part of the second stage may wear a jump that is too long for it past the end of contact; such a
    /// jump is taken again with backward Euler, which cannot.
    fn jump(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        size: f64,
        stroke: &mut Stroke,
        observer: &mut dyn Observer,
        stage: &Stage,
    ) -> Result<Jump> {
        let before = stroke.clone();
        let jump = self.integrate(step, cycles, (cycles.integrator, size), stroke, (observer, stage))?;
        if !jump.overshot {
            return Ok(jump);
        }
        let wasted = jump.report;
        *stroke = before;
        let euler = (Integrator::BackwardEuler, size);
        let mut jump = self.integrate(step, cycles, euler, stroke, (observer, stage))?;
        jump.report.iterations += wasted.iterations;
        jump.report.applications += wasted.applications;
        jump.overshot = true;
        Ok(jump)
    }

    fn integrate(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (integrator, size): (Integrator, f64),
        stroke: &mut Stroke,
        (observer, stage): (&mut dyn Observer, &Stage),
    ) -> Result<Jump> {
        // (implicit weight, share of the stage in the jump): w_stage = w_explicit + a ΔN F(w_stage).
        let (stages, explicit): (&[(f64, f64)], bool) = match integrator {
            Integrator::Sdirk2 => (&[(GAMMA, 1.0 - GAMMA), (GAMMA, GAMMA)], false),
            Integrator::BackwardEuler => (&[(1.0, 1.0)], false),
            Integrator::Explicit => (&[(0.0, 1.0)], true),
        };
        let start = self.state.worn.clone();
        let mut jump = Jump::default();
        let mut gathered = vec![0.0; start.len()];
        for (number, (weight, share)) in stages.iter().enumerate() {
            let worn: Vec<f64> = start.iter().zip(&gathered).map(|(w, g)| w + g).collect();
            let touched = self.touching(&stroke.it);
            self.stage(step, cycles, (&worn, weight * size), stroke, &mut jump, (observer, stage))?;
            if jump.report.stop != Stop::Converged {
                return Ok(jump);
            }
            jump.overshot = number > 0 && self.lost_share(&touched, &stroke.it) > MOST_LOST;
            if jump.overshot {
                return Ok(jump);
            }
            jump.dissipation += share * size * jump.checks.dissipation;
            gathered.iter_mut().zip(&stroke.it.wear_rate).for_each(|(g, rate)| *g += share * size * rate);
        }
        self.state.worn.iter_mut().zip(&gathered).for_each(|(w, g)| *w += g);
        if explicit {
            // The state that belongs to the new worn depth, for the record and the next jump.
            let worn = self.state.worn.clone();
            self.stage(step, cycles, (&worn, 0.0), stroke, &mut jump, (observer, stage))?;
        }
        Ok(jump)
    }

    /// Cells that carry pressure at either end.
    fn touching(&self, it: &Iterate) -> Vec<bool> {
        let n = self.prepared.n();
        (0..n).map(|i| (0..2).any(|end| it.hatted[end * 3 * n + 2 * n + i] > 0.0)).collect()
    }

    /// Share of the area in contact before that carries nothing any more.
    fn lost_share(&self, before: &[bool], it: &Iterate) -> f64 {
        let (mut lost, mut all) = (0.0, 0.0);
        let areas = &self.prepared.model.frame.areas;
        for ((was, is), area) in before.iter().zip(self.touching(it)).zip(areas) {
            if *was {
                all += area;
                lost += if is { 0.0 } else { *area };
            }
        }
        if all > 0.0 { lost / all } else { 0.0 }
    }

    /// Solves both stroke ends with the wear of `repeats` cycles implicit in them.
    fn stage(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (worn, repeats): (&[f64], f64),
        stroke: &mut Stroke,
        jump: &mut Jump,
        (observer, stage): (&mut dyn Observer, &Stage),
    ) -> Result<()> {
        let loads = self.carried(step, self.held.loads_at_shift());
        let laws = Laws { friction: step.friction, wear: step.wear, repeats };
        let before = jump.checks;
        let mut forces = [[f64::INFINITY; 2]; 2];
        for _ in 0..STICK_PASSES {
            let reference = SlipReference::OtherEnd { stuck: stroke.stuck.clone(), at: stroke.at.clone() };
            let end = self.end(step, &loads, reference)?;
            let mut problem = problem(&self.prepared, &self.options, worn, laws, vec![end.clone(), end]);
            let (report, checks) = solve_and_check(
                (&self.prepared, &mut problem),
                &mut stroke.it,
                &self.options,
                observer,
                stage,
            )?;
            jump.add(&report);
            jump.checks = before.worst(&checks);
            if report.stop != Stop::Converged || stroke.consistent(&problem, cycles.amplitude) {
                return Ok(());
            }
            let now = [0, 1].map(|end| self.tangential_force(&stroke.it, end));
            if settled(now, forces) {
                return Ok(());
            }
            forces = now;
            let depth: Vec<f64> =
                worn.iter().zip(&stroke.it.wear_rate).map(|(worn, rate)| worn + repeats * rate).collect();
            let report = self.resettle(step, cycles, &depth, stroke, (observer, stage))?;
            jump.add(&report);
            if report.stop != Stop::Converged {
                return Ok(());
            }
        }
        // The set of cells that stick did not come to rest.
        jump.report.stop = Stop::Unsettled;
        Ok(())
    }

    fn record_jump(
        &mut self,
        step: &Step,
        (number, touched_before): (usize, bool),
        stroke: &Stroke,
        jump: &Jump,
        clock: Instant,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let worn = self.state.worn.clone();
        let laws = Laws { friction: step.friction, wear: step.wear, repeats: 0.0 };
        let end = End {
            normal: NormalControl::Approach,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: SlipReference::OtherEnd { stuck: stroke.stuck.clone(), at: stroke.at.clone() },
        };
        let problem = problem(&self.prepared, &self.options, &worn, laws, vec![end.clone(), end]);
        let ends = [0, 1].map(|end| state::resultants(&self.prepared, &problem, &stroke.it, end));
        let mean = |value: fn(&StrokeEnd) -> f64| 0.5 * (value(&ends[0]) + value(&ends[1]));
        let approach = 0.5 * [0, 1].map(|end| self.prepared.approach(&stroke.it, end)).iter().sum::<f64>();
        let balance = state::energy_balance(&self.prepared, &self.state, &stroke.it, 1);
        let fields = state::frame_state(&problem, &stroke.it, 0, &worn);
        self.state.take(&stroke.it, 1);
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
        record.contact_touches_edge = state::touches_edge(&self.prepared, &stroke.it);
        record.certificate = state::certificate(&jump.checks, approach, balance);
        record.seconds = clock.elapsed().as_secs_f64();
        record.stroke_ends = Some(ends);
        self.finish(&mut record, &jump.report, &jump.checks);
        self.hint_at_spin(step);
        if record.contact_touches_edge && !touched_before && self.result.outcome == Outcome::Converged {
            self.result.outcome = Outcome::NotConverged("frame-edge");
        }
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
    fn return_to_center(&mut self, step: &Step, center: [f64; 3], observer: &mut dyn Observer) -> Result<()> {
        let rigid = [center[0], center[1], self.state.rigid[2]];
        self.held = Held { tangential: Tangential::Shift([center[0], center[1]]), ..self.held };
        self.stroke_to(step, rigid, observer)?;
        Ok(())
    }
}
