//! Harmonics of tractions and displacements on frames that repeat themselves, by plain sums: what transforms are held against.

use std::f64::consts::PI;

use nalgebra::Complex;

use crate::bem::half_space::green::admittance::{Admittance, Hermitian, hermitian};
use crate::bem::half_space::periodic::open_direction::OpenDirection;

type Vector = [Complex<f64>; 3];

const ZERO: Vector = [Complex::new(0.0, 0.0); 3];

/// Shares of the cells along a periodic direction that are the waves of a harmonic, besides the lowest ones; in thousandths.
const CHECKED_WAVES_PER_MILLE: [i64; 3] = [63, 211, 389];

/// Targets along an open direction, for each harmonic of the other one.
const TARGETS: usize = 16;

/// Terms of the sums over wavenumbers of a harmonic along an open direction, at most; longer waves are left out.
const TERMS: usize = 10_000_000;

/// A cut of the unit circle into `count` equal parts, exp(2π i k / count) at k.
struct RootsOfUnity(Vec<Complex<f64>>);

impl RootsOfUnity {
    fn new(count: usize) -> Self {
        Self((0..count).map(|k| Complex::cis(2.0 * PI * k as f64 / count as f64)).collect())
    }

    /// exp(2π i waves place / count).
    fn at(&self, waves: i64, place: usize) -> Complex<f64> {
        let count = self.0.len() as i64;
        self.0[(waves.rem_euclid(count) * place as i64 % count) as usize]
    }
}

/// Numbers of waves along a periodic direction of `count` cells that are each a harmonic of their own: neither uniform nor of two
/// cells; ascending.
fn checked_wave_counts(count: usize) -> Vec<i64> {
    let mut waves: Vec<i64> = [1, 2]
        .into_iter()
        .chain(CHECKED_WAVES_PER_MILLE.map(|share| (share * count as i64 + 999) / 1000))
        .collect();
    waves.retain(|wave| 2 * wave < count as i64);
    waves.sort_unstable();
    waves.dedup();
    waves
}

/// The product with a Hermitian matrix.
fn product([xx, yy, nn, xy, xy_im, xn, xn_im, yn, yn_im]: Hermitian, [x, y, n]: Vector) -> Vector {
    let [xy, xn, yn] = [(xy, xy_im), (xn, xn_im), (yn, yn_im)].map(|(re, im)| Complex::new(re, im));
    [x * xx + xy * y + xn * n, xy.conj() * x + y * yy + yn * n, xn.conj() * x + yn.conj() * y + n * nn]
}

/// Harmonics of the displacements, as they are and as they follow from the tractions: `[count]` each.
pub(super) struct Harmonics {
    pub found: Vec<Vector>,
    pub expected: Vec<Vector>,
}

/// A grid of `cells` of the sides `spacing` (mm) that repeats itself, with `[3, N]` tractions and displacements by planes.
pub(super) struct PeriodicState<'a> {
    pub cells: [usize; 2],
    pub spacing: [f64; 2],
    pub admittance: &'a Admittance,
    pub tractions: &'a [f64],
    pub displacements: &'a [f64],
}

impl PeriodicState<'_> {
    fn n(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// Some harmonics of a frame that repeats itself in both directions: W(m) / κ of those of the tractions.
    pub(super) fn doubly_periodic(&self) -> Harmonics {
        let circles = self.cells.map(RootsOfUnity::new);
        let along = self.cells.map(checked_wave_counts);
        let mut pairs: Vec<[i64; 2]> = along[0].iter().map(|&x| [x, 0]).collect();
        pairs.extend(along[1].iter().map(|&y| [0, y]));
        // Oblique ones, leaning to both sides.
        for (k, (&x, &y)) in along[0].iter().zip(along[1].iter().rev()).enumerate() {
            pairs.push([x, if k % 2 == 0 { y } else { -y }]);
        }
        let period = [0, 1].map(|axis| self.cells[axis] as f64 * self.spacing[axis]);
        let harmonics = pairs.into_iter().map(|pair| {
            let [found, load] = [self.displacements, self.tractions].map(|values| {
                self.harmonic(values, |ix, iy| {
                    (circles[0].at(pair[0], ix) * circles[1].at(pair[1], iy)).conj()
                })
            });
            let wavevector = [0, 1].map(|axis| 2.0 * PI * pair[axis] as f64 / period[axis]);
            (found, product(hermitian(&self.admittance.at(wavevector)), load))
        });
        let (found, expected) = harmonics.unzip();
        Harmonics { found, expected }
    }

    /// The weighted mean over the cells.
    fn harmonic(&self, values: &[f64], weight: impl Fn(usize, usize) -> Complex<f64>) -> Vector {
        let (n, ny) = (self.n(), self.cells[1]);
        let mut sum = ZERO;
        for cell in (0..n).filter(|&cell| (0..3).any(|c| values[c * n + cell] != 0.0)) {
            let weight = weight(cell / ny, cell % ny);
            sum.iter_mut().enumerate().for_each(|(c, sum)| *sum += weight * values[c * n + cell]);
        }
        sum.map(|sum| sum / n as f64)
    }

    /// Some harmonics along the periodic direction of a frame that is open along `line`'s axis, in some of its loaded rows of
    /// cells: the convolution of those of the tractions with K(d).
    pub(super) fn singly_periodic(&self, line: &OpenDirection) -> Harmonics {
        let (axis, count) = (line.axis, self.cells[1 - line.axis]);
        let circle = RootsOfUnity::new(count);
        let mut harmonics = Harmonics { found: Vec::new(), expected: Vec::new() };
        let loaded = self.loaded_rows(axis);
        let targets = TARGETS.min(loaded.len());
        let targets: Vec<usize> =
            (0..targets).map(|k| loaded[(2 * k + 1) * loaded.len() / (2 * targets)]).collect();
        for wave in [0].into_iter().chain(checked_wave_counts(count)) {
            if wave > 0
                && loaded.len() * line.wraparound_free_period(line.wavenumber(wave as usize, count)) > TERMS
            {
                continue;
            }
            let [found, load] = [self.displacements, self.tractions]
                .map(|values| self.row_harmonics(values, axis, |place| circle.at(wave, place).conj()));
            harmonics.found.extend(targets.iter().map(|&target| found[target]));
            harmonics.expected.extend(line.convolved(wave as usize, count, &load, &targets));
        }
        harmonics
    }

    /// Cells along `axis` whose row along the other one carries tractions.
    fn loaded_rows(&self, axis: usize) -> Vec<usize> {
        let (n, ny) = (self.n(), self.cells[1]);
        let mut loaded = vec![false; self.cells[axis]];
        for (k, _) in self.tractions.iter().enumerate().filter(|(_, traction)| **traction != 0.0) {
            let cell = k % n;
            loaded[[cell / ny, cell % ny][axis]] = true;
        }
        (0..loaded.len()).filter(|&row| loaded[row]).collect()
    }

    /// The weighted means along the other axis than `axis`, for each cell along that one.
    fn row_harmonics(
        &self,
        values: &[f64],
        axis: usize,
        weight: impl Fn(usize) -> Complex<f64>,
    ) -> Vec<Vector> {
        let (n, ny) = (self.n(), self.cells[1]);
        let mut sums = vec![ZERO; self.cells[axis]];
        for cell in 0..n {
            let place = [cell / ny, cell % ny];
            let weight = weight(place[1 - axis]);
            let sum = &mut sums[place[axis]];
            sum.iter_mut().enumerate().for_each(|(c, sum)| *sum += weight * values[c * n + cell]);
        }
        let count = self.cells[1 - axis] as f64;
        sums.iter_mut().flatten().for_each(|sum| *sum /= count);
        sums
    }
}

impl OpenDirection<'_> {
    /// The displacement in the cells `targets` along the line by the tractions `loads` (`[cells]`), both of the harmonic `index`
    /// of the `count` cells in the periodic direction, but that of two cells: by plain sums over wavenumbers, or over the cells.
    fn convolved(&self, index: usize, count: usize, loads: &[Vector], targets: &[usize]) -> Vec<Vector> {
        let loaded: Vec<usize> = (0..loads.len()).filter(|&cell| loads[cell] != ZERO).collect();
        if index == 0 {
            let from = |target: usize| {
                loaded.iter().fold(ZERO, |mut sum, &cell| {
                    let offset = target as isize - cell as isize;
                    add(&mut sum, self.influence(offset, loads[cell]));
                    sum
                })
            };
            return targets.iter().map(|&target| from(target)).collect();
        }
        let k = self.wavenumber(index, count);
        let period = self.wraparound_free_period(k);
        let circle = RootsOfUnity::new(period);
        let mut sums = vec![ZERO; targets.len()];
        for wave in 0..period {
            let mut load = ZERO;
            for &cell in &loaded {
                let phase = circle.at(wave as i64, cell).conj();
                add(&mut load, loads[cell].map(|value| value * phase));
            }
            let moved = product(self.sum_over_aliases(wave, period, (k, false)), load);
            for (sum, &target) in sums.iter_mut().zip(targets) {
                let phase = circle.at(wave as i64, target) / period as f64;
                add(sum, moved.map(|value| value * phase));
            }
        }
        sums
    }

    /// Plane strain: K(d) by a load.
    fn influence(&self, offset: isize, [x, y, n]: Vector) -> Vector {
        let [xx, yy, nn, xy, xn, yn] = self.plane_strain(offset);
        // K(-d) is the conjugate transpose of K(d).
        let [_, _, _, yx, nx, ny] = self.plane_strain(-offset).map(|entry| entry.conj());
        [xx * x + xy * y + xn * n, yx * x + yy * y + yn * n, nx * x + ny * y + nn * n]
    }
}

fn add(sum: &mut Vector, other: Vector) {
    sum.iter_mut().zip(other).for_each(|(sum, other)| *sum += other);
}
