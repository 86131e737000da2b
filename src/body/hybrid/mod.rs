//! Finite bodies at the resolution of a half-space: its operator on the frame, and what the finite body lacks of it by finite
//! elements.

mod adaptive;
mod body;
mod boundary;
pub mod correction;
mod distribution;
mod faces;
pub mod far_field;
mod field;
mod forces;
mod inclusions;
pub mod indicators;
mod locate;
pub mod operator;
mod opposite;
mod outline;
mod own_loads;
mod patch;
mod patches;
mod site;
mod sources;

pub use adaptive::OwnError;
pub use body::HybridBody;

pub use correction::Correction;
pub use far_field::FarField;
pub use forces::{FaceRef, Forces};
pub use indicators::Indicators;
pub use patch::Patch;
pub use patches::{BlockFlexibility, FaceContact, MultiPatchBody};
pub use site::{Site, Unsuited};
