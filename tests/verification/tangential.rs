//! Friction of isotropic bodies: partial slip, load paths, coupling of normal and tangential displacements.

mod large_friction;
mod loop_of_force;
mod partial_slip;
mod spence;
mod symmetry;
