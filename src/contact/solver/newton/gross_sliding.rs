//! Test for gross sliding: whether friction carries the prescribed loads while every cell slips.
//!
//! The test needs friction and unknown pressures, and does not apply to implicit wear. Without a balance, every cell
//! slips opposite to the scaled tangential force. The friction limit of the contact is then the normal force. With a
//! balance, the bodies slide along the motion that friction resists least at the pressures in sliding.

use super::super::super::balance::{Balance, LossOfEquilibrium};
use super::super::super::friction_scaling::FrictionScaling;
use super::super::super::{
    ContactState, Increment, NormalControl, PathPoint, Pressures, SlipReference, TangentialControl, Unknowns,
};
use super::super::control::{PartSolver, SolveControl};
use super::super::report::SolveReport;

/// Largest number of iterations of the test of a path point.
const MAX_ITERATIONS: usize = 500;

/// Largest number of sliding motions of a balance for which the pressures are solved.
const MAX_MOTIONS: usize = 20;

/// Largest relative change of the carried fraction of the load from one sliding motion to the next, at convergence.
const FRACTION_TOLERANCE: f64 = 1e-8;

/// Share of the friction limit from which a prescribed force counts as gross sliding.
const LIMIT_SHARE: f64 = 1.0 - 1e-12;

/// Returns whether gross sliding is certain, because a prescribed normal force is smaller than the scaled tangential
/// force of its path point.
pub(super) fn is_certain(problem: &Increment) -> bool {
    problem.path_points.iter().enumerate().any(|(end, point)| match (&point.balance, point.normal) {
        (None, NormalControl::Force(normal)) => match prescribed_load(problem, end) {
            Some(Load::Force(force)) => force[0].hypot(force[1]) > normal.max(0.0),
            _ => false,
        },
        _ => false,
    })
}

/// Result of the test.
pub(super) enum Verdict {
    /// A load reaches the friction limit.
    Slides(LossOfEquilibrium),
    /// Friction carries every load.
    Carried,
    /// The test does not apply, the pressures in sliding did not converge or are zero, or no motion without opening was found.
    Unknown,
}

/// Tests the path points with a prescribed load until one slides. Writes the tractions, the normal rigid motion and the
/// mode amplitudes of a sliding path point into `it`.
///
/// Adds the work of the solves to `report`.
pub(super) fn test(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    solver: PartSolver,
    report: &mut SolveReport,
) -> Verdict {
    let mut all = Verdict::Carried;
    let mut loads = 0;
    for end in 0..problem.path_points.len() {
        let Some(load) = prescribed_load(problem, end) else { continue };
        loads += 1;
        let mut test = SlidingTest::new(problem, it, end, control, solver, report);
        let verdict = match load {
            Load::Force(force) => test.force(force),
            Load::Balance { all, sliding } => test.balance(all, &sliding),
        };
        let state = test.state;
        match verdict {
            Verdict::Carried => {}
            Verdict::Unknown => all = Verdict::Unknown,
            Verdict::Slides(loss) => {
                let n = problem.n();
                it.scaled[3 * n * end..3 * n * (end + 1)].copy_from_slice(&state.scaled);
                it.rigid_motion[end][2] = state.rigid_motion[0][2];
                it.mode_amplitudes[end] = state.mode_amplitudes[0];
                return Verdict::Slides(loss);
            }
        }
    }
    if loads == 0 { Verdict::Unknown } else { all }
}

/// Load of a path point to which the test applies.
enum Load<'a> {
    /// Scaled tangential force on body 2.
    Force([f64; 2]),
    /// Forces and moments of a balance.
    Balance {
        all: &'a Balance,
        /// Forces and moments on the motions that change no normal gap.
        sliding: Balance,
    },
}

/// Load that path point `end` prescribes; `None` if it has no tangential force or the test does not apply. The test
/// does not apply to implicit wear, because the gap then depends on the sliding distance.
fn prescribed_load<'a>(problem: &'a Increment, end: usize) -> Option<Load<'a>> {
    let (point, hat) = (&problem.path_points[end], problem.friction_scaling()?);
    let implicit_wear = problem.wear.is_some() && problem.implicit_passes > 0.0;
    if implicit_wear || problem.pressures != Pressures::Unknown {
        return None;
    }
    match (&point.balance, point.tangential) {
        (Some(all), _) => {
            let sliding = all.without_gap(problem.areas)?;
            Some(Load::Balance { all, sliding })
        }
        (None, TangentialControl::Force(force)) if force != [0.0; 2] => {
            Some(Load::Force(hat.scaled_traction(force)))
        }
        _ => None,
    }
}

/// Test of one path point.
struct SlidingTest<'t, 'p, 'c> {
    problem: &'t Increment<'p>,
    point: &'t PathPoint,
    hat: FrictionScaling,
    /// State in sliding.
    state: ContactState,
    control: &'t mut SolveControl<'c>,
    solver: PartSolver,
    report: &'t mut SolveReport,
    /// Number of iterations in the report at which the test ends.
    last: usize,
}

impl<'t, 'p, 'c> SlidingTest<'t, 'p, 'c> {
    /// Prepares the test of the path point `end`, which must have friction.
    fn new(
        problem: &'t Increment<'p>,
        it: &ContactState,
        end: usize,
        control: &'t mut SolveControl<'c>,
        solver: PartSolver,
        report: &'t mut SolveReport,
    ) -> Self {
        let n = problem.n();
        let hat = problem.friction_scaling().expect("a load is tested with friction");
        let mut state = ContactState::new(n, vec![it.rigid_motion[end]]);
        state.mode_amplitudes = vec![it.mode_amplitudes[end]];
        state.scaled.copy_from_slice(&it.scaled[3 * n * end..3 * n * (end + 1)]);
        let (point, last) = (&problem.path_points[end], report.iterations + MAX_ITERATIONS);
        Self { problem, point, hat, state, control, solver, report, last }
    }

    /// Tests a scaled tangential force.
    fn force(&mut self, force: [f64; 2]) -> Verdict {
        let n = self.problem.n();
        let size = force[0].hypot(force[1]);
        if matches!(self.point.normal, NormalControl::Force(normal) if size < LIMIT_SHARE * normal) {
            return Verdict::Carried;
        }
        let slip = self.hat.physical_slip(force.map(|part| -part));
        let slips = [vec![slip[0]; n], vec![slip[1]; n]].concat();
        let point = PathPoint { balance: None, ..self.point.clone() };
        let start = Unknowns::from_state(&self.state);
        let solved = self.solve_sliding(point, slips);
        if !solved {
            start.restore_into(&mut self.state);
        }
        let limit = match (self.point.normal, solved) {
            // Without converged pressures, a prescribed normal force is the limit.
            (NormalControl::Force(normal), false) if normal > 0.0 => normal,
            (_, false) => return Verdict::Unknown,
            (_, true) => self.pressures().iter().zip(self.problem.areas).map(|(p, area)| p * area).sum(),
        };
        if limit == 0.0 {
            Verdict::Unknown
        } else if size < LIMIT_SHARE * limit {
            Verdict::Carried
        } else {
            Verdict::Slides(LossOfEquilibrium::by_sliding(&self.hat, force, limit))
        }
    }

    /// Tests the loads of a balance: alternates between the motion that friction resists least and the pressures in that motion.
    fn balance(&mut self, all: &Balance, along: &Balance) -> Verdict {
        let areas = self.problem.areas;
        let pressing = all.without_slip(areas);
        let normal = match &pressing {
            Some(_) => self.point.normal,
            None => NormalControl::Approach,
        };
        let mut limits = self.pressures().to_vec();
        if limits.iter().all(|limit| *limit <= 0.0) {
            limits.fill(1.0);
        }
        let Some(mut sliding) = along.least_resisted_motion(areas, &limits) else {
            return Verdict::Unknown;
        };
        let mut fraction = f64::INFINITY;
        for _ in 0..MAX_MOTIONS {
            let point = PathPoint { balance: pressing.clone(), normal, ..self.point.clone() };
            if !self.solve_sliding(point, self.physical(&sliding.slip)) {
                return Verdict::Unknown;
            }
            limits.copy_from_slice(self.pressures());
            sliding = match along.least_resisted_motion(areas, &limits) {
                Some(next) => next,
                None => return Verdict::Unknown,
            };
            let before = std::mem::replace(&mut fraction, sliding.carried_load_fraction);
            if (fraction - before).abs() <= FRACTION_TOLERANCE * fraction {
                return if fraction * LIMIT_SHARE < 1.0 {
                    Verdict::Slides(sliding.loss_of_equilibrium())
                } else if sliding.is_least {
                    Verdict::Carried
                } else {
                    Verdict::Unknown
                };
            }
        }
        Verdict::Unknown
    }

    fn pressures(&self) -> &[f64] {
        &self.state.scaled[2 * self.problem.n()..]
    }

    /// Physical slips, `[2, N]`, for the scaled slips `scaled`.
    fn physical(&self, scaled: &[f64]) -> Vec<f64> {
        let n = self.problem.n();
        let mut slips = vec![0.0; 2 * n];
        for cell in 0..n {
            (slips[cell], slips[n + cell]) = self.hat.physical_slip([scaled[cell], scaled[n + cell]]).into();
        }
        slips
    }

    /// Solves for the pressures while the cells slip by `slips`, `[2, N]`. Returns whether the pressures converged.
    fn solve_sliding(&mut self, point: PathPoint, slips: Vec<f64>) -> bool {
        let (tangential, reference) = (TangentialControl::Shift, SlipReference::Prescribed(slips));
        let sliding = Increment {
            wear: None,
            scales: self.problem.scales.clone(),
            path_points: vec![PathPoint { tangential, reference, ..point }],
            ..*self.problem
        };
        let left = self.last.saturating_sub(self.report.iterations);
        let mut control = self.control.auxiliary(self.report.iterations, left);
        let solved = (self.solver)(&sliding, &mut self.state, &mut control);
        self.report.add_work_of(&solved);
        solved.converged()
    }
}
