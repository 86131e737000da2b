//! Symbol of a block-Toeplitz operator on a uniform grid: the Fourier transform of its kernel on the zero-padded grid.

use std::ops::Range;
use std::sync::{Arc, OnceLock};

use nalgebra::Complex;
use rayon::prelude::*;

use crate::bem::half_space::grid::fft_plan::PaddedGridPlan;
use crate::bem::half_space::grid::kernel_table::{KernelComponent, KernelTable, OffsetPlane};
use crate::bem::half_space::grid::symbol::{COUPLED, UNCOUPLED};

/// Fourier transform of the kernel on a grid of cells. Each part of the transform is computed on first use.
pub(super) struct GridSymbol {
    pub(super) plan: PaddedGridPlan,
    pub(super) table: Arc<KernelTable>,
    /// Cell sides of the grid divided by the cell sides of the table.
    pub(super) coarsening: usize,
    pub(super) coupled: bool,
    /// Entry nn of the symbol, `[k_y][padded_x]`, times `weight`.
    normal: OnceLock<Vec<f64>>,
    /// Other entries of the symbol, `[k_y][COUPLED or UNCOUPLED][padded_x]`, times `weight`.
    other_planes: OnceLock<Vec<f64>>,
}

impl GridSymbol {
    pub(super) fn new(cells: [usize; 2], table: Arc<KernelTable>, coarsening: usize, coupled: bool) -> Self {
        let plan = PaddedGridPlan::new(cells);
        Self { plan, table, coarsening, coupled, normal: OnceLock::new(), other_planes: OnceLock::new() }
    }

    pub(super) fn normal(&self) -> &[f64] {
        self.normal.get_or_init(|| {
            let planes = self.table.planes(self.plan.cells, &[KernelComponent::Even(2)]);
            let symbol = self.plan.transform(|ix, row| self.add_row(&planes[0], ix, row));
            symbol.iter().map(|value| value.re * self.weight()).collect()
        })
    }

    pub(super) fn other_planes(&self) -> &[f64] {
        self.other_planes
            .get_or_init(|| self.transform_other_planes(if self.coupled { COUPLED } else { UNCOUPLED }))
    }

    pub(super) fn planes_at<'s, const P: usize>(&self, symbol: &'s [f64], ky: usize) -> [&'s [f64]; P] {
        let px = self.plan.padded[0];
        let mut planes = symbol[ky * P * px..(ky + 1) * P * px].chunks_exact(px);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }

    /// Factor 1/(padded size) of the inverse transform, times the coarsening. The coarsening is a factor because the
    /// kernel is proportional to the cell sides.
    fn weight(&self) -> f64 {
        let [px, py] = self.plan.padded;
        self.coarsening as f64 / (px * py) as f64
    }

    /// Adds the kernel values at the offset of row `ix` to `row`. The offsets repeat with the padded size.
    fn add_row(&self, plane: &OffsetPlane, ix: usize, row: &mut [f64]) {
        let (cells, period) = (self.plan.cells[0], self.plan.padded[0]);
        if let Some(dx) = wrapped_offset(ix, period, cells) {
            plane.add_row(dx, row);
        }
    }

    fn transform_other_planes(&self, count: usize) -> Vec<f64> {
        let px = self.plan.padded[0];
        let mut symbol = vec![0.0; count * px * self.plan.half_spectrum()];
        let mixed = |k: usize| vec![KernelComponent::Even(3 + k), KernelComponent::Odd(k)];
        let groups = [
            vec![vec![KernelComponent::Even(0)], vec![KernelComponent::Even(1)], mixed(0)],
            vec![mixed(1), mixed(2)],
        ];
        let mut first = 0;
        for group in &groups[..if count == COUPLED { 2 } else { 1 }] {
            let planes = self.table.planes(self.plan.cells, &group.concat());
            let mut planes = planes.as_slice();
            for components in group {
                let parts = components.len();
                let (of_these, others) = planes.split_at(parts);
                planes = others;
                let transformed = self
                    .plan
                    .transform(|ix, row| of_these.iter().for_each(|plane| self.add_row(plane, ix, row)));
                self.put(&mut symbol, count, &transformed, first..first + parts);
                first += parts;
            }
        }
        symbol
    }

    /// Writes the real part of a transform into the first of `planes`. If `planes` has two elements, writes the
    /// imaginary part into the second.
    fn put(&self, symbol: &mut [f64], count: usize, transformed: &[Complex<f64>], planes: Range<usize>) {
        let (px, weight) = (self.plan.padded[0], self.weight());
        symbol.par_chunks_exact_mut(count * px).zip(transformed.par_chunks_exact(px)).for_each(
            |(at_ky, column)| {
                let own = &mut at_ky[planes.start * px..planes.end * px];
                for (ix, value) in column.iter().enumerate() {
                    own[ix] = value.re * weight;
                    if planes.len() == 2 {
                        own[px + ix] = value.im * weight;
                    }
                }
            },
        );
    }
}

/// Cell offset for an index of the padded grid; `None` if the index belongs to the padding between positive and
/// negative offsets.
fn wrapped_offset(index: usize, period: usize, cells: usize) -> Option<isize> {
    if index < cells {
        Some(index as isize)
    } else if index + cells > period {
        Some(index as isize - period as isize)
    } else {
        None
    }
}
