//! Products of hierarchical matrices with vectors. Results have the same bits for any number of threads.

use rayon::prelude::*;

use super::matrix::{BlockContent, HierarchicalMatrix, N_PRODUCT_PARTS, StoredBlock};
use crate::linalg::vector::{axpy, dot8};

/// Term `y_target += sign C_component x_source` of a product. x and y, `[planes, N]`, consist of planes. A plane
/// contains one direction of a vector field at all N points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ComponentProduct {
    /// Index of the component.
    pub component: usize,
    /// Plane of x that is multiplied by the component.
    pub source_plane: usize,
    /// Plane of y to which the product is added.
    pub target_plane: usize,
    /// Factor of the term.
    pub sign: f64,
}

const SUMMATION_CHUNK: usize = 1024;

impl HierarchicalMatrix {
    /// Computes `y = Σ sign C_component x`. Each entry of `uses` is one term of the sum. Overwrites `y`.
    ///
    /// x and y are `[planes, N]` in the order of the tree.
    pub fn multiply(&self, uses: &[ComponentProduct], x: &[f64], y: &mut [f64]) {
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        if scratch.len() < N_PRODUCT_PARTS * y.len() {
            scratch.resize(N_PRODUCT_PARTS * y.len(), 0.0);
        }
        let results = &mut scratch[..N_PRODUCT_PARTS * y.len()];
        results.par_chunks_exact_mut(y.len()).zip(&self.parts).with_max_len(1).for_each(|(part, blocks)| {
            part.fill(0.0);
            for block in &self.blocks[blocks.clone()] {
                for one in uses {
                    self.axpy(block, one, x, part);
                }
            }
        });
        let length = y.len();
        y.par_chunks_mut(SUMMATION_CHUNK).enumerate().for_each(|(chunk, sums)| {
            sums.fill(0.0);
            for part in 0..N_PRODUCT_PARTS {
                let from = part * length + chunk * SUMMATION_CHUNK;
                let share = &results[from..from + sums.len()];
                sums.iter_mut().zip(share).for_each(|(sum, value)| *sum += value);
            }
        });
    }

    /// Adds one term for a block and for its mirrored block to `y`.
    fn axpy(&self, block: &StoredBlock, one: &ComponentProduct, x: &[f64], y: &mut [f64]) {
        let n = self.n();
        let (x, y) = (
            &x[one.source_plane * n..(one.source_plane + 1) * n],
            &mut y[one.target_plane * n..(one.target_plane + 1) * n],
        );
        // A block and its mirrored block are skipped if x vanishes on the rows and columns of the block.
        let [x_of_columns, back] = [&block.columns, &block.rows].map(|range| {
            let values = &x[range.clone()];
            values.iter().any(|value| *value != 0.0).then_some(values)
        });
        let x_of_rows = back.filter(|_| !block.is_diagonal());
        if x_of_columns.is_none() && x_of_rows.is_none() {
            return;
        }
        let (mirrored, m) = (one.sign * self.signs[one.component], block.rows.len());
        match &block.content {
            BlockContent::Near(values) => {
                let size = m * block.columns.len();
                let rows = values[one.component * size..(one.component + 1) * size].chunks_exact(size / m);
                for (k, row) in rows.enumerate() {
                    if let Some(x) = x_of_columns {
                        y[block.rows.start + k] += one.sign * dot8(row, x);
                    }
                    if let Some(x) = x_of_rows.filter(|x| x[k] != 0.0) {
                        axpy(&mut y[block.columns.clone()], mirrored * x[k], row);
                    }
                }
            }
            BlockContent::Far(components) => {
                let terms = &components[one.component];
                let mut of =
                    FarBlockProduct { block, x_of_columns, x_of_rows, y, factors: [one.sign, mirrored] };
                of.add_terms(&terms.double);
                of.add_terms(&terms.single);
            }
        }
    }
}

struct FarBlockProduct<'b> {
    block: &'b StoredBlock,
    x_of_columns: Option<&'b [f64]>,
    x_of_rows: Option<&'b [f64]>,
    y: &'b mut [f64],
    factors: [f64; 2],
}

impl FarBlockProduct<'_> {
    fn add_terms<T: Copy + Into<f64>>(&mut self, terms: &[T]) {
        let (rows, columns) = (self.block.rows.clone(), self.block.columns.clone());
        for term in terms.chunks_exact(rows.len() + columns.len()) {
            let (u, v) = term.split_at(rows.len());
            if let Some(x) = self.x_of_columns {
                axpy(&mut self.y[rows.clone()], self.factors[0] * dot8(v, x), u);
            }
            if let Some(x) = self.x_of_rows {
                axpy(&mut self.y[columns.clone()], self.factors[1] * dot8(u, x), v);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::{BlockLayout, BoundingBox, ClusterTree};
    use super::*;

    type Points = Vec<[f64; 2]>;

    fn example() -> (Points, impl Fn([f64; 2], [f64; 2]) -> [f64; 2]) {
        let at = |k: usize| {
            let (i, j) = ((k % 30) as f64, (k / 30) as f64);
            let bend = 0.3 * (i * PI / 7.0).sin();
            if k < 300 { [i + bend, j - bend] } else { [0.3 * i + 40.0, 0.2 * j + bend] }
        };
        let kernel = |a: [f64; 2], b: [f64; 2]| {
            let [x, y] = [a[0] - b[0], a[1] - b[1]];
            let r = x.hypot(y).max(0.5);
            [1.0 / r, (x + 0.3 * y) / (r * r)]
        };
        ((0..600).map(at).collect(), kernel)
    }

    fn matrix(tolerance: f64) -> (HierarchicalMatrix, Points) {
        let (points, kernel) = example();
        let extents: Vec<BoundingBox> =
            points.iter().map(|p| [p.map(|x| x - 0.1), p.map(|x| x + 0.1)]).collect();
        let tree = ClusterTree::new(&points, &extents, 20);
        let ordered: Vec<[f64; 2]> = tree.order.iter().map(|&k| points[k]).collect();
        let entries = |i: usize, j: usize, values: &mut [f64]| {
            values.copy_from_slice(&kernel(ordered[i], ordered[j]));
        };
        let layout = BlockLayout::new(tree, 1.5);
        let expected = layout.sampled_bytes(&entries, 2, tolerance);
        let matrix = layout.fill(&entries, vec![1.0, -1.0], tolerance).expect("nobody wishes to stop");
        let ratio = matrix.bytes() as f64 / expected as f64;
        assert!(ratio > 0.8 && ratio < 1.25, "{ratio}");
        (matrix, ordered)
    }

    /// Two planes: y_0 = C_0 x_0 + C_1 x_1 and y_1 = -C_1 x_0.
    const USES: [ComponentProduct; 3] = [
        ComponentProduct { component: 0, source_plane: 0, target_plane: 0, sign: 1.0 },
        ComponentProduct { component: 1, source_plane: 1, target_plane: 0, sign: 1.0 },
        ComponentProduct { component: 1, source_plane: 0, target_plane: 1, sign: -1.0 },
    ];

    fn planes(n: usize) -> Vec<f64> {
        (0..2 * n).map(|k| ((k * 7919 % 1000) as f64 * 0.37).sin()).collect()
    }

    /// Truth: direct sums over all kernel entries, for vectors with and without zeros. The relative error is 0.001 to 1
    /// times the tolerance.
    #[test]
    fn products_are_sums_over_the_kernel() {
        for tolerance in [1e-4, 1e-8] {
            let (matrix, points) = matrix(tolerance);
            let (_, kernel) = example();
            let n = matrix.n();
            for filled in [0..2 * n, 0..40, n - 30..n + 20] {
                let mut x = planes(n);
                (0..2 * n).filter(|k| !filled.contains(k)).for_each(|k| x[k] = 0.0);
                let mut y = vec![f64::NAN; 2 * n];
                matrix.multiply(&USES, &x, &mut y);
                let (mut error, mut size) = (0.0_f64, 0.0_f64);
                for i in 0..n {
                    let mut sums = [0.0; 2];
                    for j in 0..n {
                        let [even, odd] = kernel(points[i], points[j]);
                        sums[0] += even * x[j] + odd * x[n + j];
                        sums[1] -= odd * x[j];
                    }
                    for (plane, sum) in sums.into_iter().enumerate() {
                        error += (y[plane * n + i] - sum).powi(2);
                        size += sum * sum;
                    }
                }
                let relative = (error / size).sqrt();
                assert!(relative < tolerance && relative > 1e-3 * tolerance, "{tolerance}: {relative}");
            }
        }
    }

    /// Truth: a product has the same bits with one, two and three threads.
    #[test]
    fn threads_do_not_change_bits() {
        let product = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let (matrix, _) = matrix(1e-6);
                let mut y = vec![0.0; 2 * matrix.n()];
                matrix.multiply(&USES, &planes(matrix.n()), &mut y);
                y
            })
        };
        let one = product(1);
        assert!(product(2) == one && product(3) == one);
    }

    /// Truth: products with the weights of one group, summed with the weights of another group. The tolerance allows
    /// for the rounding of 600 terms.
    #[test]
    fn sums_over_groups() {
        let (matrix, _) = matrix(1e-6);
        let n = matrix.n();
        let groups = matrix.tree().clusters_of_size(100);
        let weights: Vec<f64> = (0..n).map(|k| 1.0 + 0.1 * (k as f64).sin()).collect();
        let sums = matrix.group_sums(&groups, &weights);
        for (h, group) in groups.iter().enumerate() {
            let mut x = vec![0.0; 2 * n];
            group.clone().for_each(|k| x[k] = weights[k]);
            let mut y = vec![0.0; 2 * n];
            matrix.multiply(&USES, &x, &mut y);
            for (g, group) in groups.iter().enumerate() {
                let of = |plane: usize| -> f64 { group.clone().map(|k| weights[k] * y[plane * n + k]).sum() };
                let at = g * groups.len() + h;
                assert!((of(0) - sums[0][at]).abs() < 1e-10 * sums[0][at].abs());
                assert!((of(1) + sums[1][at]).abs() < 1e-10 * sums[0][at].abs());
            }
        }
    }
}
