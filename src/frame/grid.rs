//! Uniform rectangular grid frames in the plane z = 0.

use super::{ContactFrame, Grid};
use crate::error::{Error, Result};
use crate::flexibility::per_cell::PerCell;
use crate::geometry::{Point, Triad};
use crate::linalg::memory;

const CELL_BYTES: u128 = 24 + 8;

impl ContactFrame {
    /// A grid of `cells` equal rectangles with total size 2 `half_width` and centre `center` (global x, y, mm). Its x axis is
    /// rotated by `azimuth` (radians) from global x. All normals are +z.
    ///
    /// # Errors
    /// If an argument is not admissible, or the cells do not fit into memory.
    pub fn grid(half_width: [f64; 2], cells: [usize; 2], center: [f64; 2], azimuth: f64) -> Result<Self> {
        check(half_width, cells, center, azimuth)?;
        let spacing = [2.0 * half_width[0] / cells[0] as f64, 2.0 * half_width[1] / cells[1] as f64];
        Ok(Self::of_grid(Grid { cells, spacing, center, azimuth, periodic: [false; 2] }))
    }

    /// The grid enlarged by `more[axis]` cells at both ends of each axis. Existing cells keep their positions bit by bit. `None` if
    /// the frame is no complete grid or is periodic.
    ///
    /// # Errors
    /// If the cells do not fit into memory.
    pub fn enlarged(&self, more: [usize; 2]) -> Result<Option<Self>> {
        let Some(grid) = self.whole_grid().filter(|grid| grid.periodic == [false; 2]) else {
            return Ok(None);
        };
        let cells = [0, 1].map(|axis| grid.cells[axis].saturating_add(more[axis].saturating_mul(2)));
        check_cells(cells)?;
        Ok(Some(Self::of_grid(Grid { cells, ..grid })))
    }

    fn of_grid(grid: Grid) -> Self {
        let Grid { cells, spacing, center, azimuth, .. } = grid;
        let triad = Triad::horizontal(azimuth);
        let n = cells[0] * cells[1];
        let mut centers = Vec::with_capacity(n);
        for ix in 0..cells[0] {
            centers.extend((0..cells[1]).map(|iy| grid.point(&triad, [ix as f64 + 0.5, iy as f64 + 0.5])));
        }
        Self {
            centers,
            polygons: None,
            areas: vec![spacing[0] * spacing[1]; n],
            triads: PerCell::Same(triad, n),
            origin: Point::new(center[0], center[1], 0.0),
            azimuth,
            axes: triad,
            grid: Some(grid),
            grid_indices: None,
            n_excluded: 0,
            candidates: None,
            symmetry_planes: None,
            symmetry_bounds: [false; 3],
            body_ends: None,
        }
    }
}

impl Grid {
    /// Half the side lengths along x and y, mm.
    pub fn half_width(&self) -> [f64; 2] {
        [0, 1].map(|axis| 0.5 * self.cells[axis] as f64 * self.spacing[axis])
    }

    /// Indices of the cells in a wider grid with equal numbers of added cells on opposite sides, `[N]`.
    pub fn indices_in(&self, wider: &Self) -> Vec<usize> {
        let more = [0, 1].map(|axis| (wider.cells[axis] - self.cells[axis]) / 2);
        let place = |ix: usize, iy: usize| (ix + more[0]) * wider.cells[1] + iy + more[1];
        (0..self.cells[0]).flat_map(|ix| (0..self.cells[1]).map(move |iy| place(ix, iy))).collect()
    }

    /// Indices [ix, iy] of the cell at a grid position.
    pub fn cell_indices(&self, place: usize) -> [usize; 2] {
        [place / self.cells[1], place % self.cells[1]]
    }

    /// Frame coordinate of the grid line `line` along `axis` (0, 1), mm. A half-integer `line` is the centre of a cell.
    /// The coordinates are exactly antisymmetric about the middle of the frame.
    fn coordinate(&self, axis: usize, line: f64) -> f64 {
        (line - 0.5 * self.cells[axis] as f64) * self.spacing[axis]
    }

    /// Global point at the grid lines `lines` along x and y. Half-integer values are cell centres.
    fn point(&self, triad: &Triad, lines: [f64; 2]) -> Point {
        let [x, y] = [0, 1].map(|axis| self.coordinate(axis, lines[axis]));
        Point::new(self.center[0], self.center[1], 0.0) + triad.to_global(&Point::new(x, y, 0.0))
    }

    pub(super) fn corners(&self, place: usize) -> [Point; 4] {
        let (triad, at) = (Triad::horizontal(self.azimuth), self.cell_indices(place));
        [[0, 0], [1, 0], [1, 1], [0, 1]]
            .map(|corner| self.point(&triad, [0, 1].map(|axis| (at[axis] + corner[axis]) as f64)))
    }

    pub(super) fn edge_cells(&self) -> Vec<bool> {
        let [nx, ny] = self.cells;
        let outermost = |axis: usize, i: usize| !self.periodic[axis] && (i == 0 || i + 1 == self.cells[axis]);
        let mut rim = Vec::with_capacity(nx * ny);
        for ix in 0..nx {
            rim.extend((0..ny).map(|iy| outermost(0, ix) || outermost(1, iy)));
        }
        rim
    }
}

/// Extends a cell field, `[n_components, N]`, to an enlarged frame of `n` cells. `places[i]` is the new index of cell i. New cells
/// get the value `fill(k)`, where k is the index in the extended field.
pub fn extend_field<T: Copy>(field: &[T], places: &[usize], n: usize, fill: impl Fn(usize) -> T) -> Vec<T> {
    let planes = field.len() / places.len().max(1);
    let mut out: Vec<T> = (0..planes * n).map(fill).collect();
    for (plane, values) in field.chunks_exact(places.len().max(1)).enumerate() {
        places.iter().zip(values).for_each(|(&place, value)| out[plane * n + place] = *value);
    }
    out
}

fn check(half_width: [f64; 2], cells: [usize; 2], center: [f64; 2], azimuth: f64) -> Result<()> {
    if !half_width.iter().all(|w| w.is_finite() && *w > 0.0) {
        return Err(Error::input(format!(
            "the frame's half_width is {half_width:?}; both numbers must be positive and finite"
        )));
    }
    if cells.contains(&0) {
        return Err(Error::input(format!(
            "the frame has {cells:?} cells; it needs at least one along each axis"
        )));
    }
    if !(center.iter().all(|c| c.is_finite()) && azimuth.is_finite()) {
        return Err(Error::input(format!(
            "the frame's center {center:?} and azimuth {azimuth} must be finite numbers"
        )));
    }
    check_cells(cells)
}

fn check_cells(cells: [usize; 2]) -> Result<()> {
    let n: u128 = cells.iter().map(|&n| n as u128).product();
    let what = format!("a frame of {} x {} cells", cells[0], cells[1]);
    memory::ensure(n.saturating_mul(CELL_BYTES), &what, "use fewer cells (frame.cells)")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: cell (ix, iy) has the index ix * ny + iy, and the total area is 4 w_x w_y. Corners are counter-clockwise, and the
    /// mean of the centres is the origin.
    #[test]
    fn cells_lie_as_defined() {
        let frame = ContactFrame::grid([1.2, 0.6], [4, 3], [5.0, -2.0], 0.3).unwrap();
        assert_eq!(frame.n_cells(), 12);
        let total: f64 = frame.areas.iter().sum();
        assert!((total - 4.0 * 1.2 * 0.6).abs() < 1e-14);
        let local = frame.plane_coordinates(3 + 2);
        assert!((local[0] + 0.3).abs() < 1e-14 && (local[1] - 0.4).abs() < 1e-14, "{local:?}");
        let corner = frame.corners(5);
        let area = (corner[1] - corner[0]).cross(&(corner[3] - corner[0]));
        assert!((area.z - frame.areas[5]).abs() < 1e-14);
        let mean = frame.centers.iter().sum::<Point>() / 12.0;
        assert!((mean - frame.origin).norm() < 1e-14);
        assert_eq!(frame.edge_cells().iter().filter(|r| !**r).count(), 2);
    }

    /// Truth: the outermost rows of a grid are the cells with an edge that no other cell shares.
    #[test]
    fn rims_agree() {
        let frame = ContactFrame::grid([1.0, 1.0], [5, 4], [0.0, 0.0], 0.0).unwrap();
        assert_eq!(
            super::super::edges::edge_cells(&frame.all_corners().collect::<Vec<_>>()),
            frame.edge_cells()
        );
    }

    /// Truth: a periodic direction has no edge cells, and positions beyond half a side have an image within the frame.
    #[test]
    fn repeated_frames_have_no_rim() {
        let frame = |periodic| {
            ContactFrame::grid([1.0, 2.0], [5, 4], [0.0, 0.0], 0.0).unwrap().with_periodicity(periodic)
        };
        let count = |periodic| frame(periodic).edge_cells().iter().filter(|is| **is).count();
        assert_eq!([count([true, false]), count([false, true]), count([true, true])], [10, 8, 0]);
        assert_eq!(frame([true, false]).nearest_image([1.5, 2.5]), [-0.5, 2.5]);
    }

    /// Truth: cells keep their coordinates bit by bit, and the centre stays.
    #[test]
    fn wider_grids_keep_their_cells() {
        for (cells, half) in [([5, 4], [1.3, 0.7]), ([6, 3], [0.1, 1.0 / 3.0])] {
            let frame = ContactFrame::grid(half, cells, [0.3, -7.1], 0.4).unwrap();
            let wide = frame.enlarged([2, 3]).unwrap().unwrap();
            let (grid, wider) = (frame.grid.unwrap(), wide.grid.unwrap());
            assert_eq!(wider.cells, [cells[0] + 4, cells[1] + 6]);
            let places = grid.indices_in(&wider);
            assert_eq!((places[0], places.len()), (2 * (cells[1] + 6) + 3, frame.n_cells()));
            for (cell, &place) in places.iter().enumerate() {
                let coordinates =
                    |frame: &ContactFrame, cell: usize| frame.plane_coordinates(cell).map(f64::to_bits);
                assert_eq!(coordinates(&frame, cell), coordinates(&wide, place));
                assert_eq!(frame.centers[cell], wide.centers[place]);
                assert_eq!((frame.areas[cell], frame.origin), (wide.areas[place], wide.origin));
            }
            let width = wider.half_width()[0] / (half[0] * wider.cells[0] as f64 / cells[0] as f64);
            assert!((width - 1.0).abs() < 1e-15);
        }
        let frame = ContactFrame::grid([1.0, 1.0], [4, 4], [0.0; 2], 0.0).unwrap();
        assert!(frame.enlarged([usize::MAX, 1]).is_err());
        assert!(frame.with_periodicity([true, false]).enlarged([1, 1]).unwrap().is_none());
    }

    #[test]
    fn nonsense_is_refused() {
        assert!(ContactFrame::grid([0.0, 1.0], [4, 4], [0.0; 2], 0.0).is_err());
        assert!(ContactFrame::grid([1.0, f64::NAN], [4, 4], [0.0; 2], 0.0).is_err());
        assert!(ContactFrame::grid([1.0, 1.0], [0, 4], [0.0; 2], 0.0).is_err());
        assert!(ContactFrame::grid([1.0, 1.0], [usize::MAX, 4], [0.0; 2], 0.0).is_err());
        assert!(ContactFrame::grid([1.0, 1.0], [4, 4], [0.0, f64::INFINITY], 0.0).is_err());
    }
}
