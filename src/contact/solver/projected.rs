//! The loop that all projected-gradient methods share: P <- proj(P - a ĝ(P)), a chosen by a step rule.

use super::super::projection::{Equilibrium, Motions, StepSizes, project};
use super::super::{Increment, Iterate, Unknowns};
use super::{SolveReport, SolverOptions, Stop, Watch};

/// Chooses the step sizes of the next iteration from the last change of tractions and gradient.
pub(super) trait StepRule {
    /// Sizes before any change is known.
    fn first(&self) -> StepSizes;
    /// Sizes after the iterate went from `old` to `new`.
    fn next(&mut self, problem: &Increment, old: &Iterate, new: &Iterate) -> StepSizes;
    /// Called when the iteration goes back to its best state because it stopped gaining.
    fn restart(&mut self) -> StepSizes;
}

/// Iterations in a row without equilibrium after which there is none, whatever the pressures do meanwhile.
const HOPELESS: usize = 300;

/// Iterations without a new best residual after which the loop goes back to the best state.
const PATIENCE: usize = 400;

/// Upper bounds on the eigenvalues of the normal and tangential blocks of the increment, the wear diagonal and the
/// coupling of two ends included.
pub(super) fn spectral_bounds(problem: &Increment, it: &Iterate) -> (f64, f64) {
    let ends = problem.ends.len() as f64;
    let diagonal = it.wear_path.iter().copied().fold(0.0, f64::max);
    let (scales, operator, areas) = (&problem.scales, problem.flexibility, problem.areas);
    let normal = scales.largest_normal(operator, areas);
    let tangential = problem.hat().map_or(0.0, |hat| scales.largest_tangential(operator, areas, &hat));
    (normal + ends * problem.repeats * diagonal, ends * tangential)
}

/// Runs the loop from the state in `it`; leaves the best state found in it.
pub(super) fn iterate(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    rule: &mut dyn StepRule,
    watch: &mut Watch,
) -> SolveReport {
    problem.evaluate(it);
    let mut report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    let mut steps = rule.first();
    let mut best = Best { unknowns: Unknowns::of(it), measure: f64::INFINITY, at: 0 };
    let mut next = it.clone();
    let mut equilibrium = Equilibrium::Held;
    let balances = problem.ends.iter().any(|end| end.balance.is_some());
    let mut lost = 0;
    loop {
        let [normal, tangential] = problem.residuals(it);
        let residual = normal.max(tangential);
        if (normal + tangential).is_nan() || !finite_motions(it) {
            report.stop = Stop::NotFinite;
            break;
        }
        // A sliding state is judged by its normal part, and comes after every state in equilibrium.
        let sliding = if let Equilibrium::Sliding(sliding) = equilibrium { Some(sliding) } else { None };
        let measure = if sliding.is_some() { 1.0 + normal } else { residual };
        lost = if sliding.is_some() && balances { lost + 1 } else { 0 };
        if measure < best.measure {
            best.take(it, measure, report.iterations);
            report.residual = residual;
        }
        let normal = if lost > HOPELESS { 0.0 } else { normal };
        if let Some(stop) = verdict(it, options.tolerance, (sliding.is_some(), normal, residual)) {
            let opens = sliding.is_some_and(|sliding| sliding.opens);
            report.stop = if opens { Stop::ContactLost } else { stop };
            report.sliding = sliding;
            break;
        }
        if report.iterations >= options.max_iterations {
            break;
        }
        if watch(report.iterations, residual) {
            report.stop = Stop::Interrupted;
            break;
        }
        if report.iterations > best.at + PATIENCE {
            best.unknowns.put(it);
            problem.evaluate(it);
            report.applications += problem.applications();
            best.at = report.iterations;
            steps = rule.restart();
        }
        next.rigid.clone_from(&it.rigid);
        next.floating.clone_from(&it.floating);
        let motions = Motions { rigid: &mut next.rigid, floating: &mut next.floating };
        let from = (it.hatted.as_slice(), it.gradient.as_slice());
        equilibrium = project(problem, steps, from, &mut next.hatted, motions);
        problem.evaluate(&mut next);
        report.applications += problem.applications();
        report.iterations += 1;
        steps = rule.next(problem, it, &next);
        std::mem::swap(it, &mut next);
    }
    let as_it_is = matches!(report.stop, Stop::GrossSliding | Stop::ContactLost | Stop::NotFinite);
    if !as_it_is && best.at < report.iterations {
        best.unknowns.put(it);
        problem.evaluate(it);
        report.applications += problem.applications();
    }
    report
}

fn finite_motions(it: &Iterate) -> bool {
    it.rigid.iter().flatten().chain(it.floating.iter().flatten()).all(|x| x.is_finite())
}

/// The best state so far.
struct Best {
    unknowns: Unknowns,
    measure: f64,
    at: usize,
}

impl Best {
    fn take(&mut self, it: &Iterate, measure: f64, at: usize) {
        self.unknowns.take(it);
        self.measure = measure;
        self.at = at;
    }
}

/// Whether the iteration is over: converged, or sliding at pressures that are right.
fn verdict(it: &Iterate, tolerance: f64, (sliding, normal, residual): (bool, f64, f64)) -> Option<Stop> {
    if sliding && normal <= tolerance {
        let n = it.wear_rate.len();
        let contact = it.hatted.chunks(3 * n).all(|planes| planes[2 * n..].iter().any(|p| *p > 0.0));
        return Some(if contact { Stop::GrossSliding } else { Stop::ContactLost });
    }
    (!sliding && residual <= tolerance).then_some(Stop::Converged)
}
