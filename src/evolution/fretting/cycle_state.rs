//! State of a fretting cycle: its path points, solved together as a closed cycle, and its stick zone. The stick zone depends on the
//! history, so strokes are also solved one after the other.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::contact::solver::{SolveReport, StopReason};
use crate::contact::{
    ContactState, Increment, PathPoint, SlipReference, SolverOptions, TangentialControl, Unknowns,
};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::loops::IncrementStart;
use crate::evolution::monotone::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::records::Outcome;
use crate::evolution::step::{ClosedPath, Drive, Tangential};
use crate::evolution::{Run, state};
use crate::omitted::OmittableWork;

/// Slip relative to the amplitude below which a cell counts as sticking.
const STICK_SLIP_SHARE: f64 = 1e-3;

/// Largest number of cycles without wear before they must be periodic. Responses are periodic if their change per cycle, relative
/// to their range, is at most the second constant.
const MAX_SETTLING_CYCLES: usize = 10;
const PERIODIC_TOLERANCE: f64 = 1e-3;

/// Smallest tolerance of the natural residual for strokes that only determine the stick zone.
const STROKE_TOLERANCE: f64 = 1e-6;

/// Path points of a cycle, solved together, and the stick zone.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::evolution) struct CycleState {
    pub contact: ContactState,
    /// Cells that stick through the whole cycle, `[N]`.
    pub stick_mask: Vec<bool>,
    /// Tangential gap at which the cells of `stick_mask` stick, `[2, N]`, mm.
    pub stick_gap: Vec<f64>,
    /// Solves, iterations and operator applications that are not in any record yet.
    pub uncharged_work: [usize; 3],
}

/// Prescribed positions or forces at the path points of a cycle.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(in crate::evolution) struct FrettingPath {
    /// Quantity that follows the path.
    drive: Drive,
    /// Displacement of body 2 (mm) or force on body 1 (N) along x, y at each path point, the + reversal point first.
    path_points: Vec<[f64; 2]>,
    /// Displacement of body 2 at the start of the step, mm.
    pub center: [f64; 2],
    /// Force on body 1 at the start of the step, N.
    center_force: [f64; 2],
}

impl FrettingPath {
    /// Path points of a closed path. Its centre is the displacement `center` or the force `force` at the start of the step.
    pub fn new(closed: &ClosedPath, center: [f64; 2], force: [f64; 2]) -> Self {
        Self::from_offsets(&closed.offsets(), closed.drive, (center, force))
    }

    fn from_offsets(
        offsets: &[[f64; 2]],
        drive: Drive,
        (center, center_force): ([f64; 2], [f64; 2]),
    ) -> Self {
        let about = if drive == Drive::Shift { center } else { center_force };
        let path_points = offsets.iter().map(|offset| [0, 1].map(|k| about[k] + offset[k])).collect();
        Self { drive, path_points, center, center_force }
    }

    /// The same path with the increments of `closed`. Increments are shorter at the start of each stroke, in the share `transition`
    /// of the stroke over which slip spreads.
    pub fn refined(&self, closed: &ClosedPath, transition: f64) -> Self {
        Self::from_offsets(&closed.graded_offsets(transition), closed.drive, (self.center, self.center_force))
    }

    /// Number of path points.
    pub fn len(&self) -> usize {
        self.path_points.len()
    }

    /// Index of the - reversal point.
    pub fn reversal_index(&self) -> usize {
        self.len() / 2
    }

    /// Sets the displacement of body 2 to the displacement of a path point, if displacements are prescribed.
    pub fn set_shift(&self, end: usize, rigid: &mut [f64; 3]) {
        if self.drive == Drive::Shift {
            rigid[..2].copy_from_slice(&self.path_points[end]);
        }
    }

    /// Loads that return body 2 to the centre, and the tangential control afterwards.
    pub fn return_to_center(&self, loads: PrescribedLoads) -> (PrescribedLoads, Tangential) {
        match self.drive {
            Drive::Shift => (
                PrescribedLoads { tangential: TangentialControl::Shift, ..loads },
                Tangential::Shift(self.center),
            ),
            Drive::Force => {
                let on_body2 = self.center_force.map(|force| -force);
                let tangential = TangentialControl::Force(on_body2);
                (PrescribedLoads { tangential, ..loads }, Tangential::Force(self.center_force))
            }
        }
    }

    /// Loads at a path point.
    pub fn loads(&self, end: usize, loads: PrescribedLoads) -> PrescribedLoads {
        let tangential = match self.drive {
            Drive::Shift => TangentialControl::Shift,
            // The solver takes the force on body 2.
            Drive::Force => TangentialControl::Force(self.path_points[end].map(|force| -force)),
        };
        PrescribedLoads { tangential, ..loads }
    }
}

impl CycleState {
    /// Path points with zero tractions; all cells stick.
    pub fn new(n: usize, course: &FrettingPath, rigid: [f64; 3]) -> Self {
        let motions = (0..course.len()).map(|end| {
            let mut rigid = rigid;
            course.set_shift(end, &mut rigid);
            rigid
        });
        let contact = ContactState::new(n, motions.collect());
        Self { contact, stick_mask: vec![true; n], stick_gap: vec![0.0; 2 * n], uncharged_work: [0; 3] }
    }

    /// Single path point, for steady sliding.
    pub fn for_sliding(n: usize, rigid: [f64; 3]) -> Self {
        Self {
            contact: ContactState::new(n, vec![rigid]),
            stick_mask: vec![false; n],
            stick_gap: vec![0.0; 2 * n],
            uncharged_work: [0; 3],
        }
    }

    /// Slip reference of all path points of the cycle.
    pub fn slip_reference(&self) -> SlipReference {
        SlipReference::PreviousPoint {
            stick_mask: self.stick_mask.clone(),
            stick_gap: self.stick_gap.clone(),
        }
    }

    /// Adds the work of one solve.
    pub fn charge(&mut self, report: &SolveReport) {
        self.charge_work([1, report.iterations, report.applications]);
    }

    /// Adds solves, iterations and operator applications.
    pub fn charge_work(&mut self, work: [usize; 3]) {
        self.uncharged_work.iter_mut().zip(work).for_each(|(sum, work)| *sum += work);
    }

    /// Stores the solution of a stroke. Cells leave the stick zone if they slip by more than `creep` (mm) or lose contact.
    fn record_stroke(&mut self, it: &ContactState, end: usize, creep: f64) {
        let n = self.stick_mask.len();
        let planes = end * 3 * n..(end + 1) * 3 * n;
        self.contact.scaled[planes.clone()].copy_from_slice(&it.scaled);
        self.contact.tractions[planes].copy_from_slice(&it.tractions);
        self.contact.rigid_motion[end] = it.rigid_motion[0];
        self.contact.mode_amplitudes[end] = it.mode_amplitudes[0];
        for (i, stuck) in self.stick_mask.iter_mut().enumerate() {
            *stuck &= it.scaled[2 * n + i] > 0.0 && it.slip[i].hypot(it.slip[n + i]) <= creep;
        }
        self.stick_gap.copy_from_slice(&it.gap[..2 * n]);
    }

    /// Half of the largest distance between two path points, mm.
    fn amplitude(&self) -> f64 {
        let rigid = &self.contact.rigid_motion;
        let apart = |a: &[f64; 3], b: &[f64; 3]| (a[0] - b[0]).hypot(a[1] - b[1]);
        let farthest = |a: &[f64; 3]| rigid.iter().map(|b| apart(a, b)).fold(0.0, f64::max);
        0.5 * rigid.iter().map(farthest).fold(0.0, f64::max)
    }

    /// Releases cells of the stick zone that slip at a path point of a state that did not converge. Returns whether there were any.
    pub fn release_slipping_cells(&mut self, problem: &Increment) -> bool {
        let (n, ends, creep) = (problem.n(), problem.path_points.len(), STICK_SLIP_SHARE * self.amplitude());
        let mut any = false;
        for i in 0..n {
            let slips = |end: usize| {
                let slip = self.contact.slip[end * 2 * n + i].hypot(self.contact.slip[end * 2 * n + n + i]);
                slip > creep && !problem.sticks(&self.contact, end, i)
            };
            if self.stick_mask[i] && (0..ends).any(slips) {
                self.stick_mask[i] = false;
                any = true;
            }
        }
        any
    }

    /// Returns whether the stick zone agrees with the solution: its cells stick at all path points, and no other cell does. A cell
    /// that starts to stick needs new strokes, because its stick gap depends on the history.
    pub fn has_consistent_stick_zone(&self, problem: &Increment) -> bool {
        let (n, ends, creep) = (problem.n(), problem.path_points.len(), STICK_SLIP_SHARE * self.amplitude());
        (0..n).all(|i| {
            let mut sticks = (0..ends).map(|end| problem.sticks(&self.contact, end, i));
            let creeps = |end: usize| {
                self.contact.slip[end * 2 * n + i].hypot(self.contact.slip[end * 2 * n + n + i]) <= creep
            };
            if self.stick_mask[i] {
                sticks.enumerate().all(|(end, sticks)| sticks || creeps(end))
            } else {
                !sticks.all(|sticks| sticks)
            }
        })
    }
}

/// Returns whether the responses at the path points equal the responses in the previous cycle, within `PERIODIC_TOLERANCE` of their
/// range.
pub(in crate::evolution) fn is_periodic(found: &[[f64; 2]], before: &[[f64; 2]]) -> bool {
    let apart = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let change = found.iter().zip(before).map(|(a, b)| apart(a, b)).fold(0.0, f64::max);
    let range = found.iter().map(|a| apart(a, &found[0])).fold(0.0, f64::max);
    found.len() == before.len() && change <= PERIODIC_TOLERANCE * range
}

impl Run<'_> {
    /// Solves cycles without wear, stroke by stroke, until the cycle is periodic. The stick zone depends on this history.
    pub(super) fn find_periodic_cycle(
        &mut self,
        course: &FrettingPath,
        loads: PrescribedLoads,
        ring: &mut CycleState,
    ) -> Result<()> {
        ring.contact.mode_amplitudes.fill(self.state.mode_amplitudes);
        let half = course.reversal_index();
        let mut before: Vec<[f64; 2]> = Vec::new();
        for cycle in 0..MAX_SETTLING_CYCLES {
            let up = if cycle == 0 { course.len()..course.len() + 1 } else { half + 1..course.len() + 1 };
            for end in up.map(|end| end % course.len()).chain(1..half + 1) {
                let mut rigid = [
                    ring.contact.rigid_motion[end][0],
                    ring.contact.rigid_motion[end][1],
                    self.state.rigid_motion[2],
                ];
                course.set_shift(end, &mut rigid);
                let (it, report) = self.advance_stroke(course.loads(end, loads), rigid)?;
                ring.charge(&report);
                if end == 1 {
                    ring.stick_mask.fill(true);
                }
                ring.record_stroke(&it, end, STICK_SLIP_SHARE * ring.amplitude());
                if self.result.outcome != Outcome::Converged {
                    return Ok(());
                }
            }
            let found = self.responses_at_path_points(ring, course);
            if is_periodic(&found, &before) {
                return Ok(());
            }
            before = found;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {MAX_SETTLING_CYCLES} cycles without wear the tractions have not reached a steady-state cycle; the reversal points of the last cycle are used",
            self.step().name
        ));
        Ok(())
    }

    /// Responses at the path points: forces if displacements are prescribed, displacements if forces are prescribed.
    pub(in crate::evolution) fn responses_at_path_points(
        &self,
        ring: &CycleState,
        course: &FrettingPath,
    ) -> Vec<[f64; 2]> {
        let n = self.prepared.n();
        let at = |end: usize| match course.drive {
            Drive::Force => [ring.contact.rigid_motion[end][0], ring.contact.rigid_motion[end][1]],
            Drive::Shift => {
                let tractions = &ring.contact.tractions[end * 3 * n..(end + 1) * 3 * n];
                let ([x, y, _], _) = self.prepared.resultants(tractions);
                [x, y]
            }
        };
        (0..course.len()).map(at).collect()
    }

    /// Solves one increment without wear and updates the state of the run. `rigid`: prescribed motions, and initial guess of
    /// unknown motions.
    pub(super) fn advance_stroke(
        &mut self,
        loads: PrescribedLoads,
        rigid: [f64; 3],
    ) -> Result<(ContactState, SolveReport)> {
        let step = self.step();
        let clock = Instant::now();
        let reference = SlipReference::Previous(self.state.slip_reference.clone());
        let end = self.path_point(&loads, reference)?;
        let worn = self.state.wear_depth.clone();
        let laws = ActiveLaws { wear: false, ..ActiveLaws::of(step) };
        let options = self.stroke_options();
        let mut problem = increment_problem(&self.prepared, &options, &worn, laws, vec![end]);
        let mut it = ContactState::new(self.prepared.n(), vec![rigid]);
        it.mode_amplitudes = vec![self.state.mode_amplitudes];
        if options.skip.allows(OmittableWork::ColdStarts) {
            problem.scale_tractions(&self.state.tractions, &mut it.scaled);
        }
        let stage = ProgressSpan { name: &step.name, from: 0.0, to: 0.0 };
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, &options, self.observer, &stage)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let fields = state::frame_state(&problem, &it, 0, &worn);
        self.state.set_from(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let certificate = state::certificate(&checks, approach, balance);
        let mut record = self.new_record((1, approach), &values, (&it, certificate), clock);
        self.complete_record(&mut record, &report, (&checks, options.tolerance));
        self.warn_of_spin_moment();
        if self.result.outcome != Outcome::Converged {
            self.deliver(record, fields)?;
        }
        Ok((it, report))
    }

    /// Solver options for strokes that only determine the stick zone.
    pub(super) fn stroke_options(&self) -> SolverOptions {
        SolverOptions { tolerance: self.options.tolerance.max(STROKE_TOLERANCE), ..self.options }
    }

    /// Solves strokes at the wear depth `worn` (`[N]`, mm) until the cycle is periodic, and updates stick zone and stick gap. If a
    /// stroke does not converge, the path points keep their coupled solution and the report gives the reason.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(in crate::evolution) fn recompute_stick_zone(
        &mut self,
        (course, loads): (&FrettingPath, PrescribedLoads),
        worn: &[f64],
        ring: &mut CycleState,
        stage: &ProgressSpan,
    ) -> Result<SolveReport> {
        let half = course.reversal_index();
        let options = self.stroke_options();
        // A stage that ends before 1 skips the check of the operator, which would repeat in every stroke.
        let stage = &ProgressSpan { name: stage.name, from: stage.from, to: stage.from };
        let solved = (Unknowns::from_state(&ring.contact), ring.stick_mask.clone(), ring.stick_gap.clone());
        let mut reference = IncrementStart::at_path_point(&ring.contact, half).reference;
        let mut sum = SolveReport { stop: StopReason::Converged, ..SolveReport::default() };
        let mut before: Vec<[f64; 2]> = Vec::new();
        for _ in 0..MAX_SETTLING_CYCLES {
            for end in (half + 1..course.len() + 1).map(|end| end % course.len()).chain(1..half + 1) {
                let place = IncrementStart { reference, ..IncrementStart::at_path_point(&ring.contact, end) };
                let way = (course, end, loads);
                let (place, report, _) = self.solve_stroke(way, (worn, &options), place, stage)?;
                ring.charge_work([1, 0, 0]);
                sum = report.with_work_of(&sum);
                if sum.stop != StopReason::Converged {
                    // Restores the last coupled solution, which is reported.
                    solved.0.restore_into(&mut ring.contact);
                    (ring.stick_mask, ring.stick_gap) = (solved.1, solved.2);
                    let laws = ActiveLaws::of(self.step());
                    let ends = self.path_points(course, loads, ring)?;
                    increment_problem(&self.prepared, &options, worn, laws, ends).evaluate(&mut ring.contact);
                    return Ok(sum);
                }
                if end == 1 {
                    ring.stick_mask.fill(true);
                }
                ring.record_stroke(&place.it, end, STICK_SLIP_SHARE * ring.amplitude());
                reference = place.reference;
            }
            let found = self.responses_at_path_points(ring, course);
            if is_periodic(&found, &before) {
                break;
            }
            before = found;
        }
        Ok(sum)
    }

    /// Path points of a cycle; slip at each path point is measured from the previous path point.
    ///
    /// # Errors
    /// If a load acts along a motion that nothing resists.
    pub(in crate::evolution) fn path_points(
        &mut self,
        course: &FrettingPath,
        loads: PrescribedLoads,
        ring: &CycleState,
    ) -> Result<Vec<PathPoint>> {
        (0..course.len())
            .map(|end| self.path_point(&course.loads(end, loads), ring.slip_reference()))
            .collect()
    }
}
