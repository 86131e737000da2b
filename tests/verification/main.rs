//! Problems with known answers; each test names its truth and why its tolerance.
mod bem;
mod common;
mod contact;
mod coupling;
mod fem;
mod fem_bodies;
mod fem_condensation;
mod fem_convergence;
mod fem_materials;
mod fem_meshes;
mod fem_refusals;
mod fem_supports;
mod fields;
mod laws;
mod mesh;
mod recovery;
mod wear;
