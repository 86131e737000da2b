//! Problems of solid mechanics with known answers, for the elements they are meant for.

mod bending;
mod free_modes;
mod gmsh_solids;
mod membranes;
mod meshes;
mod patch;
mod plate;
mod sphere;
mod torsion;
