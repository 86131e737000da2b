//! Interpolation of displacement and traction over a boundary element with interior nodes.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Deserialize;

use crate::quadrature::{RulePoint, quadrilateral, triangle};

/// Maximum number of nodes of an element.
pub const MOST_NODES: usize = 9;

/// Six-point rule of degree 4 on the triangle (Strang and Fix 1973). Each entry holds the coordinate a and the weight
/// of three points, whose barycentric coordinates are permutations of (a, a, 1 - 2a).
const SIX_POINTS: [(f64, f64); 2] =
    [(0.091_576_213_509_771, 0.054_975_871_827_661), (0.445_948_490_915_965, 0.111_690_794_839_006)];

/// Interpolation on a boundary element. The elements are discontinuous: their nodes lie inside.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "BoundaryElement")]
pub enum Interpolation {
    /// Constant: one node.
    Constant,
    /// Linear: three nodes on triangles, 2 x 2 on quadrilaterals.
    #[default]
    Linear,
    /// Quadratic: six nodes on triangles, 3 x 3 on quadrilaterals.
    Quadratic,
}

impl Interpolation {
    /// All interpolations.
    pub const ALL: [Self; 3] = [Self::Constant, Self::Linear, Self::Quadratic];

    /// Polynomial degree (along each direction on quadrilaterals).
    pub const fn degree(self) -> usize {
        match self {
            Self::Constant => 0,
            Self::Linear => 1,
            Self::Quadratic => 2,
        }
    }

    /// Name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Linear => "linear",
            Self::Quadratic => "quadratic",
        }
    }

    /// Number of nodes on an element.
    pub const fn n_nodes(self, triangle: bool) -> usize {
        let side = self.degree() + 1;
        if triangle { side * (side + 1) / 2 } else { side * side }
    }
}

/// Nodes of an interpolation on the reference triangle or square, with their Lagrange polynomials.
#[derive(Debug, Clone)]
pub struct ElementNodes {
    reference_points: Vec<[f64; 2]>,
    weights: Vec<f64>,
    triangle: bool,
    /// Coefficients of the monomials in each polynomial, `[node, monomial]`.
    coefficients: DMatrix<f64>,
}

impl ElementNodes {
    /// Nodes on a triangle if `triangle` is true, otherwise on a quadrilateral.
    pub fn new(interpolation: Interpolation, triangle: bool) -> Self {
        let rule =
            if triangle { on_triangle(interpolation) } else { quadrilateral(interpolation.degree() + 1) };
        let (reference_points, weights): (Vec<[f64; 2]>, Vec<f64>) = rule.into_iter().unzip();
        let n = reference_points.len();
        let matrix =
            DMatrix::from_fn(n, n, |monomial, node| monomials(n, triangle, reference_points[node])[monomial]);
        let coefficients = matrix.try_inverse().expect("nodes of a rule determine their polynomials");
        Self { reference_points, weights, triangle, coefficients }
    }

    /// Positions of the nodes in the reference element.
    pub fn reference_points(&self) -> &[[f64; 2]] {
        &self.reference_points
    }

    /// Weights of the quadrature rule whose points are the nodes.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Values of the polynomials at a point of the reference element. Entries beyond the number of nodes are zero.
    pub fn values(&self, xi: [f64; 2]) -> [f64; MOST_NODES] {
        let n = self.reference_points.len();
        let monomials = monomials(n, self.triangle, xi);
        let mut values = [0.0; MOST_NODES];
        for (node, value) in values.iter_mut().enumerate().take(n) {
            *value = (0..n).map(|k| self.coefficients[(node, k)] * monomials[k]).sum();
        }
        values
    }

    /// Derivatives of the polynomials along the directions of the reference element.
    pub fn gradients(&self, xi: [f64; 2]) -> [[f64; 2]; MOST_NODES] {
        let n = self.reference_points.len();
        let slopes = monomial_gradients(n, self.triangle, xi);
        let mut gradients = [[0.0; 2]; MOST_NODES];
        for (node, gradient) in gradients.iter_mut().enumerate().take(n) {
            *gradient = [0, 1].map(|d| (0..n).map(|k| self.coefficients[(node, k)] * slopes[k][d]).sum());
        }
        gradients
    }
}

fn monomials(n: usize, triangle: bool, [u, v]: [f64; 2]) -> [f64; MOST_NODES] {
    if triangle {
        return [1.0, u, v, u * u, u * v, v * v, 0.0, 0.0, 0.0];
    }
    let mut values = [0.0; MOST_NODES];
    let side = if n == 9 { 3 } else { n.min(2) };
    for (k, value) in values.iter_mut().enumerate().take(n) {
        *value = u.powi((k / side) as i32) * v.powi((k % side) as i32);
    }
    values
}

fn monomial_gradients(n: usize, triangle: bool, [u, v]: [f64; 2]) -> [[f64; 2]; MOST_NODES] {
    let mut slopes = [[0.0; 2]; MOST_NODES];
    if triangle {
        let all = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [2.0 * u, 0.0], [v, u], [0.0, 2.0 * v]];
        slopes[..6].copy_from_slice(&all);
        return slopes;
    }
    let side = if n == 9 { 3 } else { n.min(2) };
    let slope = |x: f64, power: usize| if power == 0 { 0.0 } else { power as f64 * x.powi(power as i32 - 1) };
    for (k, both) in slopes.iter_mut().enumerate().take(n) {
        let (a, b) = (k / side, k % side);
        *both = [slope(u, a) * v.powi(b as i32), u.powi(a as i32) * slope(v, b)];
    }
    slopes
}

fn on_triangle(interpolation: Interpolation) -> Vec<RulePoint<2>> {
    match interpolation {
        Interpolation::Constant => triangle(1),
        Interpolation::Linear => triangle(2),
        Interpolation::Quadratic => {
            let around = |(a, weight): (f64, f64)| {
                [[a, a], [1.0 - 2.0 * a, a], [a, 1.0 - 2.0 * a]].map(|place| (place, weight))
            };
            SIX_POINTS.map(around).concat()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: monomials up to the degree of the interpolation are reproduced, and so are their derivatives. The
    /// quadrature rule integrates the squares of these monomials exactly.
    #[test]
    fn polynomials_are_reproduced() {
        for interpolation in Interpolation::ALL {
            for triangle in [true, false] {
                let nodes = ElementNodes::new(interpolation, triangle);
                assert_eq!(nodes.reference_points().len(), interpolation.n_nodes(triangle));
                let degree = interpolation.degree() as i32;
                let powers = (0..=degree).flat_map(|a| (0..=degree).map(move |b| (a, b)));
                for (a, b) in powers.filter(|(a, b)| !triangle || a + b <= degree) {
                    let f = |[u, v]: [f64; 2]| u.powi(a) * v.powi(b);
                    for xi in [[0.2, 0.3], [0.0, 0.0], [0.7, 0.1]] {
                        let values = nodes.values(xi);
                        let sum: f64 =
                            nodes.reference_points().iter().zip(values).map(|(x, value)| f(*x) * value).sum();
                        assert!((sum - f(xi)).abs() < 1e-12, "{interpolation:?} {xi:?}");
                        let slope = |x: f64, n: i32| if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) };
                        let exact = [slope(xi[0], a) * xi[1].powi(b), xi[0].powi(a) * slope(xi[1], b)];
                        for (d, exact) in exact.into_iter().enumerate() {
                            let parts = nodes.reference_points().iter().zip(nodes.gradients(xi));
                            let sum: f64 = parts.map(|(x, gradient)| f(*x) * gradient[d]).sum();
                            assert!((sum - exact).abs() < 1e-11, "{interpolation:?} {xi:?} {d}");
                        }
                    }
                    let found: f64 = nodes
                        .reference_points()
                        .iter()
                        .zip(nodes.weights())
                        .map(|(x, w)| f(*x).powi(2) * w)
                        .sum();
                    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
                    let exact = if triangle {
                        factorial(2 * a) * factorial(2 * b) / factorial(2 * a + 2 * b + 2)
                    } else {
                        4.0 / (f64::from(2 * a + 1) * f64::from(2 * b + 1))
                    };
                    assert!((found - exact).abs() < 1e-13, "{interpolation:?} {a} {b}");
                }
            }
        }
    }
}
