//! Contact solvers: find tractions for which the natural residual of an [`Increment`] meets the tolerance, from a given start.

mod barzilai_borwein;
mod coarse_to_fine;
mod conjugate_gradients;
mod control;
mod newton;
mod pressures_first;
mod projected_gradient;
mod report;
mod stagnation;
mod uzawa;

pub use coarse_to_fine::solves_windows;
pub use control::{IterationCallback, Method, SolverOptions};
pub use report::{SolveReport, StopReason};
pub use stagnation::Stagnation;

use super::{ContactState, Increment, NormalControl};
use control::SolveControl;
use stagnation::ResidualHistory;

#[derive(Clone, Copy)]
enum IncrementSolver {
    ConjugateGradients,
    Newton,
    BarzilaiBorwein,
    Uzawa,
}

impl IncrementSolver {
    /// Name of the method in scene files.
    fn name(self) -> &'static str {
        match self {
            Self::ConjugateGradients => "cg",
            Self::Newton => "newton",
            Self::BarzilaiBorwein => "bb",
            Self::Uzawa => "uzawa",
        }
    }

    fn solve(self, problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        match self {
            Self::ConjugateGradients => conjugate_gradients::solve(problem, it, control),
            Self::Newton => newton::solve(problem, it, control, solve_by_sequence),
            Self::BarzilaiBorwein => barzilai_borwein::solve(problem, it, control),
            Self::Uzawa => uzawa::solve(problem, it, control),
        }
    }
}

/// Solvers in the order in which they are tried. Each solver continues from the last state of the previous one.
fn solver_sequence(method: Method, problem: &Increment) -> Vec<IncrementSolver> {
    use IncrementSolver::{BarzilaiBorwein, ConjugateGradients, Newton, Uzawa};
    match method {
        Method::Auto if conjugate_gradients::is_applicable(problem) => {
            vec![ConjugateGradients, Newton, BarzilaiBorwein]
        }
        Method::Auto => vec![Newton, BarzilaiBorwein],
        Method::ConjugateGradients if conjugate_gradients::is_applicable(problem) => vec![ConjugateGradients],
        Method::ConjugateGradients | Method::Newton => vec![Newton],
        Method::BarzilaiBorwein => vec![BarzilaiBorwein],
        Method::Uzawa => vec![Uzawa],
    }
}

/// Solves the increment from the tractions and rigid motions in `it`. Afterwards `it` contains the solution. If no
/// solution is found, it contains the best or the last state.
pub fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
) -> SolveReport {
    let mut history = ResidualHistory::default();
    let mut control = SolveControl::new(*options, watch).recording(&mut history);
    let mut report = if pressures_first::is_applicable(problem, options) {
        pressures_first::solve(problem, it, &mut control, solve_nested)
    } else {
        solve_nested(problem, it, &mut control)
    };
    if report.converged() {
        close_unloaded_gap(problem, it);
    }
    if report.stop == StopReason::Iterations {
        problem.evaluate(it);
        report.applications += problem.applications();
        let iterations = [report.iterations, options.max_iterations];
        report.stagnation = Some(Stagnation::new(problem, it, options.tolerance, history, iterations));
    }
    report
}

/// Sets the normal motion of unloaded path points on flat frames so that the smallest normal gap is zero. Without
/// normal force and tractions, every separation would be in equilibrium.
fn close_unloaded_gap(problem: &Increment, it: &mut ContactState) {
    let n = problem.n();
    for (end, spec) in problem.path_points.iter().enumerate() {
        let free = spec.normal == NormalControl::Force(0.0) && spec.balance.is_none();
        let planes = end * 3 * n..(end + 1) * 3 * n;
        if !(free && problem.rigid_axes.is_none() && it.scaled[planes.clone()].iter().all(|t| *t == 0.0)) {
            continue;
        }
        let least = |it: &mut ContactState| {
            problem.evaluate(it);
            it.gap[planes.clone()][2 * n..].iter().copied().fold(f64::INFINITY, f64::min)
        };
        it.rigid_motion[end][2] -= least(it);
        // Rounding may leave an overlap. The loop removes it, because the residual has no scale for an overlap without
        // pressure.
        let mut lift = least(it).abs();
        while least(it) < 0.0 {
            it.rigid_motion[end][2] += lift;
            lift *= 2.0;
        }
    }
}

fn solve_nested(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    if !solves_windows(problem.flexibility.grid(), &control.options) {
        return solve_by_sequence(problem, it, control);
    }
    let (report, done) = coarse_to_fine::solve(problem, it, control, solve_by_sequence);
    if done || report.stop == StopReason::Interrupted {
        return report;
    }
    solve_by_sequence(problem, it, &mut control.rest(report.iterations)).with_work_of(&report)
}

fn solve_by_sequence(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    let mut total = SolveReport::default();
    for (index, solver) in solver_sequence(control.options.method, problem).into_iter().enumerate() {
        let mut rest = control.rest(total.iterations);
        if index > 0 && rest.options.max_iterations == 0 {
            break;
        }
        let report = solver.solve(problem, it, &mut rest);
        total = total.followed_by(solver.name(), report);
        if total.stop != StopReason::Iterations {
            break;
        }
    }
    total
}
