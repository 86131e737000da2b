//! Iteration common to the projected-gradient methods: P <- proj(P - a ĝ(P)), with the gradient ĝ and the step sizes a that a
//! [`StepRule`] chooses.

use super::super::balance::StepSizes;
use super::super::projection::{Equilibrium, RigidMotions, project};
use super::super::{ContactState, Increment, Unknowns};
use super::control::SolveControl;
use super::report::{SolveReport, StopReason};

/// Chooses the step sizes of the next iteration from the last change of tractions and gradient.
pub(super) trait StepRule {
    fn first(&self) -> StepSizes;
    fn next(&mut self, problem: &Increment, old: &ContactState, new: &ContactState) -> StepSizes;
    /// Step sizes after the iteration has returned to its best state, because the residual stopped decreasing.
    fn restart(&mut self) -> StepSizes;
}

/// Number of consecutive iterations without equilibrium after which a solve with balances ends.
const MAX_STEPS_WITHOUT_EQUILIBRIUM: usize = 300;

/// Number of iterations without a new best residual after which the iteration returns to its best state.
const MAX_STEPS_WITHOUT_GAIN: usize = 400;

/// Evaluates the state. Returns `factor` divided by estimates of the largest eigenvalues of the normal and tangential blocks of the
/// increment.
pub(super) fn step_sizes(problem: &Increment, it: &mut ContactState, factor: f64) -> StepSizes {
    problem.evaluate(it);
    let ends = problem.path_points.len() as f64;
    let diagonal = it.wear_per_pressure.iter().copied().fold(0.0, f64::max);
    let (scales, operator, areas) = (&problem.scales, problem.flexibility, problem.areas);
    let normal = scales.max_normal_eigenvalue(operator, areas);
    let tangential =
        problem.friction_scaling().map_or(0.0, |hat| scales.max_tangential_eigenvalue(operator, areas, &hat));
    StepSizes {
        normal: factor / (normal + ends * problem.implicit_passes * diagonal),
        tangential: factor / (ends * tangential),
    }
}

/// Iterates from the state in `it`. Afterwards `it` contains the best state found. Without equilibrium, or with values that are not
/// finite, it contains the last state.
pub(super) fn run_projected_gradient(
    problem: &Increment,
    it: &mut ContactState,
    rule: &mut dyn StepRule,
    control: &mut SolveControl,
) -> SolveReport {
    problem.evaluate(it);
    let mut report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    let mut steps = rule.first();
    let mut best = BestState { unknowns: Unknowns::from_state(it), measure: f64::INFINITY, iteration: 0 };
    let mut next = it.clone();
    let mut equilibrium = Equilibrium::Balanced;
    let balances = problem.path_points.iter().any(|end| end.balance.is_some());
    let mut lost = 0;
    loop {
        let [normal, tangential] = problem.natural_residual_parts(it);
        let residual = normal.max(tangential);
        if (normal + tangential).is_nan() || !finite_motions(it) {
            report.stop = StopReason::NotFinite;
            break;
        }
        // A state without equilibrium is compared by its normal residual alone. The added 1 ranks this state after
        // every state in equilibrium with a residual of at most 1.
        let sliding = if let Equilibrium::Sliding(sliding) = equilibrium { Some(sliding) } else { None };
        let measure = if sliding.is_some() { 1.0 + normal } else { residual };
        lost = if sliding.is_some() && balances { lost + 1 } else { 0 };
        if measure < best.measure {
            best.take(it, measure, report.iterations);
            report.residual = residual;
        }
        let normal_residual = if lost > MAX_STEPS_WITHOUT_EQUILIBRIUM { 0.0 } else { normal };
        if let Some(stop) =
            stop_reason(it, control.options.tolerance, sliding.is_some(), normal_residual, residual)
        {
            let opens = sliding.is_some_and(|sliding| sliding.separates_bodies);
            report.stop = if opens { StopReason::ContactLost } else { stop };
            report.loss_of_equilibrium = sliding;
            break;
        }
        if report.iterations >= control.options.max_iterations {
            break;
        }
        if control.is_cancelled(report.iterations, residual) {
            report.stop = StopReason::Interrupted;
            break;
        }
        if report.iterations > best.iteration + MAX_STEPS_WITHOUT_GAIN {
            best.restore(problem, it, &mut report);
            best.iteration = report.iterations;
            steps = rule.restart();
        }
        equilibrium = gradient_step(problem, it, steps, &mut next);
        report.applications += problem.applications();
        report.iterations += 1;
        steps = rule.next(problem, it, &next);
        std::mem::swap(it, &mut next);
    }
    let as_it_is =
        matches!(report.stop, StopReason::GrossSliding | StopReason::ContactLost | StopReason::NotFinite);
    if !as_it_is && best.iteration < report.iterations {
        best.restore(problem, it, &mut report);
    }
    report
}

fn gradient_step(
    problem: &Increment,
    it: &ContactState,
    steps: StepSizes,
    next: &mut ContactState,
) -> Equilibrium {
    next.rigid_motion.clone_from(&it.rigid_motion);
    next.mode_amplitudes.clone_from(&it.mode_amplitudes);
    let motions = RigidMotions { rigid: &mut next.rigid_motion, floating: &mut next.mode_amplitudes };
    let equilibrium = project(problem, steps, &it.scaled, &it.gradient, &mut next.scaled, motions);
    problem.evaluate(next);
    equilibrium
}

fn finite_motions(it: &ContactState) -> bool {
    it.rigid_motion.iter().flatten().chain(it.mode_amplitudes.iter().flatten()).all(|x| x.is_finite())
}

struct BestState {
    unknowns: Unknowns,
    measure: f64,
    iteration: usize,
}

impl BestState {
    fn take(&mut self, it: &ContactState, measure: f64, at: usize) {
        self.unknowns.copy_from(it);
        self.measure = measure;
        self.iteration = at;
    }

    fn restore(&self, problem: &Increment, it: &mut ContactState, report: &mut SolveReport) {
        self.unknowns.restore_into(it);
        problem.evaluate(it);
        report.applications += problem.applications();
    }
}

/// Returns why the iteration ends: convergence, or loss of equilibrium at converged pressures. `None` if it continues. Pressures
/// count as converged if `normal_residual`, the normal part of the natural residual, is at most `tolerance`.
fn stop_reason(
    it: &ContactState,
    tolerance: f64,
    sliding: bool,
    normal_residual: f64,
    residual: f64,
) -> Option<StopReason> {
    if sliding && normal_residual <= tolerance {
        let n = it.wear_per_pass.len();
        let contact = it.scaled.chunks(3 * n).all(|planes| planes[2 * n..].iter().any(|p| *p > 0.0));
        return Some(if contact { StopReason::GrossSliding } else { StopReason::ContactLost });
    }
    (!sliding && residual <= tolerance).then_some(StopReason::Converged)
}
