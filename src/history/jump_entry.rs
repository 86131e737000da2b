//! What jumps hand out: their entries, and why none follow.

use std::time::Instant;

use crate::contact::certificate::{self, DirectSums, TangentialGap};
use crate::error::Result;

use super::cycling::{Cycling, Way};
use super::increments::entry;
use super::jump::Jump;
use super::record::{JumpRecord, Observer, Outcome, StrokeEnd};
use super::step::{Cycles, Spin, Step};
use super::{FRAME_EDGE, Run, state};

impl Run<'_> {
    /// The cycles that are left, in which nothing wears any more.
    pub(super) fn rest(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &mut Cycling,
        clock: Instant,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let length = cycles.count - cycling.done;
        self.result.warnings.push(format!(
            "step \"{}\": wear has taken all but a millionth of the pressure at this approach: nothing is left for the other {length} {}",
            step.name,
            cycling.unit()
        ));
        // A run that is taken up here has not evaluated its ends yet.
        let worn = self.state.worn.clone();
        let problem = self.ends_problem(step, cycling, &worn, cycling.reported_end());
        let mut checks =
            certificate::check(&problem, &mut cycling.ring.it, TangentialGap::Leave, DirectSums::None);
        drop(problem);
        // What is left is the rounding of the gap: it counts against the pressures that there were.
        checks.natural_residual *= cycling.peak_pressure() / cycling.peak;
        let jump = Jump { checks, ..Jump::new(self.prepared.n()) };
        self.record_jump(step, cycles, (cycling, &jump), (length, 0, clock), observer)
    }

    /// Ends the run before a jump that brings the contact to the rim of the frame, beyond which it would be cut off.
    pub(super) fn outgrow(&mut self, step: &Step, cycling: &Cycling, jump: &Jump, length: f64) {
        self.lost = [jump.solves, jump.report.iterations, jump.report.applications];
        self.result.outcome = FRAME_EDGE;
        let unit = cycling.unit();
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
            if let Some(resolved) = &cycling.resolved {
                self.note_remaining_error(resolved, &jump.worn);
            }
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
}
