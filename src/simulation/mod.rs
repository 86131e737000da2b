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
