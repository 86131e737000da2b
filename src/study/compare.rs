//! The variants of a scene: each body as it is or as what else may stand for it, on the same frame.

use super::bodies::{KEYS, SIDES, distances, face_map, frame};
use super::failure::Failure;
use super::fit;
use super::forecast::forecast_on;
use super::near_field::choose;
use super::replace::{self, replaced};
use crate::error::{Error, Result};
use crate::frame::{ContactFrame, GapShape};
use crate::scene::plan::{BodySpec, Plan};
use crate::scene::variant::{Discretisation, Pair};

use Discretisation::{BoundaryElements, FiniteElements, HalfSpace, Truncated};

/// Two bodies that a scene meshes, in the variants that are computed where it names none, beside the scene as it is.
const USUAL: [[Discretisation; 2]; 4] = [
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
    pub notes: Vec<String>,
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
pub fn variants(plan: &Plan, wanted: &[Pair]) -> std::result::Result<(ContactFrame, Vec<Variant>), Failure> {
    let frame = frame(plan)?;
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
    let variant = |pair: &Pair| {
        if *pair == own {
            return Variant { name: pair.to_string(), plan: Ok(plan.clone()), notes: Vec::new() };
        }
        let mut notes = Vec::new();
        let changed = changed(&shared, &frame, *pair, &mut notes);
        Variant { name: pair.to_string(), plan: changed, notes }
    };
    let variants = pairs.iter().map(variant).collect();
    Ok((frame, variants))
}

/// What the scene makes of its bodies.
fn own(plan: &Plan) -> Pair {
    Pair(plan.bodies.each_ref().map(BodySpec::discretisation))
}

/// The scene as it is and the usual variants of it: what is not meshed stays what it is, a truncated half-space becomes an exact one with
/// others.
fn usual(own: Pair) -> Vec<Pair> {
    let kind = |own: Discretisation, usual: Discretisation| match (own, usual) {
        (FiniteElements | BoundaryElements, _) | (Truncated, HalfSpace) => usual,
        _ => own,
    };
    let mut pairs = vec![own];
    for usual in USUAL {
        let kinds = [0, 1].map(|index| kind(own.0[index], usual[index]));
        if !pairs.contains(&Pair(kinds)) {
            pairs.push(Pair(kinds));
        }
    }
    pairs
}

/// The plan with its bodies as a variant has them, if it can be computed.
fn changed(plan: &Plan, frame: &ContactFrame, pair: Pair, notes: &mut Vec<String>) -> Result<Plan> {
    let mut changed = plan.clone();
    let mut hint = String::new();
    for (index, kind) in pair.0.into_iter().enumerate() {
        let (key, own) = (KEYS[index], plan.bodies[index].discretisation());
        let body = replaced(plan, index, kind, notes)?;
        if plan.move_mesh.is_some() && own == FiniteElements && kind != own {
            return Err(Error::input(format!(
                "the mesh of {key} moves with wear (wear.move_mesh), which finite elements alone do"
            )));
        }
        let asked = changed.inside.len();
        changed.inside.retain(|request| request.side != SIDES[index] || kind == own);
        if changed.inside.len() < asked {
            notes.push(format!(
                "points inside {key} (output.inside) are left out where something else stands for it"
            ));
        }
        if own == FiniteElements && kind == BoundaryElements && plan.compare.others[index].surface.is_none() {
            hint = format!("; compare.{key}.be.mesh gives it a surface mesh of its own");
        }
        if kind == HalfSpace && !replace::is_plane(frame) {
            return Err(Error::input("the contact frame is curved, a half-space needs a plane one"));
        }
        changed.bodies[index] = body;
    }
    let fits = || {
        fit::check(&changed, frame, &choose(&changed, frame)?)?;
        forecast_on(&changed, frame.clone())
    };
    if let Err(Failure { error, .. }) = fits() {
        return Err(Error::input(format!("{error}{hint}")));
    }
    Ok(changed)
}

/// The distance of the meshed surfaces, cell by cell, for bodies that do not have their meshes any more.
fn mesh_gap(plan: &Plan, frame: &ContactFrame) -> std::result::Result<GapShape, Failure> {
    let mut heights = [None, None];
    for (index, (heights, body)) in heights.iter_mut().zip(&plan.bodies).enumerate() {
        if let Some(meshed) = body.meshed() {
            *heights = Some(face_map(meshed, index, frame)?.heights(frame, &meshed.mesh));
        }
    }
    Ok(GapShape::Cells(distances(plan, frame, heights, &choose(plan, frame)?)?))
}
