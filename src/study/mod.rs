//! From a plan to its results: bodies, frame and flexibility of a scene, then its history.

pub mod accuracy;
mod bodies;
mod candidates;
pub mod compare;
mod controls;
mod expected;
mod failure;
mod fit;
mod flat_faces;
pub mod forecast;
pub mod grow;
mod inside;
mod locking;
mod memory;
pub mod moving;
mod near_field;
mod planes;
mod prepare;
pub mod refine;
mod replace;
mod repetition;
pub mod saved;
mod settings;
mod skips;
pub mod sweep;

pub use failure::SceneError;
pub use forecast::{RunEstimate, estimate};
pub use prepare::{Simulation, build, build_on_frame, build_with};

/// What the user should know of how bodies and frame of a plan fit.
///
/// # Errors
/// If they do not fit.
pub fn fit_warnings(plan: &crate::scene::plan::Plan) -> Result<Vec<String>, SceneError> {
    let frame = bodies::contact_frame(plan)?;
    fit::check(plan, &frame, &near_field::choose_near_fields(plan, &frame)?)
}
