//! What this module is.

pub(crate) mod controls;
pub(crate) mod fit;
pub(crate) mod flat_faces;
pub(crate) mod inside;
pub(crate) mod locking;
pub(crate) mod periodic;
pub(crate) mod symmetry_planes;
