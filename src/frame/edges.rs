//! Edges that cells of a frame share, identified by the coordinates of their ends.

use std::collections::HashMap;

use crate::geometry::Point;

/// Whether each cell has an edge that no other cell shares, `[N]`.
///
/// Cells from faces of one mesh have bitwise equal coordinates of shared nodes, so bits are compared.
pub(super) fn edge_cells(corners: &[impl AsRef<[Point]>]) -> Vec<bool> {
    let owners = owner_counts(corners);
    corners.iter().map(|cell| edges(cell.as_ref()).any(|edge| owners[&edge] == 1)).collect()
}

/// Edge as the bit patterns of the coordinates of its end points, independent of direction.
type EdgeKey = [[u64; 3]; 2];

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
    // Adding zero turns -0 into +0, so that the bits of both zeros are equal.
    [(point.x + 0.0).to_bits(), (point.y + 0.0).to_bits(), (point.z + 0.0).to_bits()]
}
