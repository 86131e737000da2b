//! Least-squares polynomials over a patch of samples, evaluated as weights of the samples.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::error::Result;
use crate::linalg::pseudo_inverse::pseudo_inverse;

/// Singular values up to this fraction of the largest count as zero, for example if all samples lie in one plane. All
/// singular values of patches with an aspect ratio of 1e4 are larger.
const RANK_TOLERANCE: f64 = 1e-9;

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum PolynomialSpace {
    /// Degree 1, 4 terms.
    Linear,
    /// Degree 2, 10 terms.
    Quadratic,
    /// Degree 2 along each axis, 27 terms.
    Triquadratic,
}

pub(super) struct PatchFit {
    pub samples: Vec<usize>,
    space: PolynomialSpace,
    /// Transformation from global coordinates to the axes of the polynomial.
    to_axes: Matrix3<f64>,
    centre: [f64; 3],
    scale: [f64; 3],
    /// Map from sample values to coefficients of the monomials, `[n_terms, n]`.
    inverse: DMatrix<f64>,
}

impl PatchFit {
    /// Fits polynomials of `space`, in coordinates along the columns of `axes`, to `samples`. Components of the
    /// coefficient vector that the samples do not determine are zero. A single sample gives a constant.
    pub fn new(
        space: PolynomialSpace,
        axes: Matrix3<f64>,
        samples: Vec<usize>,
        position: impl Fn(usize) -> [f64; 3],
    ) -> Result<Self> {
        let to_axes = axes.try_inverse().unwrap_or_else(Matrix3::identity);
        let local = |&sample: &usize| -> [f64; 3] { (to_axes * Vector3::from(position(sample))).into() };
        let at: Vec<[f64; 3]> = samples.iter().map(local).collect();
        let n = at.len() as f64;
        let centre: [f64; 3] = std::array::from_fn(|c| at.iter().map(|x| x[c]).sum::<f64>() / n);
        let scale: [f64; 3] =
            std::array::from_fn(|c| at.iter().map(|x| (x[c] - centre[c]).abs()).fold(0.0, f64::max));
        // An axis along which the samples coincide up to rounding gets the largest scale of all axes.
        let largest = Some(scale.iter().copied().fold(0.0, f64::max)).filter(|s| *s > 0.0).unwrap_or(1.0);
        let scale = scale.map(|s| if s > RANK_TOLERANCE * largest { s } else { largest });
        let mut patch = Self { samples, space, to_axes, centre, scale, inverse: DMatrix::zeros(0, 0) };
        let rows: Vec<Vec<f64>> = at.iter().map(|x| patch.monomials(*x)).collect();
        let a = DMatrix::from_fn(rows.len(), rows.first().map_or(0, Vec::len), |i, j| rows[i][j]);
        patch.inverse = pseudo_inverse(&a, RANK_TOLERANCE)?;
        Ok(patch)
    }

    fn monomials(&self, x: [f64; 3]) -> Vec<f64> {
        let [x, y, z]: [f64; 3] = std::array::from_fn(|c| (x[c] - self.centre[c]) / self.scale[c]);
        let powers = |x: f64| [1.0, x, x * x];
        match self.space {
            PolynomialSpace::Linear => vec![1.0, x, y, z],
            PolynomialSpace::Quadratic => vec![1.0, x, y, z, x * x, y * y, z * z, y * z, x * z, x * y],
            PolynomialSpace::Triquadratic => powers(x)
                .into_iter()
                .flat_map(|a| powers(y).map(|b| a * b))
                .flat_map(|ab| powers(z).map(|c| ab * c))
                .collect(),
        }
    }

    /// Weights of the samples for the value of the polynomial at `x`, `[n]`.
    pub fn weights_at(&self, x: [f64; 3]) -> DVector<f64> {
        let local = self.to_axes * Vector3::from(x);
        self.inverse.tr_mul(&DVector::from_vec(self.monomials(local.into())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(n: usize) -> Vec<[f64; 3]> {
        let number = |k: usize| ((k as f64) * 0.618_033_988_75).fract() - 0.5;
        (0..n).map(|i| [number(3 * i + 1), 0.01 * number(5 * i + 2), 30.0 * number(7 * i + 3)]).collect()
    }

    /// Truth: a least-squares fit reproduces a polynomial of the fitted space. Tolerance: rounding.
    #[test]
    fn polynomials_are_reproduced() {
        let axes = Matrix3::new(2.0, 0.3, 0.0, 0.0, 0.5, 0.01, 1.0, 0.0, 20.0);
        for terms in [PolynomialSpace::Linear, PolynomialSpace::Quadratic, PolynomialSpace::Triquadratic] {
            let at = scattered(60);
            let patch = PatchFit::new(terms, axes, (0..60).collect(), |i| at[i]).unwrap();
            let field = |[x, y, z]: [f64; 3]| {
                let linear = 2.0 + x - 50.0 * y + 0.2 * z;
                let local = axes.try_inverse().unwrap() * Vector3::new(x, y, z);
                linear
                    + match terms {
                        PolynomialSpace::Linear => 0.0,
                        PolynomialSpace::Quadratic => 4.0 * x * z - 3.0 * y * y + x * x,
                        PolynomialSpace::Triquadratic => 3.0 * (local.x * local.y * local.z).powi(2),
                    }
            };
            let x = [0.4, 0.003, -9.0];
            let value: f64 = patch.weights_at(x).iter().zip(&at).map(|(w, p)| w * field(*p)).sum();
            assert!((value - field(x)).abs() < 1e-12 * 60.0, "{value} {}", field(x));
        }
    }

    /// Truth: samples in one plane do not determine the gradient normal to the plane, so the fit is constant along the normal.
    #[test]
    fn what_the_samples_leave_open_is_constant() {
        let at: Vec<[f64; 3]> = scattered(12).into_iter().map(|[x, y, _]| [x, y, 2.0]).collect();
        let patch = PatchFit::new(PolynomialSpace::Linear, Matrix3::identity(), (0..12).collect(), |i| at[i])
            .unwrap();
        for (x, value) in [([0.1, 0.0, 2.0], 0.1), ([0.1, 0.0, 7.0], 0.1)] {
            let found: f64 = patch.weights_at(x).iter().zip(&at).map(|(w, p)| w * p[0]).sum();
            assert!((found - value).abs() < 1e-12, "{found}");
        }
        let alone =
            PatchFit::new(PolynomialSpace::Triquadratic, Matrix3::identity(), vec![0], |_| [1.0, 2.0, 3.0])
                .unwrap();
        assert!((alone.weights_at([5.0, -1.0, 0.0])[0] - 1.0).abs() < 1e-14);
    }
}
