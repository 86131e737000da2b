//! Integrals of the surface Green's function over cells: exact for polygons, expansions at a distance, cell influences.

pub(super) mod cell_influence;
pub mod patch;
pub mod polygon;
mod polygon_moments;
mod polygon_multipole;
pub(super) mod rectangle_expansion;
