//! Near-field model of each meshed body: a half-space corrected by finite elements, or the mesh itself.

use crate::body::hybrid::{HalfSpaceFit, Unsuitable};
use crate::coupling::Coupling;
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::scene::plan::{BodyPlan, MeshedBodyPlan, Plan};
use crate::scene::spec::body::NearField;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, worn_bodies};

/// Model that gives a body's flexibility on the frame.
#[derive(Debug, Clone)]
pub(crate) enum NearFieldModel {
    /// The body has no mesh.
    Unmeshed,
    /// The mesh itself, with the reason why no half-space is used.
    Mesh(String),
    /// The mesh itself, because a half-space was tried and is not accurate enough. Contains the reason.
    RejectedHalfSpace(String),
    /// A half-space, corrected by the mesh.
    HalfSpace(Box<HalfSpaceFit>),
}

impl NearFieldModel {
    /// The half-space, if one is used.
    pub fn half_space_fit(&self) -> Option<&HalfSpaceFit> {
        match self {
            Self::HalfSpace(site) => Some(site),
            Self::Unmeshed | Self::Mesh(_) | Self::RejectedHalfSpace(_) => None,
        }
    }

    /// Whether the gap is corrected for the curvature of the surface between the nodes, which flat faces neglect. The
    /// displacements of a half-space do not follow the flat faces.
    pub fn corrects_face_curvature(&self) -> bool {
        self.half_space_fit().is_some()
    }

    /// Whether the mesh itself represents the near field. A finite-element mesh is then condensed to its nodes under
    /// the frame.
    pub fn is_condensed(&self) -> bool {
        matches!(self, Self::Mesh(_) | Self::RejectedHalfSpace(_))
    }
}

/// Chooses the near-field models of both bodies.
///
/// # Errors
/// * A body that requests a half-space does not admit a half-space.
/// * A body is invalid.
/// * The block system is requested with boundary elements.
pub(crate) fn choose_near_fields(
    plan: &Plan,
    frame: &ContactFrame,
) -> Result<[NearFieldModel; 2], SceneError> {
    let mut choices = [NearFieldModel::Unmeshed, NearFieldModel::Unmeshed];
    for (index, choice) in choices.iter_mut().enumerate() {
        if matches!(plan.bodies[index], BodyPlan::TruncatedHalfSpace(_)) {
            *choice = NearFieldModel::Mesh("its surface is meshed".to_owned());
        }
        if let Some(fe) = plan.bodies[index].as_meshed() {
            *choice = choose_near_field(plan, fe, index, frame)?;
        }
    }
    Ok(choices)
}

fn choose_near_field(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
) -> Result<NearFieldModel, SceneError> {
    if plan.bodies[index].as_be().is_some() {
        if plan.solver.coupling == Coupling::Block {
            let error = Error::input(format!(
                "{} is a body of boundary elements, which the block system does not support: remove this key, the default is \"schur\"",
                BODY_KEYS[index]
            ));
            return Err(SceneError { error, key: "solver.coupling".to_owned() });
        }
        return Ok(NearFieldModel::Mesh("boundary elements use the near field of their mesh".to_owned()));
    }
    if fe.near_field == NearField::Mesh {
        return Ok(NearFieldModel::Mesh("near_field is \"mesh\"".to_owned()));
    }
    match (fit_half_space(plan, fe, index, frame)?, fe.near_field) {
        (Ok(site), _) => Ok(NearFieldModel::HalfSpace(Box::new(site))),
        (Err(Unsuitable(why)), NearField::HalfSpace) => Err(SceneError {
            error: Error::input(format!(
                "{} does not allow the near field of a half-space: {why}; use \"auto\" or \"mesh\"",
                BODY_KEYS[index]
            )),
            key: format!("{}.near_field", BODY_KEYS[index]),
        }),
        (Err(Unsuitable(why)), _) => Ok(NearFieldModel::Mesh(why)),
    }
}

/// Fits a half-space to body `index`, or returns why the half-space is unsuitable.
///
/// # Errors
/// If the body is invalid.
pub(crate) fn fit_half_space(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
) -> Result<std::result::Result<HalfSpaceFit, Unsuitable>, SceneError> {
    let moves = worn_bodies(plan).any(|(worn, ..)| worn == index);
    if plan.solver.coupling == Coupling::Block {
        return Ok(Err(Unsuitable(
            "the block system uses the equations of the meshes (solver.coupling)".to_owned(),
        )));
    }
    if plan.mesh_motion_threshold.is_some() && moves {
        return Ok(Err(Unsuitable("its mesh moves with wear (wear.move_mesh)".to_owned())));
    }
    HalfSpaceFit::find(&fe.fem_spec(BODY_KEYS[index]), &fe.contact, SIDES[index], frame).at(BODY_KEYS[index])
}
