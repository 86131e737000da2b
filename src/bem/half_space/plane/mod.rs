//! Operators on plane frames of any cells: dense, or compressed as a hierarchical matrix.

pub mod compressed;
pub mod dense;
