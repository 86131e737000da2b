//! Predicts the omitted work of a run before its operators are built.

use crate::bem::half_space::plane::compressed::MAX_DENSE_CELLS;
use crate::bem::half_space::{CrossBlocks, SurfaceGreen};
use crate::body::BodyEquations::HalfSpace;
use crate::body::{ElasticBody, ErrorEstimation};
use crate::contact::Method;
use crate::contact::solver::solves_windows;
use crate::coupling;
use crate::coupling::Coupling;
use crate::evolution::omitted::{OperatorOmissions, omitted_contact_work};
use crate::frame::ContactFrame;
use crate::omitted::{OmittableWork, OmittedWork};
use crate::output::field_writer::FieldKind;
use crate::scene::plan::{BodyPlan, Plan};
use crate::simulation::build::candidate_cells;
use crate::simulation::build::memory::is_compressed;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::build::settings::{cross_blocks, options};
use crate::simulation::failure::SceneError;
use crate::simulation::grown_frame;
use crate::simulation::plan_bodies::SIDES;
use crate::simulation::plan_bodies::bare_half_space;
use crate::simulation::worn_meshes;

/// Omitted work that the run of `plan` on `frame` will report, in the order of the report. The prediction does not
/// include factorisations that a cached flexibility makes unnecessary.
///
/// # Errors
/// If the frame on a half-space is not plane, or a surface Green's function does not converge.
pub(crate) fn expected_omitted_work(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
) -> Result<Vec<OmittedWork>, SceneError> {
    let mut skipped = Vec::new();
    let half_space = |(body, near): (&BodyPlan, &NearFieldModel)| {
        matches!(body, BodyPlan::HalfSpace(_)) || near.half_space_fit().is_some()
    };
    let half_spaces = plan.bodies.iter().zip(near).all(half_space);
    let summed = plan.solver.skip.allowed_skips().allows(OmittableWork::SecondHalfSpace) && half_spaces;
    if plan.solver.coupling == Coupling::Schur {
        let rigid = [0, 1].map(|index| matches!(plan.bodies[index], BodyPlan::Rigid));
        skipped =
            coupling::omitted_work(rigid, summed, bodies_couple_normal_tangential(plan, frame, summed)?);
    }
    let on_grid = on_grid(plan, frame, near);
    let grid = frame.whole_grid().filter(|_| on_grid).map(|grid| grid.cells);
    let options = options(plan);
    let uncoupled = options.method == Method::Auto
        && grid.is_some()
        && options.skip.allows(OmittableWork::NormalComponents)
        && !bodies_couple_normal_tangential(plan, frame, summed)?;
    let operator =
        OperatorOmissions { grid: grid.is_some(), windows: solves_windows(grid, &options), uncoupled };
    let of_contact = omitted_contact_work(&plan.friction, &plan.wear, &plan.steps, &options, operator);
    skipped.extend(omitted_by_plan(plan, frame));
    skipped.extend(of_contact);
    Ok(skipped)
}

/// Work that the plan and the frame omit with any operator, in the order of the report.
pub(super) fn omitted_by_plan(plan: &Plan, frame: &ContactFrame) -> Vec<OmittedWork> {
    let mut skipped: Vec<OmittedWork> = candidate_cells::omitted_work(frame).into_iter().collect();
    skipped.extend(omitted_distant_entries(plan, frame));
    skipped.extend(omitted_fields(plan));
    skipped.extend(grown_frame::omitted_work(plan));
    skipped.extend(worn_meshes::omitted_work(plan));
    skipped
}

/// Whether one grid operator represents the flexibility of both bodies.
pub(crate) fn on_grid(plan: &Plan, frame: &ContactFrame, near: &[NearFieldModel; 2]) -> bool {
    let elastic = || plan.bodies.iter().zip(near).filter(|(body, _)| !matches!(body, BodyPlan::Rigid));
    let one =
        elastic().count() == 1 || plan.solver.skip.allowed_skips().allows(OmittableWork::SecondHalfSpace);
    plan.solver.coupling == Coupling::Schur
        && frame.grid.is_some_and(|grid| grid.periodic == [false; 2])
        && elastic()
            .all(|(body, near)| matches!(body, BodyPlan::HalfSpace(_)) || near.half_space_fit().is_some())
        && one
}

fn omitted_distant_entries(plan: &Plan, frame: &ContactFrame) -> Option<OmittedWork> {
    let half_space = plan.bodies.iter().any(|body| matches!(body, BodyPlan::HalfSpace(_)));
    let tolerance = plan.solver.compression_tolerance;
    (half_space && is_compressed(plan, frame)).then(|| {
        OmittedWork::new(
            OmittableWork::DistantEntries,
            "entries of the half-space operator between distant cells",
            format!(
                "on more than {MAX_DENSE_CELLS} cells the operator is compressed with the tolerance {tolerance:e} (solver.compression_tolerance)"
            ),
        )
    })
}

fn omitted_fields(plan: &Plan) -> Vec<OmittedWork> {
    let mut skipped = skipped_stress(plan);
    let without_mesh = |body: &BodyPlan| matches!(body, BodyPlan::HalfSpace(_) | BodyPlan::Be(_));
    if plan.interior_requests.is_empty() && plan.bodies.iter().any(without_mesh) {
        skipped.push(OmittedWork::new(
            None,
            "displacement and stress inside half-spaces and boundary-element bodies",
            "output.inside requests no points",
        ));
    }
    let looked_at = !plan.output.fields.is_empty() || plan.friction.ellipse().is_some();
    if !looked_at && plan.solver.skip.allowed_skips().allows(OmittableWork::TangentialGap) {
        skipped.push(OmittedWork::new(
            OmittableWork::TangentialGap,
            "tangential gap of steps without friction and wear",
            "output.fields is empty, and there is no friction",
        ));
    }
    skipped
}

fn skipped_stress(plan: &Plan) -> Vec<OmittedWork> {
    let wanted = &plan.output.fields;
    let (what, why) = if !FieldKind::require_stress(wanted) {
        ("stress and its error estimate", "output.fields has none of \"volume\", \"stress\", \"error\"")
    } else if FieldKind::error_estimate(wanted) == ErrorEstimation::Skip {
        ("error estimate of the stress", "output.fields has neither \"volume\" nor \"error\"")
    } else {
        return Vec::new();
    };
    let meshed = [0, 1].into_iter().filter(|&index| plan.bodies[index].as_fe().is_some());
    meshed.map(|index| OmittedWork::new(None, format!("{what} of body {}", index + 1), why)).collect()
}

/// Whether the run needs the factorised stiffness of meshed bodies after condensation, even without applied loads.
/// Written fields (other than SVG pictures) need the factor. Rows of the flexibility outside the candidate cells also
/// need it.
pub(crate) fn needs_factor_after_condensation(plan: &Plan, frame: &ContactFrame) -> bool {
    plan.output.fields.iter().any(|kind| *kind != FieldKind::Svg) || frame.candidates.is_some()
}

/// Omitted work for a cached flexibility of body `index`. `solves` states whether fields or loads need the factor. The
/// cache then contains the factor, too.
pub(crate) fn omitted_factorisation(index: usize, solves: bool) -> OmittedWork {
    let factor = if solves { " and the factor for fields or loads" } else { "" };
    let (what, why) = (
        format!("factorisation of body {}", index + 1),
        format!("the cache contains the flexibility{factor}"),
    );
    OmittedWork::new(None, what, why)
}

fn bodies_couple_normal_tangential(
    plan: &Plan,
    frame: &ContactFrame,
    summed: bool,
) -> Result<bool, SceneError> {
    let meshed = plan
        .bodies
        .iter()
        .any(|body| body.as_meshed().is_some() || matches!(body, BodyPlan::TruncatedHalfSpace(_)));
    // Grid operators that keep vanishing blocks count as coupled. Dense operators detect vanishing blocks themselves.
    if meshed || (frame.grid.is_some() && cross_blocks(plan, frame) == CrossBlocks::Keep) {
        return Ok(true);
    }
    let greens = greens(plan, frame)?;
    let greens: Vec<&SurfaceGreen> = greens.iter().collect();
    Ok(if summed {
        SurfaceGreen::sum(&greens).couples_normal_tangential()
    } else {
        greens.iter().any(|green| green.couples_normal_tangential())
    })
}

fn greens(plan: &Plan, frame: &ContactFrame) -> Result<Vec<SurfaceGreen>, SceneError> {
    let mut greens = Vec::new();
    for index in 0..SIDES.len() {
        if let BodyPlan::HalfSpace(elastic) = &plan.bodies[index]
            && let HalfSpace(green) = bare_half_space(elastic, index, frame)?.equations()
        {
            greens.push(green.clone());
        }
    }
    Ok(greens)
}
