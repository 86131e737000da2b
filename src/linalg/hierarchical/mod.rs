//! Matrices of smooth kernels over points in blocks of low rank: a tree of clusters, pairs of clusters
//! that are far apart for their size, and the approximation of each such block by some of its rows and columns.
//!
//! What the kernel is does not matter here. Over points in the plane it may have several components, each a matrix that is symmetric or
//! antisymmetric; one of each pair of mirrored blocks is stored ([`HierarchicalMatrix`]). Over elements in space its entries come together for
//! a node and an element, without symmetry ([`CollocationMatrix`]).
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
