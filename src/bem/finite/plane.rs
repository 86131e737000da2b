//! Plane surface of a half-space, discretised with the kernels of a full space.
//!
//! The equation of each node y is ½ u(y) + ∫ T u dS = ∫ U t dS. The first integral is a principal value. The integrals
//! extend over the elements only: displacement and traction beyond the elements are taken as zero. Rigid motions cannot
//! provide the diagonal blocks, because the surface is open.

use faer::Par;
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::elements::BoundaryElements;
use super::interpolation::Interpolation;
use crate::cancel;
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::linalg::dense_lu::DenseLu;
use crate::linalg::dense_matrix::DenseMatrix;

const BATCH: usize = 64;

const CHECKED: usize = 24;

type Rows = (Vec<Matrix3<f64>>, Vec<Matrix3<f64>>);

/// Response of a plane surface to unit tractions.
pub struct PlaneResponse {
    /// Displacement of the nodes, `[3 n, 3 n_loaded]`, mm/MPa.
    pub displacement: DenseMatrix,
    /// Largest residual of some equations that are computed again with all unit tractions together. The residual is
    /// relative to the largest sum of the magnitudes of the terms of an equation.
    pub residual: f64,
}

impl BoundaryElements {
    fn plane_rows(&self, node: usize) -> Rows {
        let y = self.panel(node).position(self.reference_nodes_of(node).reference_points()[0]);
        let of = |i: usize| {
            // Integrals over very elongated elements take long, so cancellation is checked for each element. After a
            // cancellation the zero blocks are not used.
            if cancel::requested() {
                return (Matrix3::zeros(), Matrix3::zeros());
            }
            let influence =
                if i == node { self.influence_on_element(i, 0) } else { self.influence_off_element(i, &y) };
            (influence.double_layer[0], influence.single_layer[0])
        };
        let (mut h, g): Rows = (0..self.n_elements()).map(of).unzip();
        h[node] = Matrix3::identity() * 0.5 + self.principal_value(node, 0);
        (h, g)
    }

    /// Displacement of the nodes of a plane surface of constant elements under unit tractions on the nodes `loaded`.
    /// Other nodes carry no traction.
    ///
    /// # Errors
    /// If the elements are not constant, memory does not suffice, the equations are singular, or the run is cancelled.
    pub fn plane_response(&self, loaded: &[usize], par: Par) -> Result<PlaneResponse> {
        if self.interpolation() != Interpolation::Constant {
            return Err(Error::input("the meshed surface of a half-space takes constant elements"));
        }
        let n = self.n_nodes();
        let mut left = DenseMatrix::zeros(3 * n, 3 * n)?;
        let mut right = DenseMatrix::zeros(3 * n, 3 * loaded.len())?;
        for first in (0..n).step_by(BATCH) {
            cancel::check()?;
            let rows: Vec<Rows> =
                (first..(first + BATCH).min(n)).into_par_iter().map(|node| self.plane_rows(node)).collect();
            for (k, (h, g)) in rows.iter().enumerate() {
                let row = 3 * (first + k);
                for (node, h) in h.iter().enumerate() {
                    (0..3).for_each(|c| put(&mut left, (row, 3 * node + c), h.column(c).into()));
                }
                for (j, &node) in loaded.iter().enumerate() {
                    (0..3).for_each(|c| put(&mut right, (row, 3 * j + c), g[node].column(c).into()));
                }
            }
        }
        cancel::check()?;
        DenseLu::new(left, par)?.solve_in_place(&mut right, par)?;
        let residual = self.plane_residual(&right, loaded)?;
        Ok(PlaneResponse { displacement: right, residual })
    }

    fn plane_residual(&self, displacement: &DenseMatrix, loaded: &[usize]) -> Result<f64> {
        cancel::check()?;
        let n = self.n_nodes();
        let mut sum = vec![0.0; 3 * n];
        for j in 0..displacement.n_columns() {
            sum.iter_mut().zip(displacement.column(j)).for_each(|(sum, u)| *sum += u);
        }
        let checked: Vec<usize> = (0..n).step_by(n.div_ceil(CHECKED)).collect();
        let of_row = |&node: &usize| {
            let (h, g) = self.plane_rows(node);
            let moved = h.iter().enumerate().map(|(i, h)| h * Point::from_row_slice(&sum[3 * i..3 * i + 3]));
            let pressed = loaded.iter().map(|&node| -g[node] * Point::repeat(1.0));
            moved
                .chain(pressed)
                .fold((Point::zeros(), 0.0), |(sum, size), part| (sum + part, size + part.norm()))
        };
        let found: Vec<(Point, f64)> = checked.par_iter().map(of_row).collect();
        cancel::check()?;
        let most =
            found.iter().fold((0.0_f64, f64::MIN_POSITIVE), |(a, b), (x, y)| (a.max(x.norm()), b.max(*y)));
        Ok(most.0 / most.1)
    }
}

fn put(matrix: &mut DenseMatrix, (row, column): (usize, usize), values: Point) {
    matrix.column_mut(column)[row..row + 3].copy_from_slice(values.as_slice());
}
