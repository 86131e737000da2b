//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! The coefficients are the same in all cells and do not depend on temperature. `PreparedModel` (`evolution::model`) evaluates both
//! laws. `increment_problem` (`evolution::increment_solve`) gives the friction ellipse and the specific wear rate to the
//! `Increment` (`contact::increment`).

pub mod friction;
pub mod wear;
