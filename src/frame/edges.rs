//! Edges shared between cells of a frame, found by the positions of their ends.

use std::collections::HashMap;

use crate::geometry::Point;

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
pub(super) fn owner_counts(corners: &[impl AsRef<[Point]>]) -> HashMap<EdgeKey, usize> {
    let mut owners = HashMap::new();
    for edge in corners.iter().flat_map(|cell| edges(cell.as_ref())) {
        *owners.entry(edge).or_default() += 1;
    }
    owners
}

fn edges(cell: &[Point]) -> impl Iterator<Item = EdgeKey> + '_ {
    (0..cell.len()).map(|i| edge_key(&cell[i], &cell[(i + 1) % cell.len()]))
}

pub(super) fn edge_key(a: &Point, b: &Point) -> EdgeKey {
    let (a, b) = (bits(a), bits(b));
    if a < b { [a, b] } else { [b, a] }
}

fn bits(point: &Point) -> [u64; 3] {
    // Adding zero turns -0 into +0, so that both compare equal.
    [(point.x + 0.0).to_bits(), (point.y + 0.0).to_bits(), (point.z + 0.0).to_bits()]
}
