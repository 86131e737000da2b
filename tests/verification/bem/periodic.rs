//! Flexibility operators on frames that are periodic in one or both directions.

use super::{Random, cfrp, green, pair, steel};
use crate::crystals::cfrp_of_tables;
use nalgebra::{Complex, Matrix3, Vector3};
use orthowear::bem::half_space::{CrossBlocks, PatchIntegrator, PeriodicFlexibility, Side, SurfaceGreen};
use orthowear::error::ErrorKind;
use orthowear::flexibility::Flexibility;
use orthowear::geometry::fibre_axes;
use std::f64::consts::PI;

fn periodic(
    cells: [usize; 2],
    spacing: [f64; 2],
    directions: [bool; 2],
    green: &SurfaceGreen,
) -> PeriodicFlexibility {
    PeriodicFlexibility::new(cells, spacing, directions, green, CrossBlocks::Keep).expect("an operator")
}

fn applied(operator: &dyn Flexibility, tractions: &[f64]) -> Vec<f64> {
    let mut gap = vec![f64::NAN; tractions.len()];
    operator.apply(tractions, &mut gap);
    gap
}

/// Cut-off function: 1 within half of the reach, 0 beyond the reach, and infinitely smooth between.
fn taper(distance: f64, reach: f64) -> f64 {
    let s = 2.0 * distance / reach - 1.0;
    if s <= 0.0 {
        return 1.0;
    }
    if s >= 1.0 {
        return 0.0;
    }
    let (falling, rising) = ((-1.0 / (1.0 - s)).exp(), (-1.0 / s).exp());
    falling / (falling + rising)
}

/// Truth: the amplitudes of the displacements u3 and u1 under a normal sinusoidal traction on CFRP, published to ten digits (case
/// `aniso-sinusoidal-load` of docs/verification.md). The operator is exact for harmonics that the grid resolves. The tolerance
/// 5e-10 is the rounding of the published values.
#[test]
fn sinusoidal_load_on_cfrp() {
    let below = green(&cfrp_of_tables(), Side::Lower);
    for (cells, directions) in [([64, 1], [true, true]), ([30, 8], [true, true]), ([9, 1], [true, true])] {
        let operator = periodic(cells, [1.0 / cells[0] as f64, 0.3], directions, &below);
        let n = cells[0] * cells[1];
        let phase = |i: usize| 2.0 * PI * (i / cells[1]) as f64 / cells[0] as f64;
        let mut tractions = vec![0.0; 3 * n];
        (0..n).for_each(|i| tractions[2 * n + i] = phase(i).cos());
        let gap = applied(&operator, &tractions);
        for i in 0..n {
            let (u3, u1) = (2.413982615e-5 * phase(i).cos(), 3.569738814e-6 * phase(i).sin());
            assert!((gap[2 * n + i] - u3).abs() < 5e-10 * 2.413982615e-5, "u3 {} {u3}", gap[2 * n + i]);
            assert!((gap[i].abs() - u1.abs()).abs() < 5e-10 * 3.569738814e-6, "u1 {} {u1}", gap[i]);
        }
    }
}

/// Truth: the sum over periodic images in space, for an oblique wave of tractions. A smooth cut-off at the distance 6, six frame
/// lengths along x, makes the tail of the sum vanish. The sum uses cells of constant traction, 80 to a wavelength. Their higher
/// harmonics change the odd entries by (π² / 6) / 80² = 2.6e-4. The tolerance is 5e-4 of the largest entry.
#[test]
fn oblique_wave_equals_the_sum_over_images() {
    let green = pair(30.0);
    let integrator = PatchIntegrator::new(&green);
    let (cells, h) = ([40, 40], [0.025, 0.04]);
    let operator = periodic(cells, h, [true, true], &green);
    let wave = [2.0 * PI / (40.0 * h[0]), 2.0 * PI * 2.0 / (40.0 * h[1])];
    let n = 1600;
    let at = |i: usize| [(i / 40) as f64 * h[0], (i % 40) as f64 * h[1]];
    let direction = [0.3, -0.7, 1.0];
    let mut tractions = vec![0.0; 3 * n];
    for i in 0..n {
        let [x, y] = at(i);
        (0..3).for_each(|c| tractions[c * n + i] = direction[c] * (wave[0] * x + wave[1] * y).cos());
    }
    let gap = applied(&operator, &tractions);
    let sinc = |k: f64, h: f64| (0.5 * k * h).sin() / (0.5 * k * h);
    let h = [h[0] / 2.0, h[1] / 4.0];
    let factor = sinc(wave[0], h[0]) * sinc(wave[1], h[1]);
    let reach = 6.0;
    let mut sum = Vector3::zeros();
    let (half_x, half_y) = ((reach / h[0]) as isize, (reach / h[1]) as isize);
    for ix in -half_x..=half_x {
        for iy in -half_y..=half_y {
            let [x, y] = [ix as f64 * h[0], iy as f64 * h[1]];
            let weight = taper(x.hypot(y), reach);
            if weight > 0.0 {
                let load = weight * (wave[0] * x + wave[1] * y).cos() / factor;
                sum += integrator.rectangle(h, [-x, -y]) * Vector3::from(direction) * load;
            }
        }
    }
    for c in 0..3 {
        let found = gap[c * n];
        assert!((found - sum[c]).abs() < 5e-4 * sum.amax(), "{c}: {found} {}", sum[c]);
    }
}

/// Cosine and sine parts of the displacements of the cells with ix = d. The tractions are cos(k y) on the cells with ix = 0. Here
/// k = 2π `harmonic` / period.
fn column(operator: &PeriodicFlexibility, cells: [usize; 2], harmonic: usize, d: usize) -> [Matrix3<f64>; 2] {
    let n = cells[0] * cells[1];
    let mut parts = [Matrix3::zeros(); 2];
    for component in 0..3 {
        let mut tractions = vec![0.0; 3 * n];
        for iy in 0..cells[1] {
            tractions[component * n + iy] = (2.0 * PI * (harmonic * iy) as f64 / cells[1] as f64).cos();
        }
        let gap = applied(operator, &tractions);
        for row in 0..3 {
            for iy in 0..cells[1] {
                let phase = 2.0 * PI * (harmonic * iy) as f64 / cells[1] as f64;
                let weight = 2.0 / cells[1] as f64 * gap[row * n + d * cells[1] + iy];
                parts[0][(row, component)] += weight * phase.cos();
                parts[1][(row, component)] += weight * phase.sin();
            }
        }
    }
    parts
}

/// Truth: the sum over periodic images of exact cell integrals. Wavelengths are longer or shorter than the frame. Fibres lie in
/// the surface or out of it. The sum has at least 1000 cells of constant traction to a wavelength. Their higher harmonics change
/// the sine part by (π² / 6) / 1000². The tolerance 1e-5 of the largest entry covers the cut-off and these harmonics.
#[test]
fn open_direction_equals_the_sum_over_images() {
    for (tilt, length, harmonic, count) in
        [(30.0, 0.4, 1, 8), (0.0, 0.4, 3, 8), (0.0, 6.0, 1, 8), (90.0, 6.0, 3, 12), (30.0, 0.05, 2, 9)]
    {
        let green = pair(tilt);
        let integrator = PatchIntegrator::new(&green);
        let (cells, h) = ([12, count], 0.1);
        let operator = periodic(cells, [h, length / count as f64], [false, true], &green);
        let k = 2.0 * PI * harmonic as f64 / length;
        let thin = (2.0 * PI / k / 1000.0).min(h / 4.0);
        let factor = (0.5 * k * thin).sin() / (0.5 * k * thin);
        for d in [0, 1, 7] {
            let [even, odd] = column(&operator, cells, harmonic, d);
            let reach = (16.0 * 2.0 * PI / k).max(20.0 * h);
            let half = (reach / thin) as isize;
            let mut sums = [Matrix3::zeros(); 2];
            for j in -half..=half {
                let y = j as f64 * thin;
                let weight = taper(y.abs(), reach) / factor;
                if weight > 0.0 {
                    let block = integrator.rectangle([h, thin], [d as f64 * h, -y]);
                    sums[0] += block * (k * y).cos() * weight;
                    // cos(k (η + y)) = cos(k η) cos(k y) - sin(k η) sin(k y), so the sine part has the factor -sin(k y).
                    sums[1] += block * (k * y).sin() * weight * -1.0;
                }
            }
            let scale = operator.diagonal_blocks()[0].amax();
            assert!(
                (even - sums[0]).amax() < 1e-5 * scale,
                "{tilt} {length} {harmonic} {d}: {even} {}",
                sums[0]
            );
            assert!(
                (odd - sums[1]).amax() < 1e-5 * scale,
                "{tilt} {length} {harmonic} {d}: {odd} {}",
                sums[1]
            );
        }
    }
}

/// Truth: the influences of one very long cell, which is nearly in plane strain. The test compares differences of influences,
/// because the influences depend on the datum of the displacement. Entries that are odd in the distance d differ by d / Y between
/// a cell of length 2 Y and an infinite cell. This is 2e-5 for Y = 5e5 h and d = 9 h, with the cell width h.
#[test]
fn plane_strain_equals_a_long_cell() {
    for tilt in [0.0, 30.0] {
        let green = pair(tilt);
        let integrator = PatchIntegrator::new(&green);
        let (n, h) = (10, 0.2);
        let operator = periodic([n, 1], [h, 1.0], [false, true], &green);
        let mut columns = vec![Matrix3::zeros(); n];
        for component in 0..3 {
            let mut tractions = vec![0.0; 3 * n];
            tractions[component * n] = 1.0;
            let gap = applied(&operator, &tractions);
            (0..n).for_each(|d| (0..3).for_each(|row| columns[d][(row, component)] = gap[row * n + d]));
        }
        let long = |d: usize| integrator.rectangle([h, 1e6 * h], [d as f64 * h, 0.0]);
        for d in 1..n {
            let (found, expected) = (columns[d] - columns[0], long(d) - long(0));
            assert!((found - expected).amax() < 2e-5 * expected.amax(), "{d}: {found} {expected}");
        }
    }
}

/// Truth: the datum of plane strain. A line load on an isotropic half-space causes no displacement at the distance w, which is
/// half the width of the frame. Hence `K_nn(d) = -2 (1 - ν²) / (π E) ∫ ln(|x| / w) dx` over the cell at the distance d.
#[test]
fn plane_strain_vanishes_at_half_the_width() {
    let below = green(&steel(), Side::Lower);
    let (n, h) = (7, 0.3);
    let operator = periodic([n, 1], [h, 5.0], [false, true], &below);
    let mut tractions = vec![0.0; 3 * n];
    tractions[2 * n] = 1.0;
    let gap = applied(&operator, &tractions);
    let w = 0.5 * n as f64 * h;
    let primitive = |x: f64| x * ((x / w).abs().ln() - 1.0);
    for d in 0..n {
        let x = d as f64 * h;
        let integral = primitive(x + 0.5 * h) - primitive(x - 0.5 * h);
        let expected = -2.0 * (1.0 - 0.09) / (PI * 210e3) * integral;
        assert!((gap[2 * n + d] - expected).abs() < 1e-13 * gap[2 * n], "{d}: {} {expected}", gap[2 * n + d]);
    }
}

/// Truth: by Betti's theorem the operator is symmetric on any frame. It is positive definite, except for uniform tractions on a
/// frame that is periodic in both directions.
#[test]
fn symmetric_and_positive() {
    let cases = [
        ([6, 5], [true, true]),
        ([8, 1], [true, true]),
        ([5, 6], [false, true]),
        ([7, 4], [true, false]),
        ([1, 9], [true, false]),
        ([9, 1], [false, true]),
    ];
    for (cells, directions) in cases {
        let operator = periodic(cells, [0.1, 0.15], directions, &pair(30.0));
        let n = operator.n_cells();
        let mut dense = nalgebra::DMatrix::zeros(3 * n, 3 * n);
        for j in 0..3 * n {
            let mut unit = vec![0.0; 3 * n];
            unit[j] = 1.0;
            let gap = applied(&operator, &unit);
            (0..3 * n).for_each(|i| dense[(i, j)] = gap[i]);
        }
        assert!((&dense - dense.transpose()).amax() < 1e-14 * dense.amax(), "{cells:?}");
        let mut eigenvalues: Vec<f64> = dense.clone().symmetric_eigen().eigenvalues.iter().copied().collect();
        eigenvalues.sort_by(f64::total_cmp);
        let uniform = if directions == [true, true] { 3 } else { 0 };
        let largest = eigenvalues[3 * n - 1];
        assert!(
            eigenvalues[..uniform].iter().all(|e| e.abs() < 1e-14 * largest),
            "{cells:?} {eigenvalues:?}"
        );
        assert!(eigenvalues[uniform] > 1e-4 * largest, "{cells:?} {eigenvalues:?}");
        for (i, block) in operator.diagonal_blocks().iter().enumerate() {
            let found = Matrix3::from_fn(|a, b| dense[(a * n + i, b * n + i)]);
            assert!((found - block).amax() < 1e-13 * largest);
        }
        let pressure = Random(5).vector(n);
        let mut normal = vec![0.0; n];
        operator.apply_normal(&pressure, &mut normal);
        for i in 0..n {
            let expected: f64 = (0..n).map(|j| dense[(2 * n + i, 2 * n + j)] * pressure[j]).sum();
            assert!((normal[i] - expected).abs() < 1e-14 * largest * n as f64);
        }
    }
}

/// Truth: the response of a half-space to harmonic tractions (docs/theory-half-space.md, periodic frames). Tractions v exp(i m·x)
/// with the wave vector m displace the cell centres by W(m) v exp(i m·x) / |m|. The surface admittance W comes from the series of
/// the Green's function. The tolerance 1e-12 covers the Fourier transforms and the table of directions.
#[test]
fn single_harmonics_have_the_exact_admittance() {
    let spacing = [0.1, 0.15];
    let v = [Complex::new(0.3, -0.8), Complex::new(-0.7, 0.2), Complex::new(1.0, 0.5)];
    for (cells, waves) in [
        ([24, 18], [1.0, 0.0]),
        ([24, 18], [0.0, 8.0]),
        ([24, 18], [5.0, -7.0]),
        ([7, 9], [3.0, 4.0]),
        ([40, 1], [19.0, 0.0]),
        ([1, 30], [0.0, -2.0]),
    ] {
        for tilt in [0.0, 30.0] {
            let green = pair(tilt);
            let operator = periodic(cells, spacing, [true, true], &green);
            let n = operator.n_cells();
            let m = [0, 1].map(|axis| 2.0 * PI * waves[axis] / (cells[axis] as f64 * spacing[axis]));
            let values = |amplitude: [Complex<f64>; 3]| -> Vec<f64> {
                let phase = |i: usize| {
                    m[0] * (i / cells[1]) as f64 * spacing[0] + m[1] * (i % cells[1]) as f64 * spacing[1]
                };
                (0..3 * n).map(|i| (amplitude[i / n] * Complex::cis(phase(i % n))).re).collect()
            };
            let moved = green.symbol(m[1].atan2(m[0])) * Vector3::from(v) / Complex::from(m[0].hypot(m[1]));
            let (gap, expected) = (applied(&operator, &values(v)), values(moved.into()));
            let scale = moved.iter().fold(0.0_f64, |largest, entry| largest.max(entry.norm()));
            for (found, expected) in gap.iter().zip(&expected) {
                assert!(
                    (found - expected).abs() < 1e-12 * scale,
                    "{cells:?} {waves:?} {tilt}: {found} {expected}"
                );
            }
        }
    }
}

/// Truth: plain sums over all pairs of cells. The influence of a cell equals the influence of the first cell, shifted by the
/// distance of the cells. In periodic directions the shift is cyclic. In open directions, Betti's theorem gives the blocks of
/// backward shifts as transposed blocks. The tolerance is 1e-13 × the number of cells × the largest entry of a diagonal block.
#[test]
fn products_are_plain_convolutions() {
    let cases = [
        ([6, 5], [true, true]),
        ([12, 8], [false, true]),
        ([7, 10], [true, false]),
        ([20, 1], [false, true]),
        ([1, 15], [true, false]),
    ];
    for (cells, directions) in cases {
        let operator = periodic(cells, [0.1, 0.15], directions, &pair(30.0));
        let n = operator.n_cells();
        let column = |cell: usize| -> Vec<Matrix3<f64>> {
            let gaps: Vec<Vec<f64>> = (0..3)
                .map(|component| {
                    let mut tractions = vec![0.0; 3 * n];
                    tractions[component * n + cell] = 1.0;
                    applied(&operator, &tractions)
                })
                .collect();
            (0..n).map(|i| Matrix3::from_fn(|row, component| gaps[component][row * n + i])).collect()
        };
        let first = column(0);
        let block = |[dx, dy]: [isize; 2]| {
            let backward = if directions[0] { dy < 0 } else { dx < 0 };
            let offset = if !(directions[0] && directions[1]) && backward { [-dx, -dy] } else { [dx, dy] };
            let [ix, iy] = [0, 1].map(|axis| offset[axis].rem_euclid(cells[axis] as isize) as usize);
            let block = first[ix * cells[1] + iy];
            if offset == [dx, dy] { block } else { block.transpose() }
        };
        let tractions = Random(11).vector(3 * n);
        let gap = applied(&operator, &tractions);
        let place = |cell: usize| [(cell / cells[1]) as isize, (cell % cells[1]) as isize];
        let scale = first[0].amax();
        for i in 0..n {
            let mut sum = Vector3::zeros();
            for j in 0..n {
                let (to, from) = (place(i), place(j));
                let load = Vector3::from_fn(|component, _| tractions[component * n + j]);
                sum += block([to[0] - from[0], to[1] - from[1]]) * load;
            }
            for c in 0..3 {
                let found = gap[c * n + i];
                assert!(
                    (found - sum[c]).abs() < 1e-13 * n as f64 * scale,
                    "{cells:?} {i}: {found} {}",
                    sum[c]
                );
            }
        }
    }
}

/// Truth: uniform tractions on a frame that is periodic in both directions cause no displacement.
#[test]
fn uniform_tractions_move_nothing() {
    let operator = periodic([30, 30], [0.1, 0.15], [true, true], &pair(30.0));
    let gap = applied(&operator, &vec![7.0; 2700]);
    let scale = 7.0 * operator.diagonal_blocks()[0].amax();
    assert!(gap.iter().all(|moved| moved.abs() < 1e-12 * scale), "{gap:?}");
}

/// Truth: a rotation of frame and material by 90 degrees only renames the axes.
#[test]
fn periodic_along_x_equals_periodic_along_y() {
    let turned = cfrp(30.0).rotated(&fibre_axes(0.0, PI / 2.0));
    let (cells, spacing) = ([5, 8], [0.1, 0.07]);
    let along_y = periodic(cells, spacing, [false, true], &green(&cfrp(30.0), Side::Lower));
    let along_x = periodic([8, 5], [0.07, 0.1], [true, false], &green(&turned, Side::Lower));
    let n = 40;
    let values = Random(3).vector(3 * n);
    let turn = |planes: &[f64]| {
        let mut out = vec![0.0; 3 * n];
        for ix in 0..5 {
            for iy in 0..8 {
                // Rotation by +90 degrees maps (x, y) to (-y, x).
                let (from, to) = (ix * 8 + iy, (7 - iy) * 5 + ix);
                out[to] = -planes[n + from];
                out[n + to] = planes[from];
                out[2 * n + to] = planes[2 * n + from];
            }
        }
        out
    };
    let (expected, found) = (turn(&applied(&along_y, &values)), applied(&along_x, &turn(&values)));
    let scale = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (a, b) in found.iter().zip(&expected) {
        assert!((a - b).abs() < 1e-12 * scale, "{a} {b}");
    }
}

/// Truth: one and three threads give the same bits.
#[test]
fn same_bits_for_any_number_of_threads() {
    for directions in [[true, true], [false, true], [true, false]] {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| {
                let operator = periodic([20, 18], [0.1, 0.1], directions, &pair(30.0));
                applied(&operator, &Random(9).vector(3 * 360))
            })
        };
        assert_eq!(run(1), run(3));
    }
}

/// Truth: invalid frames are input errors.
#[test]
fn nonsense_is_refused() {
    let green = green(&steel(), Side::Lower);
    let refused = |cells, spacing, directions, word: &str| {
        let error = PeriodicFlexibility::new(cells, spacing, directions, &green, CrossBlocks::Keep)
            .err()
            .expect("refused");
        assert!(error.kind() == ErrorKind::Input && error.message().contains(word), "{error}");
    };
    refused([1, 1], [1.0, 1.0], [true, true], "one cell");
    refused([0, 4], [1.0, 1.0], [true, true], "at least one");
    refused([4, 4], [1.0, -1.0], [true, false], "positive");
    refused([4, 4], [1.0, 1e-4], [false, true], "more equal");
    // The period of 360 000 cell widths exceeds the limit of 2π 2^19 / 35 = 94 119.
    refused([4, 400], [1e-3, 0.9], [false, true], "use a shorter period or wider cells");
}
