//! Keys, contact faces, unconstrained motions and half-spaces of the bodies of a plan, and the bodies that wear.

use crate::body::{HalfSpaceBody, LoadCase};
use crate::error::{Context, Error, Result as Checked};
use crate::fem::{self, RigidBodyModes};
use crate::frame::{ContactFrame, FaceMap, Side};
use crate::geometry::format_point;
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::scene::plan::{BodyMaterial, BodyPlan, MeshedBodyPlan, Plan};
use crate::scene::spec::body::BulkStress;
use crate::simulation::build::settings::cross_blocks;
use crate::simulation::failure::{AtKey, SceneError};

pub(crate) const BODY_KEYS: [&str; 2] = ["body1", "body2"];

pub(crate) const SIDES: [Side; 2] = [Side::Lower, Side::Upper];

/// Unconstrained rigid-body modes of `body`; `None` if `body` has no mesh, or if its supports fix it.
pub(crate) fn free_motions(body: &BodyPlan, key: &str) -> Result<Option<RigidBodyModes>, SceneError> {
    match body {
        BodyPlan::Fe(fe) => fem::find_rigid_body_modes(&fe.fem_spec(key)).at(key),
        BodyPlan::Be(be) => be.bem_spec(key).free_motions().at(key),
        BodyPlan::HalfSpace(_) | BodyPlan::TruncatedHalfSpace(_) | BodyPlan::Rigid => Ok(None),
    }
}

/// Half-space of the material `elastic` for body `index`, with the cache and operator settings of the plan.
pub(crate) fn configured_half_space(
    plan: &Plan,
    elastic: &BodyMaterial,
    index: usize,
    frame: &ContactFrame,
) -> Result<HalfSpaceBody, SceneError> {
    let stiffness = elastic.stiffness_in_frame(0.0);
    let mut body = HalfSpaceBody::new(&stiffness, SIDES[index], frame).at(BODY_KEYS[index])?;
    body.cache.clone_from(&plan.flexibility_cache);
    let loads = &plan.half_space_loads[index];
    if let Some(BulkStress { name, value, preload }) = &loads.bulk_stress {
        let key = format!("{}.bulk_stress", BODY_KEYS[index]);
        let case = LoadCase { name: name.clone(), preload: *preload };
        body = body.with_bulk_stress(*value, case, frame).at(&key)?;
    }
    if let Some(temperature) = &loads.temperature {
        let key = format!("{}.temperature_change", BODY_KEYS[index]);
        let strain = elastic.thermal_strain(temperature.change);
        body = body.with_thermal_strain(&strain, temperature.case.clone(), frame).at(&key)?;
    }
    Ok(body.with_tolerance(plan.solver.compression_tolerance).with_blocks(cross_blocks(plan, frame)))
}

/// As [`configured_half_space`], without the settings of the plan.
pub(crate) fn bare_half_space(
    elastic: &BodyMaterial,
    index: usize,
    frame: &ContactFrame,
) -> Result<HalfSpaceBody, SceneError> {
    HalfSpaceBody::new(&elastic.stiffness_in_frame(0.0), SIDES[index], frame).at(BODY_KEYS[index])
}

/// Map between `frame` and the contact faces of body `index`. If the map fails on a grid, the error has the key
/// `frame.half_width`. On other frames, the error has the key of the contact group.
pub(crate) fn face_map(
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
) -> Result<FaceMap, SceneError> {
    let contact = format!("{}.contact", BODY_KEYS[index]);
    let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
    if frame.grid.is_some() {
        ensure_faces_other_body(fe, &faces, frame, index).at(&contact)?;
    }
    let key = if frame.grid.is_some() { "frame.half_width" } else { &contact };
    FaceMap::new(frame, &fe.mesh, &faces, SIDES[index]).context(|| BODY_KEYS[index].to_owned()).at(key)
}

/// Refuses a contact group without faces oriented towards the other body.
pub(super) fn ensure_faces_other_body(
    fe: &MeshedBodyPlan,
    faces: &[SurfaceFace],
    frame: &ContactFrame,
    index: usize,
) -> Checked<()> {
    let towards = frame.axes.normal() * if index == 0 { 1.0 } else { -1.0 };
    let outward = |face: &SurfaceFace| face.area_vector(&fe.mesh).dot(&towards);
    let looking: f64 = faces.iter().map(|face| outward(face).max(0.0)).sum();
    // Rounding alone gives a lateral face of a block a component along the normal.
    if looking > 1e-6 * faces.iter().map(|face| face.area(&fe.mesh)).sum::<f64>() {
        return Ok(());
    }
    Err(Error::input(format!(
        "none of the {} faces of `{}` is oriented towards {}: the outward normals of {} must point along {}, because body 1 is below and body 2 above; name the group on the other side, or rotate the mesh",
        faces.len(),
        fe.contact,
        BODY_KEYS[1 - index],
        BODY_KEYS[index],
        format_point(&towards.into())
    )))
}

/// Finite-element bodies of a plan with a positive share of the wear depth: index, body, and share.
pub(crate) fn worn_bodies(plan: &Plan) -> impl Iterator<Item = (usize, &MeshedBodyPlan, f64)> {
    let parts = [plan.wear_share, 1.0 - plan.wear_share];
    let bodies = plan.bodies.iter().zip(parts).enumerate();
    bodies
        .filter_map(|(index, (body, part))| Some((index, body.as_fe()?, part)))
        .filter(|(.., part)| *part > 0.0)
}

pub(crate) fn wears(plan: &Plan) -> bool {
    plan.wear.specific_rate(plan.friction.ellipse()).is_some() && worn_bodies(plan).next().is_some()
}
