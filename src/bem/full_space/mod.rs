//! Point forces in an elastic body without surfaces: what finite boundary-element bodies are made of.
//!
//! [`FullSpaceField`] is what bodies use: closed for isotropic materials, a table of directions for the others, which [`BarnettField`]
//! fills and is held against.

mod barnett;
mod field;
mod kelvin;

pub use barnett::BarnettField;
pub use field::FullSpaceField;
