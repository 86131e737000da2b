//! Linear algebra behind small traits: flexibility operators, sparse symmetric factorisation, ordering.

mod cgroup;
mod assembly;
pub mod cache;
pub mod cell_matrix;
mod column_counts;
pub mod columns;
pub mod composed;
pub mod constrained;
pub mod course;
pub mod dense;
pub mod dense_lu;
pub mod factor;
pub mod gmres;
pub mod gmres_columns;
mod fronts;
pub mod hierarchical;
pub mod local_inverse;
mod lower_blocks;
pub mod lu;
pub mod memory;
mod merging;
mod multifrontal;
pub mod operator;
pub mod subset;
pub mod ordering;
pub mod packed;
mod partial;
pub mod per_cell;
pub mod precision;
pub mod sparse;
pub mod two_level;
pub(crate) mod wide;
mod workspace;

pub use per_cell::PerCell;
