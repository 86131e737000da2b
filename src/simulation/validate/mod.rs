//! Checks of a plan against its meshes and its frame, before any solve.

pub(crate) mod controls;
pub(crate) mod fit;
pub(crate) mod flat_faces;
mod height_map;
mod inside;
mod locking;
mod periodic;
pub(super) mod symmetry_planes;
