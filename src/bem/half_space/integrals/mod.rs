//! Integrals of the surface Green's function over cells: exact over polygons, expansions at a distance, all pairs of cells of a frame.

pub(super) mod cell_influence;
pub mod patch;
pub mod polygon;
mod polygon_moments;
mod polygon_multipole;
pub(super) mod rectangle_expansion;
