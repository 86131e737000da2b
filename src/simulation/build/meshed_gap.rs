//! Initial gap between meshed surfaces.

use crate::coupling::{MeshedGap, meshed_gap};
use crate::frame::{ContactFrame, MeshedSurface};
use crate::mesh::faces::group_faces;
use crate::scene::plan::Plan;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES};

/// Initial gap between the meshed surfaces. `heights` are the mean surface heights of both bodies in each cell, `[N]`, mm.
pub(crate) fn surface_distances(
    plan: &Plan,
    frame: &ContactFrame,
    heights: [Option<Vec<f64>>; 2],
    near: &[NearFieldModel; 2],
) -> Result<MeshedGap, SceneError> {
    let mut surfaces = [None, None];
    for (index, heights) in heights.into_iter().enumerate() {
        let Some((fe, mean_heights)) = plan.bodies[index].as_meshed().zip(heights) else { continue };
        surfaces[index] = Some(MeshedSurface {
            mesh: fe.mesh.clone(),
            faces: group_faces(&fe.mesh, &fe.contact).at(BODY_KEYS[index])?,
            side: SIDES[index],
            mean_heights,
            curved_gap: near[index].corrects_face_curvature(),
        });
    }
    meshed_gap(&plan.gap, frame, surfaces.each_ref().map(Option::as_ref)).at("gap")
}
