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

pub mod green;
pub mod grid;
pub mod integrals;
pub mod periodic;
pub mod plane;
pub mod subsurface;

pub use crate::bem::green_tensor::{GreenTensor, TractionOperator};
pub use crate::bem::half_space::grid::fft::{CrossBlocks, FftFlexibility};
pub use crate::bem::half_space::integrals::patch::PatchIntegrator;
pub use crate::bem::half_space::plane::compressed::CompressedFlexibility;
pub use crate::bem::half_space::plane::dense::DenseFlexibility;
pub use crate::bem::half_space::subsurface::point_force::PointForceField;
pub use crate::bem::half_space::subsurface::point_force_integral::PointForceIntegral;
pub use crate::geometry::Side;
pub use green::SurfaceGreen;
pub use periodic::PeriodicFlexibility;
pub use subsurface::SubsurfaceField;
