//! Contact frame: N cells with areas and local axes, initial gaps, and maps to the contact faces of the bodies.
//!
//! - [`ContactFrame`]: cells from a [`Grid`] or the faces or nodes of a mesh, each with a constant traction. Local axes
//!   are (x, y, n), with n the outward normal of body 1.
//! - [`InitialGap`]: gap g_n of the undeformed surfaces.
//! - [`FaceMap`]: matrix I_Ij = (1 / A_I) int_{cell I} N_j dS that maps nodal values to cell averages. A_I is the area
//!   of cell I and N_j the shape function of node j.

mod cell_coverage;
mod clip;
mod edge_strips;
mod edges;
mod face_curvature;
pub mod face_map;
pub mod faces;
mod facets;
pub mod gap;
pub mod grid;
pub mod height_file;
pub mod height_table;
mod initial_contact;
mod nodes;
pub mod outline;
mod shape_integrals;
pub mod symmetry;

use std::borrow::Cow;

use crate::flexibility::per_cell::PerCell;
use crate::geometry::{Point, Triad};

pub use crate::geometry::Side;
pub use face_curvature::{EdgeSagitta, MeshedSurface, edge_sagittas};
pub use face_map::FaceMap;
pub use gap::{GapShape, InitialGap};
pub use initial_contact::first_touch;
pub use outline::Outline;

/// Smallest cosine of the angle between the frame's n and the normal of a cell that faces n.
const PERPENDICULAR_COSINE: f64 = 1e-6;

/// Uniform grid; cell (ix, iy) has the grid position `ix * cells[1] + iy`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Cell sides, mm.
    pub spacing: [f64; 2],
    /// Centre of the frame in global x, y, mm.
    pub center: [f64; 2],
    /// Angle of the frame's x axis from global x, radians.
    pub azimuth: f64,
    /// Whether frame and bodies are periodic along x, y with the sides of the frame as periods.
    pub periodic: [bool; 2],
}

/// Potential contact area: N cells with constant tractions.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFrame {
    /// Cell centres in global coordinates, mm.
    pub centers: Vec<Point>,
    /// Corners of each cell in global coordinates, counter-clockwise seen against its normal, mm. `None` if the grid
    /// defines them.
    pub polygons: Option<Vec<Vec<Point>>>,
    /// Areas, mm2.
    pub areas: Vec<f64>,
    /// Local axes (x, y, n) of each cell.
    pub triads: PerCell<Triad>,
    /// Origin of gap shapes and of moments in global coordinates, mm.
    pub origin: Point,
    /// Angle of the frame's x axis from global x, radians.
    pub azimuth: f64,
    /// The frame's own axes (x, y, n), used for rigid motions of body 2, resultants and gap shapes.
    pub axes: Triad,
    /// Grid from which the frame is made, `None` for cells of a mesh. An outline may exclude some cells of the grid.
    pub grid: Option<Grid>,
    /// Grid position of each cell, ascending, if an outline excludes some cells ([`ContactFrame::clipped_to`]).
    pub grid_indices: Option<Vec<usize>>,
    /// Number of cells excluded by an outline or by [`ContactFrame::retain_cells`].
    pub n_excluded: usize,
    /// Cells that may come into contact, `[N]`; `None` means all. Bodies form the flexibility of other cells only when contact
    /// reaches them.
    pub candidates: Option<Vec<bool>>,
    /// Whether each cell lies on a symmetry plane normal to global x, y, z, `[N]`. `None` if no cell lies on a symmetry
    /// plane.
    pub symmetry_planes: Option<Vec<[bool; 3]>>,
    /// Whether the frame ends at a symmetry plane of both bodies normal to global x, y, z.
    pub symmetry_bounds: [bool; 3],
    /// Whether each cell lies at an edge of the frame where a body also ends, `[N]`. The frame does not cut off contact at this
    /// edge.
    pub body_ends: Option<Vec<bool>>,
}

impl ContactFrame {
    /// Number of cells N.
    pub fn n_cells(&self) -> usize {
        self.areas.len()
    }

    /// Mean area of the cells, mm2.
    pub fn mean_cell_area(&self) -> f64 {
        self.areas.iter().sum::<f64>() / self.n_cells() as f64
    }

    /// Corners of a cell in global coordinates, counter-clockwise seen against its normal, mm.
    ///
    /// # Panics
    /// If the frame is neither made of polygons nor a grid.
    pub fn corners(&self, cell: usize) -> Cow<'_, [Point]> {
        match (&self.polygons, self.grid) {
            (Some(polygons), _) => polygons[cell].as_slice().into(),
            (None, Some(grid)) => grid.corners(self.grid_index(cell)).to_vec().into(),
            (None, None) => unreachable!("a frame without polygons is a grid"),
        }
    }

    /// Corners of all cells, `[N]`.
    pub fn all_corners(&self) -> impl Iterator<Item = Cow<'_, [Point]>> {
        (0..self.n_cells()).map(|cell| self.corners(cell))
    }

    /// Characteristic length: square root of the total area, mm.
    pub fn size(&self) -> f64 {
        self.areas.iter().sum::<f64>().sqrt()
    }

    /// Square root of the mean cell area, mm.
    pub fn mean_cell_side(&self) -> f64 {
        self.mean_cell_area().sqrt()
    }

    /// Coordinates of a cell's centre along the frame's x and y, measured from the origin, mm.
    pub fn plane_coordinates(&self, cell: usize) -> [f64; 2] {
        let local = self.axes.to_local(&(self.centers[cell] - self.origin));
        [local.x, local.y]
    }

    /// Makes a grid frame one period of bodies that are periodic along the axes selected by `periodic`.
    pub fn with_periodicity(mut self, periodic: [bool; 2]) -> Self {
        if let Some(grid) = &mut self.grid {
            grid.periodic = periodic;
        }
        self
    }

    /// Periodic image of `position` (frame's x, y) nearest to the frame's origin.
    pub fn nearest_image(&self, position: [f64; 2]) -> [f64; 2] {
        let Some(grid) = self.grid else { return position };
        [0, 1].map(|axis| {
            let x = position[axis];
            let side = grid.cells[axis] as f64 * grid.spacing[axis];
            // A position within the frame stays unchanged, also at half a period.
            if grid.periodic[axis] && x.abs() > 0.5 * side { x - side * (x / side).round() } else { x }
        })
    }

    /// Whether each cell lies at the edge of the frame, `[N]`. Periodic sides, edges of an outline, and cells where a
    /// body ends do not count.
    pub fn edge_cells(&self) -> Vec<bool> {
        let mut on_edge = match (self.grid, &self.grid_indices) {
            (Some(grid), None) => grid.edge_cells(),
            (Some(grid), Some(places)) => {
                let all = grid.edge_cells();
                places.iter().map(|&place| all[place]).collect()
            }
            (None, _) => edges::edge_cells(&self.all_corners().collect::<Vec<_>>()),
        };
        if let Some(ends) = &self.body_ends {
            on_edge.iter_mut().zip(ends).for_each(|(edge, ends)| *edge &= !ends);
        }
        on_edge
    }

    /// The grid, if the frame contains all of its cells.
    pub fn whole_grid(&self) -> Option<Grid> {
        self.grid.filter(|_| self.grid_indices.is_none())
    }

    /// Grid position of a cell; the cell index if the frame is no grid.
    pub fn grid_index(&self, cell: usize) -> usize {
        self.grid_indices.as_ref().map_or(cell, |places| places[cell])
    }

    /// Whether the frame is periodic along x or y.
    pub fn is_periodic(&self) -> bool {
        self.grid.is_some_and(|grid| grid.periodic != [false; 2])
    }

    /// Whether the normals of all cells have a positive component along the frame's n.
    pub fn is_single_valued(&self) -> bool {
        let n = self.axes.normal();
        self.triads.distinct().iter().all(|triad| triad.normal().dot(&n) > PERPENDICULAR_COSINE)
    }

    /// Whether all cells have the frame's own axes.
    pub fn has_uniform_axes(&self) -> bool {
        self.triads.distinct().iter().all(|triad| (triad.0 - self.axes.0).amax() < 1e-12)
    }
}
