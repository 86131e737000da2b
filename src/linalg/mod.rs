//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

pub mod additive_schwarz;
pub mod cache;
mod cgroup;
pub mod cholesky;
pub mod dense;
pub mod dense_lu;
pub mod dense_matrix;
pub mod gmres;
pub mod hierarchical;
pub mod memory;
pub mod ordering;
pub mod packed;
pub(crate) mod pseudo_inverse;
pub(crate) mod simd;
pub mod sparse;
pub mod sparse_lu;
pub mod two_level;
pub(crate) mod vector;
