//! Contact solvers: each turns an increment and a start into tractions whose natural residual meets the tolerance.

mod barzilai_borwein;
mod conjugate_gradients;
mod gauss_seidel;
mod mirror;
mod nested;
mod newton;
mod projected;
mod report;
mod sliding;
mod split;
mod uzawa;

pub use gauss_seidel::entries_bytes;
pub use mirror::{Axes, is_along, is_even, on_halves};
pub use nested::on_windows;
pub use report::{SolveReport, Stop};

use super::{Increment, Iterate, NormalControl};
use crate::linalg::precision::Precision;
use crate::skip::Skips;
use barzilai_borwein::BarzilaiBorwein;
use conjugate_gradients::ConjugateGradients;
use gauss_seidel::{Aim, GaussSeidel};
use newton::Newton;
use sliding::Sliding;
use uzawa::Uzawa;

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Projected conjugate gradients where only pressures are unknown, Newton elsewhere, Barzilai-Borwein where one of those
    /// stops gaining.
    #[default]
    Auto,
    /// Projected conjugate gradients where only pressures are unknown, Newton elsewhere.
    ConjugateGradients,
    /// Projected gradient with Barzilai-Borwein steps (docs/theory-contact.md).
    BarzilaiBorwein,
    /// Semismooth Newton with a preconditioned Krylov method.
    Newton,
    /// Nonlinear block Gauss-Seidel where the entries of the flexibility can be had, Newton elsewhere and where it stops gaining.
    GaussSeidel,
    /// Uzawa predictor-corrector with radial return (docs/theory-contact.md), the method of the source paper.
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
    pub skip: Skips,
    /// Precision of products inside linear solves; the residual that counts is always computed in double precision.
    pub precision: Precision,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            method: Method::Auto,
            max_iterations: 20_000,
            skip: Skips::ALL,
            precision: Precision::default(),
        }
    }
}

/// What a solver calls between iterations: the iteration count and the residual; `true` asks it to stop.
pub type Watch<'a> = dyn FnMut(usize, f64) -> bool + 'a;

/// A way to solve an increment.
trait Solver {
    /// Its name, as scenes write it.
    fn name(&self) -> &'static str;

    /// Whether it is worth its while for the increment, if the choice is left to the program.
    fn suits(&self, problem: &Increment) -> bool;

    /// Whether there is something to do for it from the state in `it`.
    fn begins(&self, _: &Increment, _: &mut Iterate) -> bool {
        true
    }

    /// Solves from the tractions and rigid motions in `it`, which holds the best or last state afterwards.
    fn solve(
        &self,
        problem: &Increment,
        it: &mut Iterate,
        options: &SolverOptions,
        watch: &mut Watch,
    ) -> SolveReport;
}

/// The solvers that are tried one after the other, each from where the one before it has stopped gaining.
fn chain(method: Method, problem: &Increment) -> Vec<&'static dyn Solver> {
    let (krylov, newton): (&dyn Solver, &dyn Solver) = (&ConjugateGradients, &Newton);
    match method {
        Method::Auto => {
            let pressures = krylov.suits(problem).then_some(krylov);
            let blocks: [&dyn Solver; 2] = [&GaussSeidel { aim: Aim::Few }, &GaussSeidel { aim: Aim::Start }];
            let blocks = blocks.into_iter().filter(|solver| pressures.is_none() && solver.suits(problem));
            let sliding: &dyn Solver = &Sliding;
            let sliding = sliding.suits(problem).then_some(sliding);
            let first = pressures.into_iter().chain(sliding).chain(blocks).chain([newton]);
            first.chain([&BarzilaiBorwein as &dyn Solver]).collect()
        }
        Method::GaussSeidel => vec![&GaussSeidel { aim: Aim::Tolerance }, newton],
        Method::ConjugateGradients if krylov.suits(problem) => vec![krylov],
        Method::ConjugateGradients | Method::Newton => vec![newton],
        Method::BarzilaiBorwein => vec![&BarzilaiBorwein],
        Method::Uzawa => vec![&Uzawa],
    }
}

/// Solves the increment from the tractions and rigid motions in `it`, which holds the answer afterwards.
pub fn solve(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
) -> SolveReport {
    let report = if split::suits(problem, options) {
        split::solve(problem, it, options, watch, &mut solve_nested)
    } else {
        solve_nested(problem, it, options, watch)
    };
    if report.converged() {
        touch(problem, it);
    }
    report
}

/// Where no force presses the bodies and none is left, they just touch: any distance would be in equilibrium.
fn touch(problem: &Increment, it: &mut Iterate) {
    let n = problem.n();
    for (end, spec) in problem.ends.iter().enumerate() {
        let free = spec.normal == NormalControl::Force(0.0) && spec.balance.is_none();
        let planes = end * 3 * n..(end + 1) * 3 * n;
        if !(free && problem.rigid_axes.is_none() && it.hatted[planes.clone()].iter().all(|t| *t == 0.0)) {
            continue;
        }
        let least = |it: &mut Iterate| {
            problem.evaluate(it);
            it.gap[planes.clone()][2 * n..].iter().copied().fold(f64::INFINITY, f64::min)
        };
        it.rigid[end][2] -= least(it);
        // What rounding leaves of an overlap would be an error without any pressure to measure it by.
        let mut lift = least(it).abs();
        while least(it) < 0.0 {
            it.rigid[end][2] += lift;
            lift *= 2.0;
        }
    }
}

/// Solves from coarse to fine cells and on windows, where that is worth it.
fn solve_nested(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
) -> SolveReport {
    if !nested::suits(problem, options) {
        return solve_whole(problem, it, options, watch);
    }
    let (report, done) = nested::solve(problem, it, options, watch, &mut solve_whole);
    if done || report.stop == Stop::Interrupted {
        return report;
    }
    let max_iterations = options.max_iterations.saturating_sub(report.iterations);
    let mut told = |iterations: usize, residual: f64| watch(report.iterations + iterations, residual);
    let whole = solve_whole(problem, it, &SolverOptions { max_iterations, ..*options }, &mut told);
    let iterations = report.iterations + whole.iterations;
    SolveReport { iterations, applications: report.applications + whole.applications, ..whole }
}

/// Solves on half of the cells, if the other half is their mirror image, or else on all.
fn solve_whole(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
) -> SolveReport {
    let Some(half) = mirror::solve(problem, it, options, watch, &mut by_methods) else {
        return by_methods(problem, it, options, watch);
    };
    if half.stop == Stop::Interrupted || half.converged() && half.residual <= options.tolerance {
        return half;
    }
    // Whatever cannot be had on the half is a matter of all cells.
    let max_iterations = options.max_iterations.saturating_sub(half.iterations);
    let mut told = |iterations: usize, residual: f64| watch(half.iterations + iterations, residual);
    let whole = by_methods(problem, it, &SolverOptions { max_iterations, ..*options }, &mut told);
    let iterations = half.iterations + whole.iterations;
    SolveReport { iterations, applications: half.applications + whole.applications, ..whole }
}

/// Solves on all cells by the methods of the chain.
fn by_methods(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
) -> SolveReport {
    let mut total = SolveReport::default();
    for (index, solver) in chain(options.method, problem).into_iter().enumerate() {
        let max_iterations = options.max_iterations.saturating_sub(total.iterations);
        if index > 0 && max_iterations == 0 {
            break;
        }
        if !solver.begins(problem, it) {
            continue;
        }
        let before = total.iterations;
        let mut told = |iterations: usize, residual: f64| watch(before + iterations, residual);
        let report = solver.solve(problem, it, &SolverOptions { max_iterations, ..*options }, &mut told);
        total = total.then(solver.name(), report);
        if total.stop != Stop::Iterations {
            break;
        }
    }
    total
}
