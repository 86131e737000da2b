//! Memory estimates of a run, in bytes, and checks against the memory limit.

use crate::bem::half_space::plane::compressed::MEMORY_HELP;
use crate::bem::half_space::{CrossBlocks, SubsurfaceField};
use crate::body::BodyEquations::{BoundaryElements, FiniteElements};
use crate::body::half_space::uses_compression;
use crate::body::{ElasticBody, HalfSpaceBody, PointState};
use crate::contact::solver::solves_windows;
use crate::coupling::Coupling;
use crate::error::Result;
use crate::evolution::step::Tilt;
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::omitted::OmittableWork;
use crate::output::interior_points::InteriorPointRequest;
use crate::scene::plan::{BodyPlan, Plan};
use crate::simulation::build::settings::{cross_blocks, options};
use crate::simulation::plan_bodies::SIDES;

/// Bytes of the program (14.0 to 14.5 MB) and of the data of every run.
const PROGRAM: usize = 14_500_000;

/// Additional bytes for meshed bodies.
const MESHED: usize = 1_200_000;

/// Bytes per cell for the frame, the initial gap and the cell areas.
const PER_CELL: usize = 75;

/// Bytes per cell of a run at its peak, measured on grids of 128 x 128 and 256 x 256 cells (docs/memory.md).
struct PerCell {
    /// States before and after an increment, records of the increments, and predictions.
    history: usize,
    /// Vectors of the contact solvers if most of the frame is in contact.
    solver: usize,
    /// Half-space operator on a grid, with its approximate inverses in single precision.
    operator: usize,
    /// Written fields and pictures, with the operator of a body.
    fields: usize,
}

const BYTES_PER_CELL_FRICTIONLESS: PerCell =
    PerCell { history: 384, solver: 190, operator: 120, fields: 660 };
const BYTES_PER_CELL_FRICTION: PerCell = PerCell { history: 470, solver: 980, operator: 380, fields: 750 };
const BYTES_PER_CELL_CYCLES: PerCell = PerCell { history: 783, solver: 1510, operator: 380, fields: 750 };

/// Additional bytes per cell for Newton's method, which solves frictionless contact under prescribed moments.
const MOMENTS: usize = 520;

/// Bytes of the tables of an anisotropic or periodic operator.
const OPERATOR_TABLE_BYTES: usize = 1_800_000;

/// Operators on windows of the grid, which steps with cycles keep: bytes per cell, and maximum bytes in total.
const WINDOW_OPERATOR_BYTES: [usize; 2] = [700, 4_600_000];

/// Bytes of the table of the field inside an anisotropic half-space. Measured for CFRP oblique to the symmetry planes
/// of the material.
const SUBSURFACE_TABLE_BYTES: usize = 4_900_000;

const FEWER_POINTS: &str = "request fewer points (output.inside)";

/// Memory that remains for a body after the frame and the `held` bytes of the bodies before it.
pub(crate) fn remaining_limit(plan: &Plan, frame: &ContactFrame, held: usize) -> MemoryLimit {
    plan.memory_limit.after_reserving(frame_bytes(plan, frame) + held)
}

/// Bytes of a run with this frame, without the bodies.
pub(crate) fn frame_bytes(plan: &Plan, frame: &ContactFrame) -> usize {
    let [lasting, passing] = subsurface_bytes(plan, frame);
    frame_bytes_without_points(plan, frame) + lasting + passing.saturating_sub(field_bytes(plan, frame))
}

fn frame_bytes_without_points(plan: &Plan, frame: &ContactFrame) -> usize {
    let n = frame.n_cells();
    let meshed = plan.bodies.iter().any(|body| body.as_meshed().is_some());
    let per_cell = per_cell(plan);
    let moments =
        if plan.steps.iter().any(|step| matches!(step.tilt, Some(Tilt::Moment(_)))) { MOMENTS } else { 0 };
    let moments = if has_tangential_unknowns(plan) { 0 } else { moments };
    let cells = PER_CELL + per_cell.history + per_cell.solver + moments;
    let meshed = if meshed { MESHED } else { 0 };
    PROGRAM + meshed + cells * n + of_tables(plan, frame) + field_bytes(plan, frame)
}

fn field_bytes(plan: &Plan, frame: &ContactFrame) -> usize {
    if writes(plan) { per_cell(plan).fields * frame.n_cells() } else { 0 }
}

fn writes(plan: &Plan) -> bool {
    !plan.output.fields.is_empty()
}

fn per_cell(plan: &Plan) -> PerCell {
    if has_cycles(plan) {
        BYTES_PER_CELL_CYCLES
    } else if has_tangential_unknowns(plan) {
        BYTES_PER_CELL_FRICTION
    } else {
        BYTES_PER_CELL_FRICTIONLESS
    }
}

fn has_tangential_unknowns(plan: &Plan) -> bool {
    plan.friction.ellipse().is_some()
        || plan.steps.iter().any(|step| plan.has_wear(step))
        || !plan.solver.skip.allowed_skips().allows(OmittableWork::TangentialUnknowns)
}

fn has_cycles(plan: &Plan) -> bool {
    plan.steps.iter().any(|step| step.kind.cycles().is_some())
}

/// Bytes of the tables of half-space operators on grids.
fn of_tables(plan: &Plan, frame: &ContactFrame) -> usize {
    let Some(grid) = frame.grid else { return 0 };
    let tabulated = |body: &&BodyPlan| match body {
        BodyPlan::HalfSpace(elastic) => !elastic.isotropic || grid.periodic != [false; 2],
        _ => false,
    };
    operator_table_bytes(plan, frame, plan.bodies.iter().filter(tabulated).count())
}

/// Bytes of the tables of an anisotropic half-space that serves as near field.
pub(crate) fn far_field_table_bytes(plan: &Plan, frame: &ContactFrame) -> usize {
    operator_table_bytes(plan, frame, 1) + SUBSURFACE_TABLE_BYTES
}

fn operator_table_bytes(plan: &Plan, frame: &ContactFrame, bodies: usize) -> usize {
    if bodies == 0 {
        return 0;
    }
    let of_fields = if writes(plan) { bodies + 1 } else { 0 };
    let windows = solves_windows(frame.whole_grid().map(|grid| grid.cells), &options(plan));
    let [of_cycles, kept] = match has_cycles(plan) {
        true if windows => [1, WINDOW_OPERATOR_BYTES[1].min(WINDOW_OPERATOR_BYTES[0] * frame.n_cells())],
        cycles => [usize::from(cycles), 0],
    };
    // Without friction, only the pressure is transformed.
    let of_each = if has_tangential_unknowns(plan) || has_cycles(plan) {
        OPERATOR_TABLE_BYTES
    } else {
        OPERATOR_TABLE_BYTES / 4
    };
    (1 + of_fields + of_cycles) * of_each + kept
}

/// Permanent and temporary bytes of the results at interior points. The temporary bytes and the bytes of other fields
/// are not needed at the same time.
fn subsurface_bytes(plan: &Plan, frame: &ContactFrame) -> [usize; 2] {
    let body = |request: &InteriorPointRequest| &plan.bodies[usize::from(request.side == SIDES[1])];
    let half_space = |request: &InteriorPointRequest| match body(request) {
        BodyPlan::HalfSpace(elastic) => Some(elastic),
        _ => None,
    };
    let half_spaces: Vec<_> = plan.interior_requests.iter().filter_map(half_space).collect();
    let cells = match half_spaces.is_empty() {
        true => 0,
        false => SubsurfaceField::expected_bytes(frame.all_corners().map(|corners| corners.len())),
    };
    let tabulated = half_spaces.iter().filter(|elastic| !elastic.isotropic).count();
    let tables = SUBSURFACE_TABLE_BYTES * tabulated.min(2);
    let states: usize = plan.interior_requests.iter().map(InteriorPointRequest::n_points).sum::<usize>()
        * size_of::<PointState>();
    let writing = plan.interior_requests.iter().map(InteriorPointRequest::writing_bytes).max().unwrap_or(0);
    [tables + states, writing.max(cells)]
}

/// Checks that interior points fit into memory.
///
/// # Errors
/// If they do not fit (kind `Resources`).
pub(crate) fn ensure_points_fit(plan: &Plan, frame: &ContactFrame) -> Result<()> {
    let bytes: usize = subsurface_bytes(plan, frame).iter().sum();
    let points: usize = plan.interior_requests.iter().map(InteriorPointRequest::n_points).sum();
    let without = frame_bytes_without_points(plan, frame) - field_bytes(plan, frame);
    let what = format!("displacement and stress at {points} points inside");
    plan.memory_limit.after_reserving(without).ensure_available(bytes as u128, &what, FEWER_POINTS)
}

/// Whether half-space operators on `frame` are compressed.
pub(crate) fn is_compressed(plan: &Plan, frame: &ContactFrame) -> bool {
    let eliminated = plan.solver.coupling == Coupling::Schur;
    eliminated && frame.grid.is_none() && uses_compression(frame.n_cells(), cross_blocks(plan, frame))
}

/// Bytes of the half-space operator on the whole grid, divided by the number of elastic bodies; 0 without a grid.
pub(crate) fn grid_operator_bytes(plan: &Plan, frame: &ContactFrame) -> usize {
    let elastic = plan.bodies.iter().filter(|body| !matches!(body, BodyPlan::Rigid)).count();
    let cells = frame.grid.map_or(0, |grid| grid.cells[0] * grid.cells[1]);
    per_cell(plan).operator * cells / elastic.max(1)
}

/// Lower bound for the bytes of a grid frame and its operator, before they are built.
pub(super) fn min_grid_bytes(plan: &Plan, cells: [usize; 2]) -> u128 {
    let per_cell = per_cell(plan);
    let bytes = PER_CELL + per_cell.history + per_cell.solver + per_cell.operator;
    bytes as u128 * cells[0] as u128 * cells[1] as u128
}

/// Bytes of the operator of a half-space on `frame`.
pub(crate) fn half_space_bytes(plan: &Plan, frame: &ContactFrame, body: &HalfSpaceBody) -> usize {
    match frame.grid {
        // The block system stores the matrix of each body.
        Some(_) if plan.solver.coupling == Coupling::Block => frame.n_cells().pow(2).saturating_mul(72),
        // Both bodies share one operator.
        Some(_) => grid_operator_bytes(plan, frame),
        None if is_compressed(plan, frame) => body.operator_bytes(CrossBlocks::SkipVanishing),
        None => body.operator_bytes(CrossBlocks::Keep),
    }
}
/// Checks that the operator of a half-space fits into memory.
///
/// # Errors
/// If it does not fit (kind `Resources`).
pub(crate) fn ensure_half_space_fits(
    plan: &Plan,
    frame: &ContactFrame,
    body: &HalfSpaceBody,
    left: &MemoryLimit,
) -> Result<()> {
    let what = format!("the operator on {} cells", frame.n_cells());
    let mend = if is_compressed(plan, frame) { MEMORY_HELP } else { "use fewer cells in the frame" };
    left.ensure_available(half_space_bytes(plan, frame, body) as u128, &what, mend)
}

pub(super) fn resident_bytes(body: &dyn ElasticBody) -> usize {
    match body.equations() {
        FiniteElements(body) => body.condensed().resident_bytes(),
        BoundaryElements(body) => body.held_bytes(),
        _ => 0,
    }
}
