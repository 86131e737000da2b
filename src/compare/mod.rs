//! Variants of a scene: the same contact problem on the same frame, with other discretisations of the bodies.
//!
//! [`variants()`] builds a [`Variant`] for each pair of discretisations. [`comparison::Comparison`] contains the
//! results of the variants and their differences from the reference variant. The reference is the first variant with a
//! computed step. A result a differs by 100 (a - b) / |b| percent from the result b of the reference.
//! [`step_ends::VariantStates`] provides fields and pressure profiles at the ends of steps.

pub mod comparison;
pub mod step_ends;
mod variants;

use crate::compare::variants::replace_body;
use crate::error::{Error, Result, Warning};
use crate::estimate::estimate_on_frame;
use crate::frame::{ContactFrame, GapShape};
use crate::scene::plan::{BodyPlan, Plan};
use crate::scene::variant::{Discretisation, DiscretisationPair};
use crate::simulation::build::contact_frame::contact_frame;
use crate::simulation::build::meshed_gap::surface_distances;
use crate::simulation::build::near_field::choose_near_fields;
use crate::simulation::failure::SceneError;
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, face_map};

use Discretisation::{BoundaryElements, FiniteElements, HalfSpace, TruncatedHalfSpace};

/// Discretisations of the default variants, for bodies with meshes.
const DEFAULT_PAIRS: [[Discretisation; 2]; 4] = [
    [FiniteElements, FiniteElements],
    [BoundaryElements, BoundaryElements],
    [FiniteElements, BoundaryElements],
    [HalfSpace, HalfSpace],
];

/// A scene with one pair of discretisations of its bodies.
pub struct Variant {
    /// Discretisations of body 1 and body 2, for example "FE-BE".
    pub name: String,
    /// Plan of the variant, or the reason why it cannot be computed.
    pub plan: Result<Plan>,
    /// Warnings and notes for the user.
    pub warnings: Vec<Warning>,
}

impl Variant {
    /// Name of the variant's folder of results, for example "fe-be".
    pub fn folder(&self) -> String {
        self.name.to_lowercase()
    }
}

/// Builds the contact frame of `plan` and the variants on this frame, without duplicates.
///
/// The variants are the pairs in `wanted`. If `wanted` is empty, they are the pairs that the scene names. If the scene
/// names none, they are the unchanged scene and the default variants.
///
/// A variant that cannot be computed has an error instead of a plan. The unchanged scene always has a plan; if it
/// cannot be computed, its run reports the error.
///
/// # Errors
/// If the frame cannot be built, or the gap of the meshes cannot be computed on it.
pub fn variants(
    plan: &Plan,
    wanted: &[DiscretisationPair],
) -> std::result::Result<(ContactFrame, Vec<Variant>), SceneError> {
    let frame = contact_frame(plan)?;
    let own = own(plan);
    let named = match (wanted, &plan.compare.variants) {
        ([], None) => usual(own),
        ([], Some(named)) => named.clone(),
        (wanted, _) => wanted.to_vec(),
    };
    let mut pairs = Vec::new();
    named.into_iter().for_each(|pair| {
        if !pairs.contains(&pair) {
            pairs.push(pair)
        }
    });
    let mut shared = plan.clone();
    if plan.gap.shape == GapShape::Mesh && pairs.iter().any(|pair| *pair != own) {
        shared.gap = mesh_gap(plan, &frame)?.into();
    }
    let variant = |pair: &DiscretisationPair| {
        if *pair == own {
            return Variant { name: pair.to_string(), plan: Ok(plan.clone()), warnings: Vec::new() };
        }
        let mut notes = Vec::new();
        let changed = variant_plan(&shared, &frame, *pair, &mut notes);
        Variant { name: pair.to_string(), plan: changed, warnings: notes }
    };
    let variants = pairs.iter().map(variant).collect();
    Ok((frame, variants))
}

fn own(plan: &Plan) -> DiscretisationPair {
    DiscretisationPair(plan.bodies.each_ref().map(BodyPlan::discretisation))
}

/// Pair of the scene and default pairs. In a default pair, a body without a mesh keeps its discretisation. The
/// exception is a truncated half-space: it becomes a half-space if the default pair has one.
fn usual(own: DiscretisationPair) -> Vec<DiscretisationPair> {
    let kind = |own: Discretisation, usual: Discretisation| match (own, usual) {
        (FiniteElements | BoundaryElements, _) | (TruncatedHalfSpace, HalfSpace) => usual,
        _ => own,
    };
    let mut pairs = vec![own];
    for usual in DEFAULT_PAIRS {
        let kinds = [0, 1].map(|index| kind(own.0[index], usual[index]));
        if !pairs.contains(&DiscretisationPair(kinds)) {
            pairs.push(DiscretisationPair(kinds));
        }
    }
    pairs
}

/// Plan of the variant with the discretisations `pair`.
fn variant_plan(
    plan: &Plan,
    frame: &ContactFrame,
    pair: DiscretisationPair,
    notes: &mut Vec<Warning>,
) -> Result<Plan> {
    let mut changed = plan.clone();
    let mut hint = String::new();
    for (index, kind) in pair.0.into_iter().enumerate() {
        let (key, own) = (BODY_KEYS[index], plan.bodies[index].discretisation());
        let body = replace_body(plan, index, kind, notes)?;
        if plan.mesh_motion_threshold.is_some() && own == FiniteElements && kind != own {
            return Err(Error::input(format!(
                "the mesh of {key} moves with wear (wear.move_mesh), which only finite elements support"
            )));
        }
        let asked = changed.interior_requests.len();
        changed.interior_requests.retain(|request| request.side != SIDES[index] || kind == own);
        if changed.interior_requests.len() < asked {
            notes.push(Warning::note(format!(
                "points inside {key} (output.inside) are omitted where another model replaces this body"
            )));
        }
        if own == FiniteElements
            && kind == BoundaryElements
            && plan.compare.alternatives[index].surface.is_none()
        {
            hint = format!("; compare.{key}.be.mesh can name a separate surface mesh for it");
        }
        if kind == HalfSpace && !variants::is_plane(frame) {
            return Err(Error::input("the contact frame is curved, but a half-space needs a plane frame"));
        }
        if let (HalfSpace, Some(meshed)) = (kind, plan.bodies[index].as_meshed()) {
            changed.half_space_loads[index].temperature.clone_from(&meshed.temperature);
        }
        changed.bodies[index] = body;
    }
    if let Err(SceneError { error, .. }) = estimate_on_frame(&changed, frame.clone()) {
        return Err(Error::input(format!("{error}{hint}")));
    }
    Ok(changed)
}

/// Initial gap of the scene in each cell, for variants. Their bodies may have no mesh, or another mesh.
fn mesh_gap(plan: &Plan, frame: &ContactFrame) -> std::result::Result<GapShape, SceneError> {
    let mut heights = [None, None];
    for (index, (heights, body)) in heights.iter_mut().zip(&plan.bodies).enumerate() {
        if let Some(meshed) = body.as_meshed() {
            *heights = Some(face_map(meshed, index, frame)?.mean_heights(frame, &meshed.mesh));
        }
    }
    let gap = surface_distances(plan, frame, heights, &choose_near_fields(plan, frame)?)?;
    Ok(GapShape::PerCell(gap.distance))
}
