//! Hierarchical matrices of smooth kernels. A cluster tree groups neighbouring points. Blocks between near clusters are
//! dense; blocks between distant clusters are low-rank sums `Σ u vᵀ`.
//!
//! [`HierarchicalMatrix`] belongs to points in the plane. Its components are symmetric or antisymmetric, so only one of
//! two mirrored blocks is stored. [`CollocationMatrix`] belongs to elements in space and is unsymmetric. Its kernel is
//! evaluated for a node and an element.
//!
//! # Source
//! Hackbusch 1999, "A sparse matrix arithmetic based on H-matrices"; Börm, Grasedyck and Hackbusch 2003, "Hierarchical
//! matrices".

pub mod block_partition;
pub mod cluster_tree;
mod coarse_block_jacobi;
mod collocation_block;
mod collocation_matrix;
mod cross_approximation;
mod low_rank;
mod matrix;
mod product;

pub use block_partition::{ClusterPair, MirrorBlocks, partition};
pub use cluster_tree::{BoundingBox, Cluster, ClusterTree};
pub use coarse_block_jacobi::{CoarseBlockJacobi, CollocationUnknowns, DiagonalAndBorder};
pub use collocation_block::{CollocationKernel, ElementNumbering, ROWS_PER_NODE};
pub use collocation_matrix::{BlockScalar, CollocationLayout, CollocationMatrix};
pub use cross_approximation::{KernelEntries, MAX_COMPONENTS};
pub use matrix::{BlockLayout, HierarchicalMatrix};
pub use product::ComponentProduct;
