//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.
//!
//! [`friction::FrictionLaw`] gives the friction ellipse of a cell, [`wear::WearLaw`] its specific wear rate (1/MPa).

pub mod friction;
pub mod wear;
