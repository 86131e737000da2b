//! Finite elements on problems of solid mechanics with known solutions.

mod bending;
mod free_modes;
mod gmsh_solids;
mod membranes;
mod meshes;
mod patch;
mod plate;
mod sphere;
mod torsion;
