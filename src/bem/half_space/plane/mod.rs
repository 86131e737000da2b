//! What this module is.

pub mod compressed;
pub mod dense;
