//! Meshes that move with wear: what stiffness loses as a body gets thinner.
//!
//! The worn gap enters through the frame at all times; `wear.move_mesh` also makes the worn bodies anew, with the surface of their
//! meshes moved by what they have lost, whenever that is deep by a share of their elements ([`Room`]).

use std::sync::Arc;

use super::bodies::{self, KEYS, SIDES};
use super::failure::{AtKey, Failure};
use super::prepare::Study;
use crate::body::FeBody;
use crate::body::worn::{heights_behind, worn_mesh};
use crate::error::{Error, Result};
use crate::frame::ContactFrame;
use crate::geometry::number;
use crate::history::{Before, Snapshot};
use crate::mesh::Mesh;
use crate::results::keeper::Moves;
use crate::scene::plan::{MeshedSpec, Plan};
use crate::skip::{Skipped, Work};

/// Meshes of the two bodies, where they have moved.
pub type Meshes = [Option<Arc<Mesh>>; 2];

/// How deep the bodies may wear until their meshes move.
#[derive(Debug, Clone)]
pub struct Room {
    /// Worn depth of both bodies at the last move, `[N]`, mm.
    worn: Vec<f64>,
    /// Depth of both bodies since then beyond which the meshes move, `[N]`, mm.
    depth: Vec<f64>,
}

impl Room {
    /// That of a study of `plan` after its moves so far; `None` if its meshes do not move (any more).
    ///
    /// # Errors
    /// If the contact group of a body is wrong.
    pub fn new(plan: &Plan, study: &Study, moves: &Moves) -> Result<Option<Self>> {
        let Some(share) = plan.move_mesh.filter(|_| !moves.over) else { return Ok(None) };
        let n = study.model().frame.n_cells();
        let mut depth = vec![f64::INFINITY; n];
        for (index, fe, part) in worn_bodies(plan) {
            let heights = heights_behind(&fe.mesh, &fe.contact)?;
            let Some(map) = study.meshed(index).map(FeBody::map) else { continue };
            for (cell, depth) in depth.iter_mut().enumerate() {
                let behind = map.row(cell).map(|(node, _)| heights[map.nodes()[node]]);
                *depth = behind.map(|height| share * height / part).fold(*depth, f64::min);
            }
        }
        let worn = if moves.worn.is_empty() { vec![0.0; n] } else { moves.worn.clone() };
        Ok(Some(Self { worn, depth }))
    }

    /// Whether the bodies have worn deeper, `worn` being the depth of both, `[N]`, mm.
    pub fn is_exceeded(&self, worn: &[f64]) -> bool {
        worn.iter().zip(&self.worn).zip(&self.depth).any(|((worn, before), depth)| worn - before > *depth)
    }
}

/// The meshed bodies of a plan that wear: index, body, part of the worn depth.
pub(crate) fn worn_bodies(plan: &Plan) -> impl Iterator<Item = (usize, &MeshedSpec, f64)> {
    let parts = [plan.wear_share, 1.0 - plan.wear_share];
    let bodies = plan.bodies.iter().zip(parts).enumerate();
    bodies
        .filter_map(|(index, (body, part))| Some((index, body.fe()?, part)))
        .filter(|(.., part)| *part > 0.0)
}

/// Whether some meshed body of a plan wears.
pub(crate) fn wears(plan: &Plan) -> bool {
    plan.wear.intensity(plan.friction.ellipse()).is_some() && worn_bodies(plan).next().is_some()
}

/// The meshes of the bodies that wear, after both have lost `worn` (`[N]`, mm) on `frame` (that of the plan if none is given); none
/// where nothing is worn.
///
/// # Errors
/// If an element would turn over or get too flat; if memory does not suffice.
pub fn meshes(
    plan: &Plan,
    frame: Option<&ContactFrame>,
    worn: &[f64],
) -> std::result::Result<Meshes, Failure> {
    let mut meshes = [None, None];
    if worn.is_empty() {
        return Ok(meshes);
    }
    let own = if frame.is_none() { Some(bodies::frame(plan)?) } else { None };
    let Some(frame) = frame.or(own.as_ref()) else { return Ok(meshes) };
    for (index, fe, part) in worn_bodies(plan) {
        let depth: Vec<f64> = worn.iter().map(|depth| part * depth).collect();
        let spec = fe.inputs(KEYS[index]);
        let mesh = worn_mesh(&spec, (&fe.contact, SIDES[index]), (frame, &depth), &plan.memory);
        meshes[index] = Some(Arc::new(mesh.at(KEYS[index])?));
    }
    Ok(meshes)
}

/// What a study on moved meshes goes on from.
pub struct Outdated {
    before: Before,
    snapshot: Snapshot,
}

impl Study<'_> {
    /// What is left of it for a study on moved meshes, which goes on from `snapshot`; the bodies and operators are dropped.
    pub fn outdated(self, snapshot: Snapshot) -> Outdated {
        Outdated { before: Before::of(self.model()), snapshot }
    }
}

impl Outdated {
    /// The same state with the bodies of `study`, with a note.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub fn onto(self, plan: &Plan, study: &Study) -> Result<Snapshot> {
        let places: Vec<usize> = (0..self.snapshot.n_cells()).collect();
        let mut snapshot = self.snapshot.onto(&places, study.model(), &plan.steps, Some(&self.before))?;
        let deepest = snapshot.worn().iter().copied().fold(0.0, f64::max);
        let moved = worn_bodies(plan).map(|(index, _, part)| {
            format!("{} by up to {} {}", KEYS[index], number(part * deepest), plan.units.length)
        });
        let moved: Vec<String> = moved.collect();
        snapshot.tell(format!(
            "the mesh was moved with wear{}: {}",
            after(plan, &snapshot),
            moved.join(", ")
        ));
        Ok(snapshot)
    }
}

/// The note of meshes that do not move.
pub fn stays(plan: &Plan, snapshot: &Snapshot, error: &Error) -> String {
    format!(
        "the mesh is not moved with wear{} and from there on: {}; the run goes on with the stiffness that the bodies had",
        after(plan, snapshot),
        error.message()
    )
}

/// The last entry before, for notes.
pub(super) fn after(plan: &Plan, snapshot: &Snapshot) -> String {
    snapshot.records().last().map_or_else(String::new, |last| {
        format!(
            " after step \"{}\" ({}), {} cycles and {} {} of sliding",
            last.name,
            last.increment,
            last.cycles_done,
            number(last.distance_slid),
            plan.units.length
        )
    })
}

/// The entry of the ledger for meshes that do not move.
pub(super) fn skipped(plan: &Plan) -> Option<Skipped> {
    let steps = plan.steps.iter().any(|step| step.wear);
    (plan.move_mesh.is_none() && steps && wears(plan)).then(|| {
        let why =
            "wear.move_mesh is not given: the worn gap enters through the frame, stiffness is that of the unworn bodies";
        Skipped::new(Work::MovingMeshes, "moving meshes with wear", why)
    })
}
