//! From a plan to its results: bodies, frame and flexibility of a scene, then its history.

pub(crate) mod build;
pub(crate) mod failure;
pub mod growth;
pub mod job;
pub mod mesh_motion;
pub(crate) mod omitted;
mod rebuild;
pub mod resume;
pub mod segments;
pub(crate) mod validate;

pub use crate::simulation::build::{Simulation, build, build_with};
pub use crate::simulation::failure::SceneError;

/// What the user should know of how bodies and frame of a plan fit.
///
/// # Errors
/// If they do not fit.
pub fn fit_warnings(plan: &crate::scene::plan::Plan) -> Result<Vec<String>, SceneError> {
    let frame = build::bodies::contact_frame(plan)?;
    validate::fit::check(plan, &frame, &build::near_field::choose_near_fields(plan, &frame)?)
}
