//! Contact solvers: each turns an increment and a start into tractions whose natural residual meets the tolerance.

mod barzilai_borwein;
mod conjugate_gradients;
mod projected;
mod uzawa;

pub use projected::{SolveReport, Stop};

use super::increment::{Increment, Iterate};

/// Which solver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Projected conjugate gradients where only pressures are unknown, else Barzilai-Borwein.
    #[default]
    Auto,
    /// Projected gradient with Barzilai-Borwein steps (docs/theory-contact.md).
    BarzilaiBorwein,
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
    /// Whether work that a scene does not need is skipped.
    pub skip: bool,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self { tolerance: 1e-8, method: Method::Auto, max_iterations: 20_000, skip: true }
    }
}

/// What a solver calls between iterations: the iteration count and the residual; `true` asks it to stop.
pub type Watch<'a> = dyn FnMut(usize, f64) -> bool + 'a;

/// Solves the increment from the tractions and rigid motions in `it`, which holds the answer afterwards.
pub fn solve(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
) -> SolveReport {
    match options.method {
        Method::Auto if conjugate_gradients::suits(problem) => {
            let report = conjugate_gradients::solve(problem, it, options, watch);
            if report.stop != Stop::Iterations {
                return report;
            }
            // It stopped gaining: Barzilai-Borwein goes on from there.
            let max_iterations = options.max_iterations - report.iterations;
            let rest = SolverOptions { max_iterations, ..*options };
            let more = barzilai_borwein::solve(problem, it, &rest, watch);
            let iterations = report.iterations + more.iterations;
            SolveReport { iterations, applications: report.applications + more.applications, ..more }
        }
        Method::Auto | Method::BarzilaiBorwein => barzilai_borwein::solve(problem, it, options, watch),
        Method::Uzawa => uzawa::solve(problem, it, options, watch),
    }
}
