//! Flexibility of half-spaces on a grid frame that is periodic in one or two directions.
//!
//! In a periodic direction, tractions and displacements are trigonometric polynomials through the values at the centres
//! of the cells. The admittance W(m) / κ of every harmonic is exact. In an open direction, tractions are constant over
//! each cell.
//!
//! A uniform load on an infinite surface causes no finite displacement relative to infinity. With two periodic
//! directions, the mean displacement is therefore set to zero. With one periodic direction, the mean traction of each
//! row of cells along this direction acts as a line load. The displacement due to a line load contains a logarithm of
//! the distance. This logarithm is zero at a distance of half the frame width in the open direction.
//!
//! # Source
//! Stanley and Kato 1997, "An FFT-based method for rough surface contact"; docs/theory-half-space.md.

mod open_direction;
mod periodic_symbol;

use std::sync::{Mutex, OnceLock};

use nalgebra::{Complex, Matrix3};

use super::green::SurfaceGreen;
use crate::bem::half_space::green::admittance::Admittance;
use crate::bem::half_space::grid::fft::{CrossBlocks, validate_grid};
use crate::bem::half_space::grid::fft_plan::{PaddedGridBuffers, PaddedGridPlan, fast_size};
use crate::bem::half_space::grid::preconditioner::inverse_filter;
use crate::bem::half_space::grid::spectral_filter::{ComponentSet, SpectralFilter};
use crate::bem::half_space::grid::symbol::{multiply_coupled, multiply_uncoupled};
use crate::bem::half_space::periodic::open_direction::max_period_over_cell;
use crate::bem::half_space::periodic::periodic_symbol::{
    PLANES, doubly_periodic_symbol, singly_periodic_symbol,
};
use crate::cancel;
use crate::error::{Error, Result};
use crate::flexibility::Flexibility;
use crate::flexibility::per_cell::PerCell;

/// Maximum aspect ratio of a cell in a frame with one open direction.
const MAX_CELL_ASPECT_RATIO: f64 = 1e3;

/// Symmetric flexibility operator S of half-spaces on a uniform periodic grid of cells.
///
/// In a frame that is periodic in two directions, uniform tractions cause no displacement. Cell (ix, iy) has the index
/// `ix * cells[1] + iy`.
pub struct PeriodicFlexibility {
    convolution: PaddedGridPlan,
    /// `[k_y][PLANES][padded_x]`, including the factor 1/(padded size).
    symbol: Vec<f64>,
    self_influence: Matrix3<f64>,
    coupled: bool,
    buffers: Mutex<PaddedGridBuffers>,
    spacing: [f64; 2],
    admittance: Admittance,
    normal_inverse: OnceLock<SpectralFilter>,
    full_inverse: OnceLock<SpectralFilter>,
}

impl PeriodicFlexibility {
    /// Computes the operator. If two directions are periodic, its symbol has a closed form.
    ///
    /// `cells`: numbers of cells along x and y; `spacing`: sides of a cell, mm; `periodic`: whether the frame is
    /// periodic along x and along y.
    ///
    /// # Errors
    /// - If the grid is empty, or if no direction is periodic.
    /// - If two directions are periodic and the grid has only one cell.
    /// - If the spacing is not positive and finite, or the spacing or the compliance is extremely large or small.
    /// - With one periodic direction, if the cells are too elongated or the period is too long.
    /// - If memory does not suffice, or the run is cancelled.
    pub fn new(
        cells: [usize; 2],
        spacing: [f64; 2],
        periodic: [bool; 2],
        green: &SurfaceGreen,
        cross: CrossBlocks,
    ) -> Result<Self> {
        let padded =
            [0, 1].map(|a| if periodic[a] { cells[a] } else { fast_size((2 * cells[a]).max(2) - 1) });
        validate_grid(cells, padded, spacing, green)?;
        validate_periodicity(cells, spacing, periodic, green.singularity_distance())?;
        let convolution = PaddedGridPlan::padded(cells, padded);
        let admittance = Admittance::new(green);
        let symbol = match periodic {
            [true, true] => doubly_periodic_symbol(&convolution, spacing, &admittance),
            _ => singly_periodic_symbol(
                &convolution,
                spacing,
                usize::from(periodic[0]),
                &admittance,
                green.singularity_distance(),
            ),
        };
        cancel::check()?;
        let buffers = Mutex::new(convolution.buffers(3));
        let coupled = cross == CrossBlocks::Keep || green.couples_normal_tangential();
        let self_influence = Matrix3::zeros();
        let (normal_inverse, full_inverse) = (OnceLock::new(), OnceLock::new());
        let mut made = Self {
            convolution,
            symbol,
            self_influence,
            coupled,
            buffers,
            spacing,
            admittance,
            normal_inverse,
            full_inverse,
        };
        made.self_influence = made.influence_on_itself();
        Ok(made)
    }

    /// Influence K(0) of a cell on itself.
    fn influence_on_itself(&self) -> Matrix3<f64> {
        let n = self.n_cells();
        let (mut tractions, mut gap) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        let mut own = Matrix3::zeros();
        for component in 0..3 {
            tractions[component * n] = 1.0;
            self.apply(&tractions, &mut gap);
            tractions[component * n] = 0.0;
            (0..3).for_each(|row| own[(row, component)] = gap[row * n]);
        }
        (own + own.transpose()) * 0.5
    }

    fn inverse(&self, parts: ComponentSet) -> SpectralFilter {
        let cells = self.convolution.cells;
        inverse_filter(parts, PaddedGridPlan::padded(cells, cells), self.spacing, &self.admittance)
    }

    fn planes(&self, ky: usize) -> [&[f64]; PLANES] {
        let px = self.convolution.padded[0];
        let mut planes = self.symbol[ky * PLANES * px..(ky + 1) * PLANES * px].chunks_exact(px);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }
}

impl Flexibility for PeriodicFlexibility {
    fn n_cells(&self) -> usize {
        self.convolution.cells[0] * self.convolution.cells[1]
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        self.convolution.apply::<3>(tractions, gap, &mut buffers, |ky, columns| {
            let [xx, yy, nn, xy, xy_im, xn, xn_im, yn, yn_im] = self.planes(ky);
            if self.coupled {
                multiply_coupled(nn, [xx, yy, xy, xy_im, xn, xn_im, yn, yn_im], columns);
            } else {
                multiply_uncoupled(nn, [xx, yy, xy, xy_im], columns);
            }
        });
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        self.convolution.apply::<1>(
            pressure,
            normal_gap,
            &mut buffers,
            |ky, [normal]: [&mut [Complex<f64>]; 1]| {
                normal.iter_mut().zip(self.planes(ky)[2]).for_each(|(value, s)| *value *= *s);
            },
        );
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        PerCell::Same(self.self_influence, self.n_cells())
    }

    fn couples_normal_tangential(&self) -> bool {
        self.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.normal_inverse.get_or_init(|| self.inverse(ComponentSet::Normal)).apply(normal_gap, pressure);
        true
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.full_inverse.get_or_init(|| self.inverse(ComponentSet::Coupled)).apply(gap, tractions);
        true
    }
}

fn validate_periodicity(
    cells: [usize; 2],
    spacing: [f64; 2],
    periodic: [bool; 2],
    singularity_distance: f64,
) -> Result<()> {
    if periodic == [false; 2] {
        return Err(Error::numerical(
            "the frame is not periodic in any direction: it needs the padded operator",
        ));
    }
    if periodic == [true; 2] && cells == [1, 1] {
        return Err(Error::input(
            "a frame of one cell that is periodic in both directions carries only a uniform pressure, which causes no relative displacement; give it more cells along x or y",
        ));
    }
    let across = usize::from(periodic[0]);
    let ratio = spacing[across] / spacing[1 - across];
    if periodic != [true; 2] && cells[1 - across] > 1 && ratio.max(1.0 / ratio) > MAX_CELL_ASPECT_RATIO {
        return Err(Error::input(format!(
            "the cells of the periodic frame have the sides {} x {}, but their ratio must not exceed {MAX_CELL_ASPECT_RATIO}; change half_width or cells so that the sides are more equal",
            spacing[0], spacing[1]
        )));
    }
    let [length, width] = [cells[1 - across] as f64 * spacing[1 - across], spacing[across]];
    let most = max_period_over_cell(singularity_distance);
    if periodic != [true; 2] && cells[1 - across] > 1 && length > most * width {
        return Err(Error::input(format!(
            "the period of the frame is {length}, {:.0} times the width {width} of its cells in the other direction. For these materials at most {most:.0} times is supported; use a shorter period or wider cells",
            length / width
        )));
    }
    Ok(())
}
