//! Uzawa predictor-corrector with radial return: the reference method (docs/theory-contact.md).
//!
//! Predictor: the gap for the current tractions. Corrector: p <- max(p - r_n g_n, 0), q <- radial return of q - r_t M²
//! Δg_t on |q|_μ <= p. Components are along the axes of the friction ellipse, M = diag(μ1, μ2), and |q|_μ = |M⁻¹ q|.
//!
//! Each step size r starts as 1.8 divided by the estimated largest eigenvalue of its block. Only restarts change r. The
//! convergence rate is 1 - O(h/L) with cell side h and frame size L.

use super::super::balance::StepSizes;
use super::super::{ContactState, Increment};
use super::control::SolveControl;
use super::projected_gradient::{StepRule, run_projected_gradient, step_sizes};
use super::report::SolveReport;

const RELAXATION: f64 = 1.8;

struct Constant(StepSizes);

impl StepRule for Constant {
    fn first(&self) -> StepSizes {
        self.0
    }

    fn next(&mut self, _: &Increment, _: &ContactState, _: &ContactState) -> StepSizes {
        self.0
    }

    /// Halves the step sizes, because a restart suggests that they were too long.
    fn restart(&mut self) -> StepSizes {
        self.0.normal *= 0.5;
        self.0.tangential *= 0.5;
        self.0
    }
}

/// Solves the increment from the state in `it`, as [`run_projected_gradient`] describes.
pub(super) fn solve(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    let mut rule = Constant(step_sizes(problem, it, RELAXATION));
    run_projected_gradient(problem, it, &mut rule, control)
}
