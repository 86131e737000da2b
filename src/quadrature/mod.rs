//! Quadrature rules on the reference cells: points x_i and weights w_i ([`RulePoint`]) with ∫ f ≈ Σ w_i f(x_i).

mod gauss;
mod simplex;
mod wedge_pyramid;

pub use gauss::{gauss_legendre, hexahedron, quadrilateral};
pub use simplex::{tetrahedron, triangle};
pub use wedge_pyramid::{pyramid, wedge};

/// Point of a quadrature rule: reference coordinates and weight.
pub type RulePoint<const D: usize> = ([f64; D], f64);
