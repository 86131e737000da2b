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
mod cell_influence;
pub mod compressed;
pub mod dense;
mod rectangle_expansion;
pub mod fft;
mod fft_plan;
mod spectral_filter;
pub mod green;
mod grid_symbol;
mod harmonic_check;
pub mod point_force_integral;
mod kernel_table;
pub mod kernel_cache;
mod open_direction;
mod half_grid_plan;
mod half_grid;
mod toeplitz_entries;
pub mod patch;
pub mod green_tensor;
pub mod point_force;
mod point_force_table;
pub mod periodic;
mod periodic_symbol;
pub mod polygon;
mod polygon_multipole;
mod polygon_moments;
pub mod subsurface;
mod surface_point_force;
mod symbol;
mod preconditioner;

pub use crate::geometry::Side;
pub use compressed::CompressedFlexibility;
pub use dense::DenseFlexibility;
pub use fft::{CrossBlocks, FftFlexibility};
pub use green::SurfaceGreen;
pub use green_tensor::{GreenTensor, TractionOperator};
pub use kernel_cache::KernelCache;
pub use patch::PatchIntegrator;
pub use periodic::PeriodicFlexibility;
pub use point_force::PointForceField;
pub use point_force_integral::PointForceIntegral;
pub use subsurface::SubsurfaceField;
