//! Operators on plane frames of arbitrary cells: dense, or compressed as a hierarchical matrix.

pub mod compressed;
pub mod dense;
