//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

mod cgroup;
mod column_counts;
pub mod dense;
pub mod factor;
mod fronts;
pub mod lu;
pub mod memory;
mod merging;
mod multifrontal;
pub mod operator;
pub mod ordering;
pub mod packed;
pub mod sparse;
