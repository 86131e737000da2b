//! Matrices of smooth kernels over points in the plane in blocks of low rank: a tree of clusters, pairs of clusters
//! that are far apart for their size, and the approximation of each such block by some of its rows and columns.
//!
//! What the kernel is does not matter here. It may have several components, each a matrix that is symmetric or
//! antisymmetric; one of each pair of mirrored blocks is stored.
//!
//! # Source
//! Hackbusch 1999, "A sparse matrix arithmetic based on H-matrices"; Börm, Grasedyck and Hackbusch 2003, "Hierarchical
//! matrices".

pub mod blocks;
pub mod cluster;
mod cross;
mod low_rank;
mod matrix;
mod product;

pub use blocks::{Block, blocks};
pub use cluster::{Cluster, ClusterTree, Extent};
pub use cross::{Entries, MOST};
pub(super) use low_rank::dot;
pub use matrix::{HierarchicalMatrix, Layout};
pub use product::Use;
