//! Finite bodies at the resolution of a half-space: its operator on the frame, and what the finite body lacks of it by finite
//! elements.

mod body;
mod boundary;
pub mod correction;
mod distribution;
mod faces;
pub mod far_field;
mod inclusions;
pub mod indicators;
mod locate;
pub mod operator;
mod patch;
mod site;
mod sources;

pub use body::HybridBody;
pub use boundary::{FaceRef, Forces};
pub use correction::Correction;
pub use far_field::FarField;
pub use indicators::Indicators;
pub use patch::Patch;
pub use site::{Site, Unsuited};
