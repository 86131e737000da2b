//! Finite bodies whose near field is the response of a half-space ([`HybridBody`]). The half-space operator S_hs
//! resolves the contact. Finite elements add the correction for the finite body: S = S_hs + Σ Φ Ĉ Φᵀ A, with one term
//! per body. Φ contains the cell means of a few polynomials, Ĉ the correction matrix, A the cell areas.

mod applied_loads;
mod body;
mod boundary_terms;
mod chebyshev;
pub mod corrected_flexibility;
pub mod correction;
mod face_outline;
mod face_quadrature;
pub mod far_field;
mod field;
mod forces;
mod half_space_fit;
mod inclusions;
pub mod indicators;
mod locate;
mod patch;
mod polynomial_order;
mod traction_tree;

pub use body::HybridBody;
pub use polynomial_order::AppliedLoadError;

pub use correction::Correction;
pub use far_field::FarField;
pub use forces::{FaceId, PatchForces};
pub use half_space_fit::{HalfSpaceFit, Unsuitable};
pub use indicators::Indicators;
pub use patch::ContactPatch;
