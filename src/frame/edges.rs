//! Edges shared between cells of a frame, found by the positions of their ends.

use std::collections::HashMap;

use super::ContactFrame;
use super::faces::FrameBuilder;
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
    /// Narrow strips just beyond the edges of the frame, as cells of a frame of their own, and the neighbouring cell of each strip. An outline and the sides
    /// of periodic directions are no edges.
    pub fn strips_beyond_edges(&self) -> (Self, Vec<usize>) {
        let (mut strips, mut cells) = (FrameBuilder::default(), Vec::new());
        for (cell, [a, b]) in self.outer_edges() {
            let Some(outward) = (b - a).cross(&self.triads[cell].normal()).try_normalize(0.0) else {
                continue;
            };
            let across = outward * (STRIP_WIDTH * self.areas[cell].sqrt());
            if strips.push(vec![b, a, a + across, b + across], b - a).is_some() {
                cells.push(cell);
            }
        }
        (strips.frame([0.0; 2], self.azimuth), cells)
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
