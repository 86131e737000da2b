//! Builds the bodies of a plan.

use std::sync::Arc;

use crate::body::hybrid::{HalfSpaceFit, Indicators};
use crate::body::{BeBody, ElasticBody, FeBody, HybridBody, RigidBody, TruncatedHalfSpace, TruncatedSpec};
use crate::fem::{CacheContents, CondensationResources};
use crate::frame::ContactFrame;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::Mesh;
use crate::output::near_field::NearFieldRecord;
use crate::output::truncation::TruncationRecord;
use crate::scene::plan::{BeBodyPlan, BodyMaterial, BodyPlan, MeshedBodyPlan, Plan, TruncatedHalfSpacePlan};
use crate::simulation::build::memory;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::omitted::needs_factor_after_condensation;
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, configured_half_space, face_map};
use crate::simulation::validate::flat_faces;

pub(super) struct BuiltBody {
    pub body: Box<dyn ElasticBody>,
    pub resident_bytes: usize,
    pub near_field: Option<NearFieldRecord>,
    pub truncation: Option<TruncationRecord>,
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

pub(super) struct HybridRejected {
    pub reason: String,
    pub indicators: Indicators,
}

/// Builds body `index` (0 or 1) within the memory `left`, or returns why its half-space near field is rejected.
pub(super) fn build_body(
    plan: &Plan,
    index: usize,
    worn: Option<Arc<Mesh>>,
    frame: &ContactFrame,
    near: &NearFieldModel,
    left: MemoryLimit,
) -> Result<Result<BuiltBody, HybridRejected>, SceneError> {
    match &plan.bodies[index] {
        BodyPlan::Rigid => Ok(Ok(BuiltBody::new(RigidBody, 0))),
        BodyPlan::HalfSpace(elastic) => build_half_space(plan, elastic, index, frame, left).map(Ok),
        BodyPlan::TruncatedHalfSpace(spec) => build_truncated(plan, spec, index, frame, left).map(Ok),
        BodyPlan::Be(be) => build_be(plan, be, index, frame, left).map(Ok),
        BodyPlan::Fe(fe) => {
            // [`FeBody`] builds the same map later. This call gives errors of the map the right scene key.
            face_map(fe, index, frame)?;
            match near.half_space_fit() {
                Some(site) => build_hybrid(plan, fe, index, frame, site, left),
                None => build_fe(plan, fe, worn, index, frame, near, left).map(Ok),
            }
        }
    }
}

/// Builds the half-space body `index`, and prepares its interior field if the scene requests interior points.
fn build_half_space(
    plan: &Plan,
    elastic: &BodyMaterial,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BuiltBody, SceneError> {
    let key = BODY_KEYS[index];
    let mut body = configured_half_space(plan, elastic, index, frame)?;
    body.memory = left;
    memory::ensure_half_space_fits(plan, frame, &body, &left).at(key)?;
    let held = memory::half_space_bytes(plan, frame, &body);
    let asked = plan.interior_requests.iter().any(|request| request.side == SIDES[index]);
    let note = asked.then(|| body.prepare_interior_field()).transpose().at("output.inside")?.flatten();
    let warning = note.map(|note| format!("{key}: {note}"));
    Ok(BuiltBody { warning, ..BuiltBody::new(body, held) })
}

fn build_truncated(
    plan: &Plan,
    spec: &TruncatedHalfSpacePlan,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BuiltBody, SceneError> {
    let key = BODY_KEYS[index];
    let stiffness = spec.material.stiffness_in_frame(0.0);
    let spec = TruncatedSpec { stiffness: &stiffness, half_size: spec.half_size };
    let body = TruncatedHalfSpace::new(&spec, SIDES[index], frame, plan.flexibility_cache.as_ref(), &left)
        .at(&format!("{key}.truncated"))?;
    let (held, warning) = (body.held_bytes(), body.cache_warning().map(str::to_owned));
    let truncation = Some(TruncationRecord::new(index, body.truncation()));
    Ok(BuiltBody { warning, truncation, ..BuiltBody::new(body, held) })
}

fn build_be(
    plan: &Plan,
    be: &BeBodyPlan,
    index: usize,
    frame: &ContactFrame,
    left: MemoryLimit,
) -> Result<BuiltBody, SceneError> {
    let key = BODY_KEYS[index];
    face_map(&be.meshed, index, frame)?;
    let (spec, cases, contact) = (be.bem_spec(key), be.load_specs(key), &be.meshed.contact);
    let cache = plan.flexibility_cache.as_ref();
    let mut body = BeBody::new(&spec, &cases, contact, SIDES[index], frame, cache, &left).at(key)?;
    let (held, warning) = (body.held_bytes(), body.cache_warning().map(str::to_owned));
    let elastic = &be.meshed.material;
    body.limit = plan.strength_limits.get(&elastic.name).map(|limit| (*limit, elastic.material_axes(0.0)));
    Ok(BuiltBody { warning, ..BuiltBody::new(body, held) })
}

fn build_fe(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    worn: Option<Arc<Mesh>>,
    index: usize,
    frame: &ContactFrame,
    near: &NearFieldModel,
    left: MemoryLimit,
) -> Result<BuiltBody, SceneError> {
    let key = BODY_KEYS[index];
    let cache_contents = if needs_factor_after_condensation(plan, frame) {
        CacheContents::FlexibilityAndFactor
    } else {
        CacheContents::Flexibility
    };
    let resources =
        CondensationResources { cache: plan.flexibility_cache.as_ref(), cache_contents, memory: left };
    let (spec, cases, side) = (fe.fem_spec(key), fe.load_specs(key), SIDES[index]);
    let mut body =
        FeBody::with_worn_mesh(spec, &cases, &fe.contact, side, frame, &resources, worn).at(key)?;
    let held = memory::resident_bytes(&body);
    body.limits.clone_from(&plan.strength_limits);
    let reason = match near {
        NearFieldModel::Mesh(why) | NearFieldModel::RejectedHalfSpace(why) => Some(why.clone()),
        NearFieldModel::Unmeshed | NearFieldModel::HalfSpace(_) => None,
    };
    Ok(BuiltBody::new(body, held).with_near_field(NearFieldRecord {
        body: index + 1,
        near_field: "mesh",
        reason,
        max_face_deviation: None,
        own_error: None,
        indicators: None,
    }))
}

fn build_hybrid(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
    site: &HalfSpaceFit,
    left: MemoryLimit,
) -> Result<Result<BuiltBody, HybridRejected>, SceneError> {
    let key = BODY_KEYS[index];
    let resources = CondensationResources {
        cache: plan.flexibility_cache.as_ref(),
        cache_contents: CacheContents::Flexibility,
        memory: left,
    };
    let (spec, cases, side) = (fe.fem_spec(key), fe.load_specs(key), SIDES[index]);
    let mut body = HybridBody::new(spec, &cases, &fe.contact, side, frame, site, &resources).at(key)?;
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
