//! Constitutive laws of the contact surface: friction and wear, orthotropic and dependent on the fibre direction.

pub mod friction;
pub mod wear;
