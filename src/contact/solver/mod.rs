//! Contact solvers: find the tractions of an [`Increment`] whose natural residual meets the tolerance, from a given start.

mod barzilai_borwein;
mod coarse_to_fine;
mod conjugate_gradients;
mod newton;
mod pressures_first;
mod projected_gradient;
mod report;
mod uzawa;

pub use coarse_to_fine::solves_windows;
pub use report::{SolveReport, StopReason};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactState, Increment, NormalControl};
use crate::omitted::AllowedOmissions;

/// Solution method for the contact problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Fastest suitable method: "cg" where only pressures are unknown, else "newton"; "bb" where these stop converging.
    #[default]
    Auto,
    /// Semismooth Newton with a preconditioned Krylov method.
    Newton,
    /// Projected conjugate gradients where only pressures are unknown, else as "newton".
    #[serde(rename = "cg")]
    ConjugateGradients,
    /// Barzilai-Borwein projection.
    #[serde(rename = "bb")]
    BarzilaiBorwein,
    /// Uzawa predictor-corrector with radial return. Slow; for comparison.
    Uzawa,
}

/// Solver settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// Largest accepted natural residual.
    pub tolerance: f64,
    /// Solution method.
    pub method: Method,
    /// Largest number of iterations of one solve.
    pub max_iterations: usize,
    /// Work that the solver may omit.
    pub skip: AllowedOmissions,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self { tolerance: 1e-8, method: Method::Auto, max_iterations: 20_000, skip: AllowedOmissions::ALL }
    }
}

/// Callback between iterations, with the iteration count and the residual. Returning `true` cancels the solve.
pub type IterationCallback<'a> = dyn FnMut(usize, f64) -> bool + 'a;

/// Settings and callback of one stage of a solve, and the iterations of the stages before it.
struct SolveControl<'a> {
    options: SolverOptions,
    /// Iterations of the earlier stages of the solve.
    iterations_before: usize,
    watch: &'a mut IterationCallback<'a>,
}

impl<'a> SolveControl<'a> {
    fn new(options: SolverOptions, watch: &'a mut IterationCallback<'a>) -> Self {
        Self { options, iterations_before: 0, watch }
    }

    /// Control for the rest of the solve after `iterations` iterations of the current stage.
    fn rest(&mut self, iterations: usize) -> SolveControl<'_> {
        let max_iterations = self.options.max_iterations.saturating_sub(iterations);
        SolveControl {
            options: SolverOptions { max_iterations, ..self.options },
            iterations_before: self.iterations_before + iterations,
            watch: self.watch,
        }
    }

    /// Calls the callback. Returns whether the solve is cancelled.
    fn is_cancelled(&mut self, iterations: usize, residual: f64) -> bool {
        (self.watch)(self.iterations_before + iterations, residual)
    }

    /// Returns why the solve ends after `iterations` iterations at the given residual, or `None` if it continues. `exhausted`: no
    /// iterations are left.
    fn stop_reason(&mut self, iterations: usize, residual: f64, exhausted: bool) -> Option<StopReason> {
        if residual.is_nan() {
            Some(StopReason::NotFinite)
        } else if residual <= self.options.tolerance {
            Some(StopReason::Converged)
        } else if exhausted {
            Some(StopReason::Iterations)
        } else {
            self.is_cancelled(iterations, residual).then_some(StopReason::Interrupted)
        }
    }
}

/// Solver of an increment on all cells.
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

    /// Solves from the tractions and rigid motions in `it`. Afterwards `it` contains the best or the last state.
    fn solve(self, problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        match self {
            Self::ConjugateGradients => conjugate_gradients::solve(problem, it, control),
            Self::Newton => newton::solve(problem, it, control),
            Self::BarzilaiBorwein => barzilai_borwein::solve(problem, it, control),
            Self::Uzawa => uzawa::solve(problem, it, control),
        }
    }
}

/// Solvers in the order in which they are tried. Each solver continues from the state at which the previous solver stopped making
/// progress.
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

/// Solves the increment from the tractions and rigid motions in `it`. Afterwards `it` contains the solution.
pub fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
) -> SolveReport {
    let mut control = SolveControl::new(*options, watch);
    let report = if pressures_first::is_applicable(problem, options) {
        pressures_first::solve(problem, it, &mut control)
    } else {
        solve_nested(problem, it, &mut control)
    };
    if report.converged() {
        close_unloaded_gap(problem, it);
    }
    report
}

/// Sets the rigid motion of unloaded path points so that the smallest normal gap is zero. Without normal force and tractions any
/// separation would be in equilibrium.
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
        // Opens the bodies until rounding leaves no overlap. Without pressure, the residual has no scale for an overlap.
        let mut lift = least(it).abs();
        while least(it) < 0.0 {
            it.rigid_motion[end][2] += lift;
            lift *= 2.0;
        }
    }
}

/// Solves from coarse to fine cells and on windows if [`solves_windows`] allows it, and on all cells otherwise.
fn solve_nested(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    if !solves_windows(problem.flexibility.grid(), &control.options) {
        return solve_by_sequence(problem, it, control);
    }
    let (report, done) = coarse_to_fine::solve(problem, it, control);
    if done || report.stop == StopReason::Interrupted {
        return report;
    }
    solve_by_sequence(problem, it, &mut control.rest(report.iterations)).with_work_of(&report)
}

/// Solves on all cells with the methods of the sequence, one after the other.
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
