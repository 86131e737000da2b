//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

pub mod additive_schwarz;
mod amalgamation;
pub mod cache;
mod cgroup;
pub mod cholesky;
mod column_counts;
pub mod dense;
pub mod dense_lu;
pub mod dense_matrix;
mod extend_add;
mod front_elimination;
mod fronts;
pub mod gmres;
pub mod hierarchical;
mod lower_blocks;
pub mod memory;
mod multifrontal;
pub mod ordering;
pub mod packed;
mod schedule;
pub(crate) mod simd;
pub mod sparse;
pub mod sparse_lu;
pub mod two_level;
pub(crate) mod vector;
