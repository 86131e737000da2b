//! Continuation: gaps and loads change in steps from values for which the start of the solve is the solution.
//!
//! A large change of load changes the states of many cells at once, and the active set does not converge. In a small
//! step few cells change their states, and a few Newton steps suffice. λ is the share of the change that has been
//! applied.

use super::super::super::balance::MotionValues;
use super::super::super::{
    ContactState, Increment, NormalControl, PathPoint, SlipReference, TangentialControl,
};
use super::super::control::SolveControl;
use super::NewtonSolve;

/// First step of λ.
const FIRST_STEP: f64 = 0.25;
/// Smallest step of λ.
const MIN_STEP: f64 = 1e-5;
/// Factor on the step of λ after a quick solution.
const GROWTH: f64 = 2.0;
/// Factor on the step of λ after a failure.
const REDUCTION: f64 = 0.25;
/// Largest number of Newton steps of a quick solution.
const QUICK_STEPS: usize = 5;
/// Largest number of Newton steps at one λ.
const MAX_STEPS: usize = 12;
/// Largest number of Newton steps of a continuation.
const MAX_ITERATIONS: usize = 400;
/// Number of systems that cannot be factorised after which the continuation ends. A few singular systems are accepted.
const MAX_UNFACTORISED: usize = 4;
/// Largest natural residual at λ < 1.
const INTERMEDIATE_TOLERANCE: f64 = 1e-6;

/// Share of the friction limit from which the traction of a cell counts as slipping.
const SLIP_SHARE: f64 = 1.0 - 1e-9;

/// Changes of gaps and loads of a path point that make a given state the solution. They neglect the implicit wear that
/// the change of slip causes.
struct Perturbation {
    /// Change of the gap and the slip, `[3, N]`, mm.
    gap: Vec<f64>,
    /// Change of the prescribed normal force, N.
    normal_force: f64,
    /// Change of the prescribed tangential force on body 2, N.
    tangential_force: [f64; 2],
    /// Change of the prescribed works of a balance.
    works: MotionValues,
}

impl Perturbation {
    /// Computes the changes for the evaluated state `it` with admissible tractions.
    fn new(problem: &Increment, it: &ContactState) -> Self {
        let n = problem.n();
        let mut gap = vec![0.0; 3 * n];
        for cell in 0..n {
            let normal = it.gap[2 * n + cell];
            if it.scaled[2 * n + cell] > 0.0 || normal < 0.0 {
                gap[2 * n + cell] = -normal;
            }
            (gap[cell], gap[n + cell]) = slip_change(problem, it, cell).into();
        }
        let resultant = |plane: usize| -> f64 {
            let tractions = &it.tractions[plane * n..(plane + 1) * n];
            tractions.iter().zip(problem.areas).map(|(traction, area)| traction * area).sum()
        };
        let point = &problem.path_points[0];
        let normal_force = match point.normal {
            NormalControl::Force(force) => resultant(2) - force,
            NormalControl::Approach => 0.0,
        };
        let tangential_force = match point.tangential {
            TangentialControl::Force(force) => [resultant(0) - force[0], resultant(1) - force[1]],
            TangentialControl::Shift => [0.0; 2],
        };
        let works = point.balance.as_ref().map(|balance| balance.work_defects(problem.areas, &it.scaled));
        Self { gap, normal_force, tangential_force, works: works.unwrap_or_default() }
    }

    /// Path point of `problem` with the share `rest` of the changes.
    fn path_point(&self, problem: &Increment, rest: f64) -> PathPoint {
        let mut point = problem.path_points[0].clone();
        if let NormalControl::Force(force) = &mut point.normal {
            *force += rest * self.normal_force;
        }
        if let TangentialControl::Force(force) = &mut point.tangential {
            force.iter_mut().zip(self.tangential_force).for_each(|(force, change)| *force += rest * change);
        }
        if let Some(balance) = &mut point.balance {
            balance.add_works(rest * self.works);
        }
        if let SlipReference::Previous { gap, .. } = &mut point.reference {
            gap.iter_mut().zip(&self.gap).for_each(|(from, change)| *from -= rest * change);
        }
        point
    }

    /// Initial gap of `problem` with the share `rest` of the changes.
    fn initial_gap(&self, problem: &Increment, rest: f64) -> Vec<f64> {
        let n = problem.n();
        let mut gap = problem.initial_gap.to_vec();
        gap[2 * n..].iter_mut().zip(&self.gap[2 * n..]).for_each(|(gap, change)| *gap += rest * change);
        gap
    }
}

/// Change of the slip after which the tangential traction of a cell satisfies the friction law. A cell at the friction
/// limit keeps only its slip opposite to the traction. A cell below the limit loses its slip.
fn slip_change(problem: &Increment, it: &ContactState, cell: usize) -> [f64; 2] {
    let n = problem.n();
    let (q, p) = ([it.scaled[cell], it.scaled[n + cell]], it.scaled[2 * n + cell]);
    let Some(hat) = problem.friction_scaling().filter(|_| p > 0.0) else { return [0.0; 2] };
    let slip = [it.gradient[cell], it.gradient[n + cell]];
    let size = q[0].hypot(q[1]);
    let kept = if size >= SLIP_SHARE * p {
        let against = (-(slip[0] * q[0] + slip[1] * q[1]) / size).max(0.0);
        q.map(|part| -against * part / size)
    } else {
        [0.0; 2]
    };
    hat.physical_slip([kept[0] - slip[0], kept[1] - slip[1]])
}

impl NewtonSolve<'_, '_> {
    /// Solves by continuation from the start of the solve. This needs a single path point and factorised systems, and
    /// happens once in a solve. Returns whether `it` is the solution. Otherwise `it` keeps its state.
    pub(super) fn solve_by_continuation(
        &mut self,
        it: &mut ContactState,
        control: &mut SolveControl,
    ) -> bool {
        let problem = self.problem;
        let single = matches!(&problem.path_points[..], [point] if matches!(point.reference, SlipReference::Previous { .. }));
        if self.continued || !self.factorise || self.too_large || !single {
            return false;
        }
        self.continued = true;
        let mut control = control.auxiliary(self.report.iterations, MAX_ITERATIONS);
        let first = self.report.iterations;
        let last = first + control.options.max_iterations;
        let mut state = it.clone();
        self.start.restore_into(&mut state);
        self.project(problem, &mut state);
        let perturbation = Perturbation::new(problem, &state);
        let (mut trial, mut spare) = (state.clone(), state.clone());
        let (mut share, mut step, mut unfactorised) = (0.0, FIRST_STEP, 0);
        while share < 1.0 {
            let next = f64::min(share + step, 1.0);
            let gap = perturbation.initial_gap(problem, 1.0 - next);
            let changed = Increment {
                scales: problem.scales.clone(),
                initial_gap: &gap,
                path_points: vec![perturbation.path_point(problem, 1.0 - next)],
                ..*problem
            };
            trial.copy_unknowns(&state);
            let wanted = self.options.tolerance;
            let tolerance = if next < 1.0 { wanted.max(INTERMEDIATE_TOLERANCE) } else { wanted };
            match self.correct(&changed, [&mut trial, &mut spare], tolerance, last) {
                Correction::Solved(steps) => {
                    std::mem::swap(&mut state, &mut trial);
                    share = next;
                    step *= if steps <= QUICK_STEPS { GROWTH } else { 1.0 };
                }
                failure => {
                    unfactorised += usize::from(failure == Correction::Unfactorised);
                    step = REDUCTION * (next - share);
                }
            }
            let iterations = self.report.iterations;
            let exhausted = step < MIN_STEP || unfactorised > MAX_UNFACTORISED || iterations >= last;
            if share < 1.0 && (exhausted || control.is_cancelled(iterations - first, self.best_residual)) {
                return false;
            }
        }
        std::mem::swap(it, &mut state);
        true
    }

    /// Takes Newton steps of `changed` from the unknowns in `trial`, up to the iteration `last` of the solve.
    fn correct(
        &mut self,
        changed: &Increment,
        [trial, spare]: [&mut ContactState; 2],
        tolerance: f64,
        last: usize,
    ) -> Correction {
        changed.evaluate(trial);
        self.report.applications += changed.applications();
        for steps in 0..=MAX_STEPS {
            self.report.residual = changed.natural_residual(trial);
            if self.report.residual <= tolerance {
                self.project(changed, trial);
                return Correction::Solved(steps);
            }
            if steps == MAX_STEPS || self.report.iterations >= last {
                break;
            }
            if !self.step(changed, trial, spare) {
                return Correction::Unfactorised;
            }
            std::mem::swap(trial, spare);
        }
        Correction::Failed
    }
}

/// Result of the Newton steps at one λ.
#[derive(PartialEq)]
enum Correction {
    /// The residual met the tolerance after this number of steps.
    Solved(usize),
    /// A system could not be factorised.
    Unfactorised,
    /// The residual did not meet the tolerance.
    Failed,
}
