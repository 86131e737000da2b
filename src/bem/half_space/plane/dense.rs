//! Dense flexibility matrix of half-spaces on any plane frame.

use nalgebra::Matrix3;
use rayon::prelude::*;

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::integrals::patch::PatchIntegrator;
use crate::cancel;
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::per_cell::PerCell;
use crate::linalg::memory;
use crate::linalg::vector::dot8;

/// Flexibility operator S of half-spaces on a plane frame of arbitrary convex cells with constant tractions.
///
/// K_IJ is the displacement of the centre of cell I by a unit traction on cell J. The operator has the entries
/// `S_IJ = (A_I K_IJ + A_J K_JI^T) / (2 A_I)` with the cell areas A. On a uniform grid S_IJ = K_IJ.
///
/// # Source
/// docs/theory-half-space.md, operators on the frame.
pub struct DenseFlexibility {
    n: usize,
    /// `[3 n][3 n]`, ordered by component: all x first, then all y, then all n.
    rows: Vec<f64>,
    coupled: bool,
}

impl DenseFlexibility {
    /// Computes the operator by integration over every cell for every centre.
    ///
    /// `centers` `[N]` and the counter-clockwise `corners` `[N]` of each cell have coordinates x and y in the plane of
    /// the frame, mm. `areas` `[N]` are in mm².
    ///
    /// # Errors
    /// - If the lengths differ or are zero, a number is not finite, or a cell is not a counter-clockwise polygon of positive area.
    /// - If the matrix does not fit into the memory, or the run is cancelled.
    pub fn new(
        centers: &[[f64; 2]],
        corners: &[Vec<[f64; 2]>],
        areas: &[f64],
        green: &SurfaceGreen,
    ) -> Result<Self> {
        validate_cells(centers, corners, areas)?;
        let n = centers.len();
        let bytes = 72 * (n as u128) * (n as u128);
        let mend = "use a coarser frame or a grid frame";
        memory::ensure(bytes, &format!("the dense operator on {n} cells"), mend)?;
        let integrator = PatchIntegrator::new(green);
        let mut rows = vec![0.0; 9 * n * n];
        let (rows_x, rest) = rows.split_at_mut(3 * n * n);
        let (rows_y, rows_n) = rest.split_at_mut(3 * n * n);
        (
            rows_x.par_chunks_exact_mut(3 * n),
            rows_y.par_chunks_exact_mut(3 * n),
            rows_n.par_chunks_exact_mut(3 * n),
        )
            .into_par_iter()
            .zip(centers)
            .for_each(|((row_x, row_y, row_n), &center)| {
                if cancel::requested() {
                    return;
                }
                for (j, cell) in corners.iter().enumerate() {
                    let block = integrator.polygon(cell, center);
                    for (i, row) in [&mut *row_x, &mut *row_y, &mut *row_n].into_iter().enumerate() {
                        (0..3).for_each(|component| row[component * n + j] = block[(i, component)]);
                    }
                }
            });
        cancel::check()?;
        symmetrise(&mut rows, areas);
        Ok(Self { n, rows, coupled: green.couples_normal_tangential() })
    }

    /// Operator from the displacements K of all cells under unit tractions on each cell, mm/MPa. `k` has the shape
    /// `[3 n][3 n]`, ordered by component.
    ///
    /// # Panics
    /// If `k` does not have 9 n² entries.
    pub fn of_displacements(mut k: Vec<f64>, areas: &[f64]) -> Self {
        let n = areas.len();
        assert_eq!(k.len(), 9 * n * n, "a matrix of {n} cells");
        symmetrise(&mut k, areas);
        Self { n, rows: k, coupled: true }
    }

    fn block(&self, i: usize, j: usize) -> Matrix3<f64> {
        let n = self.n;
        Matrix3::from_fn(|a, b| self.rows[(a * n + i) * 3 * n + b * n + j])
    }
}

impl Flexibility for DenseFlexibility {
    fn n_cells(&self) -> usize {
        self.n
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let rows = self.rows.par_chunks_exact(3 * self.n);
        rows.zip(gap.par_iter_mut()).for_each(|(row, g)| *g = dot8(row, tractions));
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let n = self.n;
        let rows = self.rows[6 * n * n..].par_chunks_exact(3 * n);
        rows.zip(normal_gap.par_iter_mut()).for_each(|(row, g)| *g = dot8(&row[2 * n..], pressure));
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        (0..self.n).map(|i| self.block(i, i)).collect()
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        matrix.add_columns(|k| move |i| self.block(cells[i], cells[k]));
        true
    }

    fn couples_normal_tangential(&self) -> bool {
        self.coupled
    }
}

fn symmetrise(rows: &mut [f64], areas: &[f64]) {
    let n = areas.len();
    for a in 0..3 * n {
        let area_a = areas[a % n];
        for b in a + 1..3 * n {
            let area_b = areas[b % n];
            let mean = 0.5 * (area_a * rows[a * 3 * n + b] + area_b * rows[b * 3 * n + a]);
            rows[a * 3 * n + b] = mean / area_a;
            rows[b * 3 * n + a] = mean / area_b;
        }
    }
}

/// Checks that the numbers of centres, cells and areas are equal and not zero, and that each cell is a counter-clockwise polygon of
/// positive area.
pub(super) fn validate_cells(centers: &[[f64; 2]], corners: &[Vec<[f64; 2]>], areas: &[f64]) -> Result<()> {
    let n = centers.len();
    if n == 0 || corners.len() != n || areas.len() != n {
        return Err(Error::input(format!(
            "the contact frame has {n} centres, {} cells and {} areas; these numbers must be equal and at least 1",
            corners.len(),
            areas.len()
        )));
    }
    for (i, ((center, cell), area)) in centers.iter().zip(corners).zip(areas).enumerate() {
        let finite = center.iter().chain(cell.iter().flatten()).all(|x| x.is_finite());
        let usable = cell.len() >= 3 && finite && signed_area(cell) > 0.0;
        if !(usable && area.is_finite() && *area > 0.0) {
            return Err(Error::input(format!(
                "cell {i} of the contact frame (centre {center:?}, {} corners, area {area}) is not a polygon of \
                 positive area with counter-clockwise corners; check the faces of the contact group",
                cell.len()
            )));
        }
    }
    Ok(())
}

/// Area of a polygon; negative for clockwise corners.
fn signed_area(corners: &[[f64; 2]]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    0.5 * corners.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>()
}
