//! An approximate inverse of the normal flexibility of half-spaces on a grid, for preconditioning: κ / W_nn in the
//! wavenumber domain of the grid taken as periodic.
//!
//! The error is what the repeated grid adds far from a load. Padding, which would take four times the work, saves no iteration
//! of conjugate gradients.
//!
//! # Source
//! Vollebregt 2014, "A new solver for the elastic normal contact problem using conjugate gradients, deflation, and an FFT-based
//! preconditioner".

use std::f64::consts::PI;
use std::sync::Mutex;

use super::fft_plan::{Buffers, Convolution};
use super::green::SurfaceGreen;

/// Directions over half a turn in which W_nn is tabulated: to be right within a few per cent.
const DIRECTIONS: usize = 64;

/// The zero wavenumber counts as this share of the lowest.
const LOWEST: f64 = 0.5;

/// W_nn over half a turn, 1/MPa, `[DIRECTIONS]`.
pub(super) fn normal_compliance(green: &SurfaceGreen) -> Vec<f64> {
    (0..DIRECTIONS).map(|i| green.symbol(PI * i as f64 / DIRECTIONS as f64)[(2, 2)].re).collect()
}

/// Multiplies by κ / W_nn.
pub(super) struct NormalInverse {
    convolution: Convolution,
    /// `[k_y][padded_x]`, 1/(padded size) included.
    multiplier: Vec<f64>,
    buffers: Mutex<Buffers>,
}

impl NormalInverse {
    /// For a grid of `cells` with sides `spacing` (mm), `compliance` from [`normal_compliance`].
    pub(super) fn new(cells: [usize; 2], spacing: [f64; 2], compliance: &[f64]) -> Self {
        let convolution = Convolution::periodic(cells);
        let [px, py] = convolution.padded;
        let lowest = [0, 1].map(|axis| 2.0 * PI / (convolution.padded[axis] as f64 * spacing[axis]));
        let floor = LOWEST * lowest[0].min(lowest[1]);
        let weight = 1.0 / (px * py) as f64;
        let mut multiplier = Vec::with_capacity(px * convolution.half_spectrum());
        for ky in 0..convolution.half_spectrum() {
            for kx in 0..px {
                let x = if 2 * kx <= px { kx as f64 } else { kx as f64 - px as f64 } * lowest[0];
                let y = ky as f64 * lowest[1];
                let angle = y.atan2(x).rem_euclid(PI);
                let direction = (angle / PI * compliance.len() as f64).round() as usize % compliance.len();
                multiplier.push(x.hypot(y).max(floor) / compliance[direction] * weight);
            }
        }
        let buffers = Mutex::new(convolution.buffers(1));
        Self { convolution, multiplier, buffers }
    }

    /// `pressure` from `normal_gap`, both `[N]`; does not allocate.
    pub(super) fn apply(&self, normal_gap: &[f64], pressure: &mut [f64]) {
        let px = self.convolution.padded[0];
        let mut buffers = self.buffers.lock().expect("no panic while the buffers are held");
        self.convolution.apply::<1>(normal_gap, pressure, &mut buffers, |ky, [column]| {
            let row = &self.multiplier[ky * px..(ky + 1) * px];
            column.iter_mut().zip(row).for_each(|(value, factor)| *value *= *factor);
        });
    }
}
