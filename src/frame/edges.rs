//! Edges shared between cells of a frame, found by the positions of their ends.

use std::collections::HashMap;

use crate::geometry::Point;

/// Whether some edge of a cell belongs to no other cell, `[N]`.
///
/// Cells made from faces of one mesh repeat the coordinates of a shared node to the last bit, so bits compare.
pub(super) fn edge_cells(corners: &[impl AsRef<[Point]>]) -> Vec<bool> {
    let mut owners: HashMap<[[u64; 3]; 2], usize> = HashMap::new();
    for cell in corners {
        for edge in edges(cell.as_ref()) {
            *owners.entry(edge).or_default() += 1;
        }
    }
    corners.iter().map(|cell| edges(cell.as_ref()).any(|edge| owners[&edge] == 1)).collect()
}

fn edges(cell: &[Point]) -> impl Iterator<Item = [[u64; 3]; 2]> + '_ {
    (0..cell.len()).map(|i| {
        let (a, b) = (bits(&cell[i]), bits(&cell[(i + 1) % cell.len()]));
        if a < b { [a, b] } else { [b, a] }
    })
}

fn bits(point: &Point) -> [u64; 3] {
    // Adding zero turns -0 into +0, so that both compare equal.
    [(point.x + 0.0).to_bits(), (point.y + 0.0).to_bits(), (point.z + 0.0).to_bits()]
}
