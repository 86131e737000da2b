//! One contact increment: Signorini's conditions and an elliptic Coulomb law on the frame, implicit wear included.
//!
//! Unknowns are the *hatted* tractions on body 2, P̂ = D⁻¹ P with D = diag(μ1, μ2, 1) in the friction axes
//! (docs/theory-contact.md): in them every ellipse is the unit disc and radial return is the exact projection. Planes are
//! ordered [q̂1, q̂2, p]; the matching gap is ĝ = [μ1 Δg1, μ2 Δg2, g_n], Δg the slip of the increment.
//!
//! An increment has one *end*, or two that are solved together: the two ends of a fretting stroke, coupled through
//! the slip between them and through the wear that both cause.

pub mod balance;
pub mod certificate;
mod contact_state;
mod control;
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
