//! From a plan to its results: bodies, frame and flexibility of a scene, then its history.

mod bodies;
mod controls;
mod failure;
pub mod forecast;
mod prepare;
mod skips;

pub use failure::Failure;
pub use forecast::{Forecast, forecast};
pub use prepare::{Study, prepare};
