//! Flexibility of half-spaces on half of a uniform grid whose other half is its mirror image.

use std::sync::{Arc, Mutex, OnceLock};

use nalgebra::{Complex, Matrix3};

use crate::bem::half_space::green::admittance::Admittance;
use crate::bem::half_space::grid::fft_plan::{ConvolutionPlan, fast_size};
use crate::bem::half_space::grid::grid_symbol::GridSymbol;
use crate::bem::half_space::grid::half_grid_plan::{HalfGridBuffers, HalfGridPlan, fold};
use crate::bem::half_space::grid::preconditioner::inverse_symbol;
use crate::bem::half_space::grid::spectral_filter::{ComponentSet, SpectralFilter};
use crate::bem::half_space::grid::symbol::{multiply_coupled, multiply_tangential, multiply_uncoupled};
use crate::flexibility::per_cell::PerCell;
use crate::flexibility::{Flexibility, TangentialFlexibility};

/// The operator on the half of a grid away from the mirror, for tractions whose images act on the other half.
///
/// Its diagonal is that of the whole grid: what a cell does to itself, without its image.
pub(super) struct HalfGridFlexibility {
    whole: Arc<GridSymbol>,
    across: usize,
    plan: HalfGridPlan,
    /// nn, `[harmonic][wavenumber along the mirror]`, and the rest.
    normal: OnceLock<Vec<f64>>,
    other_planes: OnceLock<Vec<f64>>,
    buffers: Mutex<Option<HalfGridBuffers<f64>>>,
    spacing: [f64; 2],
    admittance: Arc<Admittance>,
    /// In single precision, by what is multiplied: the operator, and its approximate inverse.
    single: [OnceLock<SpectralFilter<HalfGridPlan<f32>>>; PARTS],
    inverse: [OnceLock<SpectralFilter<HalfGridPlan<f32>>>; PARTS],
}

/// Kinds of [`ComponentSet`].
const PARTS: usize = 4;

impl HalfGridFlexibility {
    /// Half of a grid with an even number of cells along axis `across`, the other half of which is its mirror image.
    pub(super) fn new(
        whole: Arc<GridSymbol>,
        spacing: [f64; 2],
        admittance: Arc<Admittance>,
        across: usize,
    ) -> Self {
        Self {
            across,
            plan: HalfGridPlan::new(whole.plan.cells, whole.plan.padded, across),
            whole,
            normal: OnceLock::new(),
            other_planes: OnceLock::new(),
            buffers: Mutex::new(None),
            spacing,
            admittance,
            single: [const { OnceLock::new() }; PARTS],
            inverse: [const { OnceLock::new() }; PARTS],
        }
    }

    fn normal(&self) -> &[f64] {
        self.normal.get_or_init(|| self.folded(self.whole.normal(), 1))
    }

    fn other_planes(&self) -> &[f64] {
        self.other_planes.get_or_init(|| self.folded(self.whole.other_planes(), 0))
    }

    fn folded(&self, symbol: &[f64], own: usize) -> Vec<f64> {
        fold(symbol, own, self.whole.plan.padded, self.across)
    }

    fn parts(&self) -> ComponentSet {
        if self.whole.coupled { ComponentSet::Coupled } else { ComponentSet::Uncoupled }
    }

    /// The P planes of one harmonic.
    fn planes<'s, const P: usize>(&self, symbol: &'s [f64], harmonic: usize) -> [&'s [f64]; P] {
        let [_, length] = ConvolutionPlan::<f64>::spectrum_shape(&self.plan);
        let mut planes = symbol[harmonic * P * length..(harmonic + 1) * P * length].chunks_exact(length);
        std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
    }

    /// A product of C components.
    fn product<const C: usize>(
        &self,
        input: &[f64],
        output: &mut [f64],
        multiply: impl Fn(usize, [&mut [Complex<f64>]; C]) + Sync,
    ) {
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let buffers = buffers.get_or_insert_with(|| self.plan.buffers(3));
        self.plan.apply::<C>(input, output, buffers, multiply);
    }

    fn single(&self, parts: ComponentSet) -> &SpectralFilter<HalfGridPlan<f32>> {
        self.single[parts as usize].get_or_init(|| {
            let plan = HalfGridPlan::new(self.whole.plan.cells, self.whole.plan.padded, self.across);
            match parts {
                ComponentSet::Normal => SpectralFilter::new(plan, parts, &[self.normal()]),
                ComponentSet::Tangential => SpectralFilter::new(plan, parts, &[self.other_planes()]),
                ComponentSet::Uncoupled | ComponentSet::Coupled => {
                    SpectralFilter::new(plan, parts, &[self.normal(), self.other_planes()])
                }
            }
        })
    }

    fn inverse(&self, parts: ComponentSet) -> &SpectralFilter<HalfGridPlan<f32>> {
        self.inverse[parts as usize].get_or_init(|| {
            let padded = self.whole.plan.cells.map(fast_size);
            let symbol = inverse_symbol(parts, padded, self.spacing, &self.admittance);
            let own = usize::from(parts != ComponentSet::Tangential);
            let plan = HalfGridPlan::new(self.whole.plan.cells, padded, self.across);
            SpectralFilter::new(plan, parts, &[&fold(&symbol, own, padded, self.across)])
        })
    }
}

impl Flexibility for HalfGridFlexibility {
    fn n_cells(&self) -> usize {
        self.whole.plan.cells[0] * self.whole.plan.cells[1] / 2
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let (normal, rest) = (self.normal(), self.other_planes());
        self.product::<3>(tractions, gap, |harmonic, columns| {
            let [nn] = self.planes(normal, harmonic);
            if self.whole.coupled {
                multiply_coupled(nn, self.planes(rest, harmonic), columns);
            } else {
                multiply_uncoupled(nn, self.planes(rest, harmonic), columns);
            }
        });
    }

    fn apply_single(&self, tractions: &[f64], gap: &mut [f64]) {
        self.single(self.parts()).apply(tractions, gap);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        let normal = self.normal();
        self.product::<1>(pressure, normal_gap, |harmonic, [values]| {
            let [nn] = self.planes(normal, harmonic);
            values.iter_mut().zip(nn).for_each(|(value, s)| *value *= *s);
        });
    }

    fn apply_normal_single(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.single(ComponentSet::Normal).apply(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        PerCell::Same(self.whole.table.self_influence() * self.whole.coarsening as f64, self.n_cells())
    }

    fn couples_normal_tangential(&self) -> bool {
        self.whole.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.inverse(ComponentSet::Normal).apply(normal_gap, pressure);
        true
    }

    fn precondition(&self, gap: &[f64], tractions: &mut [f64]) -> bool {
        self.inverse(self.parts()).apply(gap, tractions);
        true
    }

    fn grid(&self) -> Option<[usize; 2]> {
        let mut cells = self.whole.plan.cells;
        cells[self.across] /= 2;
        Some(cells)
    }

    fn tangential(&self) -> Option<&dyn TangentialFlexibility> {
        (!self.whole.coupled).then_some(self)
    }
}

impl TangentialFlexibility for HalfGridFlexibility {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        let rest = self.other_planes();
        self.product::<2>(tractions, gap, |harmonic, columns| {
            multiply_tangential(self.planes(rest, harmonic), columns);
        });
    }

    fn apply_tangential_single(&self, tractions: &[f64], gap: &mut [f64]) {
        self.single(ComponentSet::Tangential).apply(tractions, gap);
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        self.inverse(ComponentSet::Tangential).apply(gap, tractions);
    }
}
