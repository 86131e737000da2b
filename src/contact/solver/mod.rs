//! Contact solvers: each turns an increment and a start into tractions whose natural residual meets the tolerance.

mod barzilai_borwein;
mod coarse_to_fine;
mod conjugate_gradients;
mod gauss_seidel;
mod newton;
mod pressures_first;
mod projected_gradient;
mod report;
mod uzawa;

pub use coarse_to_fine::solves_windows;
pub use gauss_seidel::entries_bytes;
pub use report::{SolveReport, StopReason};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ContactState, Increment, NormalControl};
use crate::omitted::AllowedOmissions;
use barzilai_borwein::BarzilaiBorwein;
use conjugate_gradients::ConjugateGradients;
use gauss_seidel::{GaussSeidel, SweepGoal};
use newton::Newton;
use uzawa::Uzawa;

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
    /// Nonlinear block Gauss-Seidel on the entries of the flexibility.
    GaussSeidel,
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

/// A way to solve an increment.
trait IncrementSolver {
    /// Its name, as scenes write it.
    fn name(&self) -> &'static str;

    /// Whether it is worth its while for the increment, if the choice is left to the program.
    fn is_applicable(&self, problem: &Increment) -> bool;

    /// Whether there is something to do for it from the state in `it`.
    fn is_useful_from(&self, _: &Increment, _: &mut ContactState) -> bool {
        true
    }

    /// Solves from the tractions and rigid motions in `it`, which holds the best or last state afterwards.
    fn solve(
        &self,
        problem: &Increment,
        it: &mut ContactState,
        options: &SolverOptions,
        watch: &mut IterationCallback,
    ) -> SolveReport;
}

/// The solvers that are tried one after the other, each from where the one before it has stopped gaining.
fn solver_sequence(method: Method, problem: &Increment) -> Vec<&'static dyn IncrementSolver> {
    let (krylov, newton): (&dyn IncrementSolver, &dyn IncrementSolver) = (&ConjugateGradients, &Newton);
    match method {
        Method::Auto => {
            let pressures = krylov.is_applicable(problem).then_some(krylov);
            let blocks: [&dyn IncrementSolver; 2] = [
                &GaussSeidel { goal: SweepGoal::ConvergeIfFewCells },
                &GaussSeidel { goal: SweepGoal::StartNewton },
            ];
            let blocks =
                blocks.into_iter().filter(|solver| pressures.is_none() && solver.is_applicable(problem));
            let first = pressures.into_iter().chain(blocks).chain([newton]);
            first.chain([&BarzilaiBorwein as &dyn IncrementSolver]).collect()
        }
        Method::GaussSeidel => vec![&GaussSeidel { goal: SweepGoal::Converge }, newton],
        Method::ConjugateGradients if krylov.is_applicable(problem) => vec![krylov],
        Method::ConjugateGradients | Method::Newton => vec![newton],
        Method::BarzilaiBorwein => vec![&BarzilaiBorwein],
        Method::Uzawa => vec![&Uzawa],
    }
}

/// Solves the increment from the tractions and rigid motions in `it`, which holds the answer afterwards.
pub fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
) -> SolveReport {
    let report = if pressures_first::is_applicable(problem, options) {
        pressures_first::solve(problem, it, options, watch, &mut solve_nested)
    } else {
        solve_nested(problem, it, options, watch)
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
fn solve_nested(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
) -> SolveReport {
    if !coarse_to_fine::is_applicable(problem, options) {
        return solve_by_sequence(problem, it, options, watch);
    }
    let (report, done) = coarse_to_fine::solve(problem, it, options, watch, &mut solve_by_sequence);
    if done || report.stop == StopReason::Interrupted {
        return report;
    }
    let max_iterations = options.max_iterations.saturating_sub(report.iterations);
    let mut told = |iterations: usize, residual: f64| watch(report.iterations + iterations, residual);
    let whole = solve_by_sequence(problem, it, &SolverOptions { max_iterations, ..*options }, &mut told);
    whole.with_work_of(&report)
}

/// Solves on all cells by the methods of the sequence, one after the other.
fn solve_by_sequence(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
) -> SolveReport {
    let mut total = SolveReport::default();
    for (index, solver) in solver_sequence(options.method, problem).into_iter().enumerate() {
        let max_iterations = options.max_iterations.saturating_sub(total.iterations);
        if index > 0 && max_iterations == 0 {
            break;
        }
        if !solver.is_useful_from(problem, it) {
            continue;
        }
        let before = total.iterations;
        let mut told = |iterations: usize, residual: f64| watch(before + iterations, residual);
        let report = solver.solve(problem, it, &SolverOptions { max_iterations, ..*options }, &mut told);
        total = total.followed_by(solver.name(), report);
        if total.stop != StopReason::Iterations {
            break;
        }
    }
    total
}
