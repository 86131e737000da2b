//! Elastic half-spaces, isotropic or anisotropic: surface Green's function, integrals over cells, flexibility operators
//! on the frame.
//!
//! All quantities are in the axes (x, y, n) of the frame. Body 1 is the lower body with the outward normal +n. Body 2
//! is the upper body with the outward normal -n. Tractions t on a body displace its surface by
//! `u(x) = ∫ G(x - y) t(y) dA`. Rows of the Green's function G are displacements, columns are tractions. With x = |x|
//! (cos φ, sin φ), G(x) = Γ(φ) / |x| and G(-x) = G(x)^T. Body 2 carries the traction P and body 1 carries -P. The gap
//! therefore changes by the integral of P with the sum of the two bodies' Green's functions.

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
