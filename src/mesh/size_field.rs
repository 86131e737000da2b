//! Target element sizes of the next mesh, at the nodes of the present mesh.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::{CellRef, Mesh};
use crate::element::ElementKind;

/// Edge length of the regular solid of kind `kind` with the volume `volume`.
pub fn edge_length(kind: ElementKind, volume: f64) -> f64 {
    let unit = match kind.n_corners() {
        4 => 1.0 / 72f64.sqrt(),
        5 => 1.0 / 18f64.sqrt(),
        6 => 3f64.sqrt() / 4.0,
        _ => 1.0,
    };
    (volume / unit).cbrt()
}

/// Bounds of a size field.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeBounds {
    /// Smallest size.
    pub least: f64,
    /// Largest size.
    pub largest: f64,
    /// Largest increase of the size per distance.
    pub growth: f64,
}

/// Sizes at the corner nodes of the solids; 0 at all other points. A size is the geometric mean of the `wanted` sizes of the
/// adjacent solids, within the bounds of size and growth. `wanted` is in the order of [`Mesh::volume_cells`], `[n_cells]`.
pub fn nodal_sizes(mesh: &Mesh, wanted: &[f64], bounds: &SizeBounds) -> Vec<f64> {
    let cells: Vec<CellRef> = mesh.volume_cells().collect();
    let corners = |cell: CellRef| &mesh.cell_nodes(cell)[..mesh.kind(cell).n_corners()];
    let (mut sum, mut count) = (vec![0.0; mesh.n_points()], vec![0.0f64; mesh.n_points()]);
    let mut cells_at: Vec<Vec<usize>> = vec![Vec::new(); mesh.n_points()];
    for (i, (&cell, size)) in cells.iter().zip(wanted).enumerate() {
        for &node in corners(cell) {
            sum[node] += size.ln();
            count[node] += 1.0;
            cells_at[node].push(i);
        }
    }
    let mean = |(sum, count): (&f64, &f64)| {
        if *count > 0.0 { (sum / count).exp().clamp(bounds.least, bounds.largest) } else { 0.0 }
    };
    let mut sizes: Vec<f64> = sum.iter().zip(&count).map(mean).collect();
    // Dijkstra's search from the smallest size. The bits of positive floats sort like the floats.
    let mut queue: BinaryHeap<Reverse<(u64, usize)>> =
        (0..sizes.len()).filter(|&i| sizes[i] > 0.0).map(|i| Reverse((sizes[i].to_bits(), i))).collect();
    while let Some(Reverse((bits, node))) = queue.pop() {
        if bits != sizes[node].to_bits() {
            continue;
        }
        for &other in cells_at[node].iter().flat_map(|&i| corners(cells[i])) {
            let distance =
                (0..3).map(|c| (mesh.points[node][c] - mesh.points[other][c]).powi(2)).sum::<f64>();
            let allowed = sizes[node] + bounds.growth * distance.sqrt();
            if allowed < sizes[other] {
                sizes[other] = allowed;
                queue.push(Reverse((allowed.to_bits(), other)));
            }
        }
    }
    sizes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured::GradedBlock;

    /// Truth: the known volumes of the regular solids of edge 2 give the edge length 2.
    #[test]
    fn edges_of_regular_solids() {
        for (kind, volume) in [
            (ElementKind::Tet4, 8.0 / 72f64.sqrt()),
            (ElementKind::Pyramid5, 8.0 / 18f64.sqrt()),
            (ElementKind::Wedge6, 2.0 * 3f64.sqrt()),
            (ElementKind::Hex20, 8.0),
        ] {
            assert!((edge_length(kind, volume) - 2.0).abs() < 1e-14);
        }
    }

    /// Truth: beyond the cell of the smallest size, the size grows along the edges of the block by `growth` times the distance.
    #[test]
    fn sizes_grow_no_faster_than_allowed() {
        let mesh = GradedBlock::uniform([2.0, 2.0], 4.0, [4, 4, 4]).mesh().unwrap();
        let mut wanted = vec![5.0; 64];
        wanted[0] = 1e-6;
        let sizes = nodal_sizes(&mesh, &wanted, &SizeBounds { least: 0.1, largest: 3.0, growth: 0.5 });
        let outermost = |&node: &usize| {
            let [x, y, z] = mesh.points[node];
            x.abs() == 2.0 && y.abs() == 2.0 && (z + 2.0).abs() == 2.0
        };
        let first = mesh.cell_nodes(mesh.volume_cells().next().unwrap());
        let corner = first.iter().copied().find(outermost).unwrap();
        assert!((sizes[corner] - 0.1).abs() < 1e-15, "the corner of one cell only");
        for (x, size) in mesh.points.iter().zip(&sizes) {
            let distance = (0..3).map(|c| (x[c] - mesh.points[corner][c]).powi(2)).sum::<f64>().sqrt();
            assert!(*size <= 3.0 && *size >= 0.1 && *size <= 0.1 + 0.5 * 3.0 * distance);
            let along_edges = (0..3).filter(|&c| x[c] != mesh.points[corner][c]).count() == 1;
            if along_edges && distance > 1.5 {
                assert!((size - (0.1 + 0.5 * (distance - 1.0))).abs() < 1e-12, "{size} at {distance}");
            }
        }
    }
}
