//! Cost of one Fourier transform of the frame, padded to twice its size. The time of all transforms is a lower bound
//! for the time of a contact solution.

use std::time::Instant;

use realfft::RealFftPlanner;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Number of columns that are transposed together.
const BLOCK: usize = 16;

/// Seconds of one real transform of 2n x 2n values on one thread: the smallest of several repetitions.
pub fn seconds(n: usize) -> f64 {
    let m = 2 * n;
    let rows = RealFftPlanner::<f64>::new().plan_fft_forward(m);
    let columns = FftPlanner::<f64>::new().plan_fft_forward(m);
    let width = m / 2 + 1;
    let values: Vec<f64> = (0..m * m).map(|i| (i % 97) as f64).collect();
    let mut input = vec![0.0; m];
    let mut spectrum = vec![Complex::default(); m * width];
    let mut block = vec![Complex::default(); m * BLOCK];
    let mut scratch = vec![Complex::default(); rows.get_scratch_len().max(columns.get_inplace_scratch_len())];
    let mut least = f64::INFINITY;
    for _ in 0..(1 << 22) / (m * m) + 3 {
        let started = Instant::now();
        for (row, out) in values.chunks(m).zip(spectrum.chunks_mut(width)) {
            input.copy_from_slice(row);
            rows.process_with_scratch(&mut input, out, &mut scratch).expect("buffers of the plan's lengths");
        }
        for first in (0..width).step_by(BLOCK) {
            let some = BLOCK.min(width - first);
            for (i, row) in spectrum.chunks(width).enumerate() {
                (0..some).for_each(|k| block[k * m + i] = row[first + k]);
            }
            columns.process_with_scratch(&mut block[..some * m], &mut scratch);
            for (i, row) in spectrum.chunks_mut(width).enumerate() {
                (0..some).for_each(|k| row[first + k] = block[k * m + i]);
            }
        }
        least = least.min(started.elapsed().as_secs_f64());
    }
    assert!(spectrum[0].re > 0.0, "the transform of positive values");
    least
}
