//! Integration points of the elements, and the map from the reference cell to the body.

use nalgebra::{Matrix3, Vector6};

use crate::element::ShapeFunctions;
use crate::quadrature::RulePoint;

/// Smallest det J of a valid element, relative to the cube of the longest column of J.
const MIN_RELATIVE_DETERMINANT: f64 = 1e-12;

#[derive(Debug, Clone, Copy)]
pub(super) struct ReferencePoint<const N: usize> {
    pub xi: [f64; 3],
    pub weight: f64,
    pub values: [f64; N],
    pub gradients: [[f64; 3]; N],
}

#[derive(Debug, Clone, Copy)]
pub(super) struct MappedPoint<const N: usize> {
    /// det J.
    pub determinant: f64,
    /// Integration weight times det J.
    pub volume: f64,
    /// Derivatives of the shape functions with respect to x, y, z.
    pub gradients: [[f64; 3]; N],
}

pub(super) struct PointStress {
    pub values: Vec<f64>,
    /// Integration weight times det J.
    pub volume: f64,
    /// Stress in Voigt order.
    pub stress: Vector6<f64>,
}

pub(super) struct ElementState {
    pub points: Vec<PointStress>,
    pub energy: f64,
    /// Nodal forces ∫ Bᵀ σ dV, `[n_nodes]`. B maps nodal displacements to strain.
    pub forces: Vec<[f64; 3]>,
}

/// Voigt entries (row, value) of the strain due to a unit displacement along `component` of a node with the shape function gradient
/// `g`.
pub(super) fn unit_strain(g: &[f64; 3], component: usize) -> [(usize, f64); 3] {
    match component {
        0 => [(0, g[0]), (4, g[2]), (5, g[1])],
        1 => [(1, g[1]), (3, g[2]), (5, g[0])],
        _ => [(2, g[2]), (3, g[1]), (4, g[0])],
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) enum ElementDefect {
    /// Inverted or degenerate element, with its value of det J.
    NonpositiveJacobian(f64),
    /// The stiffness of the enhanced strains is not positive definite, although the shape is valid.
    IndefiniteEnhancedModes,
}

pub(super) fn reference_points<S: ShapeFunctions<N, 3>, const N: usize>(
    rule: Vec<RulePoint<3>>,
) -> Vec<ReferencePoint<N>> {
    rule.into_iter()
        .map(|(xi, weight)| ReferencePoint { xi, weight, values: S::values(xi), gradients: S::gradients(xi) })
        .collect()
}

/// Jacobian matrix J_ij = dx_i / dxi_j.
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

pub(super) fn map_point<const N: usize>(
    nodes: &[[f64; 3]; N],
    sample: &ReferencePoint<N>,
) -> Result<MappedPoint<N>, ElementDefect> {
    let j = jacobian(nodes, &sample.gradients);
    let det = j.determinant();
    let longest = j.column_iter().map(|c| c.norm()).fold(0.0, f64::max);
    let inverse = j
        .try_inverse()
        .filter(|_| det > MIN_RELATIVE_DETERMINANT * longest.powi(3))
        .ok_or(ElementDefect::NonpositiveJacobian(det))?;
    let gradients = sample.gradients.map(|g| {
        std::array::from_fn(|i| inverse[(0, i)] * g[0] + inverse[(1, i)] * g[1] + inverse[(2, i)] * g[2])
    });
    Ok(MappedPoint { determinant: det, volume: sample.weight * det, gradients })
}
