//! Estimated time of contact problems and of points inside bodies.

use crate::evolution::step::Step;
use crate::frame::ContactFrame;
use crate::mesh::faces::outer_faces;
use crate::omitted::{OmittableWork, OmittedWork};
use crate::output::interior_points::InteriorPointRequest;
use crate::scene::plan::{BodyPlan, Plan};
use crate::simulation::build::memory::is_compressed;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::omitted::on_grid;
use crate::simulation::plan_bodies::SIDES;

/// Seconds per interior point: in an isotropic half-space, in an anisotropic half-space, and for each element of a
/// boundary-element body.
const PER_POINT_INSIDE: [f64; 3] = [2e-4, 2.5e-3, 1.5e-5];

/// Seconds for the table of the field inside an anisotropic half-space, per √(C_max / C_min). C_max and C_min are the
/// largest and the smallest diagonal stiffness.
const INSIDE_TABLE: f64 = 0.5;

/// Operator products per contact problem that uses an approximate inverse as preconditioner. On a grid of n cells, the
/// number of products is `PRODUCTS_ON_GRID` × n^(1/6).
const PRODUCTS_WITH_PRECONDITIONER: f64 = 70.0;
const PRODUCTS_ON_GRID: f64 = 10.0;

/// Factors on the cost of a product, for a window around the contact, and for a grid with pressures as the only
/// unknowns.
const WINDOW: f64 = 0.5;
const PRESSURES: f64 = 0.3;

/// Estimated time of all steps of a plan, s, without the omitted work in `ledger`.
pub(super) fn of_steps(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
    seconds_per_product: [f64; 2],
    ledger: &[OmittedWork],
) -> f64 {
    let skips = |skip: OmittableWork| ledger.iter().any(|entry| entry.skip == Some(skip));
    let n = frame.n_cells() as f64;
    let on_grid = on_grid(plan, frame, near);
    let half_space = plan.bodies.iter().any(|body| matches!(body, BodyPlan::HalfSpace(_)));
    // With an approximate inverse, the number of products hardly grows with the number of cells. Without it, the
    // number grows as √n.
    let products = match on_grid {
        true => PRODUCTS_ON_GRID * n.powf(1.0 / 6.0),
        false if half_space && is_compressed(plan, frame) => PRODUCTS_WITH_PRECONDITIONER,
        false => 8.0 * n.sqrt(),
    };
    let [first, second] = seconds_per_product;
    let product = if skips(OmittableWork::SecondHalfSpace) { first.max(second) } else { first + second };
    let product = if skips(OmittableWork::DistantCells) { WINDOW * product } else { product };
    let of_step = |step: &Step| {
        let bare = !(plan.has_friction(step) || plan.has_wear(step));
        let share = if on_grid && bare && skips(OmittableWork::TangentialUnknowns) { PRESSURES } else { 1.0 };
        contact_problems(step) as f64 * products * share * product
    };
    plan.steps.iter().map(of_step).sum()
}

pub(super) fn contact_problems(step: &Step) -> usize {
    match step.kind.cycles() {
        None => step.increments,
        // The path points of a cycle are solved together, and each counts as one contact problem. With a given number
        // of increments, cycles are resolved at the start and after each jump. Cycles with this number of increments
        // and with half of it are repeated, about twice. With the stroke before them these are five strokes each.
        Some(cycles) => {
            let given = step.kind.closed_path().and_then(|path| path.resolved_cycles?.increments);
            let solves = cycles.expected_solves(step.wear);
            step.kind.n_path_points() * solves
                + given.map_or(0, |increments| 15 * increments / 2 * (solves / 2))
        }
    }
}

/// Estimated time of points inside bodies, s.
pub(super) fn inside(plan: &Plan, n_solves: usize) -> f64 {
    let points: f64 = plan.interior_requests.iter().map(|request| of_points(plan, request)).sum();
    inside_tables(plan) + n_solves as f64 * points
}

/// Time for the tables of the field inside anisotropic half-spaces, s. The estimate assumes that no table is in the
/// cache.
fn inside_tables(plan: &Plan) -> f64 {
    let of = |index: usize| match &plan.bodies[index] {
        BodyPlan::HalfSpace(elastic)
            if !elastic.isotropic
                && plan.interior_requests.iter().any(|request| request.side == SIDES[index]) =>
        {
            let stiffness = elastic.stiffness.voigt().diagonal();
            INSIDE_TABLE * (stiffness.max() / stiffness.min()).sqrt()
        }
        _ => 0.0,
    };
    of(0) + of(1)
}

fn of_points(plan: &Plan, request: &InteriorPointRequest) -> f64 {
    let n = request.points().len() as f64;
    match &plan.bodies[usize::from(request.side == SIDES[1])] {
        BodyPlan::Be(be) => n * PER_POINT_INSIDE[2] * outer_faces(&be.meshed.mesh).len() as f64,
        BodyPlan::HalfSpace(elastic) => n * PER_POINT_INSIDE[usize::from(!elastic.isotropic)],
        _ => 0.0,
    }
}
