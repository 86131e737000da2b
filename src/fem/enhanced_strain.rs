//! Nine enhanced strain modes of the 8-node hexahedron, condensed in the element.
//!
//! The strain is ε = B u + G α with G = (j0 / j) T0 M(ξ). Here j = det J, 0 marks the centre, and T0 maps natural to global
//! strains. M is linear in ξ with zero mean, so ∫ G dV = 0. Constant stresses then do no work on the modes, and the patch test
//! holds on any hexahedron. With H = ∫ Gᵀ C G dV and Γ = ∫ Gᵀ C B dV, stationarity in α gives α = -H⁻¹ Γ u. The condensed stiffness
//! is K = ∫ Bᵀ C B dV - Γᵀ H⁻¹ Γ.
//!
//! # Source
//! Simo and Rifai (1990), Int. J. Numer. Meth. Engng 29, eqs. 3.6-3.15; Taylor, Beresford and Wilson (1976).

use nalgebra::{Cholesky, Const, Matrix3, Matrix6, SMatrix, SVector};

use super::integration_points::{
    ElementDefect, MappedPoint, ReferencePoint, jacobian, map_point, unit_strain,
};
use crate::element::{Hex8, ShapeFunctions};
use crate::material::VOIGT;

type Modes = SMatrix<f64, 6, 9>;

pub(super) struct EnhancedStrain {
    modes: [Modes; 8],
    gamma: SMatrix<f64, 9, 24>,
    h: Cholesky<f64, Const<9>>,
}

/// Matrix T0, which maps natural strains Ê at the centre to strains ε in global axes: ε_ij = A_ki Ê_kl A_lj with A =
/// J0⁻¹.
fn transformation(inverse: &Matrix3<f64>) -> Matrix6<f64> {
    let a = inverse;
    Matrix6::from_fn(|row, column| {
        let ((i, j), (k, l)) = (VOIGT[row], VOIGT[column]);
        match (i == j, k == l) {
            (true, _) => a[(k, i)] * a[(l, i)],
            (false, true) => 2.0 * a[(k, i)] * a[(k, j)],
            (false, false) => a[(k, i)] * a[(l, j)] + a[(l, i)] * a[(k, j)],
        }
    })
}

/// Matrix M(ξ) of the natural strains of the nine modes, which derive from Wilson's incompatible displacements 1 - ξ².
fn natural_modes([x, y, z]: [f64; 3]) -> Modes {
    let mut m = Modes::zeros();
    for (row, column, value) in
        [(0, 0, x), (1, 1, y), (2, 2, z), (3, 3, y), (3, 4, z), (4, 5, x), (4, 6, z), (5, 7, x), (5, 8, y)]
    {
        m[(row, column)] = value;
    }
    m
}

impl EnhancedStrain {
    pub fn new(
        nodes: &[[f64; 3]; 8],
        samples: &[ReferencePoint<8>],
        mapped: &[MappedPoint<8>; 8],
        c: &Matrix6<f64>,
    ) -> Result<Self, ElementDefect> {
        let centre = jacobian(nodes, &Hex8::gradients([0.0; 3]));
        let det = centre.determinant();
        let inverse =
            centre.try_inverse().filter(|_| det > 0.0).ok_or(ElementDefect::NonpositiveJacobian(det))?;
        let t = transformation(&inverse);
        let mut modes = [Modes::zeros(); 8];
        let mut h = SMatrix::<f64, 9, 9>::zeros();
        let mut gamma = SMatrix::<f64, 9, 24>::zeros();
        for ((sample, point), g) in samples.iter().zip(mapped).zip(&mut modes) {
            *g = t * natural_modes(sample.xi) * (det / point.determinant);
            let stress = (c * *g) * point.volume;
            h += g.transpose() * stress;
            for (a, gradient) in point.gradients.iter().enumerate() {
                for column in 0..3 {
                    let strain = unit_strain(gradient, column);
                    for mode in 0..9 {
                        gamma[(mode, 3 * a + column)] +=
                            strain.iter().map(|&(row, value)| stress[(row, mode)] * value).sum::<f64>();
                    }
                }
            }
        }
        let h = h.cholesky().ok_or(ElementDefect::IndefiniteEnhancedModes)?;
        Ok(Self { modes, gamma, h })
    }

    /// Subtracts Γᵀ H⁻¹ Γ from the packed lower triangle of K.
    pub fn condense(&self, packed: &mut [f64]) {
        let mut x = self.gamma;
        self.h.l_dirty().solve_lower_triangular_mut(&mut x);
        let mut k = 0;
        for i in 0..24 {
            for j in 0..=i {
                packed[k] -= x.column(i).dot(&x.column(j));
                k += 1;
            }
        }
    }

    /// Enhanced strain G α at each integration point for the nodal displacements `u`.
    pub fn strains(&self, u: &[[f64; 3]; 8]) -> [SVector<f64, 6>; 8] {
        let u = SVector::<f64, 24>::from_iterator(u.iter().flatten().copied());
        let alpha = -self.h.solve(&(self.gamma * u));
        self.modes.map(|g| g * alpha)
    }
}

pub(super) fn map_gauss_points(
    nodes: &[[f64; 3]; 8],
    samples: &[ReferencePoint<8>],
) -> Result<[MappedPoint<8>; 8], ElementDefect> {
    let mut mapped = [map_point(nodes, &samples[0])?; 8];
    for (point, sample) in mapped.iter_mut().zip(samples).skip(1) {
        *point = map_point(nodes, sample)?;
    }
    Ok(mapped)
}
