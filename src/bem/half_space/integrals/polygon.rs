//! Exact integrals of the surface Green's function over polygons.
//!
//! Each edge contributes the integral over the triangle between the edge and the target. In polar coordinates about the
//! target, the Jacobian cancels 1/r. Targets inside the polygon, or on or near its edges, therefore cause no
//! singularity. For distant targets, the contributions of the edges nearly cancel. The relative error is then about
//! 1e-16 (distance / size)^2.

use nalgebra::{Complex, Matrix3};

use crate::bem::half_space::green::{SurfaceGreen, assemble};

/// Triangle between an edge and the target, in polar coordinates about the target.
struct Edge {
    /// Distance of the target from the line of the edge, mm.
    height: f64,
    /// Unit direction from the target to the foot of the perpendicular on the line of the edge.
    foot: Complex<f64>,
    /// Unit directions from the target to the two ends of the edge.
    ends: [Complex<f64>; 2],
    /// Integrals `∫ exp(i n ψ) / cos ψ dψ` of orders n = 0 and 1, with the angle ψ measured from `foot`.
    bases: [Complex<f64>; 2],
}

/// `∫ G(target - y) dA_y` over the polygon with the given corners (counter-clockwise), mm/MPa: the displacement at the target under
/// unit tractions on the polygon.
///
/// # Source
/// docs/theory-half-space.md, constant traction on a polygon. The result is transposed, because the angle of Γ in that section is
/// the direction from the target to the source.
pub fn integrate(green: &SurfaceGreen, corners: &[[f64; 2]], target: [f64; 2]) -> Matrix3<f64> {
    let mut even = [0.0; 6];
    let mut odd = [0.0; 3];
    for (k, &from) in corners.iter().enumerate() {
        let to = corners[(k + 1) % corners.len()];
        if let Some(edge) = Edge::new(from, to, target) {
            edge.add(green, &mut even, &mut odd);
        }
    }
    assemble(&even, &odd.map(|entry| -entry))
}

impl Edge {
    /// Edge between two corners; `None` if the triangle with the target has no area.
    fn new(from: [f64; 2], to: [f64; 2], target: [f64; 2]) -> Option<Self> {
        let direction = Complex::new(to[0] - from[0], to[1] - from[1]);
        let length = direction.norm();
        if length == 0.0 {
            return None;
        }
        let along = direction / length;
        let rays = [from, to].map(|p| Complex::new(p[0] - target[0], p[1] - target[1]));
        // The height is computed from the nearer end, which gives a smaller rounding error.
        let nearest = if rays[0].norm_sqr() < rays[1].norm_sqr() { rays[0] } else { rays[1] };
        let signed = nearest.re * along.im - nearest.im * along.re;
        if signed == 0.0 {
            return None;
        }
        // For a target on the right of the edge, the foot and the sense of rotation are reversed.
        let sense = signed.signum();
        let foot = Complex::new(along.im, -along.re) * sense;
        let height = signed.abs();
        let radii = rays.map(|ray| ray.norm());
        let tangential = rays.map(|ray| sense * (ray.re * along.re + ray.im * along.im));
        let ends = [rays[0] / radii[0], rays[1] / radii[1]];
        let turn = ends[1] * ends[0].conj();
        let asinh = |t: f64, r: f64| ((t.abs() + r) / height).ln().copysign(t);
        let bases = [
            Complex::new(asinh(tangential[1], radii[1]) - asinh(tangential[0], radii[0]), 0.0),
            Complex::new(turn.arg(), (radii[1] / radii[0]).ln()),
        ];
        Some(Self { height, foot, ends, bases })
    }

    /// Adds `height ∫ Γ(φ) / cos ψ dψ` to the entries of the even and the odd harmonics.
    ///
    /// The recurrence is `P_{n+1} = foot (2 (b^n - a^n) / (i n) - foot P_{n-1})`. Here P_n = foot^n K_n, K_n = ∫ exp(i n ψ) / cos ψ
    /// dψ, and a, b are the directions of the ends.
    fn add(&self, green: &SurfaceGreen, even: &mut [f64; 6], odd: &mut [f64; 3]) {
        let (foot, [a, b]) = (self.foot, self.ends);
        let (a_squared, b_squared) = (a * a, b * b);
        // a^n and b^n for the odd and the even order n of one pass of the loop.
        let (mut a_powers, mut b_powers) = ([a, a_squared], [b, b_squared]);
        let mut integrals = [self.bases[0], foot * self.bases[1]];
        let orders = green.even().len().max(green.odd().len());
        for k in 0..orders {
            let weight = if k == 0 { self.height } else { 2.0 * self.height };
            if let Some(harmonic) = green.even().get(k) {
                accumulate(even, harmonic, integrals[0] * weight);
            }
            if let Some(harmonic) = green.odd().get(k) {
                accumulate(odd, harmonic, integrals[1] * (2.0 * self.height));
            }
            for parity in 0..2 {
                let n = (2 * k + 1 + parity) as f64;
                let difference = (b_powers[parity] - a_powers[parity]) * (2.0 / n);
                // Division by i.
                let driven = Complex::new(difference.im, -difference.re);
                integrals[parity] = foot * (driven - foot * integrals[parity]);
                a_powers[parity] *= a_squared;
                b_powers[parity] *= b_squared;
            }
        }
    }
}

fn accumulate<const N: usize>(sum: &mut [f64; N], harmonic: &[Complex<f64>; N], factor: Complex<f64>) {
    for (s, h) in sum.iter_mut().zip(harmonic) {
        *s += h.re * factor.re - h.im * factor.im;
    }
}
