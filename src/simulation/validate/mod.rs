//! Checks of a plan against its meshes and its frame, before any solve. [`validate`] defines the order of the checks.

mod cell_size;
mod closing_motion;
pub(crate) mod controls;
pub(crate) mod fit;
mod fixed_contact_nodes;
pub(crate) mod flat_faces;
mod height_map;
mod inside;
mod locking;
mod periodic;
mod region_fibre;
pub(super) mod symmetry_planes;

use crate::error::Warning;
use crate::frame::ContactFrame;
use crate::scene::plan::Plan;
use crate::simulation::build::near_field::{NearFieldModel, choose_near_fields};
use crate::simulation::failure::SceneError;

/// Frame and near-field models of a plan whose controls, bodies and frame fit together.
pub(crate) struct ValidScene {
    pub frame: ContactFrame,
    pub near_fields: [NearFieldModel; 2],
    pub warnings: Vec<Warning>,
}

/// Checks the controls of `plan`, the near fields of its bodies on `frame`, and the fit of bodies and frame.
///
/// # Errors
/// The error of the first check that fails.
pub(crate) fn validate(plan: &Plan, frame: ContactFrame) -> Result<ValidScene, SceneError> {
    controls::refuse_impossible_controls(plan, &frame)?;
    let near_fields = choose_near_fields(plan, &frame)?;
    let warnings = fit::check(plan, &frame, &near_fields)?;
    Ok(ValidScene { frame, near_fields, warnings })
}
