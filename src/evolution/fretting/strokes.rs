//! Strokes of a fretting cycle, solved one after the other to find the stick zone of the cycle.

use std::time::Instant;

use crate::contact::solver::{SolveReport, StopReason};
use crate::contact::{ContactState, PathPoint};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::cycle_increment::{IncrementStart, SolvedIncrement, Strokes, stroke_options};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::settings::STICK_ZONE;
use crate::evolution::increment_record::SolvedState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::run::{Advance, Run};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::{ClosedPath, Correction, Drive};
use crate::omitted::OmittableWork;

/// Responses at the path points: forces if displacements are prescribed, displacements if forces are prescribed.
///
/// If only loads of the bodies vary, force and displacement may be constant. The responses are then the tangential
/// tractions of all cells.
pub(super) struct Responses {
    values: Vec<[f64; 2]>,
    /// Whether the position of body 2 may change from cycle to cycle (drift).
    may_drift: bool,
}

impl Responses {
    /// Returns whether the responses differ from the responses `before` of the previous cycle by at most
    /// `periodic_tolerance` of their range. If body 2 may drift in one of the cycles, positions are compared relative
    /// to the first point.
    pub(super) fn are_periodic(&self, before: &Self) -> bool {
        self.agree_with(before, self.may_drift || before.may_drift)
    }

    /// Motion of body 2 along x, y since the previous cycle `before`, if this motion is the only change of the cycle.
    /// The responses must be displacements.
    pub(super) fn drift_since(&self, before: &Self) -> Option<[f64; 2]> {
        self.agree_with(before, true).then(|| [0, 1].map(|k| self.values[0][k] - before.values[0][k]))
    }

    /// `from_first_point`: whether the responses are compared relative to the first point.
    fn agree_with(&self, before: &Self, from_first_point: bool) -> bool {
        let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let from = |of: &Self| if from_first_point { of.values[0] } else { [0.0; 2] };
        let (origin, origin_before) = (from(self), from(before));
        let both = self.values.iter().zip(&before.values);
        let relative = |a: &[f64; 2], b: &[f64; 2]| [a[0] - b[0], a[1] - b[1]];
        let change = both
            .map(|(now, then)| apart(&relative(now, &origin), &relative(then, &origin_before)))
            .fold(0.0, f64::max);
        let range = self.values.iter().map(|value| apart(value, &self.values[0])).fold(0.0, f64::max);
        change <= STICK_ZONE.periodic_tolerance * range
    }
}

impl Run<'_> {
    /// Solves cycles at constant wear depth, stroke by stroke, until the cycle is periodic. The stick zone depends on
    /// these strokes.
    pub(super) fn find_periodic_cycle(
        &mut self,
        path: &FrettingPath,
        loads: PrescribedLoads,
        cycle: &mut CycleState,
    ) -> Advance<SolveWork> {
        let (ratio, mut work) = self.settling_ratio(path, loads)?;
        let Some(closed) = self.step().kind.closed_path() else { return Ok(work) };
        cycle.contact.mode_amplitudes.fill(self.state.mode_amplitudes);
        let first = path.first_stroke(closed, ratio);
        for point in 0..ratio {
            let coupled = (point + 1 == ratio).then_some(0);
            work += self.advance_stroke(&first, loads, point, coupled, cycle)?.1;
        }
        let fine = path.with_increments(&ClosedPath { increments: ratio * closed.increments, ..*closed });
        let mut before: Option<Responses> = None;
        for number in 0..STICK_ZONE.max_settling_cycles {
            // Sticking cells keep the tractions of the first cycle in later cycles, so only the first cycle has fine
            // increments.
            let (fine, ratio) = if number == 0 { (&fine, ratio) } else { (path, 1) };
            let half = fine.reversal_index();
            let up = if number == 0 { 0..0 } else { half + 1..fine.len() + 1 };
            for (k, point) in up.map(|point| point % fine.len()).chain(1..half + 1).enumerate() {
                let coupled = (point % ratio == 0).then_some(point / ratio);
                let (it, more) = self.advance_stroke(fine, loads, point, coupled, cycle)?;
                work += more;
                let starts = if self.prepared.cyclic_gap.is_some() { k == 0 } else { point == 1 };
                let slip_limit = cycle.slip_limit(&self.prepared);
                cycle.decide_by_stroke(&it, slip_limit, starts);
            }
            let found = self.responses_at_path_points(cycle, path);
            if before.is_some_and(|before| found.are_periodic(&before)) {
                return Ok(work);
            }
            before = Some(found);
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {} cycles without wear the tractions have not reached a steady-state cycle; the reversal points of the last cycle are used",
            self.step().name,
            STICK_ZONE.max_settling_cycles
        ));
        Ok(work)
    }

    /// Number of increments in the first cycle per increment between path points, and the solver work to find this
    /// number.
    ///
    /// The tractions of sticking cells depend on the path. Strokes are therefore refined if a cell sticks at a reversal
    /// point and resolved cycles correct the wear.
    fn settling_ratio(&mut self, path: &FrettingPath, loads: PrescribedLoads) -> Advance<(usize, SolveWork)> {
        let Some((closed, _)) =
            self.resolved_path().filter(|(_, settings)| settings.correction != Correction::Never)
        else {
            return Ok((1, SolveWork::default()));
        };
        let (n, step, worn) = (self.prepared.n(), self.step(), self.state.wear_depth.clone());
        let mut contact = ContactState::new(n, vec![self.state.rigid_motion]);
        contact.mode_amplitudes = vec![self.state.mode_amplitudes];
        let start = IncrementStart { reference: self.state.slip_reference.clone(), contact };
        let options = stroke_options(&self.options);
        let strokes = Strokes { path, loads, wear_depth: &worn, options: &options };
        let progress = ProgressSpan { name: &step.name, from: 0.0, to: 0.0 };
        let (mut here, mut work) = (start, SolveWork::default());
        for point in [0, path.reversal_index()] {
            let SolvedIncrement { next, report, .. } =
                self.solve_cycle_increment(&strokes, point, here, &progress)?;
            work += SolveWork::of(&report);
            let loaded = |i: usize| next.contact.scaled[2 * n + i] > 0.0;
            if report.stop != StopReason::Converged {
                break;
            }
            if (0..n).any(|i| loaded(i) && !self.cell_wears(&next.contact, i)) {
                return Ok((STICK_ZONE.settling_increments.div_ceil(closed.increments), work));
            }
            here = next;
        }
        Ok((1, work))
    }

    /// Solves the increment of a stroke that ends at `point` of `path`. `coupled` is the path point of `cycle` at the
    /// same position, if `cycle` has one.
    fn advance_stroke(
        &mut self,
        path: &FrettingPath,
        loads: PrescribedLoads,
        point: usize,
        coupled: Option<usize>,
        cycle: &mut CycleState,
    ) -> Advance<(ContactState, SolveWork)> {
        let mut rigid = self.state.rigid_motion;
        if let Some(coupled) = coupled {
            rigid[..2].copy_from_slice(&cycle.contact.rigid_motion[coupled][..2]);
        }
        path.set_shift(point, &mut rigid);
        let (it, report) = self.advance_cycle_increment(path.loads(point, loads), rigid)?;
        if let Some(coupled) = coupled {
            cycle.record_increment(&it, coupled);
        }
        Ok((it, SolveWork::of(&report)))
    }

    pub(super) fn responses_at_path_points(&self, cycle: &CycleState, path: &FrettingPath) -> Responses {
        let n = self.prepared.n();
        if path.is_held() {
            let tractions = cycle.contact.tractions.chunks(3 * n);
            let of_cells = tractions.flat_map(|planes| (0..n).map(|i| [planes[i], planes[n + i]]));
            return Responses { values: of_cells.collect(), may_drift: false };
        }
        let at = |point: usize| match path.drive {
            Drive::Force => {
                let it = &cycle.contact;
                let [x, y, _] = self.prepared.motion(&it.rigid_motion[point], &it.mode_amplitudes[point]);
                [x, y]
            }
            Drive::Shift => {
                let tractions = &cycle.contact.tractions[point * 3 * n..(point + 1) * 3 * n];
                let ([x, y, _], _) = self.prepared.resultants(tractions);
                [x, y]
            }
        };
        let may_drift = path.drive == Drive::Force && cycle.stick_zone.may_drift();
        Responses { values: (0..path.len()).map(at).collect(), may_drift }
    }

    /// Solves an increment of a stroke from the state of the run, and updates this state. `rigid` contains prescribed
    /// motions and initial guesses of unknown motions.
    pub(super) fn advance_cycle_increment(
        &mut self,
        loads: PrescribedLoads,
        rigid: [f64; 3],
    ) -> Advance<(ContactState, SolveReport)> {
        let step = self.step();
        let clock = Instant::now();
        let point = self.path_point(&loads, self.previous_increment())?;
        let worn = self.state.wear_depth.clone();
        let laws = ActiveLaws { wear: false, ..ActiveLaws::of(step) };
        let options = stroke_options(&self.options);
        let mut problem = increment_problem(&self.prepared, &options, &worn, laws, vec![point]);
        let mut it = ContactState::new(self.prepared.n(), vec![rigid]);
        it.mode_amplitudes = vec![self.state.mode_amplitudes];
        if options.skip.allows(OmittableWork::ColdStarts) {
            problem.scale_tractions(&self.state.tractions, &mut it.scaled);
        }
        let progress = ProgressSpan { name: &step.name, from: 0.0, to: 0.0 };
        let (report, checks) =
            solve_and_check(&self.prepared, &mut problem, &mut it, &options, self.observer, &progress)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let mut fields = state::frame_state(&problem, &it, 0, &worn);
        fields.load_amplitudes = self.amplitudes_at_phase(loads.phase);
        self.state.set_from(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let certificate = state::certificate(&checks, approach, balance);
        let solved = SolvedState { number: 1, approach, values: &values, contact: &it, certificate, clock };
        let mut record = self.new_record(solved);
        let converged = self.complete_record(&mut record, &report, &checks, options.tolerance);
        self.warn_of_spin_moment(converged);
        if let Err(end) = converged {
            self.deliver(record, fields)?;
            return Err(end.into());
        }
        Ok((it, report))
    }

    /// Path points with their slip references. Slip is measured from the previous path point; sticking cells measure
    /// slip from the stick gap.
    pub(in crate::evolution) fn path_points(
        &mut self,
        path: &FrettingPath,
        loads: PrescribedLoads,
        cycle: &CycleState,
    ) -> Result<Vec<PathPoint>> {
        (0..path.len())
            .map(|point| self.path_point(&path.loads(point, loads), cycle.stick_zone.slip_reference()))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn responses(values: [[f64; 2]; 2], may_drift: bool) -> Responses {
        Responses { values: values.to_vec(), may_drift }
    }

    /// Truth: the motion in a steady-state cycle is the same as in the cycle before, except for a drift that shifts all
    /// positions equally.
    #[test]
    fn drift_is_periodic() {
        let before = [[1.0, 0.0], [-1.0, 0.5]];
        let shifted = before.map(|[x, y]| [x + 3.0, y - 2.0]);
        let changed = [[1.0, 0.0], [-1.0, 0.51]];
        let are_periodic =
            |now, drifts: [bool; 2]| responses(now, drifts[0]).are_periodic(&responses(before, drifts[1]));
        for drifts in [[true, true], [true, false], [false, true]] {
            assert!(are_periodic(shifted, drifts), "{drifts:?}");
            assert!(!are_periodic(changed, drifts), "{drifts:?}");
        }
        assert!(are_periodic(before, [false, false]));
        assert!(!are_periodic(shifted, [false, false]));
        let drift = |now| responses(now, false).drift_since(&responses(before, false));
        assert_eq!(
            (drift(shifted), drift(before), drift(changed)),
            (Some([3.0, -2.0]), Some([0.0; 2]), None)
        );
    }
}
