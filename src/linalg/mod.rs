//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

pub mod operator;
pub mod packed;
