//! Meshes: what gmsh and meshio write is read as it is meant; damaged files are refused, never fatal.

mod element_fields;
mod gmsh_writes;
mod kinds;
mod meshio_writes;
mod quality;
mod reader;
pub mod tools;
mod vtu_cells;
pub mod writer;
