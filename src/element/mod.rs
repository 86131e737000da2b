//! Element kinds: node counts, faces, reference node order (gmsh's), shape functions; one file per finite element.

mod kind;
mod tables;

pub use kind::ElementKind;
