//! The variants of a scene: each body as it is or as what else may stand for it, on the same frame.

pub mod comparison;
pub mod step_ends;
mod variants;

use crate::compare::variants::replace_body;
use crate::error::{Error, Result};
use crate::estimate::estimate_on_frame;
use crate::frame::{ContactFrame, GapShape};
use crate::scene::plan::{BodyPlan, Plan};
use crate::scene::variant::{Discretisation, DiscretisationPair};
use crate::simulation::build::bodies::{BODY_KEYS, SIDES, contact_frame, face_map, surface_distances};
use crate::simulation::build::near_field::choose_near_fields;
use crate::simulation::failure::SceneError;
use crate::simulation::validate::fit;

use Discretisation::{BoundaryElements, FiniteElements, HalfSpace, TruncatedHalfSpace};

/// Two bodies that a scene meshes, in the variants that are computed where it names none, beside the scene as it is.
const DEFAULT_PAIRS: [[Discretisation; 2]; 4] = [
    [FiniteElements, FiniteElements],
    [BoundaryElements, BoundaryElements],
    [FiniteElements, BoundaryElements],
    [HalfSpace, HalfSpace],
];

/// One way to compute a scene.
pub struct Variant {
    /// What body 1 and body 2 are: "FE-BE".
    pub name: String,
    /// The plan, or why there is none.
    pub plan: Result<Plan>,
    /// What the user should know of it.
    pub warnings: Vec<String>,
}

impl Variant {
    /// Name of its folder: "fe-be".
    pub fn folder(&self) -> String {
        self.name.to_lowercase()
    }
}

/// The variants of `plan` on its frame: those that are `wanted`, else those that the scene names, else the scene as it is and the usual
/// ones. One that cannot be has the reason in place of a plan, unless it is the scene as it is: why that cannot be computed is told by a run.
///
/// # Errors
/// If the frame cannot be made, or the gap of two meshes cannot be taken on it.
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

/// What the scene makes of its bodies.
fn own(plan: &Plan) -> DiscretisationPair {
    DiscretisationPair(plan.bodies.each_ref().map(BodyPlan::discretisation))
}

/// The scene as it is and the usual variants of it: what is not meshed stays what it is, a truncated half-space becomes an exact one with
/// others.
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

/// The plan with its bodies as a variant has them, if it can be computed.
fn variant_plan(
    plan: &Plan,
    frame: &ContactFrame,
    pair: DiscretisationPair,
    notes: &mut Vec<String>,
) -> Result<Plan> {
    let mut changed = plan.clone();
    let mut hint = String::new();
    for (index, kind) in pair.0.into_iter().enumerate() {
        let (key, own) = (BODY_KEYS[index], plan.bodies[index].discretisation());
        let body = replace_body(plan, index, kind, notes)?;
        if plan.mesh_motion_threshold.is_some() && own == FiniteElements && kind != own {
            return Err(Error::input(format!(
                "the mesh of {key} moves with wear (wear.move_mesh), which finite elements alone do"
            )));
        }
        let asked = changed.interior_requests.len();
        changed.interior_requests.retain(|request| request.side != SIDES[index] || kind == own);
        if changed.interior_requests.len() < asked {
            notes.push(format!(
                "points inside {key} (output.inside) are left out where something else stands for it"
            ));
        }
        if own == FiniteElements
            && kind == BoundaryElements
            && plan.compare.alternatives[index].surface.is_none()
        {
            hint = format!("; compare.{key}.be.mesh gives it a surface mesh of its own");
        }
        if kind == HalfSpace && !variants::is_plane(frame) {
            return Err(Error::input("the contact frame is curved, a half-space needs a plane one"));
        }
        changed.bodies[index] = body;
    }
    let fits = || {
        fit::check(&changed, frame, &choose_near_fields(&changed, frame)?)?;
        estimate_on_frame(&changed, frame.clone())
    };
    if let Err(SceneError { error, .. }) = fits() {
        return Err(Error::input(format!("{error}{hint}")));
    }
    Ok(changed)
}

/// The distance of the meshed surfaces, cell by cell, for bodies that do not have their meshes any more.
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
