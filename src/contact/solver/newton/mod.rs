//! Semismooth Newton of Alart and Curnier for contact and friction (docs/theory-contact.md), its linear systems solved by a
//! preconditioned Krylov method on the cells in contact.
//!
//! From the augmented variables p - c_n g_n and q̂ - c_t Δĝ_t each cell is open, sticks or slips; the equations of these states,
//! linear but for the direction of slip, give the step. From afar the states cycle: projected Barzilai-Borwein steps come
//! before the first Newton step, and after one that did not lower the residual.
//!
//! # Source
//! Alart and Curnier 1991, "A mixed formulation for frictional contact problems prone to Newton like solution methods"; the cut
//! β <= 1: Hüeber, Stadler and Wohlmuth 2008.

mod preconditioner;
mod rolling;
mod tangent;
mod unknowns;

use super::super::{ContactState, Increment, SlipReference, Unknowns};
use super::barzilai_borwein;
use super::{SolveControl, SolveReport, SolverOptions, StopReason};
use crate::linalg::gmres::{Gmres, KrylovOptions};
use tangent::{LinearModel, NewtonSystem, Workspace};

/// Natural residual from which Newton steps begin: at once, and after one that failed.
const FIRST_STEP_START_RESIDUAL: f64 = 0.5;
const RESTART_RESIDUAL: f64 = 2e-2;

/// Barzilai-Borwein steps before a Newton step is tried from wherever they have led.
const MAX_START_STEPS: usize = 1000;

/// Barzilai-Borwein steps after the first Newton step that fails; twice as many after each further one.
const FALLBACK_STEPS: usize = 15;

/// Krylov vectors kept; products of one linear system.
const GMRES_RESTART: usize = 40;
const MAX_GMRES_PRODUCTS: usize = 120;

/// Bounds of the relative residual of a linear system, and its share of the natural residual.
const MAX_LINEAR_TOLERANCE: f64 = 0.05;
const MIN_LINEAR_TOLERANCE: f64 = 1e-3;
const LINEAR_TOLERANCE_SHARE: f64 = 0.1;

/// A linear residual this much below the tolerance ends the last step, if it is not below the limit.
const FINAL_STEP_TOLERANCE_SHARE: f64 = 0.3;
const MIN_FINAL_LINEAR_TOLERANCE: f64 = 1e-6;

/// Natural residual below which the states of most cells are the last ones.
const TIGHT_SOLVE_RESIDUAL: f64 = 1e-3;

/// Steps in a row that may end above the best residual, by this factor at most: cells change sides.
const NONMONOTONE_STEPS: usize = 1;
const NONMONOTONE_FACTOR: f64 = 3.0;

/// The first step of a solve may end below this residual, and a failed one is kept as a start for the repair.
const FIRST_STEP_LIMIT: f64 = 1.0;

/// Newton steps that fail before the method gives up.
const MAX_NEWTON_FAILURES: usize = 8;

/// Relative residual of the linear system of a step from a natural residual: in proportion to it, but all that is left if one step can reach that.
fn linear_tolerance(residual: f64, wanted: f64) -> f64 {
    let enough = FINAL_STEP_TOLERANCE_SHARE * wanted / residual;
    let usual = (LINEAR_TOLERANCE_SHARE * residual).clamp(MIN_LINEAR_TOLERANCE, MAX_LINEAR_TOLERANCE);
    if enough > MIN_FINAL_LINEAR_TOLERANCE && residual < TIGHT_SOLVE_RESIDUAL { enough } else { usual }
}

/// A solve in progress.
struct NewtonSolve<'s, 'p> {
    problem: &'s Increment<'p>,
    options: SolverOptions,
    report: SolveReport,
    krylov: Gmres,
    linear: LinearModel<'p>,
    workspace: Workspace,
    /// What the solve started from.
    start: Unknowns,
}

/// Solves from the state in `it`, which holds the best one afterwards.
pub(super) fn solve(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    let report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    problem.evaluate(it);
    let linear = LinearModel { flexibility: problem.flexibility, zeros: vec![0.0; 3 * problem.n()] };
    let rolls = problem.path_points.iter().any(|end| matches!(end.reference, SlipReference::Upstream(_)));
    let workspace = Workspace::new(problem);
    let krylov = Gmres::default();
    let (options, start) = (control.options, Unknowns::from_state(it));
    let solve = NewtonSolve { problem, options, report, krylov, linear, workspace, start };
    if rolls { solve.run_rolling(it, control) } else { solve.run(it, control) }
}

impl NewtonSolve<'_, '_> {
    fn run(mut self, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        let mut trial = it.clone();
        let (mut failures, mut repair, mut near) = (0, FALLBACK_STEPS, FIRST_STEP_START_RESIDUAL);
        let (mut first, mut best, mut worse) = (true, f64::INFINITY, 0);
        let mut may_start = true;
        loop {
            let residual = self.problem.natural_residual(it);
            self.report.residual = residual;
            let iterations = self.report.iterations;
            let exhausted = iterations >= self.options.max_iterations || failures >= MAX_NEWTON_FAILURES;
            if let Some(stop) = control.stop_reason(iterations, residual, exhausted) {
                self.report.stop = stop;
                return self.report;
            }
            if residual > near && (first || failures > 0) && std::mem::take(&mut may_start) {
                if self.fall_back_to_gradient(it, RESTART_RESIDUAL, MAX_START_STEPS, control) {
                    return self.report;
                }
                continue;
            }
            self.step(it, &mut trial);
            let after = self.problem.natural_residual(&trial);
            // What the first step starts from says little: a warm start is in equilibrium but for the load.
            let bound = if first { FIRST_STEP_LIMIT } else { NONMONOTONE_FACTOR * best };
            worse = if after < best { 0 } else { worse + 1 };
            best = best.min(after);
            first = false;
            if worse <= NONMONOTONE_STEPS && after < bound {
                std::mem::swap(it, &mut trial);
                continue;
            }
            worse = 0;
            failures += 1;
            may_start = true;
            near = RESTART_RESIDUAL;
            if after < FIRST_STEP_LIMIT {
                std::mem::swap(it, &mut trial);
            }
            if self.fall_back_to_gradient(it, self.options.tolerance, repair, control) {
                return self.report;
            }
            repair *= 2;
        }
    }

    /// Barzilai-Borwein steps until the residual is below `tolerance`; whether that ended the solve.
    fn fall_back_to_gradient(
        &mut self,
        it: &mut ContactState,
        tolerance: f64,
        most: usize,
        control: &mut SolveControl,
    ) -> bool {
        let mut rest = control.rest(self.report.iterations);
        let left = rest.options.max_iterations;
        rest.options = SolverOptions { tolerance, max_iterations: most.min(left), ..rest.options };
        let report = barzilai_borwein::solve(self.problem, it, &mut rest);
        self.report.add_work_of(&report);
        self.report.residual = report.residual;
        match report.stop {
            StopReason::Converged => false,
            // Not in so few steps, but more may be left.
            StopReason::Iterations if report.iterations < left => false,
            // A loose tolerance is not enough to say that there is no equilibrium, and the way there may matter.
            StopReason::GrossSliding | StopReason::ContactLost if tolerance > self.options.tolerance => {
                self.start.restore_into(it);
                self.fall_back_to_gradient(it, self.options.tolerance, usize::MAX, control)
            }
            stop => {
                (self.report.stop, self.report.loss_of_equilibrium) = (stop, report.loss_of_equilibrium);
                true
            }
        }
    }

    /// A Newton step from `it` to `trial`.
    fn step(&mut self, it: &ContactState, trial: &mut ContactState) {
        trial.copy_unknowns(it);
        let mut tangent = NewtonSystem::new(self.problem, it, &self.linear, &mut self.workspace);
        let rhs = tangent.rhs(it);
        let mut x = vec![0.0; rhs.len()];
        let residual = self.report.residual;
        let options = KrylovOptions {
            tolerance: linear_tolerance(residual, self.options.tolerance),
            max_products: MAX_GMRES_PRODUCTS,
            restart: GMRES_RESTART,
        };
        // Without memory for the vectors, or stopped, the step is that of the cycles so far: the gradient method or the stop follows.
        let solved = self.krylov.solve(&mut tangent, &rhs, &mut x, 1, options);
        tangent.restore_prescribed_forces(&rhs, &mut x);
        tangent.advance(&x, trial);
        self.problem.evaluate(trial);
        self.report.iterations += 1;
        let n_products = solved.map_or(0, |reports| reports[0].n_products);
        self.report.applications += (n_products + 2) * self.problem.applications();
    }
}
