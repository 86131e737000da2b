//! Collocation equations with low-rank far blocks, solved by the generalised minimal residual method (GMRES).
//!
//! As in the dense equations, the diagonal block of a node follows from rigid translations. The block is minus the sum
//! of the compressed off-diagonal blocks. For exterior domains, the unit matrix is added.

use faer::{MatMut, MatRef};
use nalgebra::Matrix3;
use rayon::prelude::*;

use super::collocation::{BoundaryKernel, SummedColumns, TreeOrder, influence, layout};
use super::elements::BoundaryElements;
use super::problem::{BoundaryValueProblem, BoundaryValues, Domain, MAX_DENSE_UNKNOWNS};
use crate::cancel;
use crate::error::{Error, Result};
use crate::geometry::Point;
use crate::linalg::dense::try_zeroed;
use crate::linalg::dense_lu;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::linalg::gmres::{Gmres, KrylovOptions, KrylovReport, LinearSystem};
use crate::linalg::hierarchical::{
    CoarseBlockJacobi, CollocationMatrix, CollocationUnknowns, DiagonalAndBorder,
};

/// Allowed error of an entry, divided by tolerance / √n for n unknowns. If the errors are independent, the error of a
/// row sum is then about the tolerance, relative to the free term 1/2.
const ENTRY_ERROR_SHARE: f64 = 0.5;

const RIGHT_SIDES_PER_BLOCK: usize = 24;

/// Number of Krylov vectors per right-hand side before a restart.
const RESTART: usize = 40;
/// Maximum number of products per right-hand side.
const MAX_GMRES_PRODUCTS: usize = 400;

const TYPICAL_GMRES_PRODUCTS: usize = 12;

const BATCH: usize = 16;

const RESIDUAL_OVER_TOLERANCE: f64 = 0.05;
const MIN_SINGLE_PRECISION_RESIDUAL: f64 = 1e-7;

/// Admissible tolerances. The lower limit follows from the single precision of the blocks.
pub const TOLERANCE_RANGE: [f64; 2] = [1e-6, 1e-2];

/// Typical memory of a far block `[m, n]`, bytes, divided by d² (m + n). The number of digits is d = -log10(tolerance).
const FAR_BYTES_PER_LINE_AND_DIGIT2: f64 = 4.3;

/// Collocation equations of a problem. Far blocks have low rank.
pub struct CompressedEquations {
    tolerance: f64,
    matrix: CollocationMatrix,
    order: TreeOrder,
    diagonal_blocks: Vec<Matrix3<f64>>,
    /// Border columns for the free rigid motions, `[n + motions, motions]`.
    columns: DenseMatrix,
    /// Border rows for the free rigid motions, each stored as a column, `[n, motions]`.
    rows: DenseMatrix,
    /// Right-hand side of each load.
    load_sides: Vec<Vec<f64>>,
    preconditioner: CoarseBlockJacobi,
}

/// Report on a compressed solution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompressionReport {
    /// Tolerance of the blocks.
    pub tolerance: f64,
    /// Largest number of matrix products for a right-hand side.
    pub iterations: usize,
    /// Largest residual of the iteration, relative to the right-hand side.
    pub residual: f64,
    /// Memory of the matrix and its approximate inverse, bytes.
    pub bytes: usize,
}

impl CompressedEquations {
    /// Assembles the equations of a problem and compresses far blocks to `tolerance`.
    ///
    /// # Errors
    /// If memory does not suffice, the tolerance is not admissible, rigid motions are unconstrained, or the run is cancelled.
    pub fn new(problem: &BoundaryValueProblem, tolerance: f64) -> Result<Self> {
        if !(TOLERANCE_RANGE[0]..=TOLERANCE_RANGE[1]).contains(&tolerance) {
            return Err(Error::input(format!(
                "boundary elements cannot be compressed with a tolerance of {tolerance:e}; the tolerance must lie between {:e} and {:e}",
                TOLERANCE_RANGE[0], TOLERANCE_RANGE[1]
            )));
        }
        let (traction_scale, motions) = (problem.traction_scale(), problem.motions());
        let areas = problem.elements.areas();
        let summed_columns = summed_columns(problem, traction_scale, &areas, motions.ncols());
        let layout = layout(problem.elements, summed_columns.count());
        let order = TreeOrder::new(problem.elements, &layout.tree().order);
        let kernel =
            BoundaryKernel { problem, order: &order, traction_scale, motions: &motions, summed_columns };
        let n = 3 * order.nodes.len();
        let error = tolerance * ENTRY_ERROR_SHARE / (n as f64).sqrt();
        let (matrix, sums) = layout.fill(&kernel, error)?;
        let held: Vec<bool> = (0..n).map(|at| problem.displacement_known[order.dof(at)]).collect();
        let row_sums = RowSums { kernel: &kernel, held: &held, sums };
        let mut diagonal_blocks = row_sums.rigid_translation_blocks(&matrix)?;
        let load_sides =
            (0..problem.loads.len()).map(|load| row_sums.load_side(load, &diagonal_blocks)).collect();
        let [columns, rows] = row_sums.motion_border(&areas)?;
        let positions = problem.elements.positions();
        let positions: Vec<Point> = order.nodes.iter().map(|&node| positions[node]).collect();
        for (at, held) in held.iter().enumerate() {
            if *held {
                diagonal_blocks[at / 3].column_mut(at % 3).fill(0.0);
            }
        }
        let additions = DiagonalAndBorder { blocks: &diagonal_blocks, columns: &columns, rows: &rows };
        let preconditioner = CoarseBlockJacobi::new(
            &matrix,
            &additions,
            CollocationUnknowns { positions: &positions, is_traction: &held },
        )?;
        Ok(Self { tolerance, matrix, order, diagonal_blocks, columns, rows, load_sides, preconditioner })
    }

    /// Estimated memory of assembly, `columns` right-hand sides and solution, bytes. Near blocks are counted exactly.
    /// The memory of far blocks is estimated from typical ranks.
    pub fn expected_bytes(elements: &BoundaryElements, columns: usize, tolerance: f64) -> u128 {
        let layout = layout(elements, 0);
        let [near, far] = layout.storage_counts();
        let [making, held] = CoarseBlockJacobi::expected_bytes(&layout);
        let n = 3 * elements.n_nodes();
        let blocks =
            4 * near + (FAR_BYTES_PER_LINE_AND_DIGIT2 * tolerance.log10().powi(2) * far as f64) as usize;
        let sides = rayon::current_num_threads().min(columns.div_ceil(RIGHT_SIDES_PER_BLOCK));
        let iteration = 8 * n * RIGHT_SIDES_PER_BLOCK.min(columns) * (TYPICAL_GMRES_PRODUCTS + 7);
        let parts = blocks + making.max(held + 8 * n * (columns + 12) + sides * iteration);
        parts as u128 + dense_lu::product_buffer_bytes(8 * (n as u128).pow(2))
    }

    /// Memory of the compressed matrix and its approximate inverse, bytes.
    pub fn bytes(&self) -> usize {
        self.matrix.bytes() + self.preconditioner.bytes()
    }

    /// Right-hand sides of the loads (first columns) and of unit tractions of the loaded nodes.
    fn right_sides(&self, problem: &BoundaryValueProblem) -> Result<DenseMatrix> {
        let size = 3 * problem.elements.n_nodes() + self.columns.n_columns();
        let mut right = DenseMatrix::zeros(size, problem.n_right_sides())?;
        for (load, side) in self.load_sides.iter().enumerate() {
            right.column_mut(load).copy_from_slice(side);
        }
        let elements = problem.elements;
        let mut of_element: Vec<Vec<(usize, usize)>> = vec![Vec::new(); elements.n_elements()];
        let place_of = elements.node_locations();
        for (j, &node) in problem.loaded.iter().enumerate() {
            let (element, place) = place_of[node];
            of_element[element].push((j, place));
        }
        let loaded: Vec<usize> =
            (0..of_element.len()).filter(|&element| !of_element[element].is_empty()).collect();
        let kernel_of = |element: usize| {
            let mut columns = vec![[[0.0; 3]; 3]; self.order.nodes.len() * of_element[element].len()];
            let nodes = of_element[element].len();
            for (at, columns) in self.order.node_locations.iter().zip(columns.chunks_exact_mut(nodes)) {
                let influence = influence(elements, *at, element);
                for ((_, place), column) in of_element[element].iter().zip(columns) {
                    *column = influence.single_layer[*place].data.0;
                }
            }
            columns
        };
        for batch in loaded.chunks(BATCH) {
            cancel::check()?;
            let made: Vec<Vec<[[f64; 3]; 3]>> = batch.par_iter().map(|&element| kernel_of(element)).collect();
            for (&element, columns) in batch.iter().zip(&made) {
                let nodes = of_element[element].len();
                for (k, (j, _)) in of_element[element].iter().enumerate() {
                    for c in 0..3 {
                        let to = right.column_mut(problem.loads.len() + 3 * j + c);
                        for (at, values) in columns.chunks_exact(nodes).enumerate() {
                            to[3 * at..3 * at + 3].copy_from_slice(&values[k][c]);
                        }
                    }
                }
            }
        }
        Ok(right)
    }

    /// Unknowns for the loads and for unit tractions of the loaded nodes, `[n + motions, loads + 3 loaded nodes]`.
    ///
    /// # Errors
    /// If the iteration does not converge, memory does not suffice, or the run is cancelled.
    pub(super) fn solve(&self, problem: &BoundaryValueProblem) -> Result<(DenseMatrix, CompressionReport)> {
        let mut all = self.right_sides(problem)?;
        let n = all.n_rows();
        let options = KrylovOptions {
            tolerance: (RESIDUAL_OVER_TOLERANCE * self.tolerance).max(MIN_SINGLE_PRECISION_RESIDUAL),
            max_products: MAX_GMRES_PRODUCTS,
            restart: RESTART,
        };
        let solve = |values: &mut [f64]| {
            let count = values.len() / n;
            let mut system = KrylovSystem { equations: self, count, x: Vec::new(), y: Vec::new() };
            let mut x = try_zeroed(values.len())?;
            let reports = Gmres::default().solve(&mut system, values, &mut x, count, options)?;
            self.reorder(&x, n, values);
            Ok(reports)
        };
        let reports = all
            .values_mut()
            .par_chunks_mut(RIGHT_SIDES_PER_BLOCK * n)
            .with_max_len(1)
            .map(solve)
            .collect::<Result<Vec<Vec<KrylovReport>>>>()?;
        let mut report = CompressionReport {
            tolerance: self.tolerance,
            iterations: 0,
            residual: 0.0,
            bytes: self.bytes(),
        };
        for column in reports.iter().flatten() {
            report.iterations = report.iterations.max(column.n_products);
            // NaN counts as larger than any number.
            if column.residual.abs().total_cmp(&report.residual).is_gt() {
                report.residual = column.residual.abs();
            }
        }
        if report.residual.is_nan() || report.residual > options.tolerance * 1.5 {
            return Err(Error::not_converged(format!(
                "the compressed boundary-element equations did not converge: after {} iterations the residual is {:.1e}, but at most {:.1e} is allowed. Use larger elements away from the contact, or where the body is thin. Equations with at most {} unknowns need no iteration",
                report.iterations, report.residual, options.tolerance, MAX_DENSE_UNKNOWNS
            )));
        }
        Ok((all, report))
    }

    /// Reorders `columns` of `n` rows from tree order to node order.
    fn reorder(&self, columns: &[f64], n: usize, values: &mut [f64]) {
        for (from, to) in columns.chunks_exact(n).zip(values.chunks_exact_mut(n)) {
            for at in 0..3 * self.order.nodes.len() {
                to[self.order.dof(at)] = from[at];
            }
            to[3 * self.order.nodes.len()..].copy_from_slice(&from[3 * self.order.nodes.len()..]);
        }
    }
}

/// Summed columns of the equations, with their scales. `areas`: nodal areas, mm².
fn summed_columns(
    problem: &BoundaryValueProblem,
    traction_scale: f64,
    areas: &[f64],
    n_motions: usize,
) -> SummedColumns {
    let scale = |load: &BoundaryValues| {
        let values = load.at_dofs.iter().zip(problem.displacement_known);
        let size = values.fold(0.0_f64, |size, (value, held)| {
            size.max(value.abs() * if *held { 1.0 } else { 1.0 / traction_scale })
        });
        if size > 0.0 { size } else { 1.0 }
    };
    let area: f64 = areas.iter().sum();
    let largest = areas.iter().fold(0.0_f64, |largest, area| largest.max(*area));
    SummedColumns {
        prescribed_translations: problem.displacement_known.contains(&true),
        load_scales: problem.loads.iter().map(scale).collect(),
        motions: ((largest / area).sqrt(), n_motions),
    }
}

struct RowSums<'a> {
    kernel: &'a BoundaryKernel<'a>,
    /// Whether the displacement of each dof is prescribed, in tree order.
    held: &'a [bool],
    /// Additional columns of the equations, summed over all elements, `[n, summed columns]`.
    sums: DenseMatrix,
}

impl RowSums<'_> {
    /// Diagonal blocks of the displacements. Each is minus the sum of the other blocks of its row, plus the unit matrix
    /// for exterior domains.
    fn rigid_translation_blocks(&self, matrix: &CollocationMatrix) -> Result<Vec<Matrix3<f64>>> {
        let n = matrix.n();
        let (mut translations, mut moved) = (DenseMatrix::zeros(n, 3)?, DenseMatrix::zeros(n, 3)?);
        for (at, held) in self.held.iter().enumerate() {
            translations.column_mut(at % 3)[at] = if *held { 0.0 } else { 1.0 };
        }
        matrix.add_product(translations.view(), moved.view_mut());
        if self.held.contains(&true) {
            for c in 0..3 {
                let to = moved.column_mut(c).iter_mut();
                to.zip(self.sums.column(c)).for_each(|(to, sum)| *to += sum);
            }
        }
        let far = match self.kernel.problem.domain {
            Domain::Interior => Matrix3::zeros(),
            Domain::Exterior => Matrix3::identity(),
        };
        let of_node = |node: usize| far - Matrix3::from_fn(|r, c| moved.at(3 * node + r, c));
        Ok((0..n / 3).map(of_node).collect())
    }

    fn load_side(&self, load: usize, diagonal_blocks: &[Matrix3<f64>]) -> Vec<f64> {
        let BoundaryKernel { problem, order, motions, summed_columns, .. } = self.kernel;
        let values = &problem.loads[load];
        let (n, n_nodes) = (self.held.len(), order.nodes.len());
        let mut right = vec![0.0; n + motions.ncols()];
        let at = 3 * usize::from(summed_columns.prescribed_translations) + load;
        let scale = summed_columns.load_scales[load];
        right.iter_mut().zip(self.sums.column(at)).for_each(|(right, sum)| *right = scale * sum);
        for at in (0..n).filter(|&at| self.held[at]) {
            let column = diagonal_blocks[at / 3].column(at % 3) * values.at_dofs[order.dof(at)];
            (0..3).for_each(|r| right[at - at % 3 + r] -= column[r]);
        }
        for j in 0..motions.ncols() {
            right[n + j] = values.mean_displacement.get(j).map_or(0.0, |u| u * n_nodes as f64);
        }
        right
    }

    /// Border columns and rows for the free rigid motions. `areas`: nodal areas, mm².
    fn motion_border(&self, areas: &[f64]) -> Result<[DenseMatrix; 2]> {
        let BoundaryKernel { order, motions, summed_columns, .. } = self.kernel;
        let n = self.held.len();
        let mut columns = DenseMatrix::zeros(n + motions.ncols(), motions.ncols())?;
        let mut rows = DenseMatrix::zeros(n, motions.ncols())?;
        let mean = areas.iter().sum::<f64>() / areas.len() as f64;
        for j in 0..motions.ncols() {
            let sums = self.sums.column(summed_columns.count() - summed_columns.motions.1 + j);
            let to = columns.column_mut(j).iter_mut();
            to.zip(sums).for_each(|(to, sum)| *to = sum / summed_columns.motions.0);
            for at in (0..n).filter(|&at| !self.held[at]) {
                let dof = order.dof(at);
                rows.column_mut(j)[at] = motions[(dof, j)] * areas[dof / 3] / mean;
            }
        }
        Ok([columns, rows])
    }
}

/// Equations for `count` right-hand sides. The buffers `x` and `y` hold vectors and their products with the blocks, in
/// single precision like the blocks.
struct KrylovSystem<'a> {
    equations: &'a CompressedEquations,
    count: usize,
    x: Vec<f32>,
    y: Vec<f32>,
}

impl LinearSystem for KrylovSystem<'_> {
    fn apply(&mut self, x: &[f64], image: &mut [f64]) {
        let CompressedEquations { matrix, diagonal_blocks, columns, rows, .. } = self.equations;
        let (n, size) = (matrix.n(), x.len() / self.count);
        for (from, to) in x.chunks_exact(size).zip(image.chunks_exact_mut(size)) {
            for (node, own) in diagonal_blocks.iter().enumerate() {
                let product = own * Point::from_column_slice(&from[3 * node..3 * node + 3]);
                to[3 * node..3 * node + 3].copy_from_slice(product.as_slice());
            }
            to[n..].fill(0.0);
            for b in 0..columns.n_columns() {
                to.iter_mut().zip(columns.column(b)).for_each(|(to, value)| *to += value * from[n + b]);
                to[n + b] += rows.column(b).iter().zip(from).map(|(row, x)| row * x).sum::<f64>();
            }
        }
        self.x.clear();
        self.x.extend(x.iter().map(|value| *value as f32));
        self.y.clear();
        self.y.resize(x.len(), 0.0);
        let to = MatMut::from_column_major_slice_mut(&mut self.y[..], size, self.count);
        matrix.add_product(MatRef::from_column_major_slice(&self.x, size, self.count), to);
        image.iter_mut().zip(&self.y).for_each(|(to, value)| *to += f64::from(*value));
    }

    fn precondition(&mut self, image: &[f64], x: &mut [f64]) {
        self.equations.preconditioner.apply(image, x, self.count);
    }
}
