//! Outlines of the cells of a frame for maps.

use nalgebra::Vector2;

use crate::frame::ContactFrame;
use crate::geometry::Point;
use crate::output::plot::axis::Axis;

/// Largest number of cells per side that are drawn one by one. Larger grids are drawn in blocks of cells.
const MAX_DRAWN_CELLS_PER_SIDE: usize = 96;

/// Polygons of a map in frame coordinates: single cells or blocks of cells.
pub(super) struct CellShapes {
    pub corners: Vec<Vec<Vector2<f64>>>,
    /// Cells of the frame in each polygon.
    pub cells: Vec<Vec<usize>>,
}

impl CellShapes {
    pub fn new(frame: &ContactFrame) -> Self {
        let flat = |p: &Point| frame.axes.to_local(&(p - frame.origin)).xy();
        let corners: Vec<Vec<Vector2<f64>>> =
            frame.all_corners().map(|cell| cell.iter().map(flat).collect()).collect();
        let large =
            frame.whole_grid().filter(|grid| grid.cells.iter().any(|n| *n > MAX_DRAWN_CELLS_PER_SIDE));
        match large {
            Some(grid) => Self::blocks(&corners, grid.cells),
            None => Self { cells: (0..corners.len()).map(|i| vec![i]).collect(), corners },
        }
    }

    fn blocks(corners: &[Vec<Vector2<f64>>], cells: [usize; 2]) -> Self {
        let [bx, by] = cells.map(|n| n.div_ceil(MAX_DRAWN_CELLS_PER_SIDE));
        let mut shapes = Self { corners: Vec::new(), cells: Vec::new() };
        for x0 in (0..cells[0]).step_by(bx) {
            for y0 in (0..cells[1]).step_by(by) {
                let (x1, y1) = ((x0 + bx).min(cells[0]), (y0 + by).min(cells[1]));
                let at = |ix: usize, iy: usize| ix * cells[1] + iy;
                shapes.cells.push((x0..x1).flat_map(|ix| (y0..y1).map(move |iy| at(ix, iy))).collect());
                shapes.corners.push(vec![
                    corners[at(x0, y0)][0],
                    corners[at(x1 - 1, y0)][1],
                    corners[at(x1 - 1, y1 - 1)][2],
                    corners[at(x0, y1 - 1)][3],
                ]);
            }
        }
        shapes
    }

    fn all(&self) -> impl Iterator<Item = &Vector2<f64>> {
        self.corners.iter().flatten()
    }

    /// Axes with ranges of equal length that contain all cells, in the area (left, top, width, height) in pixels.
    pub fn axes(&self, [left, top, width, height]: [f64; 4]) -> [Axis; 2] {
        let range = |axis: usize| {
            self.all().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[axis]), h.max(p[axis])))
        };
        let (rx, ry) = (range(0), range(1));
        let half = 0.5 * (rx.1 - rx.0).max(ry.1 - ry.0);
        let around = |(low, high): (f64, f64)| [0.5 * (low + high) - half, 0.5 * (low + high) + half];
        [
            Axis::with_bounds(around(rx), [left, left + width]),
            Axis::with_bounds(around(ry), [top + height, top]),
        ]
    }

    pub fn middle(&self, shape: usize) -> Vector2<f64> {
        let corners = &self.corners[shape];
        corners.iter().sum::<Vector2<f64>>() / corners.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Triad;

    /// Truth: cells in the plane of the frame keep their areas: a square wall of 2 mm by 2 mm, normal to x, has four cells of 1
    /// mm2.
    #[test]
    fn a_wall_is_drawn_with_the_areas_of_its_cells() {
        let mut frame = ContactFrame::grid([1.0, 1.0], [2, 2], [0.0, 0.0], 0.0).unwrap();
        let upright = |p: &Point| Point::new(3.0, p.x, p.y);
        let wall = frame.all_corners().map(|cell| cell.iter().map(upright).collect()).collect();
        (frame.polygons, frame.grid) = (Some(wall), None);
        frame.axes = Triad::from_normal(-Point::x(), Point::y());
        let shapes = CellShapes::new(&frame);
        assert_eq!(shapes.corners.len(), 4);
        for corners in &shapes.corners {
            let twice = |i: usize| corners[i].perp(&corners[(i + 1) % corners.len()]);
            let area = (0..corners.len()).map(twice).sum::<f64>().abs() / 2.0;
            assert!((area - 1.0).abs() < 1e-12, "{corners:?}");
        }
    }
}
