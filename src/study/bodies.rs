//! Bodies and frame of a plan.

use std::sync::Arc;

use super::failure::{AtKey, Failure};
use super::flat_faces;
use super::memory;
use super::near_field::Near;
use super::planes;
use super::settings::cross;
use super::skips::needs_solves;
use crate::body::hybrid::{Indicators, Site};
use crate::body::{
    BeBody, ElasticBody, FeBody, HalfSpaceBody, HybridBody, RigidBody, TruncatedHalfSpace, TruncatedSpec,
};
use crate::coupling::mesh_distance;
use crate::error::{Context, Error, Result as Checked};
use crate::fem::{self, FreeMotions, Keep, Resources};
use crate::frame::map::covered;
use crate::frame::{ContactFrame, FaceMap, MeshedSurface, Side};
use crate::geometry::place;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::results::near_field::NearFieldRecord;
use crate::results::truncation::TruncationRecord;
use crate::scene::keys::frame::FramePoints;
use crate::scene::plan::{BodySpec, Elastic, FrameSpec, MeshedSpec, Plan};

/// Keys of the two bodies in the scene.
pub(super) const KEYS: [&str; 2] = ["body1", "body2"];

/// The two sides of the frame.
pub(super) const SIDES: [Side; 2] = [Side::Lower, Side::Upper];

/// Checks that a grid frame fits into the memory.
///
/// # Errors
/// If it does not.
pub(super) fn ensure_grid(plan: &Plan, cells: [usize; 2]) -> Checked<()> {
    let bytes = memory::least_of_grid(plan, cells);
    let what = format!("a frame of {} x {} cells with its operator", cells[0], cells[1]);
    plan.memory.ensure(bytes, &what, "use fewer cells (frame.cells)")
}

/// The contact frame of a plan, with the planes of symmetry at which it ends.
pub(super) fn frame(plan: &Plan) -> Result<ContactFrame, Failure> {
    let frame = cells(plan)?;
    let bounded = planes::bounding(plan, &frame);
    Ok(ContactFrame { bounded, ..frame })
}

/// The cells of the frame of a plan.
fn cells(plan: &Plan) -> Result<ContactFrame, Failure> {
    match plan.frame {
        FrameSpec::Grid { half_width, cells, center, azimuth, periodic, ref outline, .. } => {
            ensure_grid(plan, cells).at("frame.cells")?;
            let frame = ContactFrame::grid(half_width, cells, center, azimuth).at("frame")?;
            let frame = frame.repeated(periodic);
            match outline {
                Some(outline) => frame.within(outline).at("frame.outline"),
                None => Ok(frame),
            }
        }
        FrameSpec::Mesh { body, points, center, azimuth, normal } => {
            let fe = plan.bodies[body].meshed().ok_or_else(|| Failure {
                error: Error::input("the frame takes the faces of a body that has no mesh"),
                key: "frame.body".to_owned(),
            })?;
            let (mesh, side) = (&fe.mesh, SIDES[body]);
            let frame = match points {
                FramePoints::Faces => ContactFrame::from_faces(mesh, &fe.contact, side, center, azimuth),
                FramePoints::Nodes => {
                    let (origin, planes) = ((center, azimuth), planes::constraining(plan));
                    ContactFrame::from_nodes_on_planes(mesh, (&fe.contact, side), origin, &planes)
                }
            };
            opposite_cells(plan, frame.at(KEYS[body])?.with_normal(normal.into()), body)
        }
    }
}

/// The cells of a frame of body `index`'s faces that lie over faces of the other body, if that is meshed; the others
/// stay open whatever happens.
fn opposite_cells(plan: &Plan, frame: ContactFrame, index: usize) -> Result<ContactFrame, Failure> {
    let other = 1 - index;
    let Some(fe) = plan.bodies[other].meshed() else { return Ok(frame) };
    let contact = format!("{}.contact", KEYS[other]);
    let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
    let covered = covered(&frame, &fe.mesh, &faces, SIDES[other]);
    if !covered.contains(&true) {
        for (body, key) in KEYS.into_iter().enumerate() {
            let Some(fe) = plan.bodies[body].meshed() else { continue };
            let contact = format!("{key}.contact");
            let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
            faces_the_other(fe, &faces, &frame, body).at(&contact)?;
        }
        let error = Error::input(format!(
            "no face of `{}` of {} lies over faces of `{}` of {} with nine tenths of its area, seen along its normal: check \
             the groups and the places of the two meshes, or take the frame from the body with the smaller faces \
             (frame.body)",
            plan.bodies[index].meshed().map_or("", |fe| fe.contact.as_str()),
            KEYS[index],
            fe.contact,
            KEYS[other]
        ));
        return Err(Failure { error, key: contact });
    }
    Ok(frame.keep(&covered))
}

/// A body that is ready to give its flexibility on the frame.
pub(super) struct Made {
    pub body: Box<dyn ElasticBody>,
    /// Bytes that it keeps.
    pub held_bytes: usize,
    /// Where its near field is computed, if it has a mesh.
    pub near_field: Option<NearFieldRecord>,
    /// How far a half-space whose surface is meshed is from one.
    pub truncation: Option<TruncationRecord>,
    /// What the user should know of how it was made.
    pub note: Option<String>,
}

impl Made {
    fn new(body: impl ElasticBody + 'static, held_bytes: usize) -> Self {
        Self { body: Box::new(body), held_bytes, near_field: None, truncation: None, note: None }
    }

    fn with_near_field(self, record: NearFieldRecord) -> Self {
        Self { near_field: Some(record), ..self }
    }
}

/// The rigid motions that the supports of `body` leave free; `None` if it is held, or has none.
pub(super) fn free_motions(body: &BodySpec, key: &str) -> Result<Option<FreeMotions>, Failure> {
    match body {
        BodySpec::Fe(fe) => fem::free_motions(&fe.inputs(key)).at(key),
        BodySpec::Be(be) => be.inputs(key).free_motions().at(key),
        BodySpec::HalfSpace(_) | BodySpec::Truncated(_) | BodySpec::Rigid => Ok(None),
    }
}

/// The half-space of a body that must not be used: why, and its indicators.
pub(super) struct GivenUp {
    pub reason: String,
    pub indicators: Indicators,
}

/// Body `index` (0 or 1) of a plan with its choice of near field, with the stiffness of its worn mesh where there is one, within the
/// memory `left` for it; or why its half-space must not be used.
pub(super) fn body(
    plan: &Plan,
    (index, worn): (usize, Option<Arc<Mesh>>),
    (frame, near): (&ContactFrame, &Near),
    left: MemoryLimit,
) -> Result<Result<Made, GivenUp>, Failure> {
    let key = KEYS[index];
    Ok(Ok(match &plan.bodies[index] {
        BodySpec::Rigid => Made::new(RigidBody, 0),
        BodySpec::HalfSpace(elastic) => {
            let body = half_space_of(plan, elastic, index, frame)?.with_memory(left);
            memory::ensure(plan, frame, &body, &left).at(key)?;
            let held = memory::of_half_space(plan, frame, &body);
            let asked = plan.inside.iter().any(|request| request.side == SIDES[index]);
            let note = asked.then(|| body.make_inside()).transpose().at("output.inside")?.flatten();
            let note = note.map(|note| format!("{key}: {note}"));
            Made { note, ..Made::new(body, held) }
        }
        BodySpec::Truncated(spec) => {
            let stiffness = spec.elastic.in_axes(0.0);
            let spec = TruncatedSpec { stiffness: &stiffness, half_size: spec.half_size };
            let body = TruncatedHalfSpace::new(&spec, SIDES[index], frame, (plan.cache.as_ref(), &left))
                .at(&format!("{key}.truncated"))?;
            let (held, note, record) = (
                body.held_bytes(),
                body.note().map(str::to_owned),
                TruncationRecord::new(index, body.truncation()),
            );
            Made { note, truncation: Some(record), ..Made::new(body, held) }
        }
        BodySpec::Be(be) => {
            face_map(&be.meshed, index, frame)?;
            let contact = (be.meshed.contact.as_str(), SIDES[index]);
            let body = BeBody::new(&be.inputs(key), contact, frame, (plan.cache.as_ref(), &left)).at(key)?;
            let (held, note) = (body.held_bytes(), body.note().map(str::to_owned));
            let elastic = &be.meshed.elastic;
            let limit = plan.limits.get(&elastic.name).map(|limit| (*limit, elastic.axes(0.0)));
            Made { note, ..Made::new(body.with_limit(limit), held) }
        }
        BodySpec::Fe(fe) => {
            // Made again with the body; here for the key of what is wrong with it.
            face_map(fe, index, frame)?;
            if let Some(site) = near.site() {
                return half_space_under(plan, fe, (index, frame, site), left);
            }
            let keep = if needs_solves(plan, frame) { Keep::FactorToo } else { Keep::Flexibility };
            let resources = Resources { cache: plan.cache.as_ref(), keep, memory: left };
            let contact = (fe.contact.as_str(), SIDES[index]);
            let body = FeBody::worn(fe.inputs(key), contact, frame, &resources, worn).at(key)?;
            let held = memory::held(&body);
            let body = body.with_limits(plan.limits.clone());
            let reason = match near {
                Near::Mesh(why) | Near::GivenUp(why) => Some(why.clone()),
                Near::Own | Near::HalfSpace(_) => None,
            };
            Made::new(body, held).with_near_field(NearFieldRecord {
                body: index + 1,
                near_field: "mesh",
                reason,
                bow: None,
                own_error: None,
                indicators: None,
            })
        }
    }))
}

/// Body `index` as the half-space of `site`, corrected by its mesh.
fn half_space_under(
    plan: &Plan,
    fe: &MeshedSpec,
    (index, frame, site): (usize, &ContactFrame, &Site),
    left: MemoryLimit,
) -> Result<Result<Made, GivenUp>, Failure> {
    let key = KEYS[index];
    let resources = Resources { cache: plan.cache.as_ref(), keep: Keep::Flexibility, memory: left };
    let contact = (fe.contact.as_str(), SIDES[index]);
    let body = HybridBody::new(fe.inputs(key), contact, frame, site, &resources).at(key)?;
    let indicators = *body.indicators();
    if let Some(reason) = indicators.objection() {
        return Ok(Err(GivenUp { reason, indicators }));
    }
    let (held, note, own_error) = (body.held_bytes(), body.note().map(str::to_owned), body.own_error());
    let body = body.with_limits(plan.limits.clone());
    Ok(Ok(Made { note, ..Made::new(body, held) }.with_near_field(NearFieldRecord {
        body: index + 1,
        near_field: "half-space",
        reason: None,
        bow: flat_faces::largest_bow(plan, fe, index, frame)?,
        own_error,
        indicators: Some(indicators),
    })))
}

/// Body `index` of `elastic` as a half-space with the settings of a plan.
pub(super) fn half_space_of(
    plan: &Plan,
    elastic: &Elastic,
    index: usize,
    frame: &ContactFrame,
) -> Result<HalfSpaceBody, Failure> {
    let stiffness = elastic.in_axes(0.0);
    let body =
        HalfSpaceBody::sharing(&stiffness, SIDES[index], frame, plan.kernels.clone()).at(KEYS[index])?;
    let body = body.with_cache(plan.cache.clone());
    Ok(body.with_tolerance(plan.solver.compression_tolerance).with_blocks(cross(plan, frame)))
}

/// Body `index` of `elastic` as a half-space.
pub(super) fn half_space(
    elastic: &Elastic,
    index: usize,
    frame: &ContactFrame,
) -> Result<HalfSpaceBody, Failure> {
    HalfSpaceBody::new(&elastic.in_axes(0.0), SIDES[index], frame).at(KEYS[index])
}

/// The map between `frame` and the contact faces of body `index`; cells that they do not cover are the frame's
/// mistake where it is a grid.
pub(super) fn face_map(fe: &MeshedSpec, index: usize, frame: &ContactFrame) -> Result<FaceMap, Failure> {
    let contact = format!("{}.contact", KEYS[index]);
    let faces = group_faces(&fe.mesh, &fe.contact).at(&contact)?;
    if frame.grid.is_some() {
        faces_the_other(fe, &faces, frame, index).at(&contact)?;
    }
    let key = if frame.grid.is_some() { "frame.half_width" } else { &contact };
    FaceMap::new(frame, &fe.mesh, &faces, SIDES[index]).context(|| KEYS[index].to_owned()).at(key)
}

/// Refuses a contact group none of whose faces look towards the other body over a plane frame.
fn faces_the_other(
    fe: &MeshedSpec,
    faces: &[SurfaceFace],
    frame: &ContactFrame,
    index: usize,
) -> Checked<()> {
    let towards = frame.axes.normal() * if index == 0 { 1.0 } else { -1.0 };
    let outward = |face: &SurfaceFace| face.area_vector(&fe.mesh).dot(&towards);
    let looking: f64 = faces.iter().map(|face| outward(face).max(0.0)).sum();
    // A side face of a block looks by rounding only.
    if looking > 1e-6 * faces.iter().map(|face| face.area(&fe.mesh)).sum::<f64>() {
        return Ok(());
    }
    Err(Error::input(format!(
        "none of the {} faces of `{}` looks towards {}: those of {} must look along {} (outward normal), for body 1 is \
         below and body 2 above; name the group of the other side, or turn the mesh",
        faces.len(),
        fe.contact,
        KEYS[1 - index],
        KEYS[index],
        place(&towards.into())
    )))
}

/// The distances of the surfaces that `plan` has meshes of, cell by cell; `heights` of the two bodies over the cells, and how their
/// near fields are chosen.
pub(super) fn distances(
    plan: &Plan,
    frame: &ContactFrame,
    heights: [Option<Vec<f64>>; 2],
    near: &[Near; 2],
) -> Result<Vec<f64>, Failure> {
    let mut faces = [Vec::new(), Vec::new()];
    for (index, (faces, body)) in faces.iter_mut().zip(&plan.bodies).enumerate() {
        if let Some(fe) = body.meshed() {
            *faces = group_faces(&fe.mesh, &fe.contact).at(KEYS[index])?;
        }
    }
    let mut surfaces = [None, None];
    for (index, heights) in heights.into_iter().enumerate() {
        surfaces[index] = plan.bodies[index].meshed().zip(heights).map(|(fe, heights)| MeshedSurface {
            mesh: &fe.mesh,
            faces: &faces[index],
            side: SIDES[index],
            heights,
        });
        if let Some(surface) = surfaces[index].as_mut().filter(|_| near[index].is_bowed()) {
            surface.heights = surface.bowed_heights(frame);
        }
    }
    mesh_distance(frame, surfaces.each_ref().map(Option::as_ref)).at("gap")
}
