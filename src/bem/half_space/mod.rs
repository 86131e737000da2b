//! Elastic half-spaces, isotropic or anisotropic: surface Green's function, integrals over cells, flexibility operators on the
//! frame.
//!
//! All quantities are in the axes (x, y, n) of the frame. The outward normal is +n for the lower body and -n for the upper body.
//! Tractions t on a body cause the displacement `u(x) = ∫ G(x - y) t(y) dA` of its surface: rows of G are displacements, columns
//! tractions. G(x) = Γ(φ) / |x| with x = |x| (cos φ, sin φ), and G(-x) = G(x)^T. Body 2 carries the traction P and body 1 carries
//! -P, so that S = G(lower) + G(upper).

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
