//! Simulation of a plan: builds bodies, frame and flexibility, runs the history, and rebuilds the model when frame or meshes
//! change.

pub(crate) mod build;
pub(crate) mod failure;
pub mod grown_frame;
pub mod growth;
pub mod job;
pub mod mesh_motion;
pub(crate) mod omitted;
pub(crate) mod plan_bodies;
mod rebuild;
pub mod resume;
pub mod segments;
pub(crate) mod validate;
pub mod worn_meshes;

pub use crate::simulation::build::{Simulation, build, build_with};
pub use crate::simulation::failure::SceneError;

/// Warnings about the fit of bodies and frame of a plan.
///
/// # Errors
/// If they do not fit.
pub fn fit_warnings(plan: &crate::scene::plan::Plan) -> Result<Vec<String>, SceneError> {
    let frame = build::contact_frame::contact_frame(plan)?;
    validate::fit::check(plan, &frame, &build::near_field::choose_near_fields(plan, &frame)?)
}
