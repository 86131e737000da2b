//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! [`friction::FrictionLaw`] gives one friction ellipse, and [`wear::WearLaw`] one specific wear rate (1/MPa), for the whole frame, both
//! in the local axes of each cell. `PreparedModel` in `evolution` evaluates the laws once; `Increment` in `contact` applies them:
//! `FrictionScaling` the ellipse, `fill_wear` the wear depth in the gap. The coefficients do not depend on temperature.

pub mod friction;
pub mod wear;
