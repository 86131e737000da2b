//! Nonlinear block Gauss-Seidel: the tractions of one cell after the other are made right for those of all others, the
//! gaps of all cells following at once (docs/theory-contact.md).
//!
//! It needs the entries of S between the cells in reach of contact, and forms them. Under a prescribed normal force all tractions are
//! scaled to it after every sweep, and the bodies move by half of the mean gap in contact.
//!
//! # Source
//! Jourdan, Alart and Jean 1998, "A Gauss-Seidel like algorithm to solve frictional contact problems".

mod cell_problem;
mod sweeps;

use super::super::{
    ContactState, Increment, NormalControl, PathPoint, Pressures, SlipReference, TangentialControl, Unknowns,
};
use super::{SolveControl, SolveReport, StopReason};
use crate::flexibility::EntryAccess;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::linalg::memory;
use sweeps::Sweeps;

/// Cells that entries are formed between at most, and at first where nothing touches yet under a prescribed force.
const MAX_CELLS: usize = 2000;
const MAX_INITIAL_CELLS: usize = 1000;

/// Cells in reach of contact that are swept over to the tolerance if the operator has no preconditioner: their entries stay in
/// the caches of the processor.
const MAX_CACHED_CELLS: usize = 256;

/// A start ends at this natural residual, or after so many sweeps; a state below the first needs none.
const START_TOLERANCE: f64 = 2e-2;
const MAX_START_SWEEPS: usize = 50;
const WARM_START_RESIDUAL: f64 = 0.5;

/// Sweeps in which the largest change of a traction has to halve.
const MAX_SWEEPS_WITHOUT_GAIN: usize = 150;

/// Bytes of the entries between the cells in reach of contact on a frame of `n` cells, at most.
pub fn entries_bytes(n: usize) -> usize {
    CellMatrix::bytes(n.min(MAX_CELLS))
}

/// How far a solve goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum SweepGoal {
    /// To the tolerance.
    Converge,
    /// To the tolerance, if the cells are few.
    ConvergeIfFewCells,
    /// To a start for Newton's method.
    StartNewton,
}

/// Whether it is worth its while for the increment, if the choice is left to the program.
pub(super) fn is_applicable(problem: &Increment) -> bool {
    // Those on grids have better.
    problem.flexibility.grid().is_none() && inapplicable_reason(problem).is_none()
}

/// As a start where the entries need only be read: to compute them takes as long as what they replace. To the tolerance where
/// they are few, and Krylov methods have no preconditioner.
pub(super) fn is_useful_from(goal: SweepGoal, problem: &Increment, it: &mut ContactState) -> bool {
    match goal {
        SweepGoal::Converge => true,
        SweepGoal::StartNewton if problem.flexibility.entry_access() == EntryAccess::Stored => {
            problem.evaluate(it);
            problem.natural_residual(it) > WARM_START_RESIDUAL
        }
        SweepGoal::StartNewton => false,
        SweepGoal::ConvergeIfFewCells => {
            let (gap, mut tractions) = (vec![0.0; 3 * problem.n()], vec![0.0; 3 * problem.n()]);
            if problem.flexibility.precondition(&gap, &mut tractions) {
                return false;
            }
            problem.evaluate(it);
            candidate_cells(problem, it).len() <= MAX_CACHED_CELLS
        }
    }
}

/// Solves from the state in `it` as far as the goal.
pub(super) fn solve(
    goal: SweepGoal,
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
) -> SolveReport {
    if goal != SweepGoal::StartNewton {
        return sweep(problem, it, control);
    }
    let tolerance = control.options.tolerance;
    let mut start = control.rest(0);
    start.options.tolerance = START_TOLERANCE.max(tolerance);
    start.options.max_iterations = MAX_START_SWEEPS.min(start.options.max_iterations);
    let mut report = sweep(problem, it, &mut start);
    if report.stop == StopReason::Converged && report.residual > tolerance {
        report.stop = StopReason::Iterations;
    }
    SolveReport { handover_reason: report.handover_reason.or(Some("a start")), ..report }
}

fn steady(end: &PathPoint) -> bool {
    matches!(end.reference, SlipReference::Upstream(_) | SlipReference::Prescribed(_))
}

/// Why the method cannot be used for the increment.
fn inapplicable_reason(problem: &Increment) -> Option<&'static str> {
    let drawn = |end: &PathPoint| end.balance.is_some() || end.tangential != TangentialControl::Shift;
    if problem.path_points.len() > 2 {
        return Some("not for cycles of more than two ends");
    }
    if problem.path_points.iter().any(steady) {
        return Some("not for steady rolling and sliding");
    }
    if problem.pressures == Pressures::Given {
        return Some("not for given pressures");
    }
    if problem.path_points.iter().any(drawn) {
        return Some("not for prescribed tangential forces, moments and bodies that float");
    }
    if problem.path_points.iter().any(|end| matches!(end.normal, NormalControl::Force(force) if force <= 0.0))
    {
        return Some("not for forces that do not press");
    }
    (problem.flexibility.entry_access() == EntryAccess::Unavailable)
        .then_some("no entries of the flexibility")
}

/// Sweeps from the state in `it`, which holds the last one afterwards.
fn sweep(problem: &Increment, it: &mut ContactState, control: &mut SolveControl) -> SolveReport {
    problem.evaluate(it);
    let report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    let residual = problem.natural_residual(it);
    let mut report = SolveReport { residual, handover_reason: inapplicable_reason(problem), ..report };
    if report.handover_reason.is_some() {
        return report;
    }
    let start = Unknowns::from_state(it);
    let mut cells = candidate_cells(problem, it);
    loop {
        let Some(mut sweeps) = assemble_sweeps(problem, it, &cells) else {
            report.handover_reason = Some("too many cells for their entries");
            return report;
        };
        if let Some(stop) = run(&mut sweeps, it, control, &mut report) {
            report.stop = stop;
            let worse = report.residual.is_nan() || report.residual > residual;
            if worse && !matches!(stop, StopReason::Converged | StopReason::Interrupted) {
                start.restore_into(it);
                problem.evaluate(it);
                report.applications += problem.applications();
                (report.stop, report.residual) = (StopReason::Iterations, residual);
            }
            return report;
        }
        cells = union(&cells, &candidate_cells(problem, it));
    }
}

/// Sweeps until the residual meets the tolerance or why they ended; `None` where bodies overlap in other cells.
fn run(
    sweeps: &mut Sweeps,
    it: &mut ContactState,
    control: &mut SolveControl,
    report: &mut SolveReport,
) -> Option<StopReason> {
    let (problem, options) = (sweeps.problem, control.options);
    let mut goal = 0.5 * options.tolerance;
    let (mut least, mut since) = (f64::INFINITY, 0);
    loop {
        if report.iterations >= options.max_iterations || since > MAX_SWEEPS_WITHOUT_GAIN {
            sweeps.store(it);
            report.residual = problem.natural_residual(it);
            return Some(if report.residual <= options.tolerance {
                StopReason::Converged
            } else {
                StopReason::Iterations
            });
        }
        if control.is_cancelled(report.iterations, report.residual) {
            sweeps.store(it);
            report.residual = problem.natural_residual(it);
            return Some(StopReason::Interrupted);
        }
        let change = sweeps.sweep();
        report.iterations += 1;
        report.applications += problem.applications();
        report.residual = change;
        since += 1;
        if change < 0.5 * least {
            (least, since) = (change, 0);
        }
        if change > goal {
            continue;
        }
        sweeps.store(it);
        report.applications += problem.applications();
        report.residual = problem.natural_residual(it);
        if report.residual.is_nan() {
            return Some(StopReason::NotFinite);
        }
        if report.residual <= options.tolerance {
            return Some(StopReason::Converged);
        }
        if candidate_cells(problem, it).iter().any(|cell| sweeps.cells.binary_search(cell).is_err()) {
            return None;
        }
        sweeps.load(it);
        goal *= 0.5;
    }
}

/// Formed cells, ascending, that carry pressure or overlap; the closest ones where a force is prescribed and nothing touches.
fn candidate_cells(problem: &Increment, it: &ContactState) -> Vec<usize> {
    let n = problem.n();
    let unformed = problem.flexibility.unformed_cells();
    let formed: Vec<usize> = (0..n).filter(|cell| unformed.binary_search(cell).is_err()).collect();
    let normal = |end: usize, cell: usize| end * 3 * n + 2 * n + cell;
    let touches = |cell: &usize| {
        (0..problem.path_points.len()).any(|end| {
            let k = normal(end, *cell);
            it.scaled[k] > 0.0 || it.gap[k] < 0.0
        })
    };
    let pressed = |end: usize| problem.path_points[end].normal != NormalControl::Approach;
    let open = |end: usize| formed.iter().all(|&cell| it.scaled[normal(end, cell)] <= 0.0);
    let Some(end) = (0..problem.path_points.len()).find(|&end| pressed(end) && open(end)) else {
        return formed.into_iter().filter(touches).collect();
    };
    let mut cells = formed;
    cells.sort_by(|a, b| it.gap[normal(end, *a)].total_cmp(&it.gap[normal(end, *b)]));
    cells.truncate(MAX_INITIAL_CELLS);
    cells.sort_unstable();
    cells
}

fn union(a: &[usize], b: &[usize]) -> Vec<usize> {
    let mut all = [a, b].concat();
    all.sort_unstable();
    all.dedup();
    all
}

/// Sweeps over `cells` from the evaluated state `it`; `None` if their entries are too many.
fn assemble_sweeps<'s, 'p>(
    problem: &'s Increment<'p>,
    it: &ContactState,
    cells: &[usize],
) -> Option<Sweeps<'s, 'p>> {
    if cells.len() > MAX_CELLS || memory::ensure(CellMatrix::bytes(cells.len()) as u128, "", "").is_err() {
        return None;
    }
    let mut matrix = CellMatrix::zeros(cells.len()).ok()?;
    problem.flexibility.add_entries(cells, &mut matrix);
    Some(Sweeps::new(problem, it, cells.to_vec(), matrix))
}
