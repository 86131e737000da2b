//! Quality indicators of a correction, which decide whether it may be used.

use nalgebra::{DMatrix, DVector};

use super::chebyshev::Chebyshev;
use super::far_field::FarField;
use super::half_space_fit::HalfSpaceFit;
use super::patch::ContactPatch;
use crate::bem::half_space::{CrossBlocks, FftFlexibility, SurfaceGreen};
use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::geometry::Side;
use crate::linalg::dense_matrix::DenseMatrix;

const COMPARISON_CELLS: usize = 24;

/// Largest imbalance at which the correction is used, for a plane contact surface.
pub const MAX_IMBALANCE: f64 = 1e-4;
/// Largest asymmetry of the boundary terms at which the correction is used, for a plane contact surface.
pub const MAX_ASYMMETRY: f64 = 1e-3;
/// Increase of the limits of imbalance and asymmetry on a curved surface, per unit of [`Indicators::rise`]. The
/// increase is needed because tractions on curved faces are missing from the balance.
pub const ALLOWANCE_PER_RISE: f64 = 5.0;
/// Largest [`Indicators::direct_difference`] at which a correction is used.
pub const MAX_DIRECT_DIFFERENCE: f64 = 0.1;
/// Largest [`Indicators::mesh_error`] at which a correction is used.
pub const MAX_MESH_ERROR: f64 = 0.1;
/// Value of [`Indicators::mesh_error`] above which the program warns. If [`Indicators::share`] exceeds 1, the value is
/// divided by the square root of `share`.
pub const MESH_ERROR_WARNING: f64 = 0.02;
/// Largest [`Indicators::field_error`] at which a correction is used.
pub const MAX_FIELD_ERROR: f64 = 1e-3;
/// Largest [`Indicators::tail`] at which a correction is used.
pub const MAX_TAIL: f64 = 1e-2;
/// Value of [`Indicators::tail`] above which the correction is computed again with more nodes.
pub const TARGET_TAIL: f64 = 2e-3;

/// Quality of a correction, judged without a reference solution.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Indicators {
    /// Polynomial nodes along x and y of the frame.
    pub nodes: [usize; 2],
    /// Height difference of the surface under the frame, divided by the longer half-side.
    pub rise: f64,
    /// Largest error of the tabulated point-force field, relative to the largest entry; 0 for isotropic bodies.
    pub field_error: f64,
    /// Largest component, among all forces, of the sum of a unit force and the resultant of its half-space tractions.
    pub imbalance: f64,
    /// Asymmetry of the boundary terms, divided by the norm of the correction matrix.
    pub asymmetry: f64,
    /// Difference between two evaluations of the correction, by Betti's theorem and by the mesh displacement on the
    /// patch. It is the largest relative change of the mean displacement under uniform tractions. Large values indicate
    /// mesh errors near the patch.
    pub direct_difference: f64,
    /// Largest estimated relative error of the mean displacement under uniform tractions. The estimate compares the
    /// finite-element stress with the recovered stress.
    pub mesh_error: f64,
    /// Weight of the highest polynomials, `share` × |a_highest| / |a|. a are the Chebyshev coefficients of the
    /// correction. a_highest are the coefficients of the highest degree in any variable.
    pub tail: f64,
    /// Norm of the correction divided by the norm of the half-space operator.
    pub share: f64,
    /// Smallest eigenvalue of the corrected operator relative to the half-space operator. It must be positive.
    pub least_eigenvalue: f64,
}

pub(super) struct PatchCorrection<'a> {
    pub matrix: &'a DenseMatrix,
    /// Correction matrix, interpolated from the displacement of the mesh.
    pub direct: &'a DenseMatrix,
    pub imbalance: f64,
    pub asymmetry: f64,
    /// Estimates the squared error, in the energy norm, of the correction for given forces on the patch.
    pub squared_error: &'a dyn Fn(&[f64]) -> Result<f64>,
}

impl Indicators {
    /// Computes the indicators of the correction `judged` with `m` nodes along x and y of the patch. `green` is given
    /// in the axes of the patch.
    pub(super) fn new(
        judged: PatchCorrection,
        site: &HalfSpaceFit,
        m: [usize; 2],
        green: &SurfaceGreen,
        field_error: f64,
    ) -> Result<Self> {
        let n = 3 * m[0] * m[1];
        let patch = &site.patch;
        let dense = |columns: &DenseMatrix| {
            let far = FarField::new(columns, m, patch, Side::Lower);
            DMatrix::from_row_slice(n, n, far.entries())
        };
        let (dual, direct) = (dense(judged.matrix), dense(judged.direct));
        let spacing = patch.half_width.map(|half| 2.0 * half / COMPARISON_CELLS as f64);
        let operator = FftFlexibility::new([COMPARISON_CELLS; 2], spacing, green, CrossBlocks::Keep)?;
        let (near, mass) = on_polynomials(&operator, patch, m, spacing);
        let far = &mass * &dual * &mass;
        let change = &mass * (&direct - &dual) * &mass;
        let sum = &near + &far;
        let uniform = |c: usize| DVector::from_fn(n, |k, _| if k / (n / 3) == c { 1.0 } else { 0.0 });
        let energy = |matrix: &DMatrix<f64>, c: usize| uniform(c).dot(&(matrix * uniform(c)));
        let differences = (0..3).map(|c| (energy(&change, c) / energy(&sum, c)).abs());
        let share = far.norm() / near.norm();
        let mut mesh_error: f64 = 0.0;
        for c in 0..3 {
            // The work of uniform tractions has an error equal to the squared energy norm of the stress error.
            let at_nodes = &mass * uniform(c);
            let nodes = n / 3;
            let forces: Vec<f64> = (0..n).map(|k| at_nodes[k % 3 * nodes + k / 3]).collect();
            mesh_error = mesh_error.max((judged.squared_error)(&forces)? / energy(&sum, c).abs());
        }
        Ok(Self {
            nodes: m,
            rise: site.rise,
            field_error,
            imbalance: judged.imbalance,
            asymmetry: judged.asymmetry,
            direct_difference: differences.fold(0.0, f64::max),
            mesh_error,
            tail: share * tail(&dual, m),
            share,
            least_eigenvalue: least_eigenvalue(near, &far),
        })
    }

    /// Reason why the correction must not be used; `None` if it may be used.
    pub fn rejection_reason(&self) -> Option<String> {
        let curved = ALLOWANCE_PER_RISE * self.rise;
        let limits = [
            ("the error of the point-force table", self.field_error, MAX_FIELD_ERROR),
            (
                "the imbalance of the half-space's tractions on the boundary",
                self.imbalance,
                MAX_IMBALANCE + curved,
            ),
            ("the asymmetry of the half-space correction", self.asymmetry, MAX_ASYMMETRY + curved),
            (
                "the difference between two evaluations of the half-space correction",
                self.direct_difference,
                MAX_DIRECT_DIFFERENCE,
            ),
            ("the estimated error of the finite elements", self.mesh_error, MAX_MESH_ERROR),
            (
                "the share of the polynomials of highest degree in the half-space correction",
                self.tail,
                MAX_TAIL,
            ),
        ];
        let exceeded = limits.iter().find(|(_, value, most)| value.is_nan() || value > most);
        let told = exceeded
            .map(|(what, value, most)| format!("{what} is {value:.2e}, but at most {most:.2e} is allowed"));
        let least = self.least_eigenvalue;
        let indefinite = least.is_nan() || least <= 0.0;
        told.or_else(|| {
            indefinite
                .then(|| format!("the operator is not positive definite (smallest eigenvalue {least:.1e})"))
        })
    }
}

/// Galerkin matrix Φᵀ A S Φ of the half-space operator S, and mass matrix Φᵀ A Φ. Φ contains the cell means of the
/// polynomials, A the cell areas.
fn on_polynomials(
    operator: &FftFlexibility,
    patch: &ContactPatch,
    m: [usize; 2],
    spacing: [f64; 2],
) -> (DMatrix<f64>, DMatrix<f64>) {
    let cells = COMPARISON_CELLS * COMPARISON_CELLS;
    let nodes = m[0] * m[1];
    let [x, y] = [0, 1].map(|axis| {
        let nodes = Chebyshev::new(m[axis], patch.half_width[axis]);
        nodes.means(COMPARISON_CELLS, spacing[axis], -patch.half_width[axis], false)
    });
    let polynomial = |k: usize| -> Vec<f64> {
        let (a, b) = (k / m[1], k % m[1]);
        (0..cells)
            .map(|cell| x[cell / COMPARISON_CELLS * m[0] + a] * y[cell % COMPARISON_CELLS * m[1] + b])
            .collect()
    };
    let polynomials: Vec<Vec<f64>> = (0..nodes).map(polynomial).collect();
    let area = spacing[0] * spacing[1];
    let product = |a: &[f64], b: &[f64]| area * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (mut near, mut mass) = (DMatrix::zeros(3 * nodes, 3 * nodes), DMatrix::zeros(3 * nodes, 3 * nodes));
    let (mut traction, mut gap) = (vec![0.0; 3 * cells], vec![0.0; 3 * cells]);
    for column in 0..3 * nodes {
        let (plane, k) = (column / nodes, column % nodes);
        traction.fill(0.0);
        traction[plane * cells..(plane + 1) * cells].copy_from_slice(&polynomials[k]);
        operator.apply(&traction, &mut gap);
        for row in 0..3 * nodes {
            let (other, i) = (row / nodes, row % nodes);
            near[(row, column)] = product(&polynomials[i], &gap[other * cells..(other + 1) * cells]);
            if other == plane {
                mass[(row, column)] = product(&polynomials[i], &polynomials[k]);
            }
        }
    }
    ((&near + near.transpose()) * 0.5, mass)
}

/// Norm of the Chebyshev coefficients of highest degree, divided by the norm of all coefficients. A coefficient counts
/// if its degree is the highest in at least one of the four variables.
fn tail(matrix: &DMatrix<f64>, m: [usize; 2]) -> f64 {
    let [x, y] = m.map(Chebyshev::coefficients);
    let nodes = m[0] * m[1];
    let single = DMatrix::from_fn(nodes, nodes, |degree, node| {
        x[degree / m[1]][node / m[1]] * y[degree % m[1]][node % m[1]]
    });
    let highest = |k: usize| k / m[1] + 1 == m[0] || k % m[1] + 1 == m[1];
    let (mut last, mut all) = (0.0, 0.0);
    for a in 0..3 {
        for b in 0..3 {
            let block = matrix.view((a * nodes, b * nodes), (nodes, nodes));
            let coefficients = &single * block * single.transpose();
            for (k, value) in coefficients.iter().enumerate() {
                all += value * value;
                if highest(k % nodes) || highest(k / nodes) {
                    last += value * value;
                }
            }
        }
    }
    (last / all).sqrt()
}

/// Smallest eigenvalue λ of (near + far) v = λ near v.
fn least_eigenvalue(near: DMatrix<f64>, far: &DMatrix<f64>) -> f64 {
    let Some(cholesky) = near.cholesky() else { return f64::NAN };
    let lower = cholesky.l();
    let Some(left) = lower.solve_lower_triangular(far) else { return f64::NAN };
    let Some(both) = lower.solve_lower_triangular(&left.transpose()) else { return f64::NAN };
    1.0 + ((&both + both.transpose()) * 0.5).symmetric_eigenvalues().min()
}
