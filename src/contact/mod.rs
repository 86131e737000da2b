//! Contact increment: Signorini conditions and elliptic Coulomb friction on the contact frame, with implicit wear.
//!
//! Unknowns are the rigid motions and the scaled (*hatted*) tractions P̂ = D⁻¹ P on body 2 (docs/theory-contact.md).
//! Tractions are in the friction axes, and D = diag(μ1, μ2, 1). In scaled variables every friction ellipse is a disc of
//! radius p, and radial return is the exact projection. A field `[3, N]` stores its three components one after the
//! other: q̂1, q̂2, p. With the slip Δg of the increment, the conjugate gap is ĝ = [μ1 Δg1, μ2 Δg2, g_n].
//!
//! An [`Increment`] has one path point, or all path points of a fretting cycle, which are solved together. The slips
//! between the path points and their common wear depth couple the equations of these points.

pub mod balance;
pub mod certificate;
mod contact_state;
mod control;
mod friction_scaling;
mod increment;
pub mod projection;
mod residual;
pub mod scales;
pub mod solver;
mod window;

pub use balance::{Balance, BalanceConstraint};
pub use contact_state::{ContactState, Unknowns};
pub use control::{NormalControl, PathPoint, Pressures, SlipReference, TangentialControl, Upstream};
pub use increment::Increment;
pub use scales::ContactScales;
pub use solver::{Method, SolverOptions};
