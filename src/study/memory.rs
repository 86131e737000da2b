//! What is taken of the memory that a run may have.

use super::prepare::cross;
use crate::bem::half_space::CompressedFlexibility;
use crate::body::BodyEquations::FiniteElements;
use crate::body::ElasticBody;
use crate::body::half_space::compressed;
use crate::contact::solver;
use crate::error::Result;
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::scene::keys::solver::{Coupling, Method};
use crate::scene::plan::{BodySpec, Plan};

/// Bytes of the program and of what a run has beside its frame and bodies.
const PROGRAM: usize = 30_000_000;

/// Bytes per cell of the frame with its states.
const PER_CELL: usize = 500;

/// What remains of the plan's memory for a body beside the frame and what the bodies before it hold.
pub(super) fn left(plan: &Plan, frame: &ContactFrame, held: usize) -> MemoryLimit {
    plan.memory.less(of_frame(plan, frame) + held)
}

/// Bytes of a run with this frame and no bodies, the solver's entries included.
pub(super) fn of_frame(plan: &Plan, frame: &ContactFrame) -> usize {
    let n = frame.n_cells();
    let meshed = plan.bodies.iter().any(|body| matches!(body, BodySpec::Fe(_)));
    let entries = match plan.solver.method {
        Method::GaussSeidel => solver::entries_bytes(n),
        // As a start, on the matrix of half-spaces.
        Method::Auto if frame.grid.is_none() && !meshed => solver::entries_bytes(n),
        _ => 0,
    };
    PROGRAM + PER_CELL * n + entries
}

/// Whether half-spaces on `frame` are compressed.
pub(super) fn compresses(plan: &Plan, frame: &ContactFrame) -> bool {
    let eliminated = plan.solver.coupling == Coupling::Schur;
    eliminated && frame.grid.is_none() && compressed(frame.n_cells(), cross(plan))
}

/// Bytes of a half-space on `frame`.
pub(super) fn of_half_space(plan: &Plan, frame: &ContactFrame) -> usize {
    // Nine planes of the symbol and the padded vectors of one application; a matrix on other frames.
    match frame.grid {
        Some(grid) => 4 * 8 * 16 * grid.cells[0] * grid.cells[1],
        None if compresses(plan, frame) => {
            CompressedFlexibility::usual_bytes(frame.n_cells(), plan.solver.compression_tolerance)
        }
        None => 72usize.saturating_mul(frame.n_cells()).saturating_mul(frame.n_cells()),
    }
}

/// Checks that body `index` fits, where that is known before it is made; a meshed body does so itself.
///
/// # Errors
/// If it does not (kind `Resources`).
pub(super) fn ensure(plan: &Plan, index: usize, frame: &ContactFrame, left: &MemoryLimit) -> Result<()> {
    if !matches!(plan.bodies[index], BodySpec::HalfSpace(_)) {
        return Ok(());
    }
    let what = format!("the operator on {} cells", frame.n_cells());
    left.ensure(of_half_space(plan, frame) as u128, &what, "use fewer cells in the frame")
}

/// Bytes that a body keeps.
pub(super) fn held(plan: &Plan, index: usize, frame: &ContactFrame, body: &dyn ElasticBody) -> usize {
    match (&plan.bodies[index], body.equations()) {
        (BodySpec::HalfSpace(_), _) => of_half_space(plan, frame),
        (_, FiniteElements(body)) => body.condensed().held_bytes(),
        _ => 0,
    }
}
