//! Search for the cells of the frame over which a point of a body surface lies.

use std::collections::HashMap;

use crate::frame::{ContactFrame, Grid};
use crate::geometry::{Point, Side};

/// Finds the cells of a frame over which surface points of a body lie.
pub struct CellLocator<'a> {
    frame: &'a ContactFrame,
    side: Side,
    common_normal: Option<Point>,
    bin: f64,
    bins: HashMap<[i64; 3], Vec<usize>>,
}

/// Surface point with its outward direction (any length; zero if unknown).
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// Position.
    pub at: Point,
    /// Outward direction.
    pub outward: Point,
}

impl<'a> CellLocator<'a> {
    /// Prepares the search for the body on `side`.
    pub fn new(frame: &'a ContactFrame, side: Side) -> Self {
        let diameter = |i: usize| {
            2.0 * frame.corners(i).iter().map(|c| (c - frame.centers[i]).norm()).fold(0.0, f64::max)
        };
        let first = frame.triads.first().map(|triad| triad.normal());
        let common_normal =
            first.filter(|n| frame.triads.distinct().iter().all(|triad| (triad.normal() - n).norm() < 1e-9));
        let mut locator = Self { frame, side, common_normal, bin: 1.0, bins: HashMap::new() };
        if frame.whole_grid().is_none() {
            let largest = (0..frame.n_cells()).map(diameter).fold(0.0, f64::max);
            locator.bin = if largest > 0.0 { largest } else { 1.0 };
            for (i, center) in frame.centers.iter().enumerate() {
                locator.bins.entry(locator.key(center)).or_default().push(i);
            }
        }
        locator
    }

    /// Cells over which the point lies: the projection of the point along the cell normal lies in the cell, and the
    /// surface at the point faces the cell. On a curved frame, only cells within one bin width of the point count. If
    /// there are none, the nearest cells count. A point over a common edge has several cells.
    pub fn cells_at(&self, point: &SurfacePoint) -> Vec<usize> {
        let mut cells = match (&self.frame.whole_grid(), self.common_normal) {
            (Some(grid), _) => grid_cells(grid, &point.at),
            (None, Some(_)) => {
                self.cells_in_adjacent_bins(&point.at).filter(|&cell| self.holds(cell, &point.at)).collect()
            }
            (None, None) => self.nearest(point),
        };
        cells.retain(|&cell| self.is_facing(cell, point));
        cells
    }

    /// Cells of a curved frame over which the point lies, within one bin width along their normals. If there are none,
    /// the nearest cells over which the point lies.
    fn nearest(&self, point: &SurfacePoint) -> Vec<usize> {
        let distance =
            |cell: usize| self.frame.triads[cell].normal().dot(&(point.at - self.frame.centers[cell])).abs();
        let over = |cell: &usize| self.holds(*cell, &point.at) && self.is_facing(*cell, point);
        let mut found: Vec<usize> = self
            .cells_in_adjacent_bins(&point.at)
            .filter(over)
            .filter(|&cell| distance(cell) <= self.bin)
            .collect();
        if found.is_empty() {
            // This cheap test excludes most cells before the test of their polygons.
            let near = |cell: &usize| self.along_surface(*cell, &point.at) <= self.bin;
            found = (0..self.frame.n_cells()).filter(near).filter(over).collect();
            let least = found.iter().map(|&cell| distance(cell)).fold(f64::INFINITY, f64::min);
            found.retain(|&cell| distance(cell) <= least + 1e-6 * self.bin);
        }
        found
    }

    /// Distance of the point from the normal through the centre of a cell.
    fn along_surface(&self, cell: usize, point: &Point) -> f64 {
        let (arm, normal) = (point - self.frame.centers[cell], self.frame.triads[cell].normal());
        (arm - normal * normal.dot(&arm)).norm()
    }

    /// Whether the surface at the point faces the cell. True if the outward direction is unknown (zero).
    fn is_facing(&self, cell: usize, point: &SurfacePoint) -> bool {
        let along = self.frame.triads[cell].normal().dot(&point.outward);
        along == 0.0 && point.outward == Point::zeros() || along * self.side.outward() > 0.0
    }

    /// Bin of a point. If all cells have a common normal, the point is first projected along this normal.
    fn key(&self, point: &Point) -> [i64; 3] {
        let along =
            self.common_normal.map_or(Point::zeros(), |n| n * n.dot(&(point - self.frame.centers[0])));
        let projection = point - along;
        [0, 1, 2].map(|axis| (projection[axis] / self.bin).floor() as i64)
    }

    fn cells_in_adjacent_bins(&self, point: &Point) -> impl Iterator<Item = usize> {
        let [x, y, z] = self.key(point);
        let mut found = Vec::new();
        for (dx, dy, dz) in (0..27).map(|k| (k / 9 - 1, k / 3 % 3 - 1, k % 3 - 1)) {
            let key = [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)];
            found.extend(self.bins.get(&key).into_iter().flatten().copied());
        }
        found.sort_unstable();
        found.dedup();
        found.into_iter()
    }

    fn holds(&self, cell: usize, point: &Point) -> bool {
        let (corners, triad) = (self.frame.corners(cell), &self.frame.triads[cell]);
        let slack = 1e-9 * self.bin;
        let mut crossings = 0;
        for (i, from) in corners.iter().enumerate() {
            let [a, b] =
                [from, &corners[(i + 1) % corners.len()]].map(|corner| triad.to_local(&(corner - point)));
            let (a, b) = (a.xy(), b.xy());
            let edge = b - a;
            let along = (-a.dot(&edge) / edge.norm_squared()).clamp(0.0, 1.0);
            if (a + edge * along).norm() <= slack {
                return true;
            }
            // A ray from an inside point along the local x axis crosses an odd number of edges.
            if (a.y > 0.0) != (b.y > 0.0) && (a.x - a.y * edge.x / edge.y) > 0.0 {
                crossings += 1;
            }
        }
        crossings % 2 == 1
    }
}

/// Cells of a grid that contain the projection of `point`: up to four at a corner.
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

/// Indices i < `n` of the intervals `[i, i + 1]` that contain `at`. A common end belongs to both intervals.
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
    use crate::geometry::Triad;

    /// Truth (definition): interval i reaches from i to i + 1. Common ends belong to two intervals.
    #[test]
    fn ends_belong_to_both_intervals() {
        assert_eq!(intervals(0.0, 3), [0]);
        assert_eq!(intervals(1.0, 3), [0, 1]);
        assert_eq!(intervals(2.5, 3), [2]);
        assert_eq!(intervals(3.0, 3), [2]);
        assert_eq!(intervals(3.1, 3), [0_usize; 0]);
        assert_eq!(intervals(f64::NAN, 3), [0_usize; 0]);
    }

    /// Two cells of 1 x 1 mm, the second rotated by `angle` about their common edge.
    fn two_cells(angle: f64) -> ContactFrame {
        let (s, c) = angle.sin_cos();
        let along = [Point::x(), Point::new(c, 0.0, s)];
        let corners = [0, 1].map(|i| {
            let from = Point::new(i as f64, 0.0, 0.0);
            vec![from, from + along[i], from + along[i] + Point::y(), from + Point::y()]
        });
        let normals = [Point::z(), Point::new(-s, 0.0, c)];
        ContactFrame {
            centers: corners.iter().map(|corners| corners.iter().sum::<Point>() / 4.0).collect(),
            polygons: Some(corners.to_vec()),
            areas: vec![1.0; 2],
            triads: normals.iter().map(|n| Triad::from_normal(*n, Point::x())).collect(),
            origin: Point::zeros(),
            azimuth: 0.0,
            axes: Triad::horizontal(0.0),
            grid: None,
            grid_indices: None,
            n_excluded: 0,
            candidates: None,
            symmetry_planes: None,
            symmetry_bounds: [false; 3],
            body_ends: None,
        }
    }

    /// Truth: points in a dart-shaped cell, classified by hand. The notch lies outside; corners and edges belong to the cell.
    #[test]
    fn a_cell_may_be_a_dart() {
        let mut frame = two_cells(0.0);
        frame.polygons.as_mut().unwrap()[0] =
            [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]].map(|[x, y]| Point::new(x, y, 0.0)).to_vec();
        let locator = CellLocator::new(&frame, Side::Upper);
        let cases = [
            ([0.3, 0.0], true),
            ([1.5, 0.7], true),
            ([1.5, -0.7], true),
            ([0.5, 0.0], true),
            ([2.0, 1.0], true),
            ([1.0, 0.5], true),
            ([0.6, 0.0], false),
            ([1.5, 0.0], false),
            ([1.5, 0.8], false),
            ([-0.1, 0.0], false),
        ];
        for ([x, y], inside) in cases {
            assert_eq!(locator.holds(0, &Point::new(x, y, 3.0)), inside, "{x} {y}");
        }
    }

    /// Truth: a point on the normal of a cell lies over this cell at any height. A surface that faces away has no cells.
    #[test]
    fn distance_does_not_matter_but_the_side_does() {
        for angle in [0.0, -0.2] {
            let frame = two_cells(angle);
            let upper = CellLocator::new(&frame, Side::Upper);
            for height in [0.0, 0.3, 5.0, 40.0] {
                for (cell, outward, found) in [(0, -1.0, vec![0]), (1, -1.0, vec![1]), (0, 1.0, vec![])] {
                    let normal = frame.triads[cell].normal();
                    let at = frame.centers[cell] + height * normal;
                    let point = SurfacePoint { at, outward: outward * normal };
                    assert_eq!(upper.cells_at(&point), found, "{angle} {height} {cell} {outward}");
                }
            }
        }
    }
}
