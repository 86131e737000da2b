//! Integration points of the elements, and the map from the reference cell to the body at each.

use nalgebra::Matrix3;

use crate::element::ShapeFunctions;
use crate::quadrature::RulePoint;

/// The least det J that still is a volume, relative to the cube of the longest column of J.
const DEGENERATE: f64 = 1e-12;

/// An integration point of the reference cell with the shape functions there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample<const N: usize> {
    pub xi: [f64; 3],
    pub weight: f64,
    pub values: [f64; N],
    pub gradients: [[f64; 3]; N],
}

/// The same point in the body.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mapped<const N: usize> {
    /// det J.
    pub jacobian: f64,
    /// Weight times det J.
    pub volume: f64,
    /// Derivatives of the shape functions by x, y, z.
    pub gradients: [[f64; 3]; N],
}

/// Why an element has no stiffness.
#[derive(Debug, Clone, Copy)]
pub(super) enum Unsound {
    /// It is inverted or degenerate where its det J is this.
    Jacobian(f64),
    /// Its shape is sound, but the stiffness of its enhanced strains is not positive definite.
    Modes,
}

/// The shape functions at the points of a rule.
pub(super) fn samples<S: ShapeFunctions<N, 3>, const N: usize>(rule: Vec<RulePoint<3>>) -> Vec<Sample<N>> {
    rule.into_iter()
        .map(|(xi, weight)| Sample { xi, weight, values: S::values(xi), gradients: S::gradients(xi) })
        .collect()
}

/// J_ij = dx_i / dxi_j.
pub(super) fn jacobian<const N: usize>(nodes: &[[f64; 3]; N], gradients: &[[f64; 3]; N]) -> Matrix3<f64> {
    let mut j = Matrix3::zeros();
    for (x, g) in nodes.iter().zip(gradients) {
        for row in 0..3 {
            for column in 0..3 {
                j[(row, column)] += x[row] * g[column];
            }
        }
    }
    j
}

/// Maps a sample into the element of nodes `nodes`.
pub(super) fn map<const N: usize>(nodes: &[[f64; 3]; N], sample: &Sample<N>) -> Result<Mapped<N>, Unsound> {
    let j = jacobian(nodes, &sample.gradients);
    let det = j.determinant();
    let longest = j.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
    let inverse =
        j.try_inverse().filter(|_| det > DEGENERATE * longest.powi(3)).ok_or(Unsound::Jacobian(det))?;
    let gradients = sample.gradients.map(|g| {
        std::array::from_fn(|i| inverse[(0, i)] * g[0] + inverse[(1, i)] * g[1] + inverse[(2, i)] * g[2])
    });
    Ok(Mapped { jacobian: det, volume: sample.weight * det, gradients })
}
