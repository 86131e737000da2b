//! Solves from coarse to fine cells, and on windows of the grid frame around the contact.
//!
//! A cold start is solved on coarse cells first. Ever finer cells follow, over the contact rectangle of the coarser solution. A
//! warm start is solved over the rectangle of the previous contact. If the warm start is far from the solution, coarse cells come
//! first. If bodies overlap outside the window, the window grows.

mod tangential;

use super::super::window::{Window, WindowOperator, WindowProblem};
use super::super::{ContactState, Increment, Pressures, SlipReference, Unknowns};
use super::control::{Method, PartSolver, SolveControl, SolverOptions};
use super::report::{SolveReport, StopReason};
use crate::omitted::OmittableWork;

/// Smallest number of frame cells for which windows and coarser cells are used.
const MIN_FRAME_CELLS: usize = 60 * 60;

/// Smallest number of coarse cells along the shorter side of a rectangle.
const MIN_COARSE_SIDE_CELLS: usize = 24;

/// Smallest tolerance of the natural residual on coarser cells.
const COARSE_TOLERANCE: f64 = 1e-4;

/// Margin of a window around the previous contact, in cells of the previous solution.
const WINDOW_MARGIN_CELLS: usize = 2;

/// Largest number of windows before the whole frame is solved.
const MAX_WINDOWS: usize = 6;

/// Largest number of iterations on coarser cells, and on a window that may still grow.
const MAX_WINDOW_ITERATIONS: usize = 500;

/// Natural residual above which a warm start counts as far from the solution, so that Newton's method would not begin from it.
const COLD_START_RESIDUAL: f64 = 0.5;

/// Natural residual above which a start of a rolling increment counts as not yet steady.
const STEADY_ROLLING_RESIDUAL: f64 = 0.1;

/// Largest ratio of window cells to frame cells. A larger window saves no work.
const MAX_WINDOW_SHARE: f64 = 0.75;

/// Rectangle of cells: first cell and one past the last cell, along x and y.
type Rectangle = [[usize; 2]; 2];

/// Returns whether increments with an operator on the cells of `grid` are solved from coarse to fine and on windows.
pub fn solves_windows(grid: Option<[usize; 2]>, options: &SolverOptions) -> bool {
    let skips = options.skip.allows(OmittableWork::DistantCells);
    skips && options.method == Method::Auto && grid.is_some_and(|[nx, ny]| nx * ny >= MIN_FRAME_CELLS)
}

/// Solves from the state in `it`. `solver` solves windows and coarser cells. Returns the report and whether the solve has ended. If
/// not, `it` contains a start for the whole frame.
pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    solver: PartSolver,
) -> (SolveReport, bool) {
    let frame = problem.flexibility.grid().expect("asked for before");
    let mut nested =
        CoarseToFine { problem, options: control.options, frame, solver, report: SolveReport::default() };
    let done = nested.run(it, control).is_some();
    (nested.report, done)
}

struct CoarseToFine<'s, 'p> {
    problem: &'s Increment<'p>,
    options: SolverOptions,
    frame: [usize; 2],
    solver: PartSolver,
    report: SolveReport,
}

impl<'p> CoarseToFine<'_, 'p> {
    fn run(&mut self, it: &mut ContactState, control: &mut SolveControl) -> Option<()> {
        if self.problem.pressures == Pressures::Given {
            return self.solve_tangential(it, control);
        }
        let start = Unknowns::from_state(it);
        let balanced = self.problem.path_points.iter().any(|end| end.balance.is_some());
        let mut rectangle = match contact_rectangle(it, self.frame) {
            // With a balance, tractions on the previous contact rectangle alone may be unable to satisfy the moment equilibrium.
            Some(_) if balanced => return None,
            // The previous rectangle is of little use if rolling is not steady yet, or if the contact has moved far.
            Some(rectangle) => {
                let limit = if self.rolls() { STEADY_ROLLING_RESIDUAL } else { COLD_START_RESIDUAL };
                let is_far = self.is_beyond(limit, self.problem, it, self.all());
                let found = if is_far { self.coarse(it, control) } else { None };
                if is_far && found.is_none() {
                    start.restore_into(it);
                }
                found.unwrap_or_else(|| expanded(rectangle, WINDOW_MARGIN_CELLS, self.frame))
            }
            None => self.coarse(it, control)?,
        };
        for _ in 0..MAX_WINDOWS {
            let (window, operator) = self.window(rectangle, 1)?;
            self.on_window(window, operator, it, control)?;
            self.problem.evaluate(it);
            self.report.applications += self.problem.applications();
            self.report.residual = self.problem.natural_residual(it);
            let outside = overlapping(it, self.frame, &window);
            match self.report.stop {
                StopReason::Converged if self.report.residual <= self.options.tolerance => return Some(()),
                StopReason::Converged => {}
                // Equilibrium may exist on the whole frame although it is lost on the window.
                StopReason::GrossSliding | StopReason::ContactLost if outside.is_some() || balanced => {
                    start.restore_into(it);
                    return None;
                }
                stop => return (stop != StopReason::Iterations).then_some(()),
            }
            let outside = outside?;
            rectangle = expanded(union(rectangle, outside), WINDOW_MARGIN_CELLS, self.frame);
        }
        None
    }

    fn all(&self) -> Rectangle {
        self.frame.map(|cells| [0, cells])
    }

    fn rolls(&self) -> bool {
        self.problem.path_points.iter().any(|end| matches!(end.reference, SlipReference::Upstream(_)))
    }

    fn is_beyond(
        &mut self,
        limit: f64,
        problem: &Increment,
        it: &mut ContactState,
        rectangle: Rectangle,
    ) -> bool {
        if self.coarsest(rectangle) == 1 {
            return false;
        }
        problem.evaluate(it);
        self.report.applications += problem.applications();
        problem.natural_residual(it) > limit
    }

    /// Largest ratio of the sides of coarse cells and frame cells, a power of two. Coarse cells must divide the frame, and at least
    /// [`MIN_COARSE_SIDE_CELLS`] of them must fit along each side of `rectangle`.
    fn coarsest(&self, rectangle: Rectangle) -> usize {
        let mut factor = 1;
        let halves = |factor: usize| {
            let divides = self.frame.iter().all(|n| n.is_multiple_of(2 * factor));
            divides
                && rectangle
                    .iter()
                    .all(|[first, last]| (last - first) / (2 * factor) >= MIN_COARSE_SIDE_CELLS)
        };
        while halves(factor) {
            factor *= 2;
        }
        factor
    }

    /// Solves on ever finer cells, down to twice the side of the frame cells. Returns the contact rectangle, or `None`
    /// if a solution fails.
    fn coarse(&mut self, it: &mut ContactState, control: &mut SolveControl) -> Option<Rectangle> {
        let mut rectangle = self.all();
        let mut factor = self.coarsest(rectangle);
        let options =
            SolverOptions { tolerance: COARSE_TOLERANCE.max(self.options.tolerance), ..self.options };
        while factor > 1 {
            let (window, operator) = self.window(rectangle, factor)?;
            // The callback decides only whether to cancel, so that it gets a constant instead of the coarse residual.
            let mut told = |iterations: usize, _: f64| control.is_cancelled(iterations, 1.0);
            self.on_window(window, operator, it, &mut SolveControl::new(options, &mut told))?;
            if self.report.stop != StopReason::Converged {
                return None;
            }
            rectangle =
                expanded(contact_rectangle(it, self.frame)?, WINDOW_MARGIN_CELLS * factor, self.frame);
            factor /= 2;
        }
        Some(rectangle)
    }

    /// Window over a rectangle and its operator. `None` if the operator cannot be restricted, or if the window would save no work.
    fn window(&self, rectangle: Rectangle, factor: usize) -> Option<(Window, WindowOperator<'p>)> {
        let needed = [0, 1].map(|axis| {
            let [first, last] = rectangle[axis];
            last.div_ceil(factor) - first / factor
        });
        let operator = self.problem.flexibility.restrict(needed, factor)?;
        let cells = operator.grid()?;
        if factor == 1 && (cells[0] * cells[1]) as f64 > MAX_WINDOW_SHARE * self.problem.n() as f64 {
            return None;
        }
        // Centre the window on the rectangle, inside the frame.
        let origin = [0, 1].map(|axis| {
            let spare = cells[axis].saturating_sub(needed[axis]) / 2;
            let first = (rectangle[axis][0] / factor).saturating_sub(spare);
            factor * first.min(self.frame[axis] / factor - cells[axis])
        });
        let operator = self.problem.flexibility.restriction_at(operator, origin, factor);
        Some((Window { frame: self.frame, origin, cells, factor }, WindowOperator::Own(operator)))
    }

    fn whole(&self) -> (Window, WindowOperator<'p>) {
        let window = Window { frame: self.frame, origin: [0, 0], cells: self.frame, factor: 1 };
        (window, WindowOperator::Frame(self.problem.flexibility))
    }

    fn on_window(
        &mut self,
        window: Window,
        operator: WindowOperator,
        it: &mut ContactState,
        control: &mut SolveControl,
    ) -> Option<()> {
        let part = WindowProblem::new(self.problem, window, operator)?;
        let mut state = part.state(it);
        self.on_part(&part, &mut state, MAX_WINDOW_ITERATIONS, control);
        part.write_back(&state, it);
        Some(())
    }

    fn on_part(
        &mut self,
        part: &WindowProblem,
        state: &mut ContactState,
        most: usize,
        control: &mut SolveControl,
    ) {
        let mut rest = control.rest(self.report.iterations);
        rest.options.max_iterations = rest.options.max_iterations.min(most);
        let report = (self.solver)(&part.problem(self.problem), state, &mut rest);
        self.report = report.with_work_of(&self.report);
    }
}

fn contact_rectangle(it: &ContactState, frame: [usize; 2]) -> Option<Rectangle> {
    let n = frame[0] * frame[1];
    let pressed = |cell: usize| it.scaled.chunks_exact(3 * n).any(|planes| planes[2 * n + cell] > 0.0);
    bounds(frame, pressed)
}

fn overlapping(it: &ContactState, frame: [usize; 2], window: &Window) -> Option<Rectangle> {
    let n = frame[0] * frame[1];
    let inside = |cell: usize| {
        let at = [cell / frame[1], cell % frame[1]];
        (0..2).all(|axis| (window.origin[axis]..window.origin[axis] + window.cells[axis]).contains(&at[axis]))
    };
    let overlaps = |cell: usize| it.gap.chunks_exact(3 * n).any(|planes| planes[2 * n + cell] < 0.0);
    bounds(frame, |cell| !inside(cell) && overlaps(cell))
}

fn bounds(frame: [usize; 2], belongs: impl Fn(usize) -> bool) -> Option<Rectangle> {
    let mut rectangle: Option<Rectangle> = None;
    for cell in (0..frame[0] * frame[1]).filter(|&cell| belongs(cell)) {
        let at = [cell / frame[1], cell % frame[1]].map(|index| [index, index + 1]);
        rectangle = Some(rectangle.map_or(at, |before| union(before, at)));
    }
    rectangle
}

fn union(a: Rectangle, b: Rectangle) -> Rectangle {
    [0, 1].map(|axis| [a[axis][0].min(b[axis][0]), a[axis][1].max(b[axis][1])])
}

fn expanded(rectangle: Rectangle, by: usize, frame: [usize; 2]) -> Rectangle {
    [0, 1].map(|axis| {
        let [first, last] = rectangle[axis];
        [first.saturating_sub(by), (last + by).min(frame[axis])]
    })
}
