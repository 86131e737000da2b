//! The contact frame: cells with areas, local axes and an initial gap, and the maps to the faces of the bodies.

use crate::geometry::{Point, Triad};

/// Layout of a uniform grid frame; cell (ix, iy) has index `ix * cells[1] + iy`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Number of cells along the frame's x and y.
    pub cells: [usize; 2],
    /// Cell sides, mm.
    pub spacing: [f64; 2],
    /// Centre of the frame in global x, y.
    pub center: [f64; 2],
    /// Angle of the frame's x axis from global x, radians.
    pub azimuth: f64,
}

/// Where contact may happen: N cells with constant tractions.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFrame {
    /// Cell centres, global.
    pub centers: Vec<Point>,
    /// Corners of each cell, counter-clockwise seen against its normal, global.
    pub corners: Vec<Vec<Point>>,
    /// Areas, mm2.
    pub areas: Vec<f64>,
    /// Local axes (x, y, n) of each cell.
    pub triads: Vec<Triad>,
    /// The grid, if the frame is one.
    pub grid: Option<Grid>,
}

impl ContactFrame {
    /// Number of cells N.
    pub fn n_cells(&self) -> usize {
        self.areas.len()
    }
}
