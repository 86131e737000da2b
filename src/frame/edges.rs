//! Edges shared between cells of a frame, found by the positions of their ends.

use std::collections::HashMap;

use super::ContactFrame;
use crate::geometry::Point;

/// Width of the strips beyond the edges of a frame, over the size of the cell.
const STRIP_WIDTH: f64 = 1e-3;

/// Whether some edge of a cell belongs to no other cell, `[N]`.
///
/// Cells made from faces of one mesh repeat the coordinates of a shared node to the last bit, so bits compare.
pub(super) fn edge_cells(corners: &[impl AsRef<[Point]>]) -> Vec<bool> {
    let owners = owner_counts(corners);
    corners.iter().map(|cell| edges(cell.as_ref()).any(|edge| owners[&edge] == 1)).collect()
}

/// An edge by the bits of its ends, in either direction.
type EdgeKey = [[u64; 3]; 2];

/// Number of cells that have each edge.
fn owner_counts(corners: &[impl AsRef<[Point]>]) -> HashMap<EdgeKey, usize> {
    let mut owners = HashMap::new();
    for edge in corners.iter().flat_map(|cell| edges(cell.as_ref())) {
        *owners.entry(edge).or_default() += 1;
    }
    owners
}

fn edges(cell: &[Point]) -> impl Iterator<Item = EdgeKey> + '_ {
    (0..cell.len()).map(|i| edge_key(&cell[i], &cell[(i + 1) % cell.len()]))
}

fn edge_key(a: &Point, b: &Point) -> EdgeKey {
    let (a, b) = (bits(a), bits(b));
    if a < b { [a, b] } else { [b, a] }
}

fn bits(point: &Point) -> [u64; 3] {
    // Adding zero turns -0 into +0, so that both compare equal.
    [(point.x + 0.0).to_bits(), (point.y + 0.0).to_bits(), (point.z + 0.0).to_bits()]
}

impl ContactFrame {
    /// Narrow strips just beyond the edges of the frame, as cells of a frame of their own, and the cell beside each. An outline and the sides of periodic
    /// directions are no edges.
    pub fn strips_beyond_edges(&self) -> (Self, Vec<usize>) {
        let outer = self.outer_edges();
        let strip = |&(cell, [a, b]): &(usize, [Point; 2])| {
            let outward = (b - a).cross(&self.triads[cell].normal()).normalize();
            let across = outward * (STRIP_WIDTH * self.areas[cell].sqrt());
            vec![b, a, a + across, b + across]
        };
        let polygons: Vec<Vec<Point>> = outer.iter().map(strip).collect();
        let cells: Vec<usize> = outer.iter().map(|edge| edge.0).collect();
        let area = |strip: &Vec<Point>| (strip[1] - strip[0]).norm() * (strip[2] - strip[1]).norm();
        let strips = Self {
            centers: polygons.iter().map(|corners| corners.iter().sum::<Point>() / 4.0).collect(),
            areas: polygons.iter().map(area).collect(),
            triads: cells.iter().map(|&cell| self.triads[cell]).collect(),
            polygons: Some(polygons),
            origin: self.origin,
            azimuth: self.azimuth,
            axes: self.axes,
            grid: None,
            grid_indices: None,
            n_excluded: 0,
            candidates: None,
            symmetry_planes: None,
            symmetry_bounds: [false; 3],
            body_ends: None,
        };
        (strips, cells)
    }

    /// The edges of cells that are edges of the frame: the cell, and the ends of its edge, counter-clockwise.
    fn outer_edges(&self) -> Vec<(usize, [Point; 2])> {
        let mut found = Vec::new();
        if let Some(grid) = self.grid {
            for cell in 0..self.n_cells() {
                let place = self.grid_index(cell);
                let at = [place / grid.cells[1], place % grid.cells[1]];
                // Sides between corners k and k + 1: their axis, and whether they are at its upper end.
                for (k, (axis, upper)) in
                    [(1, false), (0, true), (1, true), (0, false)].into_iter().enumerate()
                {
                    let last = if upper { grid.cells[axis] - 1 } else { 0 };
                    if !grid.periodic[axis] && at[axis] == last {
                        let corners = self.corners(cell);
                        found.push((cell, [corners[k], corners[(k + 1) % 4]]));
                    }
                }
            }
            return found;
        }
        let corners: Vec<_> = self.all_corners().collect();
        let owners = owner_counts(&corners);
        for (cell, corners) in corners.iter().enumerate() {
            let ends = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
            found.extend(ends.filter(|[a, b]| owners[&edge_key(a, b)] == 1).map(|ends| (cell, ends)));
        }
        found
    }
}
