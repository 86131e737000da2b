//! The symbol of a block-Toeplitz operator on a uniform grid: the transform of its kernel over the zero-padded grid.

use std::sync::{Arc, OnceLock};

use nalgebra::Complex;
use rayon::prelude::*;

use crate::bem::half_space::grid::fft_plan::PaddedGridPlan;
use crate::bem::half_space::grid::kernel_table::{KernelComponent, KernelTable, OffsetPlane};
use crate::bem::half_space::grid::symbol::{COUPLED, UNCOUPLED};

/// The transform of the kernel on a grid of cells, in parts that are made when they are first needed.
pub(super) struct GridSymbol {
    /// Of the zero-padded grid.
    pub(super) plan: PaddedGridPlan,
    pub(super) table: Arc<KernelTable>,
    /// Sides of a cell over those of the table.
    pub(super) coarsening: usize,
    pub(super) coupled: bool,
    /// nn, `[k_y][padded_x]`, 1/(padded size) included.
    normal: OnceLock<Vec<f64>>,
    /// The rest, `[k_y][COUPLED or UNCOUPLED][padded_x]`.
    other_planes: OnceLock<Vec<f64>>,
}

impl GridSymbol {
    /// Of the kernel in `table` on `cells` whose sides are `coarsening` of its own.
    pub(super) fn new(
        cells: [usize; 2],
        (table, coarsening): (Arc<KernelTable>, usize),
        coupled: bool,
    ) -> Self {
        let plan = PaddedGridPlan::new(cells);
        Self { plan, table, coarsening, coupled, normal: OnceLock::new(), other_planes: OnceLock::new() }
    }

    /// nn of the symbol.
    pub(super) fn normal(&self) -> &[f64] {
        self.normal.get_or_init(|| {
            let planes = self.table.planes(self.plan.cells, &[KernelComponent::Even(2)]);
            let symbol = self.plan.transform(|ix, row| self.add_row(&planes[0], ix, row));
            symbol.iter().map(|value| value.re * self.weight()).collect()
        })
    }

    /// The other planes of the symbol.
    pub(super) fn other_planes(&self) -> &[f64] {
        self.other_planes
            .get_or_init(|| self.transform_other_planes(if self.coupled { COUPLED } else { UNCOUPLED }))
    }

    /// The P planes of one k_y.
    pub(super) fn planes_at<'s, const P: usize>(&self, symbol: &'s [f64], ky: usize) -> [&'s [f64]; P] {
        let px = self.plan.padded[0];
        let mut planes = symbol[ky * P * px..(ky + 1) * P * px].chunks_exact(px);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }

    /// 1/(padded size), as transforms are not normalised; the kernel grows with the sides of the cells.
    fn weight(&self) -> f64 {
        let [px, py] = self.plan.padded;
        self.coarsening as f64 / (px * py) as f64
    }

    /// Adds a row of a plane of offsets, periodic with the padded size and zero where no pair of cells lies.
    fn add_row(&self, plane: &OffsetPlane, ix: usize, row: &mut [f64]) {
        let (cells, period) = (self.plan.cells[0], self.plan.padded[0]);
        if let Some(dx) = wrapped_offset(ix, period, cells) {
            plane.add_row(dx, row);
        }
    }

    /// The transform of the kernel without nn: `count` planes.
    fn transform_other_planes(&self, count: usize) -> Vec<f64> {
        let px = self.plan.padded[0];
        let mut symbol = vec![0.0; count * px * self.plan.half_spectrum()];
        let mixed = |k: usize| vec![KernelComponent::Even(3 + k), KernelComponent::Odd(k)];
        // Those of a group are tabulated together.
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
        let (px, weight) = (self.plan.padded[0], self.weight());
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
