//! Flexibility of half-spaces on a uniform grid frame: block Toeplitz, applied by fast Fourier transforms.

use std::sync::{Arc, Mutex, OnceLock};

use nalgebra::{Complex, Matrix3, Vector3};
use rayon::prelude::*;

use super::admittance::Admittance;
use super::fft_plan::{Buffers, Convolution, fast_size};
use super::filter::{Filter, Parts};
use super::green::SurfaceGreen;
use super::kernel_table::{Component, KernelTable, OffsetPlane};
use super::offsets;
use super::symbol::{COUPLED, UNCOUPLED, multiply_coupled, multiply_tangential, multiply_uncoupled};
use super::symbol_inverse::{inverse_of, normal_inverse};
use crate::error::{Error, Result};
use crate::interrupt;
use crate::linalg::PerCell;
use crate::linalg::cell_matrix::CellMatrix;
use crate::linalg::course::Course;
use crate::linalg::memory;
use crate::linalg::operator::{Entries, Flexibility, TangentialFlexibility};

/// What happens to the blocks between normal and tangential components when they vanish within rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CrossBlocks {
    /// They are multiplied like the others; the operator counts as coupled.
    Keep,
    /// They are left out if they vanish; the operator then counts as uncoupled.
    SkipVanishing,
}

/// Smaller operators kept for later.
const KEPT: usize = 6;

/// A kept operator serves up to this part more cells than asked for.
const SPARE: usize = 16;

/// The operator S of half-spaces on a uniform grid of cells with constant tractions, collocated at the centres.
///
/// Symmetric, since K(-d) = K(d)^T on a uniform grid; the transform of K (the symbol) is then Hermitian in each
/// wavevector and nine real planes hold it. Cell (ix, iy) has the index `ix * cells[1] + iy`.
///
/// # Source
/// docs/theory-half-space.md, operators on the frame.
pub struct FftFlexibility {
    convolution: Convolution,
    table: Arc<KernelTable>,
    /// Sides of a cell over those of the table.
    factor: usize,
    /// nn, `[k_y][padded_x]`, 1/(padded size) included; made when it is first needed.
    normal: OnceLock<Vec<f64>>,
    /// The rest, `[k_y][COUPLED or UNCOUPLED][padded_x]`.
    rest: OnceLock<Vec<f64>>,
    coupled: bool,
    buffers: Mutex<Option<Buffers>>,
    normal_buffers: Mutex<Option<Buffers>>,
    spacing: [f64; 2],
    admittance: Arc<Admittance>,
    normal_inverse: OnceLock<Filter>,
    full_inverse: OnceLock<Filter>,
    tangential_inverse: OnceLock<Filter>,
    /// The operator itself in single precision, the tangential part of an uncoupled one, and the normal part.
    single: OnceLock<Filter>,
    tangential_single: OnceLock<Filter>,
    normal_single: OnceLock<Filter>,
    /// Operators on parts of the grid and on coarser ones, the last used last.
    smaller: Mutex<Vec<Arc<FftFlexibility>>>,
}

impl FftFlexibility {
    /// Tabulates the influence of a cell on the grid; what is needed of it is transformed with the first product.
    ///
    /// `cells`: number along x and y; `spacing`: sides of a cell, mm; `green`: of one half-space or of a pair.
    ///
    /// # Errors
    /// If the grid is empty, the spacing is not positive and finite, or the tables do not fit into the memory.
    pub fn new(
        cells: [usize; 2],
        spacing: [f64; 2],
        green: &SurfaceGreen,
        cross: CrossBlocks,
    ) -> Result<Self> {
        check(cells, spacing, green)?;
        let table = Arc::new(KernelTable::new(cells, spacing, green));
        interrupt::check()?;
        let coupled = cross == CrossBlocks::Keep || green.couples_normal_tangential();
        Ok(Self::of_table(cells, (table, 1), spacing, coupled, Arc::new(Admittance::new(green))))
    }

    fn of_table(
        cells: [usize; 2],
        (table, factor): (Arc<KernelTable>, usize),
        spacing: [f64; 2],
        coupled: bool,
        admittance: Arc<Admittance>,
    ) -> Self {
        Self {
            convolution: Convolution::new(cells),
            table,
            factor,
            normal: OnceLock::new(),
            rest: OnceLock::new(),
            coupled,
            buffers: Mutex::new(None),
            normal_buffers: Mutex::new(None),
            spacing,
            admittance,
            normal_inverse: OnceLock::new(),
            full_inverse: OnceLock::new(),
            tangential_inverse: OnceLock::new(),
            single: OnceLock::new(),
            tangential_single: OnceLock::new(),
            normal_single: OnceLock::new(),
            smaller: Mutex::new(Vec::new()),
        }
    }

    /// The same on a smaller grid, whose cells are `factor` of its own along a side.
    fn smaller_one(&self, cells: [usize; 2], factor: usize) -> Arc<Self> {
        let spacing = self.spacing.map(|side| side * factor as f64);
        let table = (self.table.clone(), factor);
        Arc::new(Self::of_table(cells, table, spacing, self.coupled, self.admittance.clone()))
    }

    /// An upper bound of the largest eigenvalue of S, mm/MPa: the largest row sum of the symbol.
    pub fn spectral_bound(&self) -> f64 {
        let [px, py] = self.convolution.padded;
        let (normal, rest, none) = (self.normal(), self.rest(), vec![0.0; px]);
        let columns = (0..self.convolution.half_spectrum()).map(|ky| {
            let [nn] = self.columns(normal, ky);
            if self.coupled {
                return largest_row_sum(nn, self.columns(rest, ky));
            }
            let [xx, yy, re, im] = self.columns(rest, ky);
            largest_row_sum(nn, [xx, yy, re, im, &none, &none, &none, &none])
        });
        columns.fold(0.0, f64::max) * (px * py) as f64
    }

    /// nn of the symbol.
    fn normal(&self) -> &[f64] {
        self.normal.get_or_init(|| {
            let planes = self.table.planes(self.convolution.cells, &[Component::Even(2)]);
            let symbol = self.convolution.transform(|ix, row| self.add_row(&planes[0], ix, row));
            symbol.iter().map(|value| value.re * self.weight()).collect()
        })
    }

    /// The other planes of the symbol.
    fn rest(&self) -> &[f64] {
        self.rest.get_or_init(|| self.make_rest(if self.coupled { COUPLED } else { UNCOUPLED }))
    }

    /// The operator in single precision.
    fn single(&self) -> &Filter {
        self.single.get_or_init(|| {
            let symbols = [self.normal(), self.rest()];
            Filter::new(Convolution::new(self.convolution.cells), self.parts(), &symbols)
        })
    }

    /// What a product of all components multiplies.
    fn parts(&self) -> Parts {
        if self.coupled { Parts::Coupled } else { Parts::Uncoupled }
    }

    /// The approximate inverse of some components.
    fn inverse(&self, parts: Parts) -> Filter {
        inverse_of(parts, Convolution::periodic(self.convolution.cells), self.spacing, &self.admittance)
    }

    /// The P planes of one k_y.
    fn columns<'s, const P: usize>(&self, symbol: &'s [f64], ky: usize) -> [&'s [f64]; P] {
        let px = self.convolution.padded[0];
        let mut planes = symbol[ky * P * px..(ky + 1) * P * px].chunks_exact(px);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }

    /// 1/(padded size), as transforms are not normalised; the kernel grows with the sides of the cells.
    fn weight(&self) -> f64 {
        let [px, py] = self.convolution.padded;
        self.factor as f64 / (px * py) as f64
    }

    /// Adds a row of a plane of offsets, periodic with the padded size and zero where no pair of cells lies.
    fn add_row(&self, plane: &OffsetPlane, ix: usize, row: &mut [f64]) {
        let (cells, period) = (self.convolution.cells[0], self.convolution.padded[0]);
        if let Some(dx) = wrapped_offset(ix, period, cells) {
            plane.add_row(dx, row);
        }
    }

    /// The transform of the kernel without nn: `count` planes.
    fn make_rest(&self, count: usize) -> Vec<f64> {
        let px = self.convolution.padded[0];
        let mut symbol = vec![0.0; count * px * self.convolution.half_spectrum()];
        let mixed = |k: usize| vec![Component::Even(3 + k), Component::Odd(k)];
        // Those of a group are tabulated together.
        let groups =
            [vec![vec![Component::Even(0)], vec![Component::Even(1)], mixed(0)], vec![mixed(1), mixed(2)]];
        let mut first = 0;
        for group in &groups[..if count == COUPLED { 2 } else { 1 }] {
            let planes = self.table.planes(self.convolution.cells, &group.concat());
            let mut planes = planes.as_slice();
            for components in group {
                let parts = components.len();
                let (of_these, others) = planes.split_at(parts);
                planes = others;
                let transformed = self
                    .convolution
                    .transform(|ix, row| of_these.iter().for_each(|plane| self.add_row(plane, ix, row)));
                self.put((&mut symbol, count), &transformed, (first, parts));
                first += parts;
            }
        }
        symbol
    }

    /// Puts a transform into the planes of a symbol of `count`, from `first` on: its real and, of two `parts`, its imaginary part.
    fn put(
        &self,
        (symbol, count): (&mut [f64], usize),
        transformed: &[Complex<f64>],
        (first, parts): (usize, usize),
    ) {
        let (px, weight) = (self.convolution.padded[0], self.weight());
        symbol.par_chunks_exact_mut(count * px).zip(transformed.par_chunks_exact(px)).for_each(
            |(planes, column)| {
                let planes = &mut planes[first * px..(first + parts) * px];
                for (ix, value) in column.iter().enumerate() {
                    planes[ix] = value.re * weight;
                    if parts == 2 {
                        planes[px + ix] = value.im * weight;
                    }
                }
            },
        );
    }
}

impl Flexibility for FftFlexibility {
    fn n_cells(&self) -> usize {
        self.convolution.cells[0] * self.convolution.cells[1]
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.convolution.buffers(3));
        // Made before the threads part, since they would wait for each other.
        let (normal, rest) = (self.normal(), self.rest());
        self.convolution.apply::<3>(tractions, gap, buffers, |ky, columns| {
            let [nn] = self.columns(normal, ky);
            if self.coupled {
                multiply_coupled(nn, self.columns(rest, ky), columns);
            } else {
                multiply_uncoupled(nn, self.columns(rest, ky), columns);
            }
        });
    }

    fn apply_single(&self, tractions: &[f64], gap: &mut [f64]) {
        self.single().apply(tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let mut buffers = self.normal_buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.convolution.buffers(1));
        let normal = self.normal();
        self.convolution.apply::<1>(pressure, normal_gap, buffers, |ky, [values]| {
            let [nn] = self.columns(normal, ky);
            values.iter_mut().zip(nn).for_each(|(value, s)| *value *= *s);
        });
    }

    fn apply_normal_single(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let make = || Filter::new(Convolution::new(self.convolution.cells), Parts::Normal, &[self.normal()]);
        self.normal_single.get_or_init(make).apply(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        PerCell::Same(self.table.own() * self.factor as f64, self.n_cells())
    }

    fn entries(&self) -> Entries {
        Entries::Computed
    }

    fn add_entries(&self, cells: &[usize], matrix: &mut CellMatrix) {
        offsets::add_entries(self, self.convolution.cells, cells, matrix);
    }

    fn couples_normal_tangential(&self) -> bool {
        self.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        let make =
            || normal_inverse(Convolution::periodic(self.convolution.cells), self.spacing, &self.admittance);
        self.normal_inverse.get_or_init(make).apply(normal_gap, pressure);
        true
    }

    fn direct(&self, cell: usize, tractions: &[f64]) -> Option<[f64; 3]> {
        let (n, ny) = (self.n_cells(), self.convolution.cells[1]);
        let mut sum = Vector3::zeros();
        for source in 0..n {
            let traction = Vector3::new(tractions[source], tractions[n + source], tractions[2 * n + source]);
            if traction != Vector3::zeros() {
                let along =
                    |axis: fn(usize, usize) -> usize| axis(cell, ny) as isize - axis(source, ny) as isize;
                let offset = [along(|cell, ny| cell / ny), along(|cell, ny| cell % ny)];
                sum += self.table.integral(offset) * traction;
            }
        }
        Some((sum * self.factor as f64).into())
    }

    fn grid(&self) -> Option<[usize; 2]> {
        Some(self.convolution.cells)
    }

    fn on_grid(&self, at_least: [usize; 2], factor: usize) -> Option<Arc<dyn Flexibility>> {
        let most = self.convolution.cells.map(|n| n / factor);
        if self.factor != 1 || (0..2).any(|axis| at_least[axis] > most[axis]) {
            return None;
        }
        let mut kept = self.smaller.lock().expect("no panic while the operators are held");
        let suits = |operator: &Arc<Self>| {
            let cells = operator.convolution.cells;
            operator.factor == factor
                && (0..2).all(|axis| {
                    at_least[axis] <= cells[axis]
                        && cells[axis] <= at_least[axis] + at_least[axis] / SPARE + 2
                })
        };
        let operator = match kept.iter().position(suits) {
            Some(found) => kept.remove(found),
            None => {
                // As many cells as the padded size has room for.
                let cells = [0, 1].map(|axis| most[axis].min(fast_size(2 * at_least[axis] - 1).div_ceil(2)));
                self.smaller_one(cells, factor)
            }
        };
        kept.push(operator.clone());
        if kept.len() > KEPT {
            kept.remove(0);
        }
        Some(operator)
    }

    /// Which of the operators on smaller grids serve a window depends on the windows before it.
    fn course(&self) -> Course {
        let kept = self.smaller.lock().expect("no panic while the operators are held");
        let smaller = kept.iter().map(|operator| (operator.convolution.cells, operator.factor)).collect();
        let parts = kept.iter().map(|operator| operator.course()).collect();
        Course { smaller, parts, ..Course::default() }
    }

    fn repeat(&self, course: &Course) -> Result<()> {
        let mut kept = self.smaller.lock().expect("no panic while the operators are held");
        *kept = course.smaller.iter().map(|&(cells, factor)| self.smaller_one(cells, factor)).collect();
        kept.iter().zip(&course.parts).try_for_each(|(operator, course)| operator.repeat(course))
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.full_inverse.get_or_init(|| self.inverse(self.parts())).apply(gap, tractions);
        true
    }

    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        (!self.coupled).then_some(self)
    }
}

impl TangentialFlexibility for FftFlexibility {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.convolution.buffers(3));
        let rest = self.rest();
        self.convolution.apply::<2>(tractions, gap, buffers, |ky, columns| {
            multiply_tangential(self.columns(rest, ky), columns);
        });
    }

    fn apply_tangential_single(&self, tractions: &[f64], gap: &mut [f64]) {
        let make =
            || Filter::new(Convolution::new(self.convolution.cells), Parts::Tangential, &[self.rest()]);
        self.tangential_single.get_or_init(make).apply(tractions, gap);
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        self.tangential_inverse.get_or_init(|| self.inverse(Parts::Tangential)).apply(gap, tractions);
    }
}

/// Largest sum of magnitudes in a row of the 3 x 3 matrices of a column.
fn largest_row_sum(nn: &[f64], [xx, yy, xy_re, xy_im, xn_re, xn_im, yn_re, yn_im]: [&[f64]; COUPLED]) -> f64 {
    let at = |i: usize| {
        let (xy, xn, yn) = (xy_re[i].hypot(xy_im[i]), xn_re[i].hypot(xn_im[i]), yn_re[i].hypot(yn_im[i]));
        (xx[i].abs() + xy + xn).max(yy[i].abs() + xy + yn).max(nn[i].abs() + xn + yn)
    };
    (0..xx.len()).map(at).fold(0.0, f64::max)
}

/// The offset that the index of a periodic table stands for; `None` between the two ends.
fn wrapped_offset(index: usize, period: usize, cells: usize) -> Option<isize> {
    if index < cells {
        Some(index as isize)
    } else if index + cells > period {
        Some(index as isize - period as isize)
    } else {
        None
    }
}

/// Lengths and compliances whose powers, products and transforms stay within the range of the numbers.
const SIZES: [f64; 2] = [1e-20, 1e20];

pub(super) fn check(cells: [usize; 2], spacing: [f64; 2], green: &SurfaceGreen) -> Result<()> {
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
    let moderate = |size: f64| (SIZES[0]..=SIZES[1]).contains(&size);
    let compliance = green.largest();
    if !(spacing.into_iter().all(moderate) && moderate(compliance)) {
        return Err(Error::input(format!(
            "the cells of the contact frame have the sides {:.3e} x {:.3e}, and the half-spaces a compliance of {compliance:.2e} (displacement \
             by pressure and length): what is computed lies between {:e} and {:e}; choose units in which these are closer to 1",
            spacing[0], spacing[1], SIZES[0], SIZES[1]
        )));
    }
    // Symbol, kernel table, one transform on its way (two planes) and the work space, about 2n per direction.
    let padded: u128 = cells.iter().map(|&n| 2 * n as u128).product();
    let bytes = padded * 8 * (5 + 5 + 4 + 6);
    memory::ensure(bytes, &format!("the operator on {} x {} cells", cells[0], cells[1]), "use fewer cells")
}
