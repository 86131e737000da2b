//! Operator of finite bodies on a grid: half-space operator plus the far fields of the bodies.

use std::ops::Range;
use std::sync::{Arc, Mutex};

use nalgebra::Matrix3;

use super::far_field::{FarField, FarFieldOnGrid, FarFieldScratch};
use crate::bem::half_space::{CrossBlocks, FftFlexibility, SurfaceGreen};
use crate::error::Result;
use crate::flexibility::Flexibility;
use crate::flexibility::per_cell::PerCell;
use crate::flexibility::subset::SubsetFlexibility;
use crate::frame::Grid;

/// S = S_hs + Σ Φ Ĉ Φᵀ A on a whole grid: half-space operator plus the far fields of all bodies. Φ contains the cell
/// means of the polynomials, Ĉ the correction matrix of a body, A the cell areas.
pub struct CorrectedFlexibility {
    near: Arc<dyn Flexibility>,
    far: Arc<Vec<FarField>>,
    on_grid: Vec<FarFieldOnGrid>,
    spacing: [f64; 2],
    /// Corner of the first cell relative to the patch centre, mm.
    first: [f64; 2],
    work: Mutex<Vec<FarFieldScratch>>,
}

impl CorrectedFlexibility {
    /// Adds the far fields `far` of bodies to the operator `near` on all cells of `grid`. The rectangle of `grid` is
    /// the patch of all bodies.
    pub fn new(near: Arc<dyn Flexibility>, far: Vec<FarField>, grid: &Grid) -> Self {
        let first = grid.half_width().map(|half| -half);
        Self::on_cells(near, Arc::new(far), grid.cells, grid.spacing, first)
    }

    /// Adds the far fields to `near` on `cells`, the numbers of cells along x and y. The cells have the sides `spacing`
    /// and start at `first` relative to the patch centre, mm.
    fn on_cells(
        near: Arc<dyn Flexibility>,
        far: Arc<Vec<FarField>>,
        cells: [usize; 2],
        spacing: [f64; 2],
        first: [f64; 2],
    ) -> Self {
        let on_grid: Vec<FarFieldOnGrid> = far.iter().map(|far| far.on_grid(cells, spacing, first)).collect();
        let work = Mutex::new(on_grid.iter().map(FarFieldScratch::new).collect());
        Self { near, far, on_grid, spacing, first, work }
    }

    fn add_far(&self, planes: Range<usize>, tractions: &[f64], gap: &mut [f64]) {
        let mut work = self.work.lock().expect("no panic while the work is held");
        for ((far, on_grid), work) in self.far.iter().zip(&self.on_grid).zip(work.iter_mut()) {
            on_grid.add_product(far, planes.clone(), tractions, gap, work);
        }
    }
}

impl Flexibility for CorrectedFlexibility {
    fn n_cells(&self) -> usize {
        self.near.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.near.apply(tractions, gap);
        self.add_far(0..3, tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.near.apply_normal(pressure, normal_gap);
        self.add_far(2..3, pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        let near = self.near.diagonal_blocks();
        let mut blocks: Vec<Matrix3<f64>> = near.iter().copied().collect();
        for (far, on_grid) in self.far.iter().zip(&self.on_grid) {
            on_grid.add_diagonal(far, &mut blocks);
        }
        PerCell::Each(blocks)
    }

    /// Uses the preconditioner of the half-space operator, without the far fields.
    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.near.precondition_normal(normal_gap, pressure)
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.near.precondition(gap, tractions)
    }

    fn direct_sum(&self, cell: usize, tractions: &[f64]) -> Option<[f64; 3]> {
        let mut gap = self.near.direct_sum(cell, tractions)?;
        let n = self.n_cells();
        for (far, on_grid) in self.far.iter().zip(&self.on_grid) {
            let to = on_grid.cell_weights(cell);
            let mut forces = vec![[0.0; 3]; to.len()];
            for from in 0..n {
                let traction = [0, 1, 2].map(|c| tractions[c * n + from]);
                if traction != [0.0; 3] {
                    for (force, value) in forces.iter_mut().zip(on_grid.cell_weights(from)) {
                        (0..3).for_each(|c| force[c] += value * traction[c]);
                    }
                }
            }
            for (j, force) in forces.iter().enumerate() {
                let mut unit = vec![0.0; to.len()];
                unit[j] = 1.0;
                let share = on_grid.block(far, &to, &unit) * nalgebra::Vector3::from(*force);
                (0..3).for_each(|c| gap[c] += share[c]);
            }
        }
        Some(gap)
    }

    fn grid(&self) -> Option<[usize; 2]> {
        self.near.grid()
    }

    /// Restricts only the half-space operator. [`Self::restriction_at`] adds the far field, which depends on the
    /// position of the smaller grid.
    fn restrict(&self, at_least: [usize; 2], factor: usize) -> Option<Arc<dyn Flexibility>> {
        self.near.restrict(at_least, factor)
    }

    fn restriction_at(
        &self,
        smaller: Arc<dyn Flexibility>,
        origin: [usize; 2],
        factor: usize,
    ) -> Arc<dyn Flexibility> {
        let Some(cells) = smaller.grid() else { return smaller };
        let first = [0, 1].map(|axis| self.first[axis] + origin[axis] as f64 * self.spacing[axis]);
        let spacing = self.spacing.map(|side| side * factor as f64);
        Arc::new(Self::on_cells(smaller, self.far.clone(), cells, spacing, first))
    }
}

/// Builds the operator of bodies with the far fields `far`, on all cells of `grid` or on its cells `places`. `green` is
/// the sum of the Green's functions of their half-spaces.
///
/// # Errors
/// If memory does not suffice.
pub fn build_corrected_flexibility(
    green: &SurfaceGreen,
    far: Vec<FarField>,
    grid: &Grid,
    places: Option<&[usize]>,
    cross: CrossBlocks,
) -> Result<Arc<dyn Flexibility>> {
    let near = FftFlexibility::new(grid.cells, grid.spacing, green, cross)?;
    let whole = Arc::new(CorrectedFlexibility::new(Arc::new(near), far, grid));
    Ok(match places {
        None => whole,
        Some(places) => Arc::new(SubsetFlexibility::new(whole, places.to_vec())),
    })
}
