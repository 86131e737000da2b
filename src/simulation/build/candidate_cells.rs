//! Candidate cells, which may come into contact under the prescribed steps. Meshed bodies form their flexibility on
//! these cells first.
//!
//! Under a prescribed approach, bodies touch where their undeformed surfaces would overlap. This estimate is no strict
//! bound. Therefore, the solver checks the other cells in each state, and forms their flexibility when they come into
//! contact.

use crate::coupling::Coupling;
use crate::evolution::step::{Normal, Step, Tangential};
use crate::frame::{ContactFrame, GapShape};
use crate::omitted::{OmittableWork, OmittedWork};
use crate::scene::plan::{BodyPlan, Plan, PrescribedDisplacement};
use crate::simulation::build::meshed_gap::surface_distances;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, face_map, free_motions};

/// Multiple of the largest approach that limits the initial gap of candidate cells.
const MARGIN: f64 = 1.25;

/// Smallest share of candidate cells for which the flexibility is formed on all cells at once. Checks of the few other
/// cells would cost more than they save.
const MAX_ACTIVE_SHARE: f64 = 0.6;

/// Adds the candidate cells to `frame`, if they are few enough.
///
/// # Errors
/// If a support or a gap of the plan is wrong.
pub(crate) fn with_active_cells(
    plan: &Plan,
    mut frame: ContactFrame,
    near: &[NearFieldModel; 2],
) -> Result<ContactFrame, SceneError> {
    let Some(reach) = active_gap_limit(plan, &frame, near) else { return Ok(frame) };
    if !undeformed_before_contact(plan)? {
        return Ok(frame);
    }
    let gap = initial_gap(plan, &frame, near)?;
    let first =
        if frame.has_uniform_axes() { gap.iter().copied().fold(f64::INFINITY, f64::min) } else { 0.0 };
    let cells: Vec<bool> = gap.iter().map(|gap| gap - first <= reach).collect();
    let count = cells.iter().filter(|&&is| is).count();
    if count > 0 && (count as f64) < MAX_ACTIVE_SHARE * cells.len() as f64 {
        frame.candidates = Some(cells);
    }
    Ok(frame)
}

pub(crate) fn omitted_work(frame: &ContactFrame) -> Option<OmittedWork> {
    let cells = frame.candidates.as_ref()?;
    let others = cells.iter().filter(|&&is| !is).count();
    Some(OmittedWork::new(
        OmittableWork::OpenCells,
        format!("flexibility of meshed bodies on {others} of {} cells", cells.len()),
        "their initial gap exceeds the approach; the flexibility is computed when the contact reaches them",
    ))
}

/// Limit of the initial gap of candidate cells, mm; `None` if all cells are candidates. If all cells have the same
/// axes, the smallest gap is subtracted from the initial gap.
///
/// The limit is rounded up to a power of sqrt(2), so that runs with similar approaches share a cache entry.
fn active_gap_limit(plan: &Plan, frame: &ContactFrame, near: &[NearFieldModel; 2]) -> Option<f64> {
    let condensed =
        |(body, near): (&BodyPlan, &NearFieldModel)| body.as_fe().is_some() && near.is_condensed();
    let meshed = plan.bodies.iter().zip(near).any(condensed);
    if !plan.solver.skip.allowed_skips().allows(OmittableWork::OpenCells)
        || plan.solver.coupling == Coupling::Block
        || !meshed
    {
        return None;
    }
    // A rotation closes the gap of cells far from the centre.
    let turns = |step: &Step| step.tilt.is_some() || (step.spin.is_some() && !frame.has_uniform_axes());
    if plan.steps.iter().any(|step| turns(step) || matches!(step.normal, Some(Normal::Force(_)))) {
        return None;
    }
    let approach = plan.max_prescribed_approach()?;
    // On inclined cells, motion in the frame's plane closes the gap, too.
    let sideways =
        if frame.has_uniform_axes() { 0.0 } else { plan.steps.iter().try_fold(0.0, tangential_travel)? };
    let needed = MARGIN * approach + sideways;
    Some(2f64.powf((2.0 * needed.log2()).ceil() / 2.0))
}

/// Adds the largest in-plane motion of body 2 in `step` to the motion `before` this step, mm. `None` if a prescribed
/// force determines the motion. The sum over all steps bounds the motion of the run.
fn tangential_travel(before: f64, step: &Step) -> Option<f64> {
    let shift = match step.tangential {
        Some(Tangential::Force(_)) => return None,
        Some(Tangential::Shift([x, y])) => x.hypot(y),
        None => 0.0,
    };
    Some(before + shift + step.kind.reach()?)
}

fn undeformed_before_contact(plan: &Plan) -> Result<bool, SceneError> {
    for (body, key) in plan.bodies.iter().zip(BODY_KEYS) {
        let Some(fe) = body.as_meshed() else { continue };
        let moves = fe.supports.iter().any(PrescribedDisplacement::is_moving);
        if fe.is_loaded() || moves || free_motions(body, key)?.is_some() {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Distance of the undeformed surfaces in each cell, `[N]`, mm.
fn initial_gap(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
) -> Result<Vec<f64>, SceneError> {
    let mut heights = [None, None];
    if plan.gap.shape == GapShape::Mesh {
        for (index, heights) in heights.iter_mut().enumerate() {
            let Some(fe) = plan.bodies[index].as_meshed() else { continue };
            *heights = Some(face_map(fe, index, frame)?.mean_heights(frame, &fe.mesh));
        }
    }
    if heights.iter().any(Option::is_some) {
        return Ok(surface_distances(plan, frame, heights, near)?.distance);
    }
    plan.gap.evaluate(frame).at("gap")
}
