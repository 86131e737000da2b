//! Products in the wavenumber domain in single precision, for preconditioners. Input and symbol are scaled to magnitude 1, so that
//! no system of units exceeds the range of single precision.

use std::sync::Mutex;

use nalgebra::Complex;
use rayon::prelude::*;

use crate::bem::half_space::grid::fft_plan::{PaddedGridBuffers, PaddedGridPlan};
use crate::bem::half_space::grid::symbol::{
    COUPLED, UNCOUPLED, multiply_coupled, multiply_tangential, multiply_uncoupled,
};

const LANES: usize = 8;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bem::half_space) enum ComponentSet {
    Normal,
    Tangential,
    /// Normal and tangential components without coupling between them.
    Uncoupled,
    Coupled,
}

impl ComponentSet {
    pub(super) const COUNT: usize = 4;

    fn n_components(self) -> usize {
        match self {
            Self::Normal => 1,
            Self::Tangential => 2,
            Self::Uncoupled | Self::Coupled => 3,
        }
    }

    /// Number of planes of a symbol. The first plane is nn if the set includes the normal component.
    pub(super) fn n_planes(self) -> usize {
        match self {
            Self::Normal => 1,
            Self::Tangential => UNCOUPLED,
            Self::Uncoupled => 1 + UNCOUPLED,
            Self::Coupled => 1 + COUPLED,
        }
    }
}

pub(in crate::bem::half_space) struct SpectralFilter {
    convolution: PaddedGridPlan<f32>,
    parts: ComponentSet,
    /// `[k_y][planes][padded_x]`, divided by its largest magnitude `size`.
    symbol: Vec<f32>,
    size: f64,
    buffers: Mutex<PaddedGridBuffers<f32>>,
}

impl SpectralFilter {
    /// Joins the planes of `symbols`, each `[k_y][planes][padded_x]`, in this order.
    /// The symbols contain the factor 1/(number of padded cells).
    pub(super) fn new(convolution: PaddedGridPlan<f32>, parts: ComponentSet, symbols: &[&[f64]]) -> Self {
        let size = symbols.iter().map(|symbol| max_abs(symbol)).fold(0.0, f64::max);
        let half = convolution.half_spectrum();
        let mut symbol = vec![0.0; symbols.iter().map(|planes| planes.len()).sum()];
        let row = symbol.len() / half;
        symbol.par_chunks_exact_mut(row).enumerate().for_each(|(ky, row)| {
            let columns = symbols.iter().flat_map(|planes| planes.chunks_exact(planes.len() / half).nth(ky));
            row.iter_mut().zip(columns.flatten()).for_each(|(to, value)| *to = (value / size) as f32);
        });
        let buffers = Mutex::new(convolution.buffers(parts.n_components()));
        Self { convolution, parts, symbol, size, buffers }
    }

    /// Filters `input`, which has one plane of cell values for each component, and writes the result to `output`.
    pub(in crate::bem::half_space) fn apply(&self, input: &[f64], output: &mut [f64]) {
        let scale = max_abs(input);
        if scale.is_nan() || scale == 0.0 {
            output.fill(0.0 * scale);
            return;
        }
        let (px, planes) = (self.convolution.padded[0], self.parts.n_planes());
        let scales = [1.0 / scale, scale * self.size];
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        let row = |ky: usize| &self.symbol[ky * planes * px..(ky + 1) * planes * px];
        match self.parts {
            ComponentSet::Normal => {
                let multiply = |ky: usize, [column]: [&mut [Complex<f32>]; 1]| {
                    column.iter_mut().zip(row(ky)).for_each(|(value, factor)| *value *= *factor);
                };
                self.convolution.apply_scaled::<1>(input, output, &mut buffers, scales, multiply);
            }
            ComponentSet::Tangential => {
                let multiply = |ky: usize, columns: [&mut [Complex<f32>]; 2]| {
                    multiply_tangential(split(row(ky), px), columns);
                };
                self.convolution.apply_scaled::<2>(input, output, &mut buffers, scales, multiply);
            }
            ComponentSet::Uncoupled => {
                let multiply = |ky: usize, columns: [&mut [Complex<f32>]; 3]| {
                    let (nn, rest) = row(ky).split_at(px);
                    multiply_uncoupled(nn, split(rest, px), columns);
                };
                self.convolution.apply_scaled::<3>(input, output, &mut buffers, scales, multiply);
            }
            ComponentSet::Coupled => {
                let multiply = |ky: usize, columns: [&mut [Complex<f32>]; 3]| {
                    let (nn, rest) = row(ky).split_at(px);
                    multiply_coupled(nn, split(rest, px), columns);
                };
                self.convolution.apply_scaled::<3>(input, output, &mut buffers, scales, multiply);
            }
        }
    }
}

fn split<const P: usize>(planes: &[f32], px: usize) -> [&[f32]; P] {
    let mut planes = planes.chunks_exact(px);
    std::array::from_fn(|_| planes.next().expect("as many planes as the layout has"))
}

/// Largest magnitude; NaN if any value is not finite.
fn max_abs(values: &[f64]) -> f64 {
    let (mut magnitudes, mut sums) = ([0.0_f64; LANES], [0.0; LANES]);
    let chunks = values.chunks_exact(LANES);
    let rest = chunks.remainder();
    let mut take = |chunk: &[f64]| {
        for ((magnitude, sum), value) in magnitudes.iter_mut().zip(&mut sums).zip(chunk) {
            *magnitude = if value.abs() > *magnitude { value.abs() } else { *magnitude };
            *sum += 0.0 * value;
        }
    };
    chunks.for_each(&mut take);
    take(rest);
    magnitudes.into_iter().fold(0.0, f64::max) + sums.iter().sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the largest absolute value by inspection, 0 for an empty list, NaN for a list with NaN.
    #[test]
    fn the_largest_of_some() {
        let mut values: Vec<f64> = (0..21).map(|k| f64::from(k % 7) - 4.5).collect();
        assert_eq!(max_abs(&values), 4.5);
        values[20] = -7.0;
        assert_eq!(max_abs(&values), 7.0);
        values[3] = f64::NAN;
        assert!(max_abs(&values).is_nan());
        assert_eq!(max_abs(&[]), 0.0);
    }
}
