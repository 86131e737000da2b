//! What this module is.

pub mod patch;
pub mod polygon;
pub(crate) mod cell_influence;
pub(crate) mod polygon_moments;
pub(crate) mod polygon_multipole;
pub(crate) mod rectangle_expansion;
