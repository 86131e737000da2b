//! Gap heights on a table of points.

use super::ContactFrame;
use crate::error::{Error, Result};

/// Gap heights on a table of points.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightTable {
    /// Gap heights, mm, first index along the table's x: `values[ix * shape[1] + iy]`.
    pub values: Vec<f64>,
    /// Number of values along x and y.
    pub shape: [usize; 2],
    /// Spacing of the values along x and y, mm. The table is centred at the offset of the gap, and the gap is
    /// interpolated bilinearly. `None`: one value per cell.
    pub spacing: Option<[f64; 2]>,
    /// Angle from the frame's x to the table's x, radians; needs a spacing.
    pub angle: f64,
}

impl HeightTable {
    /// Gap at the centre of each cell, `[N]`, mm; its smallest value is 0.
    ///
    /// # Errors
    /// If the table, its spacing or its angle is not admissible, or the table does not cover the frame. Without a spacing: if there
    /// is not one value per cell, or `offset` or the angle is not zero.
    pub fn evaluate(&self, frame: &ContactFrame, offset: [f64; 2]) -> Result<Vec<f64>> {
        self.check()?;
        let (sin, cos) = self.angle.sin_cos();
        let mut gap = match self.spacing {
            None => self.per_cell(frame, offset)?,
            Some(spacing) => {
                let repeats = self.repeats(frame, spacing);
                (0..frame.n_cells())
                    .map(|cell| {
                        let [x, y] = frame.plane_coordinates(cell);
                        let [x, y] = frame.nearest_image([x - offset[0], y - offset[1]]);
                        self.interpolate([cos * x + sin * y, cos * y - sin * x], spacing, repeats)
                    })
                    .collect::<Result<Vec<f64>>>()?
            }
        };
        let lowest = gap.iter().copied().fold(f64::INFINITY, f64::min);
        gap.iter_mut().for_each(|g| *g -= lowest);
        Ok(gap)
    }

    fn check(&self) -> Result<()> {
        if self.shape[0].checked_mul(self.shape[1]) != Some(self.values.len()) || self.values.is_empty() {
            return Err(Error::input(format!(
                "gap heights: {} values do not fill a table of {} x {}",
                self.values.len(),
                self.shape[0],
                self.shape[1]
            )));
        }
        if let Some(bad) = self.values.iter().position(|v| !v.is_finite()) {
            return Err(Error::input(format!(
                "gap heights: the value in row {}, column {} is {}; all must be finite numbers",
                bad / self.shape[1] + 1,
                bad % self.shape[1] + 1,
                self.values[bad]
            )));
        }
        if !self.angle.is_finite() {
            return Err(Error::input(format!("gap.angle = {} must be a finite number", self.angle)));
        }
        match self.spacing {
            Some(s) if !s.iter().all(|d| d.is_finite() && *d > 0.0) => {
                Err(Error::input(format!("gap.spacing = {s:?}: both numbers must be positive and finite")))
            }
            _ => Ok(()),
        }
    }

    fn per_cell(&self, frame: &ContactFrame, offset: [f64; 2]) -> Result<Vec<f64>> {
        if offset != [0.0, 0.0] {
            return Err(Error::input(
                "gap.offset does not apply to heights given per cell: add gap.spacing, or remove the offset",
            ));
        }
        if self.angle != 0.0 {
            return Err(Error::input(
                "gap.angle does not apply to heights given per cell: add gap.spacing, or remove the angle",
            ));
        }
        let fits = match frame.grid {
            Some(grid) => grid.cells == self.shape,
            None => self.values.len() == frame.n_cells(),
        };
        if !fits {
            let wanted = match frame.grid {
                Some(grid) => format!("{} x {}", grid.cells[0], grid.cells[1]),
                None => frame.n_cells().to_string(),
            };
            return Err(Error::input(format!(
                "gap heights: the file has {} x {} values, but the frame has {wanted} cells: give one value per cell (first index along x), or gap.spacing",
                self.shape[0], self.shape[1]
            )));
        }
        Ok((0..frame.n_cells()).map(|cell| self.values[frame.grid_index(cell)]).collect())
    }

    /// Whether the table is one period of a periodic frame, along x and y. The first value of the table then follows the last.
    fn repeats(&self, frame: &ContactFrame, spacing: [f64; 2]) -> [bool; 2] {
        let Some(grid) = frame.grid else { return [false; 2] };
        [0, 1].map(|axis| {
            let side = grid.cells[axis] as f64 * grid.spacing[axis];
            let table = self.shape[axis] as f64 * spacing[axis];
            grid.periodic[axis] && self.angle == 0.0 && (table - side).abs() <= 1e-9 * side
        })
    }

    fn interpolate(&self, position: [f64; 2], spacing: [f64; 2], repeats: [bool; 2]) -> Result<f64> {
        let mut low = [0usize; 2];
        let mut share = [0.0; 2];
        for axis in 0..2 {
            let last = (self.shape[axis] - 1) as f64;
            let index = position[axis] / spacing[axis] + 0.5 * last;
            if repeats[axis] {
                low[axis] = (index.floor() as isize).rem_euclid(self.shape[axis] as isize) as usize;
                share[axis] = index - index.floor();
                continue;
            }
            if index < -1e-9 || index > last + 1e-9 {
                return Err(Error::input(format!(
                    "gap heights extend {} from their centre along {}, but the cells of the frame extend {:.6}: use a larger table, or a smaller frame",
                    0.5 * last * spacing[axis],
                    ["x", "y"][axis],
                    position[axis].abs()
                )));
            }
            let index = index.clamp(0.0, last);
            low[axis] = (index.floor() as usize).min(self.shape[axis].saturating_sub(2));
            share[axis] = index - low[axis] as f64;
        }
        let at = |dx: usize, dy: usize| {
            let next = |axis: usize, step: usize| match low[axis] + step {
                beyond if beyond == self.shape[axis] && repeats[axis] => 0,
                within => within.min(self.shape[axis] - 1),
            };
            self.values[next(0, dx) * self.shape[1] + next(1, dy)]
        };
        let [s, t] = share;
        Ok((1.0 - s) * ((1.0 - t) * at(0, 0) + t * at(0, 1)) + s * ((1.0 - t) * at(1, 0) + t * at(1, 1)))
    }
}
