//! Nonlinear block Gauss-Seidel: the tractions of one cell after the other are made right for those of all others, the
//! gaps of all cells following at once (docs/theory-contact.md).
//!
//! It needs the entries of S between the cells in reach of contact, and forms them. Under a prescribed normal force all tractions are
//! scaled to it after every sweep, and the bodies move by half of the mean gap in contact.
//!
//! # Source
//! Jourdan, Alart and Jean 1998, "A Gauss-Seidel like algorithm to solve frictional contact problems".

mod local;
mod sweeps;

use super::super::{
    End, Increment, Iterate, NormalControl, Pressures, SlipReference, TangentialControl, Unknowns,
};
use super::{SolveReport, Solver, SolverOptions, Stop, Watch};
use crate::linalg::cell_matrix::CellMatrix;
use crate::linalg::memory;
use crate::linalg::operator::Entries;
use sweeps::Sweeps;

/// Cells that entries are formed between at most, and at first where nothing touches yet under a prescribed force.
const MOST: usize = 2000;
const NEAREST: usize = 1000;

/// Cells in reach of contact that are swept over to the tolerance if the operator has no preconditioner: their entries stay in
/// the caches of the processor.
const CACHED: usize = 256;

/// A start ends at this natural residual, or after so many sweeps; a state below the first needs none.
const NEAR: f64 = 2e-2;
const STARTING: usize = 50;
const WARM: f64 = 0.5;

/// Sweeps in which the largest change of a traction has to halve.
const PATIENCE: usize = 150;

/// Bytes of the entries between the cells in reach of contact on a frame of `n` cells, at most.
pub fn entries_bytes(n: usize) -> usize {
    CellMatrix::bytes(n.min(MOST))
}

/// How far a solve goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Aim {
    /// To the tolerance.
    Tolerance,
    /// To the tolerance, if the cells are few.
    Few,
    /// To a start for Newton's method.
    Start,
}

/// The method.
pub(super) struct GaussSeidel {
    pub aim: Aim,
}

impl Solver for GaussSeidel {
    fn name(&self) -> &'static str {
        "gauss-seidel"
    }

    fn suits(&self, problem: &Increment) -> bool {
        // Those on grids have better.
        problem.flexibility.grid().is_none() && refusal(problem).is_none()
    }

    /// As a start where the entries need only be read: to compute them takes as long as what they replace. To the tolerance where
    /// they are few, and Krylov methods have no preconditioner.
    fn begins(&self, problem: &Increment, it: &mut Iterate) -> bool {
        match self.aim {
            Aim::Tolerance => true,
            Aim::Start if problem.flexibility.entries() == Entries::Stored => {
                problem.evaluate(it);
                problem.natural_residual(it) > WARM
            }
            Aim::Start => false,
            Aim::Few => {
                let (gap, mut tractions) = (vec![0.0; 3 * problem.n()], vec![0.0; 3 * problem.n()]);
                if problem.flexibility.precondition(&gap, &mut tractions) {
                    return false;
                }
                problem.evaluate(it);
                in_reach(problem, it).len() <= CACHED
            }
        }
    }

    fn solve(
        &self,
        problem: &Increment,
        it: &mut Iterate,
        options: &SolverOptions,
        watch: &mut Watch,
    ) -> SolveReport {
        if self.aim != Aim::Start {
            return solve(problem, it, options, watch);
        }
        let start = SolverOptions {
            tolerance: NEAR.max(options.tolerance),
            max_iterations: STARTING.min(options.max_iterations),
            ..*options
        };
        let mut report = solve(problem, it, &start, watch);
        if report.stop == Stop::Converged && report.residual > options.tolerance {
            report.stop = Stop::Iterations;
        }
        SolveReport { left: report.left.or(Some("a start")), ..report }
    }
}

fn steady(end: &End) -> bool {
    matches!(end.reference, SlipReference::Upstream(_) | SlipReference::Given(_))
}

/// Why the method cannot be used for the increment.
fn refusal(problem: &Increment) -> Option<&'static str> {
    let drawn = |end: &End| end.balance.is_some() || end.tangential != TangentialControl::Shift;
    if problem.ends.len() > 2 {
        return Some("not for cycles of more than two ends");
    }
    if problem.ends.iter().any(steady) {
        return Some("not for steady rolling and sliding");
    }
    if problem.pressures == Pressures::Given {
        return Some("not for given pressures");
    }
    if problem.ends.iter().any(drawn) {
        return Some("not for prescribed tangential forces, moments and bodies that float");
    }
    if problem.ends.iter().any(|end| matches!(end.normal, NormalControl::Force(force) if force <= 0.0)) {
        return Some("not for forces that do not press");
    }
    (problem.flexibility.entries() == Entries::None).then_some("no entries of the flexibility")
}

/// Solves from the state in `it`, which holds the last one afterwards.
fn solve(problem: &Increment, it: &mut Iterate, options: &SolverOptions, watch: &mut Watch) -> SolveReport {
    problem.evaluate(it);
    let report = SolveReport { applications: problem.applications(), ..SolveReport::default() };
    let residual = problem.natural_residual(it);
    let mut report = SolveReport { residual, left: refusal(problem), ..report };
    if report.left.is_some() {
        return report;
    }
    let start = Unknowns::of(it);
    let mut cells = in_reach(problem, it);
    loop {
        let Some(mut sweeps) = formed(problem, it, &cells) else {
            report.left = Some("too many cells for their entries");
            return report;
        };
        if let Some(stop) = run(&mut sweeps, it, options, (watch, &mut report)) {
            report.stop = stop;
            let worse = report.residual.is_nan() || report.residual > residual;
            if worse && !matches!(stop, Stop::Converged | Stop::Interrupted) {
                start.put(it);
                problem.evaluate(it);
                report.applications += problem.applications();
                (report.stop, report.residual) = (Stop::Iterations, residual);
            }
            return report;
        }
        cells = union(&cells, &in_reach(problem, it));
    }
}

/// Sweeps until the residual meets the tolerance or why they ended; `None` where bodies overlap in other cells.
fn run(
    sweeps: &mut Sweeps,
    it: &mut Iterate,
    options: &SolverOptions,
    (watch, report): (&mut Watch, &mut SolveReport),
) -> Option<Stop> {
    let problem = sweeps.problem;
    let mut goal = 0.5 * options.tolerance;
    let (mut least, mut since) = (f64::INFINITY, 0);
    loop {
        if report.iterations >= options.max_iterations || since > PATIENCE {
            sweeps.give(it);
            report.residual = problem.natural_residual(it);
            return Some(if report.residual <= options.tolerance {
                Stop::Converged
            } else {
                Stop::Iterations
            });
        }
        if watch(report.iterations, report.residual) {
            sweeps.give(it);
            report.residual = problem.natural_residual(it);
            return Some(Stop::Interrupted);
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
        sweeps.give(it);
        report.applications += problem.applications();
        report.residual = problem.natural_residual(it);
        if report.residual.is_nan() {
            return Some(Stop::NotFinite);
        }
        if report.residual <= options.tolerance {
            return Some(Stop::Converged);
        }
        if in_reach(problem, it).iter().any(|cell| sweeps.cells.binary_search(cell).is_err()) {
            return None;
        }
        sweeps.take(it);
        goal *= 0.5;
    }
}

/// Formed cells, ascending, that carry pressure or overlap; the closest ones where a force is prescribed and nothing touches.
fn in_reach(problem: &Increment, it: &Iterate) -> Vec<usize> {
    let n = problem.n();
    let unformed = problem.flexibility.unformed();
    let formed: Vec<usize> = (0..n).filter(|cell| unformed.binary_search(cell).is_err()).collect();
    let normal = |end: usize, cell: usize| end * 3 * n + 2 * n + cell;
    let touches = |cell: &usize| {
        (0..problem.ends.len()).any(|end| {
            let k = normal(end, *cell);
            it.hatted[k] > 0.0 || it.gap[k] < 0.0
        })
    };
    let pressed = |end: usize| problem.ends[end].normal != NormalControl::Approach;
    let open = |end: usize| formed.iter().all(|&cell| it.hatted[normal(end, cell)] <= 0.0);
    let Some(end) = (0..problem.ends.len()).find(|&end| pressed(end) && open(end)) else {
        return formed.into_iter().filter(touches).collect();
    };
    let mut cells = formed;
    cells.sort_by(|a, b| it.gap[normal(end, *a)].total_cmp(&it.gap[normal(end, *b)]));
    cells.truncate(NEAREST);
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
fn formed<'s, 'p>(problem: &'s Increment<'p>, it: &Iterate, cells: &[usize]) -> Option<Sweeps<'s, 'p>> {
    if cells.len() > MOST || memory::ensure(CellMatrix::bytes(cells.len()) as u128, "", "").is_err() {
        return None;
    }
    let mut matrix = CellMatrix::zeros(cells.len()).ok()?;
    problem.flexibility.add_entries(cells, &mut matrix);
    Some(Sweeps::new(problem, it, cells.to_vec(), matrix))
}
