//! Flexibility of half-spaces on half of a uniform grid whose other half is its mirror image.

use std::sync::{Arc, Mutex, OnceLock};

use nalgebra::{Complex, Matrix3};

use super::admittance::Admittance;
use super::fft_plan::{Transforms, fast_size};
use super::filter::{Filter, Parts};
use super::grid_symbol::GridSymbol;
use super::mirror_plan::{MirrorBuffers, MirrorPlan, fold};
use super::symbol::{multiply_coupled, multiply_tangential, multiply_uncoupled};
use super::symbol_inverse::inverse_symbol;
use crate::linalg::PerCell;
use crate::linalg::operator::{Flexibility, TangentialFlexibility};

/// The operator on the half of a grid away from the mirror, for tractions whose images act on the other half.
///
/// Its diagonal is that of the whole grid: what a cell does to itself, without its image.
pub(super) struct MirrorFlexibility {
    whole: Arc<GridSymbol>,
    across: usize,
    plan: MirrorPlan,
    /// nn, `[harmonic][wavenumber along the mirror]`, and the rest.
    normal: OnceLock<Vec<f64>>,
    rest: OnceLock<Vec<f64>>,
    buffers: Mutex<Option<MirrorBuffers<f64>>>,
    spacing: [f64; 2],
    admittance: Arc<Admittance>,
    /// In single precision, by what is multiplied: the operator, and its approximate inverse.
    single: [OnceLock<Filter<MirrorPlan<f32>>>; PARTS],
    inverse: [OnceLock<Filter<MirrorPlan<f32>>>; PARTS],
}

/// Kinds of [`Parts`].
const PARTS: usize = 4;

impl MirrorFlexibility {
    /// Half of a grid with an even number of cells along axis `across`, the other half of which is its mirror image.
    pub(super) fn new(
        whole: Arc<GridSymbol>,
        spacing: [f64; 2],
        admittance: Arc<Admittance>,
        across: usize,
    ) -> Self {
        Self {
            across,
            plan: MirrorPlan::new(whole.plan.cells, whole.plan.padded, across),
            whole,
            normal: OnceLock::new(),
            rest: OnceLock::new(),
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

    fn rest(&self) -> &[f64] {
        self.rest.get_or_init(|| self.folded(self.whole.rest(), 0))
    }

    fn folded(&self, symbol: &[f64], own: usize) -> Vec<f64> {
        fold(symbol, own, self.whole.plan.padded, self.across)
    }

    fn parts(&self) -> Parts {
        if self.whole.coupled { Parts::Coupled } else { Parts::Uncoupled }
    }

    /// The P planes of one harmonic.
    fn planes<'s, const P: usize>(&self, symbol: &'s [f64], harmonic: usize) -> [&'s [f64]; P] {
        let [_, length] = Transforms::<f64>::columns(&self.plan);
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

    fn single(&self, parts: Parts) -> &Filter<MirrorPlan<f32>> {
        self.single[parts as usize].get_or_init(|| {
            let plan = MirrorPlan::new(self.whole.plan.cells, self.whole.plan.padded, self.across);
            match parts {
                Parts::Normal => Filter::new(plan, parts, &[self.normal()]),
                Parts::Tangential => Filter::new(plan, parts, &[self.rest()]),
                Parts::Uncoupled | Parts::Coupled => Filter::new(plan, parts, &[self.normal(), self.rest()]),
            }
        })
    }

    fn inverse(&self, parts: Parts) -> &Filter<MirrorPlan<f32>> {
        self.inverse[parts as usize].get_or_init(|| {
            let padded = self.whole.plan.cells.map(fast_size);
            let symbol = inverse_symbol(parts, padded, self.spacing, &self.admittance);
            let own = usize::from(parts != Parts::Tangential);
            let plan = MirrorPlan::new(self.whole.plan.cells, padded, self.across);
            Filter::new(plan, parts, &[&fold(&symbol, own, padded, self.across)])
        })
    }
}

impl Flexibility for MirrorFlexibility {
    fn n_cells(&self) -> usize {
        self.whole.plan.cells[0] * self.whole.plan.cells[1] / 2
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let (normal, rest) = (self.normal(), self.rest());
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
        self.single(Parts::Normal).apply(pressure, normal_gap);
    }

    fn diagonal_blocks(&self) -> PerCell<Matrix3<f64>> {
        PerCell::Same(self.whole.table.own() * self.whole.factor as f64, self.n_cells())
    }

    fn couples_normal_tangential(&self) -> bool {
        self.whole.coupled
    }

    fn precondition_normal(&self, normal_gap: &[f64], pressure: &mut [f64]) -> bool {
        self.inverse(Parts::Normal).apply(normal_gap, pressure);
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

impl TangentialFlexibility for MirrorFlexibility {
    fn apply_tangential(&self, tractions: &[f64], gap: &mut [f64]) {
        let rest = self.rest();
        self.product::<2>(tractions, gap, |harmonic, columns| {
            multiply_tangential(self.planes(rest, harmonic), columns);
        });
    }

    fn apply_tangential_single(&self, tractions: &[f64], gap: &mut [f64]) {
        self.single(Parts::Tangential).apply(tractions, gap);
    }

    fn precondition_tangential(&self, gap: &[f64], tractions: &mut [f64]) {
        self.inverse(Parts::Tangential).apply(gap, tractions);
    }
}
