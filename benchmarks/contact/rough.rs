//! Self-affine rough surface with the Hurst exponent 0.8: a sum of waves with random phases. The surface is the same on
//! every grid.

use std::f64::consts::PI;
use std::fmt::Write;
use std::path::Path;

use super::Outcome;

/// Number of wavelengths across the frame for the longest waves.
const LONGEST: i32 = 2;
/// Number of wavelengths across the frame for the shortest waves.
const SHORTEST: i32 = 32;
const HURST: f64 = 0.8;
/// Share of the frame in real contact, which determines the force.
const CONTACT: f64 = 0.01;

/// Waves (kx, ky, amplitude, phase) of the surface on a frame of unit width, with kx ≥ 0.
pub struct Rough {
    waves: Vec<(i32, i32, f64, f64)>,
}

impl Default for Rough {
    /// The surface of the benchmark, with a fixed seed and a root mean square slope of 0.1.
    fn default() -> Self {
        let mut state = 20_261_121_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut waves = Vec::new();
        for kx in 0..=SHORTEST {
            for ky in -SHORTEST..=SHORTEST {
                let k = f64::from(kx).hypot(f64::from(ky));
                let phase = 2.0 * PI * random();
                let half_plane = kx > 0 || ky > 0;
                if half_plane && (f64::from(LONGEST)..=f64::from(SHORTEST)).contains(&k) {
                    waves.push((kx, ky, k.powf(-1.0 - HURST), phase));
                }
            }
        }
        let slope = |waves: &[(i32, i32, f64, f64)]| -> f64 {
            let square = |&(kx, ky, a, _): &(i32, i32, f64, f64)| {
                0.5 * (2.0 * PI * a).powi(2) * (f64::from(kx).powi(2) + f64::from(ky).powi(2))
            };
            waves.iter().map(square).sum::<f64>().sqrt()
        };
        let factor = SLOPE / slope(&waves);
        waves.iter_mut().for_each(|wave| wave.2 *= factor);
        Self { waves }
    }
}

const SLOPE: f64 = 0.1;

impl Rough {
    /// Normal force at which about the share CONTACT of a frame of unit area is in contact. `reduced` is the modulus
    /// E*, MPa. For these few waves, a mean pressure p gives the contact area 2.7 p / (E* slope).
    pub fn force(&self, reduced: f64) -> f64 {
        CONTACT * reduced * SLOPE / 2.7
    }

    /// Heights above the deepest point at the centres of `n` x `n` cells, first index along x.
    pub fn heights(&self, n: usize) -> Vec<f64> {
        let place = |i: usize| 2.0 * PI * ((i as f64 + 0.5) / n as f64 - 0.5);
        let (count, offset) = (2 * SHORTEST as usize + 1, SHORTEST);
        // Each wave is amplitude times the cosine of 2 pi (kx x + ky y) + phase. For each x and ky, the sum over kx is
        // evaluated once, as real and imaginary parts.
        let mut heights = vec![0.0; n * n];
        for (i, row) in heights.chunks_mut(n).enumerate() {
            let mut sums = vec![[0.0; 2]; count];
            for &(kx, ky, amplitude, phase) in &self.waves {
                let (sin, cos) = (f64::from(kx) * place(i) + phase).sin_cos();
                let sum = &mut sums[(ky + offset) as usize];
                *sum = [sum[0] + amplitude * cos, sum[1] + amplitude * sin];
            }
            for (j, height) in row.iter_mut().enumerate() {
                for (k, [real, imaginary]) in sums.iter().enumerate() {
                    let (sin, cos) = ((k as i32 - offset) as f64 * place(j)).sin_cos();
                    *height += real * cos - imaginary * sin;
                }
            }
        }
        let deepest = heights.iter().copied().fold(f64::INFINITY, f64::min);
        heights.iter_mut().for_each(|height| *height -= deepest);
        heights
    }

    /// Writes the heights as a table, one line per position along x.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path, n: usize) -> Outcome<()> {
        let mut text = String::new();
        for row in self.heights(n).chunks(n) {
            for (j, height) in row.iter().enumerate() {
                write!(text, "{}{height:.9e}", if j > 0 { "," } else { "" })?;
            }
            text.push('\n');
        }
        Ok(std::fs::write(path, text)?)
    }
}
