//! Flexibility of half-spaces on a uniform grid frame: block-Toeplitz operator, applied by fast Fourier transforms.

use std::sync::{Arc, Mutex, OnceLock};

use nalgebra::{Matrix3, Vector3};

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::admittance::Admittance;
use crate::bem::half_space::grid::fft_plan::{PaddedGridBuffers, PaddedGridPlan, fast_size};
use crate::bem::half_space::grid::grid_symbol::GridSymbol;
use crate::bem::half_space::grid::kernel_table::KernelTable;
use crate::bem::half_space::grid::preconditioner::inverse_filter;
use crate::bem::half_space::grid::spectral_filter::{ComponentSet, SpectralFilter};
use crate::bem::half_space::grid::symbol::{multiply_coupled, multiply_tangential, multiply_uncoupled};
use crate::bem::half_space::grid::toeplitz::ToeplitzBlocks;
use crate::cancel;
use crate::error::{Error, Result};
use crate::flexibility::cell_matrix::CellMatrix;
use crate::flexibility::per_cell::PerCell;
use crate::flexibility::{Flexibility, TangentialFlexibility};
use crate::linalg::memory;

/// Treatment of the blocks between normal and tangential components if they vanish within rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrossBlocks {
    /// Multiplies the blocks even if they vanish. The operator counts as coupled.
    Keep,
    /// Skips vanishing blocks. The operator then counts as uncoupled.
    SkipVanishing,
}

const MAX_SMALLER_GRIDS: usize = 6;

/// Flexibility operator S of half-spaces on a uniform grid of cells with constant tractions, collocated at the centres.
///
/// The influence K at the cell offset d satisfies K(-d) = K(d)^T. S is therefore symmetric, and its symbol, the Fourier
/// transform of K, is Hermitian. Cell (ix, iy) has the index `ix * cells[1] + iy`.
///
/// # Source
/// docs/theory-half-space.md, operators on the frame.
pub struct FftFlexibility {
    symbol: Arc<GridSymbol>,
    buffers: Mutex<Option<PaddedGridBuffers>>,
    normal_buffers: Mutex<Option<PaddedGridBuffers>>,
    spacing: [f64; 2],
    admittance: Arc<Admittance>,
    /// Approximate inverses as preconditioners, one for each set of components.
    inverse: [OnceLock<SpectralFilter>; ComponentSet::COUNT],
    /// Operators on smaller grids, in the order of their last use.
    smaller_grids: Mutex<Vec<Arc<FftFlexibility>>>,
}

impl FftFlexibility {
    /// Tabulates the influence of a cell on the grid.
    ///
    /// `cells`: numbers of cells along x and y; `spacing`: sides of a cell, mm; `green`: Green's function of one
    /// half-space, or the sum for a pair.
    ///
    /// # Errors
    /// - If the grid is empty, or the spacing is not positive and finite.
    /// - If the spacing or the compliance is extremely large or small.
    /// - If the tables do not fit into the memory, or the run is cancelled.
    pub fn new(
        cells: [usize; 2],
        spacing: [f64; 2],
        green: &SurfaceGreen,
        cross: CrossBlocks,
    ) -> Result<Self> {
        validate_grid(cells, cells.map(|n| 2 * n), spacing, green)?;
        let coupled = cross == CrossBlocks::Keep || green.couples_normal_tangential();
        let table = Arc::new(KernelTable::new(cells, spacing, green));
        cancel::check()?;
        let symbol = Arc::new(GridSymbol::new(cells, table, 1, coupled));
        Ok(Self::of_symbol(symbol, spacing, Arc::new(Admittance::new(green))))
    }

    fn of_symbol(symbol: Arc<GridSymbol>, spacing: [f64; 2], admittance: Arc<Admittance>) -> Self {
        Self {
            symbol,
            buffers: Mutex::new(None),
            normal_buffers: Mutex::new(None),
            spacing,
            admittance,
            inverse: [const { OnceLock::new() }; ComponentSet::COUNT],
            smaller_grids: Mutex::new(Vec::new()),
        }
    }

    /// Operator on a grid of `cells` cells, whose sides are `factor` times the cell sides of this grid.
    fn on_smaller_grid(&self, cells: [usize; 2], factor: usize) -> Arc<Self> {
        let spacing = self.spacing.map(|side| side * factor as f64);
        let symbol = GridSymbol::new(cells, self.symbol.table.clone(), factor, self.symbol.coupled);
        Arc::new(Self::of_symbol(Arc::new(symbol), spacing, self.admittance.clone()))
    }

    fn cells(&self) -> [usize; 2] {
        self.symbol.plan.cells
    }

    fn parts(&self) -> ComponentSet {
        if self.symbol.coupled { ComponentSet::Coupled } else { ComponentSet::Uncoupled }
    }

    fn inverse(&self, parts: ComponentSet) -> &SpectralFilter {
        self.inverse[parts as usize].get_or_init(|| {
            inverse_filter(parts, PaddedGridPlan::periodic(self.cells()), self.spacing, &self.admittance)
        })
    }
}

impl Flexibility for FftFlexibility {
    fn n_cells(&self) -> usize {
        self.cells()[0] * self.cells()[1]
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.symbol.plan.buffers(3));
        // The planes are computed before the parallel section. Inside this section, threads would wait for each other.
        let (normal, rest) = (self.symbol.normal(), self.symbol.other_planes());
        self.symbol.plan.apply::<3>(tractions, gap, buffers, |ky, columns| {
            let [nn] = self.symbol.planes_at(normal, ky);
            if self.symbol.coupled {
                multiply_coupled(nn, self.symbol.planes_at(rest, ky), columns);
            } else {
                multiply_uncoupled(nn, self.symbol.planes_at(rest, ky), columns);
            }
        });
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let mut buffers = self.normal_buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.symbol.plan.buffers(1));
        let normal = self.symbol.normal();
        self.symbol.plan.apply::<1>(pressure, normal_gap, buffers, |ky, [values]| {
            let [nn] = self.symbol.planes_at(normal, ky);
            values.iter_mut().zip(nn).for_each(|(value, s)| *value *= *s);
        });
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        PerCell::Same(self.symbol.table.self_influence() * self.symbol.coarsening as f64, self.n_cells())
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) -> bool {
        let blocks = ToeplitzBlocks::new(self, self.cells());
        matrix.add_columns(|k| {
            let blocks = &blocks;
            move |i| blocks.block(cells[i], cells[k])
        });
        true
    }

    fn couples_normal_tangential(&self) -> bool {
        self.symbol.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.inverse(ComponentSet::Normal).apply(normal_gap, pressure);
        true
    }

    fn direct_sum(&self, cell: usize, tractions: &[f64]) -> Option<[f64; 3]> {
        let (n, ny) = (self.n_cells(), self.cells()[1]);
        let mut sum = Vector3::zeros();
        for source in 0..n {
            let traction = Vector3::new(tractions[source], tractions[n + source], tractions[2 * n + source]);
            if traction != Vector3::zeros() {
                let along =
                    |axis: fn(usize, usize) -> usize| axis(cell, ny) as isize - axis(source, ny) as isize;
                let offset = [along(|cell, ny| cell / ny), along(|cell, ny| cell % ny)];
                sum += self.symbol.table.integral(offset) * traction;
            }
        }
        Some((sum * self.symbol.coarsening as f64).into())
    }

    fn grid(&self) -> Option<[usize; 2]> {
        Some(self.cells())
    }

    fn restrict(&self, at_least: [usize; 2], factor: usize) -> Option<Arc<dyn Flexibility>> {
        let most = self.cells().map(|n| n / factor);
        if self.symbol.coarsening != 1 || (0..2).any(|axis| at_least[axis] > most[axis]) {
            return None;
        }
        // Largest grid that fits into this grid and needs no more padding than a grid of `at_least` cells. The size is
        // even along each axis where `at_least` is even. The choice does not depend on earlier calls, so a resumed run
        // has the same operators.
        let room = |axis: usize| most[axis].min(fast_size(2 * at_least[axis] - 1).div_ceil(2));
        let cells = [0, 1].map(|axis| room(axis) - room(axis) % 2 * (1 - at_least[axis] % 2));
        let mut kept = self.smaller_grids.lock().expect("no panic while the operators are held");
        let found = kept.iter().position(|it| it.symbol.coarsening == factor && it.cells() == cells);
        let operator = match found {
            Some(found) => kept.remove(found),
            None => self.on_smaller_grid(cells, factor),
        };
        kept.push(operator.clone());
        if kept.len() > MAX_SMALLER_GRIDS {
            kept.remove(0);
        }
        Some(operator)
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.inverse(self.parts()).apply(gap, tractions);
        true
    }

    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        (!self.symbol.coupled).then_some(self)
    }
}

impl TangentialFlexibility for FftFlexibility {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.symbol.plan.buffers(3));
        let rest = self.symbol.other_planes();
        self.symbol.plan.apply::<2>(tractions, gap, buffers, |ky, columns| {
            multiply_tangential(self.symbol.planes_at(rest, ky), columns);
        });
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        self.inverse(ComponentSet::Tangential).apply(gap, tractions);
    }
}

/// Admissible range of lengths and compliances. Within this range, powers, products and transforms neither overflow nor
/// underflow.
const MAGNITUDE_RANGE: [f64; 2] = [1e-20, 1e20];

pub(in crate::bem::half_space) fn validate_grid(
    cells: [usize; 2],
    padded: [usize; 2],
    spacing: [f64; 2],
    green: &SurfaceGreen,
) -> Result<()> {
    if cells.contains(&0) {
        return Err(Error::input(format!(
            "the contact frame has {} x {} cells; each direction needs at least one",
            cells[0], cells[1]
        )));
    }
    if !spacing.iter().all(|h| h.is_finite() && *h > 0.0) {
        return Err(Error::input(format!(
            "the cells of the contact frame have the sides {} x {}; both must be positive and finite",
            spacing[0], spacing[1]
        )));
    }
    let moderate = |size: f64| (MAGNITUDE_RANGE[0]..=MAGNITUDE_RANGE[1]).contains(&size);
    let compliance = green.max_coefficient();
    if !(spacing.into_iter().all(moderate) && moderate(compliance)) {
        return Err(Error::input(format!(
            "the cells of the contact frame have the sides {:.3e} x {:.3e}, and the half-spaces have a compliance of {compliance:.2e} (displacement per pressure and length). These numbers must lie between {:e} and {:e}; choose units in which they are closer to 1",
            spacing[0], spacing[1], MAGNITUDE_RANGE[0], MAGNITUDE_RANGE[1]
        )));
    }
    // Real numbers per padded cell: 5 for the symbol, 5 for the kernel table, 4 for one transform in progress (two
    // complex planes), 6 for work space.
    let bytes = padded.iter().map(|&n| n as u128).product::<u128>() * 8 * (5 + 5 + 4 + 6);
    memory::ensure(bytes, &format!("the operator on {} x {} cells", cells[0], cells[1]), "use fewer cells")
}
