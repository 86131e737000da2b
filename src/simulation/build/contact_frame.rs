//! Builds the contact frame of a plan.

use crate::coupling::MIN_STEEP_COSINE;
use crate::error::{Error, Result as Checked};
use crate::frame::face_map::covered_cells;
use crate::frame::{ContactFrame, GapShape};
use crate::mesh::faces::group_faces;
use crate::scene::plan::{FramePlan, Plan};
use crate::scene::spec::frame::FramePoints;
use crate::simulation::build::frame_edges::with_body_ends;
use crate::simulation::build::memory;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, ensure_faces_other_body};
use crate::simulation::validate::symmetry_planes;

/// Checks that a grid frame with its operator fits into memory.
///
/// # Errors
/// If it does not fit.
pub(crate) fn ensure_grid(plan: &Plan, cells: [usize; 2]) -> Checked<()> {
    let bytes = memory::min_grid_bytes(plan, cells);
    let what = format!("a frame of {} x {} cells with its operator", cells[0], cells[1]);
    plan.memory_limit.ensure_available(bytes, &what, "use fewer cells (frame.cells)")
}

/// Contact frame of a plan, with the symmetry planes and the body edges at which it ends.
pub(crate) fn contact_frame(plan: &Plan) -> Result<ContactFrame, SceneError> {
    with_ends(plan, cells(plan)?)
}

/// Adds the symmetry planes and the body edges at which `frame` ends.
///
/// # Errors
/// As [`with_body_ends`].
pub(crate) fn with_ends(plan: &Plan, frame: ContactFrame) -> Result<ContactFrame, SceneError> {
    let symmetry_bounds = symmetry_planes::symmetry_axes_at_frame_edge(plan, &frame);
    with_body_ends(plan, ContactFrame { symmetry_bounds, ..frame })
}

fn cells(plan: &Plan) -> Result<ContactFrame, SceneError> {
    match plan.frame {
        FramePlan::Grid { half_width, cells, center, azimuth, periodic, ref outline, .. } => {
            ensure_grid(plan, cells).at("frame.cells")?;
            let frame = ContactFrame::grid(half_width, cells, center, azimuth).at("frame")?;
            let frame = frame.with_periodicity(periodic);
            match outline {
                Some(outline) => frame.clipped_to(outline).at("frame.outline"),
                None => Ok(frame),
            }
        }
        FramePlan::Mesh { body, points, center, azimuth, normal } => {
            let fe = plan.bodies[body].as_meshed().ok_or_else(|| SceneError {
                error: Error::input("the frame uses the faces of a body without a mesh"),
                key: "frame.body".to_owned(),
            })?;
            let (mesh, side) = (&fe.mesh, SIDES[body]);
            let frame = match points {
                FramePoints::Faces => ContactFrame::from_faces(mesh, &fe.contact, side, center, azimuth),
                FramePoints::Nodes => {
                    let planes = symmetry_planes::symmetry_nodes(plan);
                    ContactFrame::from_nodes(mesh, &fe.contact, side, center, azimuth, &planes)
                }
            };
            cells_over_other_body(plan, frame.at(BODY_KEYS[body])?.with_normal(normal.into()), body)
        }
    }
}

/// Drops the cells of a frame of body `index` that cannot touch the other body. If the other body is meshed, the cells
/// opposite its contact faces remain. Otherwise, if the gap comes from the mesh, the cells whose normals point towards
/// the plane of the other body remain.
fn cells_over_other_body(plan: &Plan, frame: ContactFrame, index: usize) -> Result<ContactFrame, SceneError> {
    let other = 1 - index;
    let Some(fe) = plan.bodies[other].as_meshed() else {
        let n = frame.axes.normal();
        let cosine = |cell: usize| frame.triads[cell].normal().dot(&n);
        let looks: Vec<bool> = (0..frame.n_cells()).map(|cell| cosine(cell) >= MIN_STEEP_COSINE).collect();
        let some_look_away = looks.contains(&true) && looks.contains(&false);
        let is_ring = plan.gap.shape == GapShape::Mesh && some_look_away;
        return Ok(if is_ring { frame.retain_cells(&looks) } else { frame });
    };
    let contact = format!("{}.contact", BODY_KEYS[other]);
    let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
    let covered = covered_cells(&frame, &fe.mesh, &faces, SIDES[other]);
    if !covered.contains(&true) {
        for (body, key) in BODY_KEYS.into_iter().enumerate() {
            let Some(fe) = plan.bodies[body].as_meshed() else { continue };
            let contact = format!("{key}.contact");
            let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
            ensure_faces_other_body(fe, &faces, &frame, body).at(&contact)?;
        }
        let error = Error::input(format!(
            "no face of `{}` ({}), seen along the normal of the face, is covered to nine tenths by faces of `{}` ({}): check the groups and the positions of the two meshes, or take the frame from the body with the smaller faces (frame.body)",
            plan.bodies[index].as_meshed().map_or("", |fe| fe.contact.as_str()),
            BODY_KEYS[index],
            fe.contact,
            BODY_KEYS[other]
        ));
        return Err(SceneError { error, key: contact });
    }
    Ok(frame.retain_cells(&covered))
}
