//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

pub mod dense;
pub mod factor;
pub mod lu;
pub mod memory;
pub mod operator;
pub mod ordering;
pub mod packed;
pub mod sparse;
