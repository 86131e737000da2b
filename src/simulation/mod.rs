//! Simulation of a plan: builds bodies, frame and flexibility, runs the steps, and rebuilds the model when frame or meshes change.
//!
//! `validate` checks a plan, `build` builds the [`Simulation`], `segments` runs it and writes the results. After each segment
//! `rebuild` decides whether the run ends, or continues after a change: on a larger frame (`grown_frame` makes it, `growth` transfers
//! the state), or with meshes moved by wear (`worn_meshes` makes them, `mesh_motion` transfers the state). `resume` starts a run from
//! the checkpoint of an earlier one.

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
