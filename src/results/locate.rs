//! Which cells of the frame a point of a body's surface lies in.

use std::collections::HashMap;

use crate::frame::{ContactFrame, Grid};
use crate::geometry::Point;

/// Finds the cells of a frame that points lie in.
pub struct Locator<'a> {
    frame: &'a ContactFrame,
    bin: f64,
    bins: HashMap<[i64; 3], Vec<usize>>,
}

impl<'a> Locator<'a> {
    /// Prepares the search; a grid frame needs no preparation.
    pub fn new(frame: &'a ContactFrame) -> Self {
        let diameter = |i: usize| {
            2.0 * frame.corners[i].iter().map(|c| (c - frame.centers[i]).norm()).fold(0.0, f64::max)
        };
        let mut locator = Self { frame, bin: 1.0, bins: HashMap::new() };
        if frame.grid.is_none() {
            let largest = (0..frame.n_cells()).map(diameter).fold(0.0, f64::max);
            locator.bin = if largest > 0.0 { largest } else { 1.0 };
            for (i, center) in frame.centers.iter().enumerate() {
                locator.bins.entry(locator.key(center)).or_default().push(i);
            }
        }
        locator
    }

    /// Cells that hold the projection of `point` along their normals; several where it lies on their common edge,
    /// none outside the frame.
    pub fn cells_at(&self, point: &Point) -> Vec<usize> {
        match &self.frame.grid {
            Some(grid) => grid_cells(grid, point),
            None => self.near(point).filter(|&cell| self.holds(cell, point)).collect(),
        }
    }

    fn key(&self, point: &Point) -> [i64; 3] {
        [0, 1, 2].map(|axis| (point[axis] / self.bin).floor() as i64)
    }

    /// Cells whose centres lie in the bin of `point` or a bin beside it, in ascending order.
    fn near(&self, point: &Point) -> impl Iterator<Item = usize> {
        let [x, y, z] = self.key(point);
        let mut found = Vec::new();
        for (dx, dy, dz) in (0..27).map(|k| (k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1)) {
            found.extend(self.bins.get(&[x + dx, y + dy, z + dz]).into_iter().flatten().copied());
        }
        found.sort_unstable();
        found.into_iter()
    }

    /// Whether the projection of `point` lies in the (convex) cell, its border included.
    fn holds(&self, cell: usize, point: &Point) -> bool {
        let corners = &self.frame.corners[cell];
        let normal = self.frame.triads[cell].normal();
        let slack = 1e-9 * self.bin;
        if normal.dot(&(point - self.frame.centers[cell])).abs() > self.bin {
            return false;
        }
        (0..corners.len()).all(|i| {
            let (from, to) = (corners[i], corners[(i + 1) % corners.len()]);
            let edge = to - from;
            normal.dot(&edge.cross(&(point - from))) >= -slack * edge.norm()
        })
    }
}

/// Cells of a grid that hold the projection of `point`: up to four on a corner.
fn grid_cells(grid: &Grid, point: &Point) -> Vec<usize> {
    let (s, c) = grid.azimuth.sin_cos();
    let arm = [point.x - grid.center[0], point.y - grid.center[1]];
    let local = [c * arm[0] + s * arm[1], c * arm[1] - s * arm[0]];
    let [along_x, along_y] = [0, 1].map(|axis| {
        let at = local[axis] / grid.spacing[axis] + 0.5 * grid.cells[axis] as f64;
        intervals(at, grid.cells[axis])
    });
    along_x.iter().flat_map(|ix| along_y.iter().map(move |iy| ix * grid.cells[1] + iy)).collect()
}

/// Unit intervals among the first `n` that hold `at`, two on a common end.
fn intervals(at: f64, n: usize) -> Vec<usize> {
    let (low, high) = ((at - 1e-9).floor(), (at + 1e-9).floor());
    let mut found: Vec<usize> =
        [low, high].into_iter().filter(|i| *i >= 0.0 && *i < n as f64).map(|i| i as usize).collect();
    found.dedup();
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: unit intervals by hand.
    #[test]
    fn ends_belong_to_both_intervals() {
        assert_eq!(intervals(0.0, 3), [0]);
        assert_eq!(intervals(1.0, 3), [0, 1]);
        assert_eq!(intervals(2.5, 3), [2]);
        assert_eq!(intervals(3.0, 3), [2]);
        assert_eq!(intervals(3.1, 3), [0_usize; 0]);
        assert_eq!(intervals(f64::NAN, 3), [0_usize; 0]);
    }
}
