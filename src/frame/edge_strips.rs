//! Narrow strips beyond the edges of a frame, to check whether bodies continue there.

use super::ContactFrame;
use super::edges::{edge_key, owner_counts};
use super::faces::FrameBuilder;
use crate::geometry::Point;

/// Width of the strips, relative to the size of the cell.
const STRIP_WIDTH: f64 = 1e-3;

impl ContactFrame {
    /// Narrow strips beyond the edges of the frame, as cells of a separate frame, and the neighbouring cell of each strip. The
    /// boundary of an outline and a periodic side do not count as edges.
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

    /// Cell and end points of each outer edge, counter-clockwise around the cell.
    fn outer_edges(&self) -> Vec<(usize, [Point; 2])> {
        let mut found = Vec::new();
        if let Some(grid) = self.grid {
            for cell in 0..self.n_cells() {
                let at = grid.cell_indices(self.grid_index(cell));
                // For the side between corners k and k + 1: `axis` is normal to the side, and `upper` states whether
                // the side lies at the upper end of this axis.
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
