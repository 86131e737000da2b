//! Semismooth Newton method of Alart and Curnier for contact and friction (docs/theory-contact.md). A preconditioned Krylov method
//! solves the linear systems on the cells in contact.
//!
//! The augmented variables p - c_n g_n and q̂ - c_t Δĝ_t decide whether a cell is open, sticks or slips. g_n is the
//! normal gap and Δĝ_t the scaled slip. c_n and c_t are local stiffnesses. The equations of these cell states give the
//! step. They are linear except for the direction of slip.
//!
//! Far from the solution the states alternate. Projected Barzilai-Borwein steps therefore precede the first Newton step
//! if the residual is large, and follow failed Newton steps. Systems of meshed bodies are factorised after a failure.
//! Large systems are factorised by patches of cells. After two failed steps, a continuation changes gaps and loads
//! gradually from the start, and factorised steps are shortened.
//!
//! # Source
//! Alart and Curnier 1991, "A mixed formulation for frictional contact problems prone to Newton like solution methods". Hüeber,
//! Stadler and Wohlmuth 2008: the bound β <= 1 on the factor of the radial return.

mod continuation;
mod factorised_systems;
mod gross_sliding;
mod patches;
mod preconditioner;
mod rolling;
mod system_matrix;
mod tangent;
mod unknowns;

use super::super::residual::largest_pressure;
use super::super::{ContactState, Increment, SlipReference, Unknowns};
use super::barzilai_borwein;
use super::control::{PartSolver, SolveControl, SolverOptions};
use super::report::{SolveReport, StopReason};
use crate::linalg::gmres::{Gmres, KrylovOptions, KrylovReport};
use gross_sliding::Verdict;
use tangent::{LinearModel, NewtonSystem, Workspace};

/// Largest natural residual at which the first Newton step of a solve begins.
const FIRST_STEP_START_RESIDUAL: f64 = 0.5;
/// Largest natural residual at which Newton steps begin after a failed step or after Barzilai-Borwein steps at the
/// start.
const RESTART_RESIDUAL: f64 = 2e-2;

/// Largest number of Barzilai-Borwein steps before a Newton step is tried regardless of the residual.
const MAX_START_STEPS: usize = 1000;

/// Largest number of Barzilai-Borwein steps after the first failed Newton step. The number doubles after each further failure.
const FALLBACK_STEPS: usize = 15;

/// Number of Krylov vectors between restarts. On large systems of meshed bodies GMRES does not restart, because errors
/// of long wavelength do not converge across restarts.
const GMRES_RESTART: usize = 40;
/// Largest number of operator products in the solution of one linear system.
const MAX_GMRES_PRODUCTS: usize = 120;

/// Largest relative residual of a linear system.
const MAX_LINEAR_TOLERANCE: f64 = 0.05;
/// Smallest relative residual of a linear system, except in a last step ([`FINAL_STEP_TOLERANCE_SHARE`]).
const MIN_LINEAR_TOLERANCE: f64 = 1e-3;
/// Ratio of the relative residual of a linear system to the natural residual, between both bounds.
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

/// Number of Newton steps and restarts by Barzilai-Borwein steps after which systems of meshed bodies are factorised. A
/// failed step may start the factorisation earlier ([`factorised_systems::follow_failure`]).
const MAX_ITERATIVE_STEPS: usize = 10;

/// Largest number of consecutive exact steps without a new best residual. Cells may change state for several steps before the
/// residual falls to rounding.
const EXACT_STEPS_WITHOUT_GAIN: usize = 10;

/// Least decrease of the mean residual in a damped step, relative to the decrease that the linear equations predict.
const SUFFICIENT_GAIN: f64 = 0.1;

/// Smallest tried length of a damped step, as a share of the Newton step.
const MIN_STEP_LENGTH: f64 = 1e-4;

/// Limit of the residual after the first step of a solve. A larger residual means that the step fails. If a failed step
/// ends below this limit, the Barzilai-Borwein steps start from its result.
const FIRST_STEP_LIMIT: f64 = 1.0;

/// Number of failed Newton steps after which the method ends.
const MAX_NEWTON_FAILURES: usize = 8;

/// Relative residual of the linear system, for a step that starts at the natural residual `residual`. It is
/// proportional to `residual`, within bounds. If one step can reach the tolerance `wanted`, the linear residual is
/// small enough for this tolerance.
fn linear_tolerance(residual: f64, wanted: f64) -> f64 {
    let enough = FINAL_STEP_TOLERANCE_SHARE * wanted / residual;
    let usual = (LINEAR_TOLERANCE_SHARE * residual).clamp(MIN_LINEAR_TOLERANCE, MAX_LINEAR_TOLERANCE);
    if enough > MIN_FINAL_LINEAR_TOLERANCE && residual < TIGHT_SOLVE_RESIDUAL { enough } else { usual }
}

/// Data of a solve in progress.
struct NewtonSolve<'s, 'p> {
    problem: &'s Increment<'p>,
    options: SolverOptions,
    report: SolveReport,
    krylov: Gmres,
    linear: LinearModel<'p>,
    workspace: Workspace,
    /// Whether linear systems are factorised.
    factorise: bool,
    /// Whether the last system was too large to be factorised.
    too_large: bool,
    part_solver: PartSolver,
    /// Whether friction is known to carry the prescribed loads.
    carried: bool,
    /// Whether the test for gross sliding under a balance was made.
    tested: bool,
    /// Whether the continuation was tried.
    continued: bool,
    /// Unknowns at the start of the solve.
    start: Unknowns,
    /// Unknowns of the state with the smallest residual.
    best: Unknowns,
    best_residual: f64,
}

/// Solves from the state in `it`. Afterwards `it` contains the solution, the state of lost equilibrium, or the best
/// state.
///
/// `part_solver` computes the pressures in gross sliding, and the pressures from which steady rolling with friction
/// starts.
pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    part_solver: PartSolver,
) -> SolveReport {
    let report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    problem.evaluate(it);
    let linear = LinearModel { flexibility: problem.flexibility, zeros: vec![0.0; 3 * problem.n()] };
    let rolls = problem.path_points.iter().any(|end| matches!(end.reference, SlipReference::Upstream(_)));
    let workspace = Workspace::new(problem);
    let krylov = Gmres::default();
    let (options, start) = (control.options, Unknowns::from_state(it));
    let (factorise, too_large, carried, tested, continued) = (false, false, false, false, false);
    let (best, best_residual) = (start.clone(), f64::INFINITY);
    let solve = NewtonSolve {
        problem,
        options,
        report,
        krylov,
        linear,
        workspace,
        factorise,
        too_large,
        part_solver,
        carried,
        tested,
        continued,
        start,
        best,
        best_residual,
    };
    if rolls { solve.run_rolling(it, control) } else { solve.run(it, control) }
}

/// Decides by natural residuals whether steps of a solve are accepted.
#[derive(Clone, Copy)]
struct Progress {
    /// Whether no step has been taken yet.
    first: bool,
    best: f64,
    /// Number of consecutive steps without a new best residual.
    worse: usize,
}

impl Progress {
    /// Returns whether a step to the residual `after` is accepted. `exact` is the result of [`NewtonSolve::step`].
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
        if gross_sliding::is_certain(self.problem) && self.slides(it, control) == Some(true) {
            return self.report;
        }
        let mut trial = it.clone();
        let (mut failures, mut near) = (0, FIRST_STEP_START_RESIDUAL);
        let mut progress = Progress { first: true, best: f64::INFINITY, worse: 0 };
        // State before the first exact step since the last failure.
        let mut kept: Option<Unknowns> = None;
        let (mut may_start, mut admissible) = (true, true);
        for steps in 1.. {
            let residual = self.problem.natural_residual(it);
            self.report.residual = residual;
            if admissible {
                self.keep_best(it);
            }
            let iterations = self.report.iterations;
            let exhausted = iterations >= self.options.max_iterations || failures >= MAX_NEWTON_FAILURES;
            if let Some(stop) = control.stop_reason(iterations, residual, exhausted) {
                self.end(it, stop);
                break;
            }
            if residual > near && (progress.first || failures > 0) && std::mem::take(&mut may_start) {
                if self.fall_back_to_gradient(it, RESTART_RESIDUAL, MAX_START_STEPS, control) {
                    break;
                }
                continue;
            }
            self.factorise |= steps > MAX_ITERATIVE_STEPS && factorised_systems::are_applicable(self.problem);
            let exact = self.step(self.problem, it, &mut trial);
            let mut after = self.problem.natural_residual(&trial);
            if exact {
                kept.get_or_insert_with(|| Unknowns::from_state(it));
                after = self.finish_exact_step(it, &mut trial, after, failures > 1);
            }
            let before = progress;
            if progress.accepts(after, exact) {
                admissible = !exact;
                std::mem::swap(it, &mut trial);
                continue;
            }
            let may_factorise = !self.factorise && !self.too_large;
            if may_factorise && factorised_systems::follow_failure(self.problem, failures) {
                // Repeat the step with factors, because it would fail again without them.
                (self.factorise, progress) = (true, before);
                continue;
            }
            (progress.worse, admissible) = (0, true);
            failures += 1;
            (may_start, near) = (true, RESTART_RESIDUAL);
            if let Some(kept) = kept.take() {
                kept.restore_into(it);
                progress.best = f64::INFINITY;
            } else if after < FIRST_STEP_LIMIT {
                std::mem::swap(it, &mut trial);
            }
            if self.recover(it, failures, control) {
                break;
            }
        }
        self.report
    }

    /// Continues after `failures` failed steps. Returns whether the solve has ended.
    fn recover(&mut self, it: &mut ContactState, failures: usize, control: &mut SolveControl) -> bool {
        if failures == 2 {
            if self.slides(it, control) == Some(true) {
                return true;
            }
            if self.solve_by_continuation(it, control) {
                return false;
            }
        }
        let most = FALLBACK_STEPS << (failures - 1);
        self.fall_back_to_gradient(it, self.options.tolerance, most, control)
    }

    /// Stores the state `it` if its residual is the smallest of the solve.
    fn keep_best(&mut self, it: &ContactState) {
        if self.report.residual < self.best_residual {
            self.best.copy_from(it);
            self.best_residual = self.report.residual;
        }
    }

    /// Ends the solve for the reason `stop`, with the best state unless `it` is the solution.
    fn end(&mut self, it: &mut ContactState, stop: StopReason) {
        if stop != StopReason::Converged {
            self.best.restore_into(it);
            self.report.residual = self.project(self.problem, it);
        }
        self.report.stop = stop;
    }

    fn has_balance(&self) -> bool {
        self.problem.path_points.iter().any(|point| point.balance.is_some())
    }

    /// Returns whether the prescribed loads make the bodies slide; `None` if this is unknown. If the bodies slide, the
    /// report contains the loss of equilibrium, and `it` is the state in sliding. Under a balance, the test begins at
    /// the start of the solve and runs once.
    fn slides(&mut self, it: &mut ContactState, control: &mut SolveControl) -> Option<bool> {
        if self.carried {
            return Some(false);
        }
        let balanced = self.has_balance();
        if balanced && std::mem::replace(&mut self.tested, true) {
            return None;
        }
        let kept = balanced.then(|| Unknowns::from_state(it));
        if balanced {
            self.start.restore_into(it);
        }
        let verdict = gross_sliding::test(self.problem, it, control, self.part_solver, &mut self.report);
        if let Verdict::Slides(loss) = verdict {
            for (motion, start) in it.rigid_motion.iter_mut().zip(&self.start.rigid_motion) {
                (motion[0], motion[1]) = (start[0], start[1]);
            }
            self.problem.evaluate(it);
            self.report.applications += self.problem.applications();
            self.report.residual = self.problem.natural_residual(it);
            (self.report.stop, self.report.loss_of_equilibrium) = (StopReason::GrossSliding, Some(loss));
            return Some(true);
        }
        if let Some(kept) = kept {
            kept.restore_into(it);
        }
        self.carried = matches!(verdict, Verdict::Carried);
        self.carried.then_some(false)
    }

    /// Completes an exact step from `it` to `trial`, whose residual is `after`. Projects the tractions of a solution,
    /// and shortens a step if `damped` is set. Returns the residual, which is infinite if no step length reduces the
    /// mean residual.
    fn finish_exact_step(
        &mut self,
        it: &ContactState,
        trial: &mut ContactState,
        after: f64,
        damped: bool,
    ) -> f64 {
        if after <= self.options.tolerance {
            return self.project(self.problem, trial);
        }
        if !damped {
            return after;
        }
        let p_max = largest_pressure(it, self.problem.n());
        let before = self.problem.mean_residual(it, p_max);
        let mut length = 1.0;
        while length >= MIN_STEP_LENGTH {
            if self.problem.mean_residual(trial, p_max) <= (1.0 - SUFFICIENT_GAIN * length) * before {
                return self.problem.natural_residual(trial);
            }
            trial.halve_step(it);
            length *= 0.5;
            self.problem.evaluate(trial);
            self.report.applications += self.problem.applications();
        }
        f64::INFINITY
    }

    /// Projects the tractions onto the admissible set. Returns the residual.
    fn project(&mut self, problem: &Increment, it: &mut ContactState) -> f64 {
        it.project_to_cone();
        problem.evaluate(it);
        self.report.applications += problem.applications();
        problem.natural_residual(it)
    }

    /// Takes at most `most` Barzilai-Borwein steps until the residual meets `tolerance`. A reported loss of equilibrium
    /// is checked and may cause further steps. Returns whether the solve has ended.
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
            StopReason::GrossSliding | StopReason::ContactLost => {
                self.check_loss(it, &report, tolerance, control)
            }
            StopReason::Iterations | StopReason::Interrupted => {
                self.keep_best(it);
                self.end(it, report.stop);
                true
            }
            StopReason::NotFinite | StopReason::StickZoneNotConverged => {
                self.report.stop = report.stop;
                true
            }
        }
    }

    /// Continues after Barzilai-Borwein steps that report a loss of equilibrium at the tolerance `tolerance`. With a
    /// loose tolerance or a balance, the report is no proof, because it may depend on the iterates. Returns whether the
    /// solve has ended.
    fn check_loss(
        &mut self,
        it: &mut ContactState,
        loss: &SolveReport,
        tolerance: f64,
        control: &mut SolveControl,
    ) -> bool {
        let full = tolerance <= self.options.tolerance;
        if !full {
            self.start.restore_into(it);
            self.problem.evaluate(it);
        }
        if !full || self.has_balance() {
            if self.slides(it, control) == Some(true) {
                return true;
            }
            self.factorise |= factorised_systems::are_applicable(self.problem);
            if self.solve_by_continuation(it, control) {
                return false;
            }
        }
        if self.carried {
            if self.has_balance() {
                // The state without equilibrium is far from the solution, so that the solve starts again.
                self.start.restore_into(it);
                self.problem.evaluate(it);
            }
            return false;
        }
        if !full {
            return self.fall_back_to_gradient(it, self.options.tolerance, usize::MAX, control);
        }
        if control.is_cancelled(self.report.iterations, self.best_residual) {
            self.end(it, StopReason::Interrupted);
            return true;
        }
        (self.report.stop, self.report.loss_of_equilibrium) = (loss.stop, loss.loss_of_equilibrium);
        self.report.residual = loss.residual;
        true
    }

    /// Takes a Newton step of `problem` from `it` to `trial`. Returns whether the step is exact: factors solved the
    /// linear system, and the tractions are not projected.
    fn step(&mut self, problem: &Increment, it: &ContactState, trial: &mut ContactState) -> bool {
        trial.copy_unknowns(it);
        let mut tangent = NewtonSystem::new(problem, it, &self.linear, &mut self.workspace);
        if self.factorise {
            tangent.factorise();
        }
        tangent.factorise_patches();
        self.too_large = tangent.is_large();
        let rhs = tangent.rhs(it);
        let mut x = vec![0.0; rhs.len()];
        let residual = self.report.residual;
        let tolerance = if tangent.is_factorised() {
            FACTORISED_LINEAR_TOLERANCE
        } else {
            linear_tolerance(residual, self.options.tolerance)
        };
        let restart = if tangent.patches.is_empty() { GMRES_RESTART } else { MAX_GMRES_PRODUCTS };
        let options = KrylovOptions { tolerance, max_products: MAX_GMRES_PRODUCTS, restart };
        // If GMRES has no memory for its vectors or is cancelled, the step uses the result of the last completed
        // restart. The step then fails, or the cancellation ends the solve.
        let solved = self.krylov.solve(&mut tangent, &rhs, &mut x, 1, options);
        let report =
            solved.map_or(KrylovReport { n_products: 0, residual: f64::INFINITY }, |reports| reports[0]);
        let exact = tangent.is_factorised() && report.residual <= tolerance;
        tangent.restore_prescribed_forces(&rhs, &mut x);
        tangent.advance(&x, trial);
        if !exact {
            trial.project_to_cone();
        }
        problem.evaluate(trial);
        self.report.iterations += 1;
        self.report.applications += (report.n_products + 2) * problem.applications();
        exact
    }
}
