//! Compressed flexibility of half-spaces on any plane frame: low-rank blocks between distant clusters of cells.

use std::sync::{Mutex, OnceLock};

use nalgebra::{Matrix3, Vector3};

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::bem::half_space::integrals::cell_influence::{
    Cell, CellInfluence, row_and_column, tolerance_shares,
};
use crate::bem::half_space::integrals::patch::PatchIntegrator;
use crate::bem::half_space::plane::dense::validate_cells;
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::per_cell::PerCell;
use crate::linalg::additive_schwarz::AdditiveSchwarz;
use crate::linalg::hierarchical::{
    BlockLayout, BoundingBox, ClusterTree, ComponentProduct, HierarchicalMatrix,
};
use crate::linalg::memory::MemoryLimit;

const LEAF: usize = 48;

/// Two clusters are admissible, with a low-rank block, if the smaller diameter is at most this multiple of their
/// distance.
const ADMISSIBILITY: f64 = 3.0;

/// Maximum number of cells of a frame for the dense operator.
pub const MAX_DENSE_CELLS: usize = 1000;

/// Default relative tolerance of the compressed operator.
pub const DEFAULT_TOLERANCE: f64 = 1e-8;

/// Typical memory of a far block `[m, n]` per kernel component, bytes, divided by d² (m + n). The number of digits is
/// d = -log10(tolerance).
const FAR_BYTES_PER_LINE_AND_DIGIT2: f64 = 1.9;

/// Typical time of the build for n cells on two cores, seconds, divided by n ln n × (number of kernel components) × d².
/// The number of digits is d = -log10(tolerance).
const BUILD_SECONDS_PER_CELL: f64 = 2e-7;

/// Advice if memory does not suffice.
pub const MEMORY_HELP: &str = "use a coarser frame or a grid frame, or raise solver.compression_tolerance";

/// Admissible tolerances.
pub const TOLERANCE_RANGE: [f64; 2] = [1e-12, 1e-2];

/// Compressed operator S of half-spaces on a plane frame of arbitrary convex cells with constant tractions.
///
/// Its products equal products with [`DenseFlexibility`](crate::bem::half_space::DenseFlexibility) within a tolerance.
/// The symmetric matrix F = S A^-1 with the cell areas A is stored in hierarchical blocks (see
/// [`hierarchical`](crate::linalg::hierarchical)).
///
/// # Source
/// docs/theory-half-space.md, operators on the frame.
pub struct CompressedFlexibility {
    matrix: HierarchicalMatrix,
    pairs: CellInfluence,
    all: Vec<ComponentProduct>,
    /// Products of the normal block of S, for the pressure alone.
    normal: Vec<ComponentProduct>,
    /// Position in the tree and area of each cell.
    place_and_area: Vec<(usize, f64)>,
    integrator: PatchIntegrator,
    inverses: [OnceLock<AdditiveSchwarz>; 2],
    /// Two vectors `[3, N]` in tree order, for input and result.
    scratch: Mutex<[Vec<f64>; 2]>,
}

impl CompressedFlexibility {
    /// Computes the operator from the arguments of
    /// [`DenseFlexibility::new`](crate::bem::half_space::DenseFlexibility::new). Products with a vector x differ from
    /// products with the dense operator by about `tolerance` ‖S‖ ‖x‖.
    ///
    /// # Errors
    /// - If the lengths differ or are zero, a number is not finite, or a cell is not a counter-clockwise polygon of
    ///   positive area.
    /// - If the tolerance is not within [`TOLERANCE_RANGE`].
    /// - If the operator does not fit into the machine's memory, or the run is cancelled.
    pub fn new(
        centers: &[[f64; 2]],
        corners: &[Vec<[f64; 2]>],
        areas: &[f64],
        green: &SurfaceGreen,
        tolerance: f64,
    ) -> Result<Self> {
        Self::within_memory(centers, corners, areas, green, tolerance, &MemoryLimit::of_machine())
    }

    /// As [`Self::new`] with a memory `limit`.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn within_memory(
        centers: &[[f64; 2]],
        corners: &[Vec<[f64; 2]>],
        areas: &[f64],
        green: &SurfaceGreen,
        tolerance: f64,
        limit: &MemoryLimit,
    ) -> Result<Self> {
        validate_cells(centers, corners, areas)?;
        if !(TOLERANCE_RANGE[0]..=TOLERANCE_RANGE[1]).contains(&tolerance) {
            return Err(Error::input(format!(
                "an operator cannot be compressed with a tolerance of {tolerance:e}; the tolerance must lie between {:e} and {:e}",
                TOLERANCE_RANGE[0], TOLERANCE_RANGE[1]
            )));
        }
        let layout = layout(centers, corners, areas);
        let order = &layout.tree().order;
        let ordered = order.iter().map(|&cell| Cell::new(centers[cell], corners[cell].clone(), areas[cell]));
        let mut places = vec![(0, 0.0); order.len()];
        order.iter().enumerate().for_each(|(place, &cell)| places[cell] = (place, areas[cell]));
        let pairs = CellInfluence::new(ordered.collect(), green, tolerance);
        let components = pairs.components();
        let entries = |i: usize, j: usize, values: &mut [f64]| pairs.entry(i, j, values);
        let bytes = layout.sampled_bytes(&entries, components.len(), tolerance)
            + auxiliary_bytes(centers.len(), corners.iter().map(Vec::len).sum());
        let what = format!("the compressed operator on {} cells", centers.len());
        limit.ensure_available(bytes as u128, &what, MEMORY_HELP)?;
        let uses = |(component, entry): (usize, &KernelComponent)| {
            let (row, column) = row_and_column(*entry);
            let one = ComponentProduct { component, source_plane: column, target_plane: row, sign: 1.0 };
            let sign = if matches!(entry, KernelComponent::Odd(_)) { -1.0 } else { 1.0 };
            let mirrored = ComponentProduct { component, source_plane: row, target_plane: column, sign };
            [Some(one), (row != column).then_some(mirrored)].into_iter().flatten()
        };
        let all: Vec<ComponentProduct> = components.iter().enumerate().flat_map(uses).collect();
        let normal = all.iter().filter(|one| (one.source_plane, one.target_plane) == (2, 2));
        let normal =
            normal.map(|one| ComponentProduct { source_plane: 0, target_plane: 0, ..*one }).collect();
        let signs = components.iter().map(|c| if matches!(c, KernelComponent::Odd(_)) { -1.0 } else { 1.0 });
        let matrix = layout.fill(&entries, signs.collect(), tolerance)?;
        let n = centers.len();
        Ok(Self {
            matrix,
            all,
            normal,
            place_and_area: places,
            integrator: PatchIntegrator::new(green),
            inverses: [OnceLock::new(), OnceLock::new()],
            scratch: Mutex::new([vec![0.0; 3 * n], vec![0.0; 3 * n]]),
            pairs,
        })
    }

    /// Estimated memory, bytes, with an error of up to a third. Near blocks are counted exactly. The memory of far
    /// blocks is estimated from typical ranks for the tolerance. [`Self::new`] has the same arguments but uses a more
    /// accurate estimate.
    pub fn typical_bytes(
        centers: &[[f64; 2]],
        corners: &[Vec<[f64; 2]>],
        areas: &[f64],
        green: &SurfaceGreen,
        tolerance: f64,
    ) -> usize {
        let layout = layout(centers, corners, areas);
        auxiliary_bytes(centers.len(), corners.iter().map(Vec::len).sum())
            + layout.estimated_bytes(
                green.nonzero_components().len(),
                tolerance,
                FAR_BYTES_PER_LINE_AND_DIGIT2,
            )
    }

    /// Typical build time for `n` cells on two cores, seconds, to within a factor of about two.
    pub fn typical_build_seconds(n: usize, green: &SurfaceGreen, tolerance: f64) -> f64 {
        let (n, components) = (n as f64, green.nonzero_components().len() as f64);
        BUILD_SECONDS_PER_CELL * n * n.ln() * components * tolerance.log10().powi(2)
    }

    /// Current memory, bytes, including the approximate inverses built so far.
    pub fn bytes(&self) -> usize {
        let inverses: usize =
            self.inverses.iter().filter_map(OnceLock::get).map(AdditiveSchwarz::bytes).sum();
        self.matrix.bytes() + self.pairs.bytes() + inverses
    }

    /// Applies `with` to `x` in tree order and writes the result to `y`. The input of a cell is multiplied by
    /// `factor(area)` and its result by `back(area)`, with the area of the cell.
    fn in_order(
        &self,
        x: &[f64],
        y: &mut [f64],
        factor: impl Fn(f64) -> f64,
        with: impl FnOnce(&[f64], &mut [f64]),
        back: impl Fn(f64) -> f64,
    ) {
        let n = self.place_and_area.len();
        let mut scratch = self.scratch.lock().expect("no panic while the scratch is held");
        let [from, to] = &mut *scratch;
        let (from, to) = (&mut from[..x.len()], &mut to[..y.len()]);
        for (values, from) in x.chunks_exact(n).zip(from.chunks_exact_mut(n)) {
            for (value, (place, area)) in values.iter().zip(&self.place_and_area) {
                from[*place] = value * factor(*area);
            }
        }
        with(from, to);
        for (values, to) in y.chunks_exact_mut(n).zip(to.chunks_exact(n)) {
            for (value, (place, area)) in values.iter_mut().zip(&self.place_and_area) {
                *value = to[*place] * back(*area);
            }
        }
    }

    fn multiply(&self, uses: &[ComponentProduct], x: &[f64], y: &mut [f64]) {
        let scale = self.pairs.scale();
        let product = |x: &[f64], y: &mut [f64]| self.matrix.multiply(uses, x, y);
        self.in_order(x, y, |area| area, product, |_| 1.0 / scale);
    }

    /// Multiplies by an approximation of S⁻¹ = A⁻¹ F⁻¹.
    fn apply_approximate_inverse(&self, which: usize, uses: &[ComponentProduct], x: &[f64], y: &mut [f64]) {
        let (scale, n) = (self.pairs.scale(), self.place_and_area.len());
        let make = || {
            let mut weights = vec![0.0; n];
            self.place_and_area.iter().for_each(|(place, area)| weights[*place] = *area);
            AdditiveSchwarz::new(&self.matrix, uses, x.len() / n, &weights)
        };
        let inverse = self.inverses[which].get_or_init(make);
        self.in_order(x, y, |_| scale, |x, y| inverse.apply(x, y), |area| 1.0 / area);
    }
}

fn layout(centers: &[[f64; 2]], corners: &[Vec<[f64; 2]>], areas: &[f64]) -> BlockLayout {
    let extent = |cell: &Vec<[f64; 2]>| -> BoundingBox {
        let bound = |with: fn(f64, f64) -> f64, start: f64| {
            [0, 1].map(|axis| cell.iter().map(|p| p[axis]).fold(start, with))
        };
        [bound(f64::min, f64::INFINITY), bound(f64::max, f64::NEG_INFINITY)]
    };
    let extents: Vec<BoundingBox> = corners.iter().map(extent).collect();
    BlockLayout::new(ClusterTree::new(centers, &extents, LEAF), ADMISSIBILITY)
        .with_tolerance_shares(&tolerance_shares(areas))
}

fn auxiliary_bytes(n: usize, corners: usize) -> usize {
    let vectors = 3 * 8 * (16 + 2);
    let moments = 8 * 91;
    n * (vectors + moments + 200) + 16 * corners + AdditiveSchwarz::expected_bytes(n, 3)
}

impl Flexibility for CompressedFlexibility {
    fn n_cells(&self) -> usize {
        self.place_and_area.len()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.multiply(&self.all, tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.multiply(&self.normal, pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        self.place_and_area.iter().map(|&(place, _)| self.pairs.matrix(place, place)).collect()
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        let place = |cell: usize| self.place_and_area[cell].0;
        matrix.add_columns(|k| move |i| self.pairs.matrix(place(cells[i]), place(cells[k])));
        true
    }

    fn couples_normal_tangential(&self) -> bool {
        let crosses = |component: &KernelComponent| {
            let (row, column) = row_and_column(*component);
            row != column && column == 2
        };
        self.pairs.components().iter().any(crosses)
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.apply_approximate_inverse(0, &self.normal, normal_gap, pressure);
        true
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.apply_approximate_inverse(1, &self.all, gap, tractions);
        true
    }

    fn direct_sum(&self, cell: usize, tractions: &[f64]) -> Option<[f64; 3]> {
        let n = self.place_and_area.len();
        let mut sum = Vector3::zeros();
        for source in 0..n {
            let traction = Vector3::new(tractions[source], tractions[n + source], tractions[2 * n + source]);
            if traction != Vector3::zeros() {
                let [i, j] = [cell, source].map(|cell| self.place_and_area[cell].0);
                sum += self.pairs.block_by_integration(&self.integrator, i, j) * traction;
            }
        }
        Some(sum.into())
    }
}
