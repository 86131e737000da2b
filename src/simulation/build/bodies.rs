//! Builds the bodies and the frame of a plan.

use std::sync::Arc;

use crate::body::hybrid::{HalfSpaceFit, Indicators};
use crate::body::{
    BeBody, ElasticBody, FeBody, HalfSpaceBody, HybridBody, RigidBody, TruncatedHalfSpace, TruncatedSpec,
};
use crate::coupling::{MIN_STEEP_COSINE, MeshedGap, mesh_distance};
use crate::error::{Context, Error, Result as Checked};
use crate::fem::{self, CacheContents, CondensationResources, RigidBodyModes};
use crate::frame::face_map::covered_cells;
use crate::frame::{ContactFrame, FaceMap, GapShape, MeshedSurface, Side};
use crate::geometry::format_point;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::output::near_field::NearFieldRecord;
use crate::output::truncation::TruncationRecord;
use crate::scene::plan::{BodyMaterial, BodyPlan, FramePlan, MeshedBodyPlan, Plan};
use crate::scene::spec::frame::FramePoints;
use crate::simulation::build::frame_edges::with_body_ends;
use crate::simulation::build::memory;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::build::settings::cross_blocks;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::omitted::needs_factor_after_condensation;
use crate::simulation::validate::flat_faces;
use crate::simulation::validate::symmetry_planes;

/// Keys of the two bodies in the scene.
pub(crate) const BODY_KEYS: [&str; 2] = ["body1", "body2"];

/// Side of the contact on which body 1 and body 2 lie.
pub(crate) const SIDES: [Side; 2] = [Side::Lower, Side::Upper];

/// Checks that a grid frame with its operator fits into memory.
///
/// # Errors
/// If it does not fit.
pub(in crate::simulation) fn ensure_grid(plan: &Plan, cells: [usize; 2]) -> Checked<()> {
    let bytes = memory::min_grid_bytes(plan, cells);
    let what = format!("a frame of {} x {} cells with its operator", cells[0], cells[1]);
    plan.memory_limit.ensure_available(bytes, &what, "use fewer cells (frame.cells)")
}

/// Contact frame of a plan, with the symmetry planes and the body edges at which it ends.
pub(crate) fn contact_frame(plan: &Plan) -> Result<ContactFrame, SceneError> {
    with_ends(plan, cells(plan)?)
}

/// Adds the symmetry planes at which `frame` ends, and the cells at which a body ends.
///
/// # Errors
/// As [`with_body_ends`].
pub(in crate::simulation) fn with_ends(plan: &Plan, frame: ContactFrame) -> Result<ContactFrame, SceneError> {
    let symmetry_bounds = symmetry_planes::symmetry_axes_at_frame_edge(plan, &frame);
    with_body_ends(plan, ContactFrame { symmetry_bounds, ..frame })
}

/// Contact frame of a plan, without symmetry planes and body edges.
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
                    let (origin, planes) = ((center, azimuth), symmetry_planes::symmetry_nodes(plan));
                    ContactFrame::from_nodes(mesh, (&fe.contact, side), origin, &planes)
                }
            };
            cells_over_other_body(plan, frame.at(BODY_KEYS[body])?.with_normal(normal.into()), body)
        }
    }
}

/// Drops the cells of a frame from the faces of body `index` that cannot touch the other body. Against a meshed body, it keeps the
/// cells over its contact faces. Otherwise, for a gap from the mesh, it keeps the cells whose normals point towards the plane of
/// the other body.
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
            "no face of `{}` of {} has nine tenths of its area opposite faces of `{}` of {}, seen along its normal: check the groups and the positions of the two meshes, or take the frame from the body with the smaller faces (frame.body)",
            plan.bodies[index].as_meshed().map_or("", |fe| fe.contact.as_str()),
            BODY_KEYS[index],
            fe.contact,
            BODY_KEYS[other]
        ));
        return Err(SceneError { error, key: contact });
    }
    Ok(frame.retain_cells(&covered))
}

/// A body that can compute its flexibility on the frame.
pub(super) struct BuiltBody {
    pub body: Box<dyn ElasticBody>,
    /// Memory that the body keeps, bytes.
    pub resident_bytes: usize,
    /// Near-field model, if the body has a mesh.
    pub near_field: Option<NearFieldRecord>,
    /// Truncation error of a half-space with a meshed surface.
    pub truncation: Option<TruncationRecord>,
    /// Warning about the construction of the body.
    pub warning: Option<String>,
}

impl BuiltBody {
    fn new(body: impl ElasticBody + 'static, resident_bytes: usize) -> Self {
        Self { body: Box::new(body), resident_bytes, near_field: None, truncation: None, warning: None }
    }

    fn with_near_field(self, record: NearFieldRecord) -> Self {
        Self { near_field: Some(record), ..self }
    }
}

/// Unconstrained rigid-body modes of `body`. `None` if the supports fix it, or if it is a half-space or rigid.
pub(crate) fn free_motions(body: &BodyPlan, key: &str) -> Result<Option<RigidBodyModes>, SceneError> {
    match body {
        BodyPlan::Fe(fe) => fem::find_rigid_body_modes(&fe.fem_spec(key)).at(key),
        BodyPlan::Be(be) => be.bem_spec(key).free_motions().at(key),
        BodyPlan::HalfSpace(_) | BodyPlan::TruncatedHalfSpace(_) | BodyPlan::Rigid => Ok(None),
    }
}

/// Rejected half-space near field: the reason and the indicators.
pub(super) struct HybridRejected {
    pub reason: String,
    pub indicators: Indicators,
}

/// Builds body `index` (0 or 1) with its near-field model and its worn mesh, if any, within the memory `left`. Returns the reason
/// if the half-space near field is rejected.
pub(super) fn build_body(
    plan: &Plan,
    (index, worn): (usize, Option<Arc<Mesh>>),
    (frame, near): (&ContactFrame, &NearFieldModel),
    left: MemoryLimit,
) -> Result<Result<BuiltBody, HybridRejected>, SceneError> {
    let key = BODY_KEYS[index];
    Ok(Ok(match &plan.bodies[index] {
        BodyPlan::Rigid => BuiltBody::new(RigidBody, 0),
        BodyPlan::HalfSpace(elastic) => {
            let mut body = configured_half_space(plan, elastic, index, frame)?;
            body.memory = left;
            memory::ensure_half_space_fits(plan, frame, &body, &left).at(key)?;
            let held = memory::half_space_bytes(plan, frame, &body);
            let asked = plan.interior_requests.iter().any(|request| request.side == SIDES[index]);
            let note =
                asked.then(|| body.prepare_interior_field()).transpose().at("output.inside")?.flatten();
            let warning = note.map(|note| format!("{key}: {note}"));
            BuiltBody { warning, ..BuiltBody::new(body, held) }
        }
        BodyPlan::TruncatedHalfSpace(spec) => {
            let stiffness = spec.material.stiffness_in_frame(0.0);
            let spec = TruncatedSpec { stiffness: &stiffness, half_size: spec.half_size };
            let body =
                TruncatedHalfSpace::new(&spec, SIDES[index], frame, (plan.flexibility_cache.as_ref(), &left))
                    .at(&format!("{key}.truncated"))?;
            let (held, warning) = (body.held_bytes(), body.cache_warning().map(str::to_owned));
            let truncation = Some(TruncationRecord::new(index, body.truncation()));
            BuiltBody { warning, truncation, ..BuiltBody::new(body, held) }
        }
        BodyPlan::Be(be) => {
            face_map(&be.meshed, index, frame)?;
            let contact = (be.meshed.contact.as_str(), SIDES[index]);
            let mut body =
                BeBody::new(&be.bem_spec(key), contact, frame, (plan.flexibility_cache.as_ref(), &left))
                    .at(key)?;
            let (held, note) = (body.held_bytes(), body.cache_warning().map(str::to_owned));
            let elastic = &be.meshed.material;
            body.limit =
                plan.strength_limits.get(&elastic.name).map(|limit| (*limit, elastic.material_axes(0.0)));
            BuiltBody { warning: note, ..BuiltBody::new(body, held) }
        }
        BodyPlan::Fe(fe) => {
            // [`FeBody`] builds this map again. The call here only attributes errors to the right scene key.
            face_map(fe, index, frame)?;
            if let Some(site) = near.half_space_fit() {
                return build_hybrid(plan, fe, (index, frame, site), left);
            }
            let cache_contents = if needs_factor_after_condensation(plan, frame) {
                CacheContents::FlexibilityAndFactor
            } else {
                CacheContents::Flexibility
            };
            let resources = CondensationResources {
                cache: plan.flexibility_cache.as_ref(),
                cache_contents,
                memory: left,
            };
            let contact = (fe.contact.as_str(), SIDES[index]);
            let mut body =
                FeBody::with_worn_mesh(fe.fem_spec(key), contact, frame, &resources, worn).at(key)?;
            let held = memory::resident_bytes(&body);
            body.limits.clone_from(&plan.strength_limits);
            let reason = match near {
                NearFieldModel::Mesh(why) | NearFieldModel::RejectedHalfSpace(why) => Some(why.clone()),
                NearFieldModel::Unmeshed | NearFieldModel::HalfSpace(_) => None,
            };
            BuiltBody::new(body, held).with_near_field(NearFieldRecord {
                body: index + 1,
                near_field: "mesh",
                reason,
                max_face_deviation: None,
                own_error: None,
                indicators: None,
            })
        }
    }))
}

/// Builds body `index` with a half-space near field at `site`, corrected by its mesh.
fn build_hybrid(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    (index, frame, site): (usize, &ContactFrame, &HalfSpaceFit),
    left: MemoryLimit,
) -> Result<Result<BuiltBody, HybridRejected>, SceneError> {
    let key = BODY_KEYS[index];
    let resources = CondensationResources {
        cache: plan.flexibility_cache.as_ref(),
        cache_contents: CacheContents::Flexibility,
        memory: left,
    };
    let contact = (fe.contact.as_str(), SIDES[index]);
    let mut body = HybridBody::new(fe.fem_spec(key), contact, frame, site, &resources).at(key)?;
    let indicators = *body.indicators();
    if let Some(reason) = indicators.rejection_reason() {
        return Ok(Err(HybridRejected { reason, indicators }));
    }
    let (held, warning, own_error) =
        (body.held_bytes(), body.cache_warning().map(str::to_owned), body.applied_load_error());
    body.limits.clone_from(&plan.strength_limits);
    Ok(Ok(BuiltBody { warning, ..BuiltBody::new(body, held) }.with_near_field(NearFieldRecord {
        body: index + 1,
        near_field: "half-space",
        reason: None,
        max_face_deviation: flat_faces::max_curvature_correction(plan, fe, index, frame)?,
        own_error,
        indicators: Some(indicators),
    })))
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
    Ok(body.with_tolerance(plan.solver.compression_tolerance).with_blocks(cross_blocks(plan, frame)))
}

/// Half-space of the material `elastic` for body `index`, without the settings of the plan.
pub(in crate::simulation) fn bare_half_space(
    elastic: &BodyMaterial,
    index: usize,
    frame: &ContactFrame,
) -> Result<HalfSpaceBody, SceneError> {
    HalfSpaceBody::new(&elastic.stiffness_in_frame(0.0), SIDES[index], frame).at(BODY_KEYS[index])
}

/// Map between `frame` and the contact faces of body `index`. Errors for uncovered cells name the key of the grid, or of the
/// contact group if the frame is no grid.
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

/// Refuses a contact group without faces whose outward normals point towards the other body along the frame's normal.
fn ensure_faces_other_body(
    fe: &MeshedBodyPlan,
    faces: &[SurfaceFace],
    frame: &ContactFrame,
    index: usize,
) -> Checked<()> {
    let towards = frame.axes.normal() * if index == 0 { 1.0 } else { -1.0 };
    let outward = |face: &SurfaceFace| face.area_vector(&fe.mesh).dot(&towards);
    let looking: f64 = faces.iter().map(|face| outward(face).max(0.0)).sum();
    // A lateral face of a block has a component along the normal by rounding only.
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

/// Initial gap between the meshed surfaces of `plan`. `heights` are the mean surface heights of both bodies in each cell, `[N]`,
/// mm. `near` are the near-field models of both bodies.
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
    mesh_distance(frame, surfaces.each_ref().map(Option::as_ref)).at("gap")
}
