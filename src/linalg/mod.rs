//! Linear algebra of the solver: dense, sparse and hierarchical matrices, factorisations, iterative solvers, and memory
//! limits.
//!
//! - Systems K x = f with a stiffness matrix K: [`sparse::SymmetricSparse`] stores K, a [`cholesky::SymmetricSolver`]
//!   solves the system. Solvers are [`cholesky::CholeskyFactor`] (K = L Lᵀ) and [`two_level::TwoLevelSolver`]
//!   (conjugate gradients).
//! - Dense matrices in packed or compressed storage: [`packed::PackedSymmetric`], [`hierarchical::HierarchicalMatrix`],
//!   [`hierarchical::CollocationMatrix`].
//! - Unsymmetric systems: [`dense_lu::DenseLu`], [`sparse_lu::SparseLu`], [`gmres::Gmres`].
//! - Resources: [`memory::MemoryLimit`] and the file cache [`cache::Cache`].

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
