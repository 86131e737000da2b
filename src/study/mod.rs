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

pub use failure::Failure;
pub use forecast::{Forecast, forecast};
pub use prepare::{Study, prepare, prepare_on, prepare_worn};

/// What the user should know of how bodies and frame of a plan fit.
///
/// # Errors
/// If they do not fit.
pub fn notes(plan: &crate::scene::plan::Plan) -> Result<Vec<String>, Failure> {
    let frame = bodies::frame(plan)?;
    fit::check(plan, &frame, &near_field::choose(plan, &frame)?)
}
