//! Correction of the half-space operator on the frame. It is a polynomial in the positions of the force and of the
//! displacement.

use super::chebyshev::Chebyshev;
use super::patch::ContactPatch;
use crate::geometry::Side;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::linalg::simd::wide;
use crate::quadrature::gauss_legendre;

/// Correction of the gap at (x, y) due to a unit force at (x', y'): Σ L_a(x) L_b(y) Ĉ_ab,cd L_c(x') L_d(y'), axes of
/// the frame. L are the Lagrange polynomials through the Chebyshev nodes, Ĉ is the correction between these nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct FarField {
    nodes: [Chebyshev; 2],
    /// Whether the y axis of the patch is opposite to the y axis of the frame.
    y_flipped: bool,
    /// Gap per force at the nodes, mm/N, `[3 m_x m_y]²`. Component i at node (a, b) has index (i m_x + a) m_y + b.
    matrix: Vec<f64>,
}

/// Polynomials of a far field, averaged over the cells of a grid. m_x and m_y are the numbers of polynomial nodes along
/// x and y.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct FarFieldOnGrid {
    pub cells: [usize; 2],
    /// Cell means of the polynomials in x, `[cells along x, m_x]`.
    x: Vec<f64>,
    /// Cell means of the polynomials in y, `[m_y, cells along y]`.
    y: Vec<f64>,
    nodes_per_side: [usize; 2],
    pub area: f64,
}

pub(super) struct FarFieldScratch {
    pub rows: Vec<f64>,
    pub forces: Vec<f64>,
    pub gaps: Vec<f64>,
}

impl FarField {
    /// Far field of the body at `side`. `matrix` is the correction between forces at `m` = [m_x, m_y] nodes, in axes of
    /// the patch. Force i = a m_y + b acts at node a along x and node b along y.
    pub(super) fn new(matrix: &DenseMatrix, m: [usize; 2], patch: &ContactPatch, side: Side) -> Self {
        let nodes = [0, 1].map(|axis| Chebyshev::new(m[axis], patch.half_width[axis]));
        let matrix = by_planes(matrix, side);
        Self { nodes, y_flipped: side == Side::Upper, matrix }
    }

    /// Number of polynomial nodes along x and y.
    pub fn nodes_per_side(&self) -> [usize; 2] {
        [0, 1].map(|axis| self.nodes[axis].nodes().len())
    }

    /// Averages the polynomials over `cells` of a grid. The first cell begins at `first` relative to the patch centre,
    /// axes of the frame.
    pub(super) fn on_grid(&self, cells: [usize; 2], spacing: [f64; 2], first: [f64; 2]) -> FarFieldOnGrid {
        let nodes_per_side = self.nodes_per_side();
        let [x, y] = [0, 1].map(|axis| {
            let turned = axis == 1 && self.y_flipped;
            self.nodes[axis].means(cells[axis], spacing[axis], first[axis], turned)
        });
        let n = cells[1];
        let by_node = (0..nodes_per_side[1] * n).map(|k| y[(k % n) * nodes_per_side[1] + k / n]).collect();
        FarFieldOnGrid { cells, x, y: by_node, nodes_per_side, area: spacing[0] * spacing[1] }
    }

    fn on_frame(&self, grid: &crate::frame::Grid) -> FarFieldOnGrid {
        self.on_grid(grid.cells, grid.spacing, grid.half_width().map(|half| -half))
    }

    pub(super) fn entries(&self) -> &[f64] {
        &self.matrix
    }

    fn multiply(&self, planes: std::ops::Range<usize>, forces: &[f64], gaps: &mut [f64]) {
        let [mx, my] = self.nodes_per_side();
        let (n, first) = (mx * my, planes.start * mx * my);
        let size = planes.len() * n;
        for (row, gap) in gaps[..size].iter_mut().enumerate() {
            let entries = &self.matrix[(first + row) * 3 * n + first..][..size];
            *gap = entries.iter().zip(&forces[..size]).map(|(entry, force)| entry * force).sum();
        }
    }

    /// Forces at the nodes of the patch that replace the `tractions` in the cells `places` of `grid`, axes of the
    /// patch. Component i at node (a, b) has index 3 (a m_y + b) + i.
    pub(super) fn forces(
        &self,
        grid: &crate::frame::Grid,
        places: Option<&[usize]>,
        tractions: &[f64],
    ) -> Vec<f64> {
        let on_grid = self.on_frame(grid);
        let mut work = FarFieldScratch::new(&on_grid);
        let (all, n) = (grid.cells[0] * grid.cells[1], tractions.len() / 3);
        let nodes = self.nodes_per_side()[0] * self.nodes_per_side()[1];
        let mut forces = vec![0.0; 3 * nodes];
        for c in 0..3 {
            let own = &tractions[c * n..(c + 1) * n];
            let mut plane = vec![0.0; all];
            match places {
                Some(places) => {
                    places.iter().zip(own).for_each(|(&place, traction)| plane[place] = *traction)
                }
                None => plane.copy_from_slice(own),
            }
            let sign = if self.y_flipped && c > 0 { -1.0 } else { 1.0 };
            let mut at_nodes = vec![0.0; nodes];
            on_grid.gather(&plane, &mut work.rows, &mut at_nodes);
            at_nodes.iter().enumerate().for_each(|(i, force)| forces[3 * i + c] = sign * force);
        }
        forces
    }

    /// Means over the cells `places` of an interpolated displacement, axes of the frame, component by component. The
    /// nodal values `at_nodes` are in axes of the patch, with the indices of [`Self::forces`].
    pub(super) fn cell_means(
        &self,
        grid: &crate::frame::Grid,
        places: Option<&[usize]>,
        at_nodes: &[f64],
    ) -> Vec<f64> {
        let on_grid = self.on_frame(grid);
        let mut work = FarFieldScratch::new(&on_grid);
        let mut all = Vec::new();
        for c in 0..3 {
            let sign = if self.y_flipped && c > 0 { -1.0 } else { 1.0 };
            let values: Vec<f64> = at_nodes.iter().skip(c).step_by(3).map(|value| sign * value).collect();
            let mut plane = vec![0.0; grid.cells[0] * grid.cells[1]];
            on_grid.scatter(&values, &mut work.rows, &mut plane);
            match places {
                Some(places) => all.extend(places.iter().map(|&place| plane[place])),
                None => all.append(&mut plane),
            }
        }
        all
    }

    /// Gap component `a` at node `i` due to a unit force along `b` at node `j`, mm/N.
    fn entry(&self, (a, i): (usize, usize), (b, j): (usize, usize)) -> f64 {
        let n = self.nodes_per_side()[0] * self.nodes_per_side()[1];
        self.matrix[(a * n + i) * 3 * n + b * n + j]
    }
}

/// Transforms the matrix from axes of the patch to axes of the frame. Sorts rows and columns by component instead of by
/// node. The result is stored row by row.
fn by_planes(matrix: &DenseMatrix, side: Side) -> Vec<f64> {
    // The patch axes of body 2 are the axes of the frame, rotated by half a turn about x.
    let sign = |c: usize| if side == Side::Upper && c > 0 { -1.0 } else { 1.0 };
    let (n_rows, n_columns) = (matrix.n_rows(), matrix.n_columns());
    let mut planes = vec![0.0; n_rows * n_columns];
    let at = |k: usize, n: usize| (k % 3) * (n / 3) + k / 3;
    for column in 0..n_columns {
        for row in 0..n_rows {
            planes[at(row, n_rows) * n_columns + at(column, n_columns)] =
                sign(row % 3) * sign(column % 3) * matrix.at(row, column);
        }
    }
    planes
}

impl Chebyshev {
    /// Means of the Lagrange polynomials over consecutive cells, `[cells, m]`. If `turned` is set, the polynomials are
    /// evaluated at -x instead of x.
    pub(super) fn means(&self, cells: usize, spacing: f64, first: f64, turned: bool) -> Vec<f64> {
        let m = self.nodes().len();
        let rule = gauss_legendre(m / 2 + 1);
        let mut means = vec![0.0; cells * m];
        let mut values = vec![0.0; m];
        for (cell, means) in means.chunks_exact_mut(m).enumerate() {
            for &(xi, weight) in &rule {
                let x = first + spacing * (cell as f64 + 0.5 + 0.5 * xi);
                self.lagrange(if turned { -x } else { x }, &mut values);
                means.iter_mut().zip(&values).for_each(|(mean, value)| *mean += 0.5 * weight * value);
            }
        }
        means
    }
}

impl FarFieldScratch {
    pub fn new(grid: &FarFieldOnGrid) -> Self {
        let n = 3 * grid.nodes_per_side[0] * grid.nodes_per_side[1];
        Self {
            rows: vec![0.0; grid.cells[0] * grid.nodes_per_side[1]],
            forces: vec![0.0; n],
            gaps: vec![0.0; n],
        }
    }
}

impl FarFieldOnGrid {
    /// Adds the far-field gap of the cells due to the cell tractions to `gap`, for the components in the range
    /// `planes`.
    pub fn add_product(
        &self,
        field: &FarField,
        planes: std::ops::Range<usize>,
        tractions: &[f64],
        gap: &mut [f64],
        work: &mut FarFieldScratch,
    ) {
        let n = self.nodes_per_side[0] * self.nodes_per_side[1];
        let cells = self.cells[0] * self.cells[1];
        for (plane, forces) in tractions.chunks_exact(cells).zip(work.forces.chunks_exact_mut(n)) {
            self.gather(plane, &mut work.rows, forces);
        }
        field.multiply(planes, &work.forces, &mut work.gaps);
        for (plane, gaps) in gap.chunks_exact_mut(cells).zip(work.gaps.chunks_exact(n)) {
            self.scatter(gaps, &mut work.rows, plane);
        }
    }

    pub fn gather(&self, plane: &[f64], rows: &mut [f64], forces: &mut [f64]) {
        let [mx, my] = self.nodes_per_side;
        sum_rows(plane, &self.y, my, rows);
        forces.fill(0.0);
        for (sums, x) in rows.chunks_exact(my).zip(self.x.chunks_exact(mx)) {
            for (forces, x) in forces.chunks_exact_mut(my).zip(x) {
                forces.iter_mut().zip(sums).for_each(|(force, sum)| *force += self.area * x * sum);
            }
        }
    }

    /// Interpolates the nodal gaps of one component, and adds their cell means to `plane`.
    pub fn scatter(&self, gaps: &[f64], rows: &mut [f64], plane: &mut [f64]) {
        let [mx, my] = self.nodes_per_side;
        for (row, x) in rows.chunks_exact_mut(my).zip(self.x.chunks_exact(mx)) {
            row.fill(0.0);
            for (gaps, x) in gaps.chunks_exact(my).zip(x) {
                row.iter_mut().zip(gaps).for_each(|(value, gap)| *value += x * gap);
            }
        }
        add_rows(rows, &self.y, my, plane);
    }

    /// Means of the polynomials of all nodes over one cell, `[m_x m_y]`.
    pub fn cell_weights(&self, cell: usize) -> Vec<f64> {
        let ([mx, my], ny) = (self.nodes_per_side, self.cells[1]);
        let (ix, iy) = (cell / ny, cell % ny);
        (0..mx * my).map(|k| self.x[ix * mx + k / my] * self.y[(k % my) * ny + iy]).collect()
    }

    /// Gap of one cell due to the traction on another cell. `to` and `from` are the [`Self::cell_weights`] of these two
    /// cells.
    pub fn block(&self, field: &FarField, to: &[f64], from: &[f64]) -> nalgebra::Matrix3<f64> {
        nalgebra::Matrix3::from_fn(|a, b| {
            let row =
                |i: usize| from.iter().enumerate().map(|(j, v)| field.entry((a, i), (b, j)) * v).sum::<f64>();
            to.iter().enumerate().map(|(i, value)| value * row(i)).sum::<f64>() * self.area
        })
    }

    pub fn add_diagonal(&self, field: &FarField, blocks: &mut [nalgebra::Matrix3<f64>]) {
        let ([mx, my], [nx, ny]) = (self.nodes_per_side, self.cells);
        let mut along = vec![nalgebra::Matrix3::<f64>::zeros(); mx * mx];
        for iy in 0..ny {
            for (k, sum) in along.iter_mut().enumerate() {
                let (a, c) = (k / mx, k % mx);
                *sum = nalgebra::Matrix3::from_fn(|i, j| {
                    let pairs = (0..my * my).map(|l| (l / my, l % my));
                    let term = |(b, d): (usize, usize)| {
                        self.y[b * ny + iy]
                            * self.y[d * ny + iy]
                            * field.entry((i, a * my + b), (j, c * my + d))
                    };
                    pairs.map(term).sum()
                });
            }
            for ix in 0..nx {
                let x = &self.x[ix * mx..(ix + 1) * mx];
                let block = &mut blocks[ix * ny + iy];
                for (k, sum) in along.iter().enumerate() {
                    *block += sum * (self.area * x[k / mx] * x[k % mx]);
                }
            }
        }
    }
}

/// Scalar products of each row of `plane` with each of the `m` rows of `y`, `[n_rows, m]`.
fn sum_rows(plane: &[f64], y: &[f64], m: usize, sums: &mut [f64]) {
    wide!(sum_rows_in(plane => plane: &[f64], y => y: &[f64], m => m: usize, sums => sums: &mut [f64]));
}

/// Adds in eight partial sums with a fixed order, so that the result is reproducible.
#[inline(always)]
fn sum_rows_in(plane: &[f64], y: &[f64], m: usize, sums: &mut [f64]) {
    const LANES: usize = 8;
    let n = y.len() / m;
    for (row, sums) in plane.chunks_exact(n).zip(sums.chunks_exact_mut(m)) {
        for (sum, y) in sums.iter_mut().zip(y.chunks_exact(n)) {
            let mut lanes = [0.0; LANES];
            for (a, b) in row.chunks_exact(LANES).zip(y.chunks_exact(LANES)) {
                (0..LANES).for_each(|k| lanes[k] += a[k] * b[k]);
            }
            let rest = n - n % LANES;
            let rest: f64 = row[rest..].iter().zip(&y[rest..]).map(|(a, b)| a * b).sum();
            *sum = lanes.iter().sum::<f64>() + rest;
        }
    }
}

/// Adds to each row of `plane` the `m` rows of `y` times the `weights` of this row, `[n_rows, m]`.
fn add_rows(weights: &[f64], y: &[f64], m: usize, plane: &mut [f64]) {
    wide!(add_rows_in(weights => weights: &[f64], y => y: &[f64], m => m: usize, plane => plane: &mut [f64]));
}

#[inline(always)]
fn add_rows_in(weights: &[f64], y: &[f64], m: usize, plane: &mut [f64]) {
    const BLOCK: usize = 64;
    let n = y.len() / m;
    for (weights, row) in weights.chunks_exact(m).zip(plane.chunks_exact_mut(n)) {
        for (k, part) in row.chunks_mut(BLOCK).enumerate() {
            for (weight, y) in weights.iter().zip(y.chunks_exact(n)) {
                let y = &y[k * BLOCK..][..part.len()];
                part.iter_mut().zip(y).for_each(|(sum, y)| *sum += weight * y);
            }
        }
    }
}
