//! Finite bodies at the resolution of a half-space: its operator on the frame, and what the finite body lacks of it by finite
//! elements.

mod polynomial_order;
mod body;
mod boundary_terms;
pub mod correction;
mod traction_tree;
mod face_quadrature;
pub mod far_field;
mod field;
mod forces;
mod inclusions;
pub mod indicators;
mod locate;
pub mod corrected_flexibility;
mod patch_coupling;
mod face_outline;
mod applied_loads;
mod patch;
mod multi_patch_body;
mod half_space_fit;
mod chebyshev;

pub use body::HybridBody;
pub use polynomial_order::AppliedLoadError;

pub use correction::Correction;
pub use far_field::FarField;
pub use forces::{FaceId, PatchForces};
pub use half_space_fit::{HalfSpaceFit, Unsuitable};
pub use indicators::Indicators;
pub use multi_patch_body::{FaceContact, MultiFrameFlexibility, MultiPatchBody};
pub use patch::ContactPatch;
