//! The contact frame: cells with areas, local axes and an initial gap, and the maps to the faces of the bodies.
//!
//! Local axes of a cell are (x, y, n), n being the outward normal of body 1; a cell carries a constant traction.

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
pub use face_curvature::{EdgeSagitta, edge_sagittas};
pub use face_map::FaceMap;
pub use gap::{GapShape, InitialGap};
pub use initial_contact::{MeshedSurface, first_touch};
pub use outline::Outline;

/// Cells with a smaller component of their normal along the frame's n are perpendicular to its plane.
const PERPENDICULAR_COSINE: f64 = 1e-6;

/// Layout of a uniform grid frame; cell (ix, iy) has the place `ix * cells[1] + iy`.
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
    /// Whether frame and bodies repeat themselves along x, y at the distance of the frame's sides.
    pub periodic: [bool; 2],
}

/// Where contact may happen: N cells with constant tractions.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactFrame {
    /// Cell centres, global.
    pub centers: Vec<Point>,
    /// Corners of each cell, counter-clockwise seen against its normal, global; `None` where they are those of the grid
    /// ([`ContactFrame::corners`]).
    pub polygons: Option<Vec<Vec<Point>>>,
    /// Areas, mm2.
    pub areas: Vec<f64>,
    /// Local axes (x, y, n) of each cell.
    pub triads: PerCell<Triad>,
    /// Origin of gap shapes and of moments, global.
    pub origin: Point,
    /// Angle of the frame's x axis from global x, radians.
    pub azimuth: f64,
    /// The frame's own axes (x, y, n): of rigid motions of body 2, of resultants and of gap shapes.
    pub axes: Triad,
    /// The grid, if the frame is one or a part of one.
    pub grid: Option<Grid>,
    /// Place in the grid of each cell, ascending, where an outline leaves some of them out ([`ContactFrame::clipped_to`]); `None`
    /// where all places have their cell.
    pub grid_indices: Option<Vec<usize>>,
    /// Number of cells that were left out ([`ContactFrame::retain_cells`]).
    pub n_excluded: usize,
    /// The cells that may come into contact, `[N]`; `None` stands for all. Bodies form their flexibility on these, and on
    /// others when contact comes there.
    pub candidates: Option<Vec<bool>>,
    /// Which of the global axes x, y, z are normal to a plane of symmetry that the cell lies on, `[N]`; `None` where no cell lies on
    /// any.
    pub symmetry_planes: Option<Vec<[bool; 3]>>,
    /// Which of the global axes x, y, z are normal to a plane of symmetry of both bodies at which the frame ends.
    pub symmetry_bounds: [bool; 3],
    /// Cells at edges of the frame at which a body ends, too, so that contact is not cut off there, `[N]`; `None` where there are none.
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

    /// Corners of a cell, counter-clockwise seen against its normal, global.
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

    /// Those of all cells, `[N]`.
    pub fn all_corners(&self) -> impl Iterator<Item = Cow<'_, [Point]>> {
        (0..self.n_cells()).map(|cell| self.corners(cell))
    }

    /// A length that measures it: the root of its area, mm.
    pub fn size(&self) -> f64 {
        self.areas.iter().sum::<f64>().sqrt()
    }

    /// Mean side of the cells: the root of their mean area, mm.
    pub fn mean_cell_side(&self) -> f64 {
        self.mean_cell_area().sqrt()
    }

    /// Coordinates of a cell's centre along the frame's x and y, measured from the origin, mm.
    pub fn plane_coordinates(&self, cell: usize) -> [f64; 2] {
        let local = self.axes.to_local(&(self.centers[cell] - self.origin));
        [local.x, local.y]
    }

    /// The frame as one period of bodies that repeat themselves along its x, y where `periodic` says so; a mesh frame stays
    /// as it is.
    pub fn with_periodicity(mut self, periodic: [bool; 2]) -> Self {
        if let Some(grid) = &mut self.grid {
            grid.periodic = periodic;
        }
        self
    }

    /// `position` along the frame's x, y, or its image that is nearest to the origin.
    pub fn nearest_image(&self, position: [f64; 2]) -> [f64; 2] {
        let Some(grid) = self.grid else { return position };
        [0, 1].map(|axis| {
            let x = position[axis];
            let side = grid.cells[axis] as f64 * grid.spacing[axis];
            // Half a period away both images are as near: a position within the frame is its own.
            if grid.periodic[axis] && x.abs() > 0.5 * side { x - side * (x / side).round() } else { x }
        })
    }

    /// Whether each cell lies on an edge of the frame beyond which both bodies continue: some edge of it belongs to no other cell, `[N]`;
    /// where the frame repeats itself, and where a body ends, there is none.
    pub fn edge_cells(&self) -> Vec<bool> {
        let mut on_edge = match (self.grid, &self.grid_indices) {
            (Some(grid), None) => grid.edge_cells(),
            // The edge of the grid; that of an outline is none.
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

    /// The grid, if every place of it has its cell.
    pub fn whole_grid(&self) -> Option<Grid> {
        self.grid.filter(|_| self.grid_indices.is_none())
    }

    /// Place in the grid of a cell; its index where the frame is no grid.
    pub fn grid_index(&self, cell: usize) -> usize {
        self.grid_indices.as_ref().map_or(cell, |places| places[cell])
    }

    /// Whether the frame repeats itself along x or y.
    pub fn is_periodic(&self) -> bool {
        self.grid.is_some_and(|grid| grid.periodic != [false; 2])
    }

    /// Whether each point of the frame's plane has one cell at most: all cells look along n, none away from it.
    pub fn is_single_valued(&self) -> bool {
        let n = self.axes.normal();
        self.triads.distinct().iter().all(|triad| triad.normal().dot(&n) > PERPENDICULAR_COSINE)
    }

    /// Whether the axes of all cells are the frame's own.
    pub fn has_uniform_axes(&self) -> bool {
        self.triads.distinct().iter().all(|triad| (triad.0 - self.axes.0).amax() < 1e-12)
    }
}
