//! Strokes of a fretting cycle, solved one after the other to find the stick zone of the cycle.

use std::time::Instant;

use crate::contact::solver::SolveReport;
use crate::contact::{ContactState, PathPoint, SlipReference};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::cycle_increment::stroke_options;
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::settings::STICK_ZONE;
use crate::evolution::increment_record::SolvedState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::run::{Advance, Run};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::Drive;
use crate::omitted::OmittableWork;

/// Returns whether the responses `found` differ from the responses `before` of the previous cycle by at most `periodic_tolerance`
/// of the range of `found`.
pub(in crate::evolution) fn is_periodic(found: &[[f64; 2]], before: &[[f64; 2]]) -> bool {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let change = found.iter().zip(before).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    let range = found.iter().map(|a| apart(a, &found[0])).fold(0.0, f64::max);
    found.len() == before.len() && change <= STICK_ZONE.periodic_tolerance * range
}

impl Run<'_> {
    /// Solves cycles without wear, stroke by stroke, until the cycle is periodic. The stick zone depends on this history.
    pub(super) fn find_periodic_cycle(
        &mut self,
        path: &FrettingPath,
        loads: PrescribedLoads,
        cycle: &mut CycleState,
    ) -> Advance<SolveWork> {
        let mut work = SolveWork::default();
        cycle.contact.mode_amplitudes.fill(self.state.mode_amplitudes);
        let half = path.reversal_index();
        let mut before: Vec<[f64; 2]> = Vec::new();
        for number in 0..STICK_ZONE.max_settling_cycles {
            let up = if number == 0 { path.len()..path.len() + 1 } else { half + 1..path.len() + 1 };
            for point in up.map(|point| point % path.len()).chain(1..half + 1) {
                let mut rigid = [
                    cycle.contact.rigid_motion[point][0],
                    cycle.contact.rigid_motion[point][1],
                    self.state.rigid_motion[2],
                ];
                path.set_shift(point, &mut rigid);
                let (it, report) = self.advance_cycle_increment(path.loads(point, loads), rigid)?;
                work += SolveWork::of(&report);
                cycle.decide_by_stroke(&it, point);
                cycle.record_increment(&it, point);
            }
            let found = self.responses_at_path_points(cycle, path);
            if is_periodic(&found, &before) {
                return Ok(work);
            }
            before = found;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {} cycles without wear the tractions have not reached a steady-state cycle; the reversal points of the last cycle are used",
            self.step().name,
            STICK_ZONE.max_settling_cycles
        ));
        Ok(work)
    }

    /// Responses at the path points: forces if displacements are prescribed, displacements if forces are prescribed.
    pub(in crate::evolution) fn responses_at_path_points(
        &self,
        cycle: &CycleState,
        path: &FrettingPath,
    ) -> Vec<[f64; 2]> {
        let n = self.prepared.n();
        // Without sticking cells the body may drift from cycle to cycle.
        let first = cycle.contact.rigid_motion[0];
        let origin = if cycle.stick_zone.may_drift() { [first[0], first[1]] } else { [0.0; 2] };
        let at = |point: usize| match path.drive {
            Drive::Force => [0, 1].map(|k| cycle.contact.rigid_motion[point][k] - origin[k]),
            Drive::Shift => {
                let tractions = &cycle.contact.tractions[point * 3 * n..(point + 1) * 3 * n];
                let ([x, y, _], _) = self.prepared.resultants(tractions);
                [x, y]
            }
        };
        (0..path.len()).map(at).collect()
    }

    /// `rigid` contains prescribed motions and initial guesses.
    pub(super) fn advance_cycle_increment(
        &mut self,
        loads: PrescribedLoads,
        rigid: [f64; 3],
    ) -> Advance<(ContactState, SolveReport)> {
        let step = self.step();
        let clock = Instant::now();
        let reference = SlipReference::Previous(self.state.slip_reference.clone());
        let point = self.path_point(&loads, reference)?;
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
        let fields = state::frame_state(&problem, &it, 0, &worn);
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

    /// Path points whose slip is measured from the previous path point, or in sticking cells from the stick gap.
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
