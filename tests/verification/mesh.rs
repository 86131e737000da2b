//! Meshes: files of gmsh and meshio are read correctly; damaged files are refused and never cause a panic.

mod element_fields;
mod gmsh_writes;
mod kinds;
mod meshio_writes;
mod quality;
mod reader;
pub mod tools;
mod vtu_cells;
pub mod writer;
