//! Semismooth Newton method of Alart and Curnier for contact and friction (docs/theory-contact.md). A preconditioned Krylov method
//! solves the linear systems on the cells in contact.
//!
//! The augmented variables p - c_n g_n and q̂ - c_t Δĝ_t decide whether a cell is open, sticks or slips. g_n is the normal gap, Δĝ_t
//! the scaled slip; c_n and c_t are local stiffnesses. The equations of these cell states give the step; they are linear except for
//! the direction of slip. Far from the solution the states alternate. Projected Barzilai-Borwein steps therefore precede the first
//! Newton step if the residual is large, and follow failed Newton steps. Systems of meshed bodies are factorised after a failure.
//!
//! # Source
//! Alart and Curnier 1991, "A mixed formulation for frictional contact problems prone to Newton like solution methods". Hüeber,
//! Stadler and Wohlmuth 2008: the bound β <= 1 on the factor of the radial return.

mod factorised_systems;
mod preconditioner;
mod rolling;
mod system_matrix;
mod tangent;
mod unknowns;

use super::super::{ContactState, Increment, SlipReference, Unknowns};
use super::barzilai_borwein;
use super::control::{PartSolver, SolveControl, SolverOptions};
use super::report::{SolveReport, StopReason};
use crate::linalg::gmres::{Gmres, KrylovOptions, KrylovReport};
use tangent::{LinearModel, NewtonSystem, Workspace};

/// Largest natural residual from which the first Newton step of a solve begins.
const FIRST_STEP_START_RESIDUAL: f64 = 0.5;
/// Largest natural residual from which Newton steps begin after a failed step or after Barzilai-Borwein steps at the start.
const RESTART_RESIDUAL: f64 = 2e-2;

/// Largest number of Barzilai-Borwein steps before a Newton step is tried regardless of the residual.
const MAX_START_STEPS: usize = 1000;

/// Largest number of Barzilai-Borwein steps after the first failed Newton step. The number doubles after each further failure.
const FALLBACK_STEPS: usize = 15;

/// Number of Krylov vectors between restarts.
const GMRES_RESTART: usize = 40;
/// Largest number of operator products in the solution of one linear system.
const MAX_GMRES_PRODUCTS: usize = 120;

/// Largest relative residual of a linear system.
const MAX_LINEAR_TOLERANCE: f64 = 0.05;
/// Smallest relative residual of a linear system, except in a last step ([`FINAL_STEP_TOLERANCE_SHARE`]).
const MIN_LINEAR_TOLERANCE: f64 = 1e-3;
/// Ratio of the relative residual of a linear system to the natural residual, where neither bound applies.
const LINEAR_TOLERANCE_SHARE: f64 = 0.1;

/// Ratio of the linear residual in the last Newton step to the tolerance of the natural residual.
const FINAL_STEP_TOLERANCE_SHARE: f64 = 0.3;
/// Smallest relative linear residual for which [`FINAL_STEP_TOLERANCE_SHARE`] is used.
const MIN_FINAL_LINEAR_TOLERANCE: f64 = 1e-6;

/// Largest relative residual of a factorised linear system.
const FACTORISED_LINEAR_TOLERANCE: f64 = 1e-9;

/// Natural residual below which most cells no longer change their state.
const TIGHT_SOLVE_RESIDUAL: f64 = 1e-3;

/// Largest number of consecutive Newton steps without a new best residual. Cells may change state in a step and raise the residual.
const NONMONOTONE_STEPS: usize = 1;
/// Bound on the residual of a step without a new best residual, relative to the best residual.
const NONMONOTONE_FACTOR: f64 = 3.0;

/// Number of steps with iterative solutions of the linear systems, after which systems of meshed bodies are factorised. A failed
/// step may cause this earlier ([`factorised_systems::follow_failure`]).
const MAX_ITERATIVE_STEPS: usize = 10;

/// Largest number of consecutive exact steps without a new best residual. Cells may change state for several steps before the
/// residual falls to rounding.
const EXACT_STEPS_WITHOUT_GAIN: usize = 10;

/// Bound on the residual after the first step of a solve; with a larger residual the step fails. A failed step with a residual
/// below this bound is the start of the Barzilai-Borwein steps.
const FIRST_STEP_LIMIT: f64 = 1.0;

/// Number of failed Newton steps after which the method ends.
const MAX_NEWTON_FAILURES: usize = 8;

/// Relative residual of the linear system, for a step that starts at the natural residual `residual`. It is proportional to
/// `residual`, within bounds. If one step can reach the tolerance `wanted`, the linear residual is small enough for that.
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
    /// Whether linear systems are factorised.
    factorise: bool,
    /// Unknowns at the start of the solve.
    start: Unknowns,
}

/// Solves from the state in `it`. Afterwards `it` contains the last state; in steady rolling, the best state.
///
/// `frictionless_solver` computes the pressures from which steady rolling with friction starts.
pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    frictionless_solver: PartSolver,
) -> SolveReport {
    let report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    problem.evaluate(it);
    let linear = LinearModel { flexibility: problem.flexibility, zeros: vec![0.0; 3 * problem.n()] };
    let rolls = problem.path_points.iter().any(|end| matches!(end.reference, SlipReference::Upstream(_)));
    let workspace = Workspace::new(problem);
    let krylov = Gmres::default();
    let (options, start) = (control.options, Unknowns::from_state(it));
    let factorise = false;
    let solve = NewtonSolve { problem, options, report, krylov, linear, workspace, factorise, start };
    if rolls { solve.run_rolling(it, control, frictionless_solver) } else { solve.run(it, control) }
}

/// Judges the steps of a solve by their natural residuals.
#[derive(Clone, Copy)]
struct Progress {
    /// Whether no step was taken.
    first: bool,
    best: f64,
    /// Number of consecutive steps without a new best residual.
    worse: usize,
}

impl Progress {
    /// Returns whether a step to the residual `after` is accepted.
    fn accepts(&mut self, after: f64, exact: bool) -> bool {
        // The residual of a warm start reflects only the change of load and does not bound the residual of the first step.
        let (most, bound) = match (exact, self.first) {
            (true, _) => (EXACT_STEPS_WITHOUT_GAIN, f64::INFINITY),
            (false, true) => (NONMONOTONE_STEPS, FIRST_STEP_LIMIT),
            (false, false) => (NONMONOTONE_STEPS, NONMONOTONE_FACTOR * self.best),
        };
        self.worse = if after < self.best { 0 } else { self.worse + 1 };
        self.best = self.best.min(after);
        self.first = false;
        self.worse <= most && after < bound
    }
}

impl NewtonSolve<'_, '_> {
    fn run(mut self, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
        let mut trial = it.clone();
        let (mut failures, mut repair, mut near) = (0, FALLBACK_STEPS, FIRST_STEP_START_RESIDUAL);
        let mut progress = Progress { first: true, best: f64::INFINITY, worse: 0 };
        // State before the first exact step since the last failure.
        let mut kept: Option<Unknowns> = None;
        let (mut may_start, mut steps) = (true, 0);
        loop {
            let residual = self.problem.natural_residual(it);
            self.report.residual = residual;
            let iterations = self.report.iterations;
            let exhausted = iterations >= self.options.max_iterations || failures >= MAX_NEWTON_FAILURES;
            if let Some(stop) = control.stop_reason(iterations, residual, exhausted) {
                if self.factorise && stop != StopReason::Converged {
                    it.project_to_cone();
                    self.problem.evaluate(it);
                    self.report.applications += self.problem.applications();
                    self.report.residual = self.problem.natural_residual(it);
                }
                self.report.stop = stop;
                return self.report;
            }
            if residual > near && (progress.first || failures > 0) && std::mem::take(&mut may_start) {
                if self.fall_back_to_gradient(it, RESTART_RESIDUAL, MAX_START_STEPS, control) {
                    return self.report;
                }
                continue;
            }
            steps += 1;
            self.factorise |= steps > MAX_ITERATIVE_STEPS && factorised_systems::are_applicable(self.problem);
            let exact = self.step(it, &mut trial);
            let mut after = self.problem.natural_residual(&trial);
            if exact {
                kept.get_or_insert_with(|| Unknowns::from_state(it));
                after = self.project_solution(&mut trial, after);
            }
            let before = progress;
            if progress.accepts(after, exact) {
                std::mem::swap(it, &mut trial);
                continue;
            }
            if !self.factorise && factorised_systems::follow_failure(self.problem, failures) {
                // Without factors, the same step fails again.
                (self.factorise, progress) = (true, before);
                continue;
            }
            progress.worse = 0;
            failures += 1;
            (may_start, near) = (true, RESTART_RESIDUAL);
            if let Some(kept) = kept.take() {
                kept.restore_into(it);
                progress.best = f64::INFINITY;
            } else if after < FIRST_STEP_LIMIT {
                std::mem::swap(it, &mut trial);
            }
            if self.fall_back_to_gradient(it, self.options.tolerance, repair, control) {
                return self.report;
            }
            repair *= 2;
        }
    }

    /// Projects the tractions of an exact step if its residual `after` meets the tolerance. Returns the residual.
    fn project_solution(&mut self, trial: &mut ContactState, after: f64) -> f64 {
        if after.is_nan() || after > self.options.tolerance {
            return after;
        }
        trial.project_to_cone();
        self.problem.evaluate(trial);
        self.report.applications += self.problem.applications();
        self.problem.natural_residual(trial)
    }

    /// Takes Barzilai-Borwein steps until the residual meets `tolerance`: at most `most` steps, unless equilibrium seems lost.
    /// Returns whether the solve has ended.
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
            // The step limit was reached, but the solve has iterations left.
            StopReason::Iterations if report.iterations < left => false,
            // A loose tolerance does not prove that equilibrium is lost, and the result may depend on the iterates. Repeat from the
            // start with the full tolerance.
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

    /// Takes a Newton step from `it` to `trial`. Returns whether it is exact: by factors of the linear system, without a projection of
    /// the tractions.
    fn step(&mut self, it: &ContactState, trial: &mut ContactState) -> bool {
        trial.copy_unknowns(it);
        let mut tangent = NewtonSystem::new(self.problem, it, &self.linear, &mut self.workspace);
        if self.factorise {
            tangent.factorise();
        }
        let rhs = tangent.rhs(it);
        let mut x = vec![0.0; rhs.len()];
        let residual = self.report.residual;
        let tolerance = if tangent.is_factorised() {
            FACTORISED_LINEAR_TOLERANCE
        } else {
            linear_tolerance(residual, self.options.tolerance)
        };
        let options = KrylovOptions { tolerance, max_products: MAX_GMRES_PRODUCTS, restart: GMRES_RESTART };
        // If GMRES has no memory for its vectors or is cancelled, the step uses the result of the last completed restart. It fails, or
        // the solve ends.
        let solved = self.krylov.solve(&mut tangent, &rhs, &mut x, 1, options);
        let report =
            solved.map_or(KrylovReport { n_products: 0, residual: f64::INFINITY }, |reports| reports[0]);
        let exact = tangent.is_factorised() && report.residual <= tolerance;
        tangent.restore_prescribed_forces(&rhs, &mut x);
        tangent.advance(&x, trial);
        if !exact {
            trial.project_to_cone();
        }
        self.problem.evaluate(trial);
        self.report.iterations += 1;
        self.report.applications += (report.n_products + 2) * self.problem.applications();
        exact
    }
}
