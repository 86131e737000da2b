//! What this module is.

pub mod friction;
pub mod wear;
