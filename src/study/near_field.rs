//! Where the near field of each meshed body is computed: in a half-space that the finite elements correct, or in the mesh.

use super::bodies::{KEYS, SIDES};
use super::failure::{AtKey, Failure};
use super::moving;
use crate::body::hybrid::{Site, Unsuited};
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::scene::keys::body::NearField;
use crate::scene::keys::solver::Coupling;
use crate::scene::plan::{BodySpec, MeshedSpec, Plan};

/// How a body comes by its flexibility on the frame.
#[derive(Debug, Clone)]
pub(super) enum Near {
    /// It has no mesh.
    Own,
    /// Its mesh is condensed, and why no half-space is taken.
    Mesh(String),
    /// Its mesh is condensed, for its half-space was tried and is not good enough: why.
    GivenUp(String),
    /// A half-space, corrected by its mesh.
    HalfSpace(Box<Site>),
}

impl Near {
    /// The half-space, if that is taken.
    pub fn site(&self) -> Option<&Site> {
        match self {
            Self::HalfSpace(site) => Some(site),
            Self::Own | Self::Mesh(_) | Self::GivenUp(_) => None,
        }
    }

    /// Whether its flat faces are bowed in the gap: displacements of a half-space do not follow them.
    pub fn is_bowed(&self) -> bool {
        self.site().is_some()
    }

    /// Whether the mesh is condensed to the nodes under the frame.
    pub fn is_condensed(&self) -> bool {
        matches!(self, Self::Mesh(_) | Self::GivenUp(_))
    }
}

/// The choice for both bodies of `plan` on `frame`.
///
/// # Errors
/// If a body asks for a half-space that it has no place for, or is not sound.
pub(super) fn choose(plan: &Plan, frame: &ContactFrame) -> Result<[Near; 2], Failure> {
    let mut choices = [Near::Own, Near::Own];
    for (index, choice) in choices.iter_mut().enumerate() {
        if matches!(plan.bodies[index], BodySpec::Truncated(_)) {
            *choice = Near::Mesh("its surface is meshed".to_owned());
        }
        if let Some(fe) = plan.bodies[index].meshed() {
            *choice = of_body(plan, fe, index, frame)?;
        }
    }
    Ok(choices)
}

fn of_body(plan: &Plan, fe: &MeshedSpec, index: usize, frame: &ContactFrame) -> Result<Near, Failure> {
    if plan.bodies[index].be().is_some() {
        if plan.solver.coupling == Coupling::Block {
            let error = Error::input(format!(
                "{} is one of boundary elements, which the block system does not take: remove it, \"schur\" is the default",
                KEYS[index]
            ));
            return Err(Failure { error, key: "solver.coupling".to_owned() });
        }
        return Ok(Near::Mesh("boundary elements have that of their mesh".to_owned()));
    }
    if fe.near_field == NearField::Mesh {
        return Ok(Near::Mesh("near_field is \"mesh\"".to_owned()));
    }
    match (place(plan, fe, index, frame)?, fe.near_field) {
        (Ok(site), _) => Ok(Near::HalfSpace(Box::new(site))),
        (Err(Unsuited(why)), NearField::HalfSpace) => Err(Failure {
            error: Error::input(format!(
                "{} has no place for the near field of a half-space: {why}; take \"auto\" or \"mesh\"",
                KEYS[index]
            )),
            key: format!("{}.near_field", KEYS[index]),
        }),
        (Err(Unsuited(why)), _) => Ok(Near::Mesh(why)),
    }
}

/// The place for a half-space in body `index` under `frame`, or why there is none.
///
/// # Errors
/// If the body is not sound.
pub(super) fn place(
    plan: &Plan,
    fe: &MeshedSpec,
    index: usize,
    frame: &ContactFrame,
) -> Result<std::result::Result<Site, Unsuited>, Failure> {
    let moves = moving::worn_bodies(plan).any(|(worn, ..)| worn == index);
    if plan.solver.coupling == Coupling::Block {
        return Ok(Err(Unsuited(
            "the block system takes the equations of meshes (solver.coupling)".to_owned(),
        )));
    }
    if plan.move_mesh.is_some() && moves {
        return Ok(Err(Unsuited("its mesh moves with wear (wear.move_mesh)".to_owned())));
    }
    Site::find(&fe.inputs(KEYS[index]), &fe.contact, SIDES[index], frame).at(KEYS[index])
}
