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

pub mod blocks;
pub mod cluster;
mod cross;
mod general;
mod grouped;
mod low_rank;
mod matrix;
mod local_coarse;
mod product;

pub use blocks::{Block, all_blocks, blocks};
pub use cluster::{Cluster, ClusterTree, Extent};
pub use cross::{Entries, MOST};
pub use general::{CollocationLayout, CollocationMatrix, Real};
pub use grouped::{Collocation, Groups, ROWS};
pub use local_coarse::{Additions, LocalCoarse, Unknowns};
pub(super) use low_rank::dot;
pub use matrix::{HierarchicalMatrix, Layout};
pub use product::Use;
