//! Meshes of bodies whose contact surface has moved with wear.

use std::sync::Arc;

use crate::body::worn_mesh::worn_mesh;
use crate::frame::ContactFrame;
use crate::mesh::Mesh;
use crate::omitted::OmittedWork;
use crate::scene::plan::Plan;
use crate::simulation::build::contact_frame::contact_frame;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, wears, worn_bodies};

/// Worn meshes of the two bodies; `None` for meshes that have not moved.
pub type WornMeshes = [Option<Arc<Mesh>>; 2];

/// Meshes of the worn bodies for the wear depth `worn` on `frame` (sum of both bodies, `[N]`, mm). Without `frame`,
/// `worn` belongs to the frame of the plan. If `worn` is empty, no mesh has moved.
///
/// # Errors
/// If the plan's frame is invalid, an element would invert or become too flat, or memory does not suffice.
pub fn worn_meshes(
    plan: &Plan,
    frame: Option<&ContactFrame>,
    worn: &[f64],
) -> std::result::Result<WornMeshes, SceneError> {
    let mut meshes = [None, None];
    if worn.is_empty() {
        return Ok(meshes);
    }
    let own = if frame.is_none() { Some(contact_frame(plan)?) } else { None };
    let Some(frame) = frame.or(own.as_ref()) else { return Ok(meshes) };
    for (index, fe, part) in worn_bodies(plan) {
        let depth: Vec<f64> = worn.iter().map(|depth| part * depth).collect();
        let spec = fe.fem_spec(BODY_KEYS[index]);
        let mesh = worn_mesh(&spec, &fe.contact, SIDES[index], frame, &depth, &plan.memory_limit);
        meshes[index] = Some(Arc::new(mesh.at(BODY_KEYS[index])?));
    }
    Ok(meshes)
}

pub(super) fn omitted_work(plan: &Plan) -> Option<OmittedWork> {
    let steps = plan.steps.iter().any(|step| step.wear);
    (plan.mesh_motion_threshold.is_none() && steps && wears(plan)).then(|| {
        let why = "wear.move_mesh is not given: wear changes the gap, but not the stiffness of the bodies";
        OmittedWork::new(None, "moving meshes with wear", why)
    })
}
