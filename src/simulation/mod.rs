//! Simulation of a plan: builds bodies, frame and flexibility, runs the steps, and rebuilds the model when frame or meshes change.
//!
//! `validate` checks a plan, `build` builds the [`Simulation`], `segments` runs it and writes the results. After each segment,
//! `rebuild` ends or continues the run: on a larger frame (made by `grown_frame`, with the state from `growth`) or with worn meshes
//! (made by `worn_meshes`, with the state from `mesh_motion`). `resume` starts a run from a checkpoint.

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
