//! Simulation of a plan: builds bodies, frame and flexibility, runs the steps, and rebuilds the model when frame or
//! meshes change.
//!
//! - `validate` checks a plan.
//! - `build` builds the [`Simulation`].
//! - `segments` runs the simulation and writes the results. A segment is the part of a run on one frame with one set of
//!   meshes.
//! - `rebuild` ends the run after a segment, or continues it on a larger frame or with worn meshes.
//! - `grown_frame` makes the larger frame, and `growth` transfers the state to it.
//! - `worn_meshes` makes the worn meshes, and `mesh_motion` transfers the state to them.
//! - `resume` starts a run from a checkpoint.

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
