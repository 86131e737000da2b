//! Contact solvers: each turns an increment and a start into tractions whose natural residual meets the tolerance.

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

/// Iterations for the contact problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Selects the fastest suitable method.
    #[default]
    Auto,
    /// Semismooth Newton with a preconditioned Krylov method.
    Newton,
    /// Projected conjugate gradients where only pressures are unknown, Newton elsewhere.
    #[serde(rename = "cg")]
    ConjugateGradients,
    /// Barzilai-Borwein projection.
    #[serde(rename = "bb")]
    BarzilaiBorwein,
    /// Uzawa predictor-corrector with radial return.
    Uzawa,
}

/// Solver settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// Bound on the natural residual.
    pub tolerance: f64,
    /// Solver.
    pub method: Method,
    /// Bound on the iterations of one solve.
    pub max_iterations: usize,
    /// Work that may be left out.
    pub skip: AllowedOmissions,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self { tolerance: 1e-8, method: Method::Auto, max_iterations: 20_000, skip: AllowedOmissions::ALL }
    }
}

/// What a solver calls between iterations: the iteration count and the residual; `true` asks it to stop.
pub type IterationCallback<'a> = dyn FnMut(usize, f64) -> bool + 'a;

/// Settings and callback of a solve, and the iterations before this part of it.
struct SolveControl<'a> {
    options: SolverOptions,
    /// Iterations before this part of a solve.
    iterations_before: usize,
    watch: &'a mut IterationCallback<'a>,
}

impl<'a> SolveControl<'a> {
    fn new(options: SolverOptions, watch: &'a mut IterationCallback<'a>) -> Self {
        Self { options, iterations_before: 0, watch }
    }

    /// The control of the rest of a solve, after `iterations` of it.
    fn rest(&mut self, iterations: usize) -> SolveControl<'_> {
        let max_iterations = self.options.max_iterations.saturating_sub(iterations);
        SolveControl {
            options: SolverOptions { max_iterations, ..self.options },
            iterations_before: self.iterations_before + iterations,
            watch: self.watch,
        }
    }

    /// Calls the callback; whether the solve is to stop.
    fn is_cancelled(&mut self, iterations: usize, residual: f64) -> bool {
        (self.watch)(self.iterations_before + iterations, residual)
    }

    /// Why a solve ends after `iterations` at a residual, if it does; `exhausted`: without more iterations in any case.
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

/// A way to solve an increment.
#[derive(Clone, Copy)]
enum IncrementSolver {
    ConjugateGradients,
    Newton,
    BarzilaiBorwein,
    Uzawa,
}

impl IncrementSolver {
    /// Its name, as scenes write it.
    fn name(self) -> &'static str {
        match self {
            Self::ConjugateGradients => "cg",
            Self::Newton => "newton",
            Self::BarzilaiBorwein => "bb",
            Self::Uzawa => "uzawa",
        }
    }

    /// Solves from the tractions and rigid motions in `it`, which holds the best or last state afterwards.
    fn solve(self, problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        match self {
            Self::ConjugateGradients => conjugate_gradients::solve(problem, it, control),
            Self::Newton => newton::solve(problem, it, control),
            Self::BarzilaiBorwein => barzilai_borwein::solve(problem, it, control),
            Self::Uzawa => uzawa::solve(problem, it, control),
        }
    }
}

/// The solvers that are tried one after the other, each from where the one before it has stopped gaining.
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

/// Solves the increment from the tractions and rigid motions in `it`, which holds the answer afterwards.
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

/// Where no force presses the bodies and none is left, they just touch: any distance would be in equilibrium.
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
        // What rounding leaves of an overlap would be an error without any pressure to measure it by.
        let mut lift = least(it).abs();
        while least(it) < 0.0 {
            it.rigid_motion[end][2] += lift;
            lift *= 2.0;
        }
    }
}

/// Solves from coarse to fine cells and on windows, where that is worth it.
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

/// Solves on all cells by the methods of the sequence, one after the other.
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
