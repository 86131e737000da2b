//! Elastic half-spaces of any anisotropy: surface Green's function, polygon integrals, operators on the frame.
//!
//! Everything is in the axes (x, y, n) of the frame; stiffnesses are given in those axes. The lower body has the
//! outward normal +n, the upper one -n. `u(x) = ∫ G(x - y) t(y) dA`, rows of G = displacement, columns =
//! traction on the body, G(x) = Γ(φ) / |x| with x = |x| (cos φ, sin φ), G(-x) = G(x)^T. The contact sees
//! S = G(lower) + G(upper), since body 2 carries the traction P and body 1 carries -P.
//!
//! The way from a stiffness to an operator:
//!
//! [`Stiffness`](crate::material::Stiffness) -> [`SurfaceGreen`] -> [`PatchIntegrator`] ->
//! [`FftFlexibility`] (grid frames) or [`DenseFlexibility`] (any plane frame); on grids that repeat themselves
//! [`SurfaceGreen`] -> [`PeriodicFlexibility`]

mod admittance;
mod angular_table;
pub mod barnett_lothe;
mod boussinesq;
mod cell_pairs;
pub mod compressed;
pub mod dense;
mod far_field;
pub mod fft;
mod fft_plan;
mod filter;
pub mod green;
mod grid_symbol;
mod harmonics;
pub mod interior;
mod kernel_table;
pub mod kernels;
mod line;
mod mirror_plan;
mod mirrored;
mod offsets;
pub mod patch;
pub mod point_field;
pub mod point_force;
mod point_force_table;
pub mod periodic;
mod periodic_symbol;
pub mod polygon;
mod polygon_far;
mod polygon_moments;
pub mod subsurface;
mod surface_field;
mod symbol;
mod symbol_inverse;

pub use crate::geometry::Side;
pub use compressed::CompressedFlexibility;
pub use dense::DenseFlexibility;
pub use fft::{CrossBlocks, FftFlexibility};
pub use green::SurfaceGreen;
pub use interior::InteriorField;
pub use kernels::Kernels;
pub use patch::PatchIntegrator;
pub use periodic::PeriodicFlexibility;
pub use point_field::{PointField, TractionMap};
pub use point_force::PointForceField;
pub use subsurface::Subsurface;
