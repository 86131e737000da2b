//! Element kinds: node counts, faces, reference node order (gmsh's), shape functions; one file per finite element.

mod hex8;
mod kind;
mod quad4;
mod quad8;
mod quad9;
mod shape;
mod tables;
mod tet4;
mod tri3;
mod tri6;

pub use hex8::Hex8;
pub use kind::ElementKind;
pub use quad4::Quad4;
pub use quad8::Quad8;
pub use quad9::Quad9;
pub use shape::ShapeFunctions;
pub use tet4::Tet4;
pub use tri3::Tri3;
pub use tri6::Tri6;
