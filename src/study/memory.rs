//! What is taken of the memory that a run may have.

use super::bodies::SIDES;
use super::settings::cross;
use crate::bem::half_space::compressed::MEND;
use crate::bem::half_space::{CrossBlocks, Subsurface};
use crate::body::BodyEquations::{BoundaryElements, FiniteElements};
use crate::body::half_space::compressed;
use crate::body::{ElasticBody, HalfSpaceBody, PointState};
use crate::contact::solver;
use crate::error::Result;
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::results::inside::InsideRequest;
use crate::scene::keys::solver::{Coupling, Method};
use crate::scene::plan::{BodySpec, Plan};

/// Bytes of the program and of what a run has beside its frame and bodies.
const PROGRAM: usize = 30_000_000;

/// Bytes per cell of the frame with its states.
const PER_CELL: usize = 500;

/// What is said of points inside for which there is no memory.
const FEWER_POINTS: &str = "ask for fewer points (output.inside)";

/// What remains of the plan's memory for a body beside the frame and what the bodies before it hold.
pub(super) fn left(plan: &Plan, frame: &ContactFrame, held: usize) -> MemoryLimit {
    plan.memory.less(of_frame(plan, frame) + held)
}

/// Bytes of a run with this frame and no bodies, the solver's entries included.
pub(super) fn of_frame(plan: &Plan, frame: &ContactFrame) -> usize {
    let n = frame.n_cells();
    let meshed = plan.bodies.iter().any(|body| body.meshed().is_some());
    let entries = match plan.solver.method {
        Method::GaussSeidel => solver::entries_bytes(n),
        // As a start, on the matrix of half-spaces.
        Method::Auto if frame.grid.is_none() && !meshed => solver::entries_bytes(n),
        _ => 0,
    };
    PROGRAM + PER_CELL * n + entries + of_inside(plan, frame)
}

/// Bytes of the points inside bodies and of what their computation takes.
fn of_inside(plan: &Plan, frame: &ContactFrame) -> usize {
    let half_space = |request: &InsideRequest| {
        matches!(plan.bodies[usize::from(request.side == SIDES[1])], BodySpec::HalfSpace(_))
    };
    let cells = match plan.inside.iter().any(half_space) {
        true => Subsurface::bytes(frame.all_corners().map(|corners| corners.len())),
        false => 0,
    };
    let states: usize =
        plan.inside.iter().map(InsideRequest::n_points).sum::<usize>() * size_of::<PointState>();
    let writing = plan.inside.iter().map(InsideRequest::writing_bytes).max().unwrap_or(0);
    states + writing.max(cells)
}

/// Checks that points inside bodies fit.
///
/// # Errors
/// If they do not (kind `Resources`).
pub(super) fn ensure_inside(plan: &Plan, frame: &ContactFrame) -> Result<()> {
    let bytes = of_inside(plan, frame);
    let points: usize = plan.inside.iter().map(InsideRequest::n_points).sum();
    let without = of_frame(plan, frame) - bytes;
    let what = format!("displacement and stress at {points} points inside");
    plan.memory.less(without).ensure(bytes as u128, &what, FEWER_POINTS)
}

/// Whether half-spaces on `frame` are compressed.
pub(super) fn compresses(plan: &Plan, frame: &ContactFrame) -> bool {
    let eliminated = plan.solver.coupling == Coupling::Schur;
    eliminated && frame.grid.is_none() && compressed(frame.n_cells(), cross(plan, frame))
}

/// Bytes of the operator of a half-space on the whole grid of `frame`; 0 if that is none.
pub(super) fn of_grid(frame: &ContactFrame) -> usize {
    frame.grid.map_or(0, |grid| 4 * 8 * 16 * grid.cells[0] * grid.cells[1])
}

/// Bytes of the operator of a half-space on `frame`.
pub(super) fn of_half_space(plan: &Plan, frame: &ContactFrame, body: &HalfSpaceBody) -> usize {
    match frame.grid {
        // Of the whole grid, of which the body may have a part.
        Some(_) => of_grid(frame),
        None if compresses(plan, frame) => body.operator_bytes(CrossBlocks::SkipVanishing),
        None => body.operator_bytes(CrossBlocks::Keep),
    }
}
/// Checks that the operator of a half-space fits.
///
/// # Errors
/// If it does not (kind `Resources`).
pub(super) fn ensure(
    plan: &Plan,
    frame: &ContactFrame,
    body: &HalfSpaceBody,
    left: &MemoryLimit,
) -> Result<()> {
    let what = format!("the operator on {} cells", frame.n_cells());
    let mend = if compresses(plan, frame) { MEND } else { "use fewer cells in the frame" };
    left.ensure(of_half_space(plan, frame, body) as u128, &what, mend)
}

/// Bytes that a meshed body keeps.
pub(super) fn held(body: &dyn ElasticBody) -> usize {
    match body.equations() {
        FiniteElements(body) => body.condensed().held_bytes(),
        BoundaryElements(body) => body.held_bytes(),
        _ => 0,
    }
}
