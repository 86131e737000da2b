//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

mod cgroup;
mod extend_add;
pub mod cache;
mod column_counts;
pub mod dense_matrix;
pub mod constrained;
pub mod dense;
pub mod dense_lu;
pub mod cholesky;
pub mod gmres;
pub mod gmres_multi_rhs;
mod fronts;
pub mod hierarchical;
pub mod additive_schwarz;
mod lower_blocks;
pub mod sparse_lu;
pub mod memory;
mod amalgamation;
mod multifrontal;
pub mod ordering;
pub mod packed;
mod front_elimination;
pub mod sparse;
pub mod two_level;
pub(crate) mod simd;
mod schedule;

pub use crate::flexibility::per_cell::PerCell;
