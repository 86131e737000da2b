//! Point forces in an infinite elastic body (full space): kernels of the finite boundary-element bodies.
//!
//! [`FullSpaceField`] has a closed form for isotropic materials and a table of directions for others. [`BarnettField`] computes the
//! values of the table and serves as its reference.

mod barnett;
mod field;
mod kelvin;

pub use barnett::BarnettField;
pub use field::FullSpaceField;
