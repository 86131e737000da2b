//! Surface Green's function of a half-space, or of a pair of half-spaces, as a Fourier series in the direction ([`SurfaceGreen`]).

pub(super) mod admittance;
pub(super) mod angular_table;
pub mod barnett_lothe;
pub(super) mod kernel_component;

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix3};
use rayon::prelude::*;
use realfft::RealFftPlanner;

use crate::bem::half_space::green::barnett_lothe::BarnettLothe;
use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::cancel;
use crate::error::{Error, Result};
use crate::geometry::Side;
use crate::material::Stiffness;

/// Initial and maximum number of sampled directions over half a turn.
const DIRECTIONS: [usize; 2] = [32, 1 << 13];

/// Maximum size of the last quarter of the harmonics, relative to the largest harmonic. The harmonics decay
/// geometrically, so the omitted harmonics are then of the order of rounding errors.
const TAIL: f64 = 1e-12;

/// Maximum relative size of the last quarter of the harmonics for the maximum number of directions.
const TAIL_AT_LIMIT: f64 = 1e-9;

pub(super) const HARMONIC_CUTOFF: f64 = 1e-15;

const ZERO_COMPONENT_TOLERANCE: f64 = 1e-12;

const ONE: Complex<f64> = Complex::new(1.0, 0.0);

/// Harmonic of even order: symmetric matrix, entries xx, yy, nn, xy, xn, yn.
pub(super) type EvenHarmonic = [Complex<f64>; 6];

/// Harmonic of odd order: antisymmetric matrix, entries xy, xn, yn.
pub(super) type OddHarmonic = [Complex<f64>; 3];

const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

/// Surface Green's function Γ(φ) / r: displacement of the surface per unit force, at the distance r from the force in
/// the direction φ.
///
/// Γ(φ), 1/MPa, is the real Fourier series Σ γ_n exp(i n φ). For even n, γ_n is a symmetric matrix and follows from
/// L^-1. For odd n, γ_n is antisymmetric and follows from S L^-1. S and L are the Barnett-Lothe tensors
/// ([`BarnettLothe`]).
///
/// # Source
/// docs/theory-half-space.md, point forces.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceGreen {
    /// γ_0, γ_2, γ_4, ...
    even: Vec<EvenHarmonic>,
    /// γ_1, γ_3, γ_5, ...
    odd: Vec<OddHarmonic>,
}

impl SurfaceGreen {
    /// Green's function of one half-space; `stiffness` is in the axes (x, y, n) of the frame.
    ///
    /// # Errors
    /// If the stiffness is nearly singular, or if the run is cancelled. Also if the Barnett-Lothe integrals or the
    /// series do not converge (stiffness ratios above about 10^5).
    pub fn new(stiffness: &Stiffness, side: Side) -> Result<Self> {
        let mut samples = sample(stiffness, side, DIRECTIONS[0], 0.0)?;
        loop {
            let green = Self::from_samples(&samples);
            let tail = green.relative_tail();
            if tail <= TAIL {
                return Ok(green.truncated());
            }
            let count = samples.len();
            if count >= DIRECTIONS[1] {
                return if tail <= TAIL_AT_LIMIT { Ok(green.truncated()) } else { Err(no_decay(tail)) };
            }
            let between = sample(stiffness, side, count, 0.5)?;
            samples = samples.into_iter().zip(between).flat_map(|(a, b)| [a, b]).collect();
        }
    }

    /// Sum of the Green's functions of several bodies.
    pub fn sum(bodies: &[&Self]) -> Self {
        let even = bodies.iter().map(|body| body.even.len()).max().unwrap_or(0);
        let odd = bodies.iter().map(|body| body.odd.len()).max().unwrap_or(0);
        let zero = Complex::new(0.0, 0.0);
        let mut total = Self { even: vec![[zero; 6]; even], odd: vec![[zero; 3]; odd] };
        for body in bodies {
            for (sum, harmonic) in total.even.iter_mut().zip(&body.even) {
                sum.iter_mut().zip(harmonic).for_each(|(s, h)| *s += h);
            }
            for (sum, harmonic) in total.odd.iter_mut().zip(&body.odd) {
                sum.iter_mut().zip(harmonic).for_each(|(s, h)| *s += h);
            }
        }
        total
    }

    /// Γ(φ), 1/MPa; rows = displacement, columns = traction. `phi` is the direction from the source, radians.
    pub fn gamma(&self, phi: f64) -> Matrix3<f64> {
        let turn = Complex::from_polar(1.0, phi);
        assemble(&real_sum(&self.even, ONE, turn * turn), &real_sum(&self.odd, turn, turn * turn))
    }

    /// Surface admittance W(m) for m = (cos `angle`, sin `angle`) and the wavenumber κ = 1, 1/MPa. W is Hermitian and
    /// positive definite.
    ///
    /// # Source
    /// docs/theory-half-space.md, harmonic tractions.
    pub fn symbol(&self, angle: f64) -> Matrix3<Complex<f64>> {
        // The coefficients of Re W are 2π i^-n γ_n for even n. The coefficients of Im W are -2π γ_n / sin(n π/2) for
        // odd n. Each factor of γ_n alternates in sign with n.
        let turn = Complex::from_polar(1.0, angle);
        let re = assemble(&real_sum(&self.even, ONE, -turn * turn), &[0.0; 3]);
        let im = assemble(&[0.0; 6], &real_sum(&self.odd, -turn, -turn * turn));
        Matrix3::from_fn(|i, j| Complex::new(re[(i, j)], im[(i, j)]) * (2.0 * PI))
    }

    /// Fourier series of W(m) for the wavenumber κ = 1. The even part is Re W (symmetric), the odd part Im W
    /// (antisymmetric).
    pub(super) fn admittance_series(&self) -> Self {
        let factor = |k: usize| if k.is_multiple_of(2) { 2.0 * PI } else { -2.0 * PI };
        let mut series = self.clone();
        series.even.iter_mut().enumerate().for_each(|(k, h)| h.iter_mut().for_each(|c| *c *= factor(k)));
        series.odd.iter_mut().enumerate().for_each(|(k, h)| h.iter_mut().for_each(|c| *c *= -factor(k)));
        series
    }

    /// Estimated distance of the nearest complex singularity of Γ(φ) / r from the real axis. The variable is the
    /// position along a line at unit distance from the source.
    pub(super) fn singularity_distance(&self) -> f64 {
        // Harmonics that reach the cut-off at order n decay as exp(-η n) with η = -ln(cut-off) / n. Γ is therefore
        // analytic for |Im φ| < η. On a line at the distance d from the source, Γ / r is then analytic within d tanh η
        // of the real axis.
        (-HARMONIC_CUTOFF.ln() / self.order().max(1) as f64).tanh()
    }

    /// Whether tangential tractions cause normal displacements, and vice versa.
    pub fn couples_normal_tangential(&self) -> bool {
        let cross =
            self.even.iter().flat_map(|h| [h[4], h[5]]).chain(self.odd.iter().flat_map(|h| [h[1], h[2]]));
        cross.map(|c| c.norm()).fold(0.0, f64::max) > ZERO_COMPONENT_TOLERANCE * self.max_coefficient()
    }

    pub(super) fn nonzero_components(&self) -> Vec<KernelComponent> {
        let bound = ZERO_COMPONENT_TOLERANCE * self.max_coefficient();
        let even =
            (0..6).filter(|&c| self.even.iter().any(|h| h[c].norm() > bound)).map(KernelComponent::Even);
        let odd = (0..3).filter(|&c| self.odd.iter().any(|h| h[c].norm() > bound)).map(KernelComponent::Odd);
        even.chain(odd).collect()
    }

    /// Order of the highest harmonic.
    pub fn order(&self) -> usize {
        (2 * self.even.len()).saturating_sub(2).max((2 * self.odd.len()).saturating_sub(1))
    }

    pub(super) fn even(&self) -> &[EvenHarmonic] {
        &self.even
    }

    pub(super) fn odd(&self) -> &[OddHarmonic] {
        &self.odd
    }

    /// Series from samples of W at equidistant directions over half a turn.
    fn from_samples(samples: &[AdmittanceSample]) -> Self {
        let half = samples.len();
        let fft = RealFftPlanner::new().plan_fft_forward(2 * half);
        let transform = |value: &dyn Fn(&AdmittanceSample) -> f64, parity: f64| {
            let (mut turn, mut spectrum) = (fft.make_input_vec(), fft.make_output_vec());
            for (j, sample) in samples.iter().enumerate() {
                turn[j] = value(sample);
                turn[j + half] = parity * turn[j];
            }
            fft.process(&mut turn, &mut spectrum).expect("buffers made by the plan");
            spectrum
        };
        let re = SYMMETRIC.map(|(i, j)| transform(&|w: &AdmittanceSample| w[0][(i, j)], 1.0));
        let im = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| transform(&|w: &AdmittanceSample| w[1][(i, j)], -1.0));
        let weight = 1.0 / (2.0 * PI * 2.0 * half as f64);
        let sign = |k: usize| if k.is_multiple_of(2) { weight } else { -weight };
        Self {
            even: (0..half / 2).map(|k| std::array::from_fn(|c| re[c][2 * k] * sign(k))).collect(),
            odd: (0..half / 2).map(|k| std::array::from_fn(|c| im[c][2 * k + 1] * -sign(k))).collect(),
        }
    }

    pub(super) fn max_coefficient(&self) -> f64 {
        self.even.iter().map(magnitude).fold(0.0, f64::max)
    }

    fn relative_tail(&self) -> f64 {
        let from = self.even.len() * 3 / 4;
        let even = self.even[from..].iter().map(magnitude);
        let odd = self.odd[from..].iter().map(magnitude);
        even.chain(odd).fold(0.0, f64::max) / self.max_coefficient()
    }

    fn truncated(self) -> Self {
        self.truncated_at(HARMONIC_CUTOFF)
    }

    /// Series without the trailing harmonics that are smaller than `share` times the largest harmonic.
    pub(super) fn truncated_at(mut self, share: f64) -> Self {
        let bound = share * self.max_coefficient();
        let kept = |sizes: Vec<f64>| sizes.iter().rposition(|&size| size > bound).map_or(0, |last| last + 1);
        let even = kept(self.even.iter().map(magnitude).collect());
        let odd = kept(self.odd.iter().map(magnitude).collect());
        self.even.truncate(even);
        self.odd.truncate(odd);
        self
    }
}

/// Re W and Im W in one direction.
type AdmittanceSample = [Matrix3<f64>; 2];

/// W at `count` equidistant directions over half a turn. The first direction lies `offset` spacings from the x axis.
fn sample(stiffness: &Stiffness, side: Side, count: usize, offset: f64) -> Result<Vec<AdmittanceSample>> {
    (0..count)
        .into_par_iter()
        .map(|j| {
            cancel::check()?;
            let angle = PI * (j as f64 + offset) / count as f64;
            BarnettLothe::new(stiffness, side, angle).map(|tensors| tensors.admittance())
        })
        .collect()
}

/// Sum of a real series over its positive and negative orders. `first` is the phase factor of the lowest order, and
/// `ratio` is the factor from one harmonic to the next. The term of order 0 counts once, all other terms count twice.
fn real_sum<const N: usize>(
    harmonics: &[[Complex<f64>; N]],
    first: Complex<f64>,
    ratio: Complex<f64>,
) -> [f64; N] {
    let mut sum = [0.0; N];
    let mut phase = first * 2.0;
    for (k, harmonic) in harmonics.iter().enumerate() {
        let factor = if k == 0 && N == 6 { ONE } else { phase };
        sum.iter_mut().zip(harmonic).for_each(|(s, h)| *s += (factor * h).re);
        phase *= ratio;
    }
    sum
}

fn magnitude<const N: usize>(harmonic: &[Complex<f64>; N]) -> f64 {
    harmonic.iter().map(|c| c.norm()).fold(0.0, f64::max)
}

/// Matrix from its symmetric entries (xx, yy, nn, xy, xn, yn) and antisymmetric entries (xy, xn, yn).
pub(super) fn assemble(even: &[f64; 6], odd: &[f64; 3]) -> Matrix3<f64> {
    Matrix3::new(
        even[0],
        even[3] + odd[0],
        even[4] + odd[1],
        even[3] - odd[0],
        even[1],
        even[5] + odd[2],
        even[4] - odd[1],
        even[5] - odd[2],
        even[2],
    )
}

fn no_decay(tail: f64) -> Error {
    Error::input(format!(
        "the Fourier series of the half-space's Green's function has only decayed to {tail:.1e} after {} harmonics, but {TAIL_AT_LIMIT:e} is required. Ratios of the Young's moduli up to about 1e5 are supported; use a material with a smaller ratio",
        DIRECTIONS[1]
    ))
}
