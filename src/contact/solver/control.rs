//! Settings of a solve, and its control between iterations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::{ContactState, Increment};
use super::report::{SolveReport, StopReason};
use super::stagnation::ResidualHistory;
use crate::omitted::AllowedOmissions;

/// Solution method for the contact problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// Fastest suitable method: "cg" where only pressures are unknown, else "newton". If "cg" stops converging, "newton" continues;
    /// if "newton" does, "bb".
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

/// Settings and callback of one stage of a solve.
pub(super) struct SolveControl<'a> {
    pub(super) options: SolverOptions,
    iterations_before: usize,
    watch: &'a mut IterationCallback<'a>,
    /// Residuals of the whole problem, if they are recorded.
    history: Option<&'a mut ResidualHistory>,
}

impl<'a> SolveControl<'a> {
    pub(super) fn new(options: SolverOptions, watch: &'a mut IterationCallback<'a>) -> Self {
        Self { options, iterations_before: 0, watch, history: None }
    }

    /// Records the residuals of the iterations in `history`.
    pub(super) fn recording(self, history: &'a mut ResidualHistory) -> Self {
        Self { history: Some(history), ..self }
    }

    pub(super) fn rest(&mut self, iterations: usize) -> SolveControl<'_> {
        let max_iterations = self.options.max_iterations.saturating_sub(iterations);
        SolveControl {
            options: SolverOptions { max_iterations, ..self.options },
            iterations_before: self.iterations_before + iterations,
            watch: self.watch,
            history: self.history.as_deref_mut(),
        }
    }

    /// Control of an auxiliary problem after `iterations` iterations of the solve, with at most `most` further
    /// iterations. Residuals of the auxiliary problem are not recorded.
    pub(super) fn auxiliary(&mut self, iterations: usize, most: usize) -> SolveControl<'_> {
        let mut rest = self.rest(iterations);
        rest.options.max_iterations = rest.options.max_iterations.min(most);
        SolveControl { history: None, ..rest }
    }

    pub(super) fn is_cancelled(&mut self, iterations: usize, residual: f64) -> bool {
        let iterations = self.iterations_before + iterations;
        if let Some(history) = self.history.as_deref_mut() {
            history.add(iterations, residual);
        }
        (self.watch)(iterations, residual)
    }

    /// Reason to end the solve after `iterations` iterations, `None` to continue. `exhausted` states that no iterations
    /// are left.
    pub(super) fn stop_reason(
        &mut self,
        iterations: usize,
        residual: f64,
        exhausted: bool,
    ) -> Option<StopReason> {
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

/// Solver that a method calls for a part of its problem. It updates the state to the solution, or to the best or last state found.
pub(super) type PartSolver = fn(&Increment, &mut ContactState, &mut SolveControl) -> SolveReport;
