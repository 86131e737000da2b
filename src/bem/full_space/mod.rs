//! Point forces in an infinite elastic body (full space): kernels of the finite boundary-element bodies.

mod barnett;
mod field;
mod kelvin;

pub use barnett::BarnettField;
pub use field::FullSpaceField;
