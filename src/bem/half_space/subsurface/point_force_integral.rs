//! Displacement and displacement gradient inside a half-space under a point force on its surface, by an integral over
//! directions.

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::{Matrix3, Vector3};

use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::{AngularTable, evaluate_series};
use crate::bem::half_space::green::barnett_lothe::condition;
use crate::error::{Error, Result};
use crate::linalg::simd::wide;
use crate::material::Stiffness;

/// Initial and maximum number of points of the angular rule.
const POINTS: [usize; 2] = [16, 1 << 14];

/// Convergence limit: change of the field when the number of points doubles, relative to the largest value.
const MAX_CHANGE: f64 = 1e-11;

/// Number of rules. Each rule is computed for one ratio of depth to distance from the z axis: 1, 1/4, 1/16, ... The
/// last rule also serves all smaller ratios.
const RULES: i32 = 10;

/// Number of quadrature points per batch, for SIMD.
const LANES: usize = POINTS[0];

/// Number of entries of the integrand: G and its derivatives along x, y, z.
const TERMS: usize = 36;

/// Field of a unit force at the origin of the surface of the half-space z < 0, whose outward normal is +z.
///
/// G(x) = −1/(4π²z) ∫₀^2π D⁻¹ [1 − (R + τT) A] dθ with D = Q + τ(R + Rᵀ) + τ²T, m = (cos θ, sin θ, 0) and τ = −(m·x)/z.
/// The matrices are Q = C(m, m), R = C(m, e3), T = C(e3, e3), with C(u, v)_ik = C_ijkl u_j v_l and the unit vector e3
/// along z. A = S L⁻¹ follows from the Barnett-Lothe tensors S and L.
///
/// # Source
/// docs/theory-half-space.md, the field inside.
#[derive(Debug, Clone)]
pub struct PointForceIntegral {
    /// C(e_x, e_x), C(e_x, e_y) + C(e_y, e_x), C(e_y, e_y).
    plane: [Matrix3<f64>; 3],
    /// C(e_x, e3), C(e_y, e3).
    mixed: [Matrix3<f64>; 2],
    mixed_sum: [Matrix3<f64>; 2],
    /// C(e3, e3).
    normal: Matrix3<f64>,
    /// A(θ), antisymmetric: entries xy, xz, yz.
    coupling: AngularTable,
    rules: Vec<Vec<RulePoint>>,
    /// Initial number of points.
    min_points: usize,
}

/// Point of the angular rule: tan ψ, and the weight dψ/ds divided by its mean π/2. `PointForceIntegral::integrate`
/// defines ψ and s.
#[derive(Debug, Clone, Copy)]
struct RulePoint {
    tangent: f64,
    weight: f64,
}

struct Direction {
    phi: f64,
    cos: f64,
    sin: f64,
    /// Distance from the z axis divided by the depth.
    slope: f64,
}

impl PointForceIntegral {
    /// Prepares the integral for a material in the axes of the surface. `green` is the surface Green's function of this
    /// material.
    pub fn new(stiffness: &Stiffness, green: &SurfaceGreen) -> Self {
        let contract = |j: usize, l: usize| Matrix3::from_fn(|i, k| stiffness.component(i, j, k, l));
        let admittance = green.admittance_series();
        let count = AngularTable::count(admittance.order());
        let coupling = [0, 1, 2].map(|c| {
            evaluate_series(count, admittance.odd().iter().enumerate().map(|(k, h)| (2 * k + 1, h[c])))
        });
        let mixed = [contract(0, 2), contract(1, 2)];
        // The integrand varies over angles of about 1 / √r, where r is the ratio of the largest to the smallest
        // stiffness. The initial number of points therefore grows with √r.
        let first = (2.0 * condition(stiffness).sqrt()) as usize;
        Self {
            plane: [contract(0, 0), contract(0, 1) + contract(1, 0), contract(1, 1)],
            mixed,
            mixed_sum: mixed.map(|mixed| mixed + mixed.transpose()),
            normal: contract(2, 2),
            coupling: AngularTable::new(&coupling),
            rules: (0..RULES).map(|k| rule(0.25_f64.powi(k))).collect(),
            min_points: first.next_power_of_two().clamp(POINTS[0], POINTS[1] / 4),
        }
    }

    /// Field at a point `x` (mm) below the surface.
    ///
    /// # Errors
    /// If the point is not finite, is not below the surface, or is too near to the surface for the rule to converge.
    pub fn at(&self, x: &Vector3<f64>) -> Result<GreenTensor> {
        let distance = x.norm();
        if !distance.is_finite() || x.z >= 0.0 {
            return Err(Error::input(format!("the point {:?} does not lie below the surface", x.as_slice())));
        }
        let (field, change) = self.integrate(x, MAX_CHANGE);
        if change <= MAX_CHANGE {
            return Ok(field);
        }
        Err(Error::numerical(format!(
            "the field at {:?} does not converge: the depth of this point is only {:.1e} of its distance from the force",
            x.as_slice(),
            -x.z / distance
        )))
    }

    /// Field at a point below the surface, and an error estimate. The estimate is the change at the last doubling of
    /// the number of points, relative to the largest entries. The number of points doubles until the change is at most
    /// `change`, or until the largest rule is reached.
    ///
    /// The trapezoidal rule is applied in s. With the modulus k = √(1 - k'²) and the quarter period K, tan ψ = k' sc(K
    /// s, k) and θ = φ + π/2 + ψ. Here φ is the polar angle of the point, and k' is approximately the ratio of depth to
    /// distance from the z axis. The poles near tan ψ = ±i k' and ±i are then far from the real line.
    ///
    /// The change at the doubling before the last must also be small. Without this condition, false convergence occurs
    /// where the leading error, which oscillates with φ, vanishes.
    pub(super) fn integrate(&self, x: &Vector3<f64>, change: f64) -> (GreenTensor, f64) {
        let direction = Direction::new(x);
        let mut sums = [0.0; TERMS];
        let (mut coarse, mut before): (Option<GreenTensor>, f64) = (None, f64::INFINITY);
        let rule =
            &self.rules[(direction.slope.max(1.0).log2() / 2.0).round().min(f64::from(RULES - 1)) as usize];
        let mut points = self.min_points;
        loop {
            let stride = POINTS[1] / points;
            let (from, step) = if coarse.is_none() { (0, stride) } else { (stride, 2 * stride) };
            let mut taken = rule[from..].iter().step_by(step);
            debug_assert_eq!(taken.len() % LANES, 0);
            while let Some(&first) = taken.next() {
                let mut block = [first; LANES];
                block[1..].iter_mut().zip(&mut taken).for_each(|(point, &taken)| *point = taken);
                self.add(&direction, &block, &mut sums);
            }
            let fine = field(&sums, x.z, points);
            let last = coarse.map_or(f64::INFINITY, |coarse| {
                let value = (fine.value - coarse.value).amax() / fine.value.amax();
                value.max(fine.max_gradient_difference(&coarse) / fine.max_gradient())
            });
            if last <= change && before <= 10.0 * change.sqrt() || points >= POINTS[1] {
                return (fine, last);
            }
            (coarse, before, points) = (Some(fine), last, 2 * points);
        }
    }

    fn add(&self, direction: &Direction, points: &[RulePoint; LANES], sums: &mut [f64; TERMS]) {
        let [mut cos, mut sin] = [[0.0; LANES]; 2];
        let mut coupling = [[0.0; 3]; LANES];
        for (l, point) in points.iter().enumerate() {
            cos[l] = 1.0 / (1.0 + point.tangent * point.tangent).sqrt();
            sin[l] = point.tangent * cos[l];
            self.coupling.add_at(direction.phi + FRAC_PI_2 + point.tangent.atan(), &mut coupling[l]);
        }
        let weight = points.map(|point| point.weight);
        let mut terms = [[0.0; LANES]; TERMS];
        weigh(self, direction, [&cos, &sin, &weight], &coupling, &mut terms);
        sums.iter_mut().zip(&terms).for_each(|(sum, terms)| *sum += terms.iter().sum::<f64>());
    }

    /// Weighted terms of the sums at one point of the rule: F, m_x F', m_y F' and F + τF'. The integrand is F = D⁻¹ [1
    /// − (R + τT) A], and F' = ∂F/∂τ.
    #[inline(always)]
    fn term(&self, direction: &Direction, [cos, sin, weight]: [f64; 3], a: [f64; 3]) -> [f64; TERMS] {
        // Direction m at θ = φ + π/2 + ψ, and τ.
        let m = [-(direction.sin * cos + direction.cos * sin), direction.cos * cos - direction.sin * sin];
        let tau = -sin * direction.slope;
        let both = |i: usize, k: usize| m[0] * self.mixed_sum[0][(i, k)] + m[1] * self.mixed_sum[1][(i, k)];
        let squares = [m[0] * m[0], m[0] * m[1], m[1] * m[1]];
        let d = |i: usize, k: usize| {
            let q: f64 = (0..3).map(|j| squares[j] * self.plane[j][(i, k)]).sum();
            q + tau * (both(i, k) + tau * self.normal[(i, k)])
        };
        let factor = Factor::new([d(0, 0), d(1, 0), d(1, 1), d(2, 0), d(2, 1), d(2, 2)]);
        // Rows of (R + τT) A.
        let row = |i: usize| {
            let entry = |k: usize| {
                m[0] * self.mixed[0][(i, k)] + m[1] * self.mixed[1][(i, k)] + tau * self.normal[(i, k)]
            };
            times_antisymmetric([entry(0), entry(1), entry(2)], a)
        };
        let right = [row(0), row(1), row(2)];
        let f = factor.solve([0, 1, 2].map(|i| [0, 1, 2].map(|k| f64::from(u8::from(i == k)) - right[i][k])));
        let row = |i: usize| {
            let entry = |k: usize| both(i, k) + 2.0 * tau * self.normal[(i, k)];
            let through = [entry(0), entry(1), entry(2)];
            let coupled = times_antisymmetric([0, 1, 2].map(|k| self.normal[(i, k)]), a);
            [0, 1, 2]
                .map(|j| -(through[0] * f[0][j] + through[1] * f[1][j] + through[2] * f[2][j]) - coupled[j])
        };
        let slope = factor.solve([row(0), row(1), row(2)]);
        let mut terms = [0.0; TERMS];
        for k in 0..9 {
            let (f, slope) = (weight * f[k / 3][k % 3], weight * slope[k / 3][k % 3]);
            terms[k] = f;
            terms[9 + k] = m[0] * slope;
            terms[18 + k] = m[1] * slope;
            terms[27 + k] = f + tau * slope;
        }
        terms
    }
}

/// Computes the weighted terms at a batch of points. `points` holds cos ψ, sin ψ and the weights.
fn weigh(
    integral: &PointForceIntegral,
    direction: &Direction,
    points: [&[f64; LANES]; 3],
    coupling: &[[f64; 3]; LANES],
    terms: &mut [[f64; LANES]; TERMS],
) {
    wide!(weigh_inline(
        integral => integral: &PointForceIntegral,
        direction => direction: &Direction,
        points => points: [&[f64; LANES]; 3],
        coupling => coupling: &[[f64; 3]; LANES],
        terms => terms: &mut [[f64; LANES]; TERMS]
    ))
}

#[inline(always)]
fn weigh_inline(
    integral: &PointForceIntegral,
    direction: &Direction,
    points: [&[f64; LANES]; 3],
    coupling: &[[f64; 3]; LANES],
    terms: &mut [[f64; LANES]; TERMS],
) {
    for l in 0..LANES {
        let point = [points[0][l], points[1][l], points[2][l]];
        let term = integral.term(direction, point, coupling[l]);
        for k in 0..TERMS {
            terms[k][l] = term[k];
        }
    }
}

impl Direction {
    fn new(x: &Vector3<f64>) -> Self {
        let radius = x.x.hypot(x.y);
        let (cos, sin) = if radius > 0.0 { (x.x / radius, x.y / radius) } else { (1.0, 0.0) };
        let slope = -radius / x.z;
        Self { phi: sin.atan2(cos), cos, sin, slope }
    }
}

/// Points of the largest rule for a `ratio` of depth to distance from the z axis. The angle ψ runs over half a turn,
/// from −π/2 to π/2.
fn rule(ratio: f64) -> Vec<RulePoint> {
    // The points are offset by half a step from the centre and the ends, so that all tangents are finite.
    let tangents = (0..POINTS[1]).map(|k| {
        let s = (2 * k + 1) as f64 / POINTS[1] as f64 - 1.0;
        (ratio * elliptic_tangent(s.abs(), ratio)).copysign(s)
    });
    let slope = |tangent: f64| ((tangent * tangent + ratio * ratio) / (1.0 + tangent * tangent)).sqrt();
    let mean = arithmetic_geometric_mean(ratio);
    tangents.map(|tangent| RulePoint { tangent, weight: slope(tangent) / mean }).collect()
}

/// Jacobi's sc(K s, k) for 0 < s < 1, quarter period K and complementary modulus `ratio`, by Landen's transformation.
fn elliptic_tangent(s: f64, ratio: f64) -> f64 {
    if s > 0.5 {
        return 1.0 / (ratio * elliptic_tangent(1.0 - s, ratio));
    }
    if ratio > 1.0 - f64::EPSILON {
        return (FRAC_PI_2 * s).tan();
    }
    let sum = 1.0 + ratio;
    let inverse = 1.0 / elliptic_tangent(2.0 * s, 2.0 * ratio.sqrt() / sum);
    2.0 / (sum * inverse + ((sum * inverse).powi(2) + 4.0 * ratio).sqrt())
}

/// Arithmetic-geometric mean of 1 and `b` <= 1.
fn arithmetic_geometric_mean(b: f64) -> f64 {
    if b > 1.0 - f64::EPSILON {
        1.0
    } else {
        0.5 * (1.0 + b) * arithmetic_geometric_mean(2.0 * b.sqrt() / (1.0 + b))
    }
}

fn field(sums: &[f64; TERMS], z: f64, points: usize) -> GreenTensor {
    let factor = 1.0 / (2.0 * PI * points as f64);
    let part = |k: usize, factor: f64| Matrix3::from_row_slice(&sums[9 * k..9 * k + 9]) * factor;
    GreenTensor { value: part(0, -factor / z), gradient: [1, 2, 3].map(|k| part(k, factor / (z * z))) }
}

/// Factors L and 1/d of a positive definite matrix L diag(d) Lᵀ.
struct Factor {
    l: [f64; 3],
    inverse: [f64; 3],
}

impl Factor {
    #[inline(always)]
    fn new([xx, yx, yy, zx, zy, zz]: [f64; 6]) -> Self {
        let first = 1.0 / xx;
        let (l10, l20) = (yx * first, zx * first);
        let second = 1.0 / (yy - l10 * yx);
        let rest = zy - l20 * yx;
        let l21 = rest * second;
        Self { l: [l10, l20, l21], inverse: [first, second, 1.0 / (zz - l20 * zx - l21 * rest)] }
    }

    /// Solves for three right-hand sides, given by rows.
    #[inline(always)]
    fn solve(&self, [mut x, mut y, mut z]: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let ([l10, l20, l21], [first, second, third]) = (self.l, self.inverse);
        for j in 0..3 {
            y[j] -= l10 * x[j];
            z[j] = (z[j] - l20 * x[j] - l21 * y[j]) * third;
            y[j] = y[j] * second - l21 * z[j];
            x[j] = x[j] * first - l10 * y[j] - l20 * z[j];
        }
        [x, y, z]
    }
}

/// Row vector times the antisymmetric matrix with the entries xy, xz, yz.
#[inline(always)]
fn times_antisymmetric([x, y, z]: [f64; 3], [xy, xz, yz]: [f64; 3]) -> [f64; 3] {
    [-(y * xy + z * xz), x * xy - z * yz, x * xz + y * yz]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::green_tensor::TractionOperator;
    use crate::geometry::Side;

    fn interior(stiffness: &Stiffness) -> PointForceIntegral {
        PointForceIntegral::new(stiffness, &SurfaceGreen::new(stiffness, Side::Lower).unwrap())
    }

    fn cfrp(tilt: f64) -> Stiffness {
        let fibre = Stiffness::transversely_isotropic(167_230.0, 9544.0, 5292.0, 0.272, 0.369).unwrap();
        fibre.rotated(nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), -tilt.to_radians()).matrix())
    }

    /// Truth: in an isotropic body z < 0, G equals the solutions of Boussinesq and Cerruti.
    #[test]
    fn isotropic_bodies() {
        let (e, nu) = (210e3, 0.3);
        let field = interior(&Stiffness::isotropic(e, nu).unwrap());
        let mu = e / (2.0 * (1.0 + nu));
        for x in [[0.3, -0.4, -0.7], [0.0, 0.0, -1.3], [2.0, 1.0, -0.2], [1.0, 0.5, -0.01]] {
            let found = field.at(&Vector3::from(x)).unwrap().value * (4.0 * PI * mu);
            let [x, y, depth] = [x[0], x[1], -x[2]];
            let s = 1.0 / (x * x + y * y + depth * depth).sqrt();
            let (s3, k) = (s * s * s, 1.0 - 2.0 * nu);
            let near = 1.0 / (1.0 / s + depth);
            let (a, b) = (k * s * near, k * s * near * near);
            let wanted = Matrix3::new(
                s + x * x * s3 + k * near - b * x * x,
                x * y * (s3 - b),
                -(x * depth * s3 - a * x),
                x * y * (s3 - b),
                s + y * y * s3 + k * near - b * y * y,
                -(y * depth * s3 - a * y),
                -(x * depth * s3 + a * x),
                -(y * depth * s3 + a * y),
                depth * depth * s3 + 2.0 * (1.0 - nu) * s,
            );
            assert!((found - wanted).amax() < 1e-11 * wanted.amax(), "{found} {wanted}");
        }
    }

    /// Truth: the derivatives equal finite differences. The field decays like 1 / distance, and tends to Γ(φ) / r at the surface.
    #[test]
    fn derivatives_scale_and_surface() {
        let stiffness = cfrp(30.0);
        let field = interior(&stiffness);
        let x = Vector3::new(0.5, 0.3, -0.4);
        let at = field.at(&x).unwrap();
        for k in 0..3 {
            let mut step = Vector3::zeros();
            step[k] = 1e-4;
            let difference =
                (field.at(&(x + step)).unwrap().value - field.at(&(x - step)).unwrap().value) / 2e-4;
            assert!((at.gradient[k] - difference).amax() < 1e-6 * at.gradient[k].amax(), "along {k}");
        }
        let far = field.at(&(x * 7.0)).unwrap();
        assert!((far.value * 7.0 - at.value).amax() < 1e-12 * at.value.amax());
        let green = SurfaceGreen::new(&stiffness, Side::Lower).unwrap();
        let apart = |depth: f64| {
            let near = field.at(&Vector3::new(0.6, 0.8, -depth)).unwrap().value;
            let surface = green.gamma(0.8_f64.atan2(0.6));
            (near - surface).amax() / surface.amax()
        };
        let [coarse, fine] = [4e-3, 2e-3].map(apart);
        assert!(fine < 1e-2 && (coarse / fine - 2.0).abs() < 0.1, "{coarse} {fine}");
    }

    #[test]
    fn tractions_balance_the_force() {
        let stiffness = cfrp(30.0);
        let field = interior(&stiffness);
        let mut sum = Matrix3::zeros();
        let (around, down) = (48, 24);
        for i in 0..down {
            // Midpoint rule in u. The cosine of the polar angle, cos β = u² (3 - 2 u), has zero slope at the surface.
            let u = (i as f64 + 0.5) / down as f64;
            let (cos, slope) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
            let sin = (1.0 - cos * cos).sqrt();
            for k in 0..around {
                let phi = 2.0 * PI * k as f64 / around as f64;
                let n = Vector3::new(sin * phi.cos(), sin * phi.sin(), -cos);
                let weight = 2.0 * PI / around as f64 * slope / down as f64;
                sum += TractionOperator::new(&stiffness, &n).apply(&field.at(&n).unwrap()) * weight;
            }
        }
        assert!((sum + Matrix3::identity()).amax() < 2e-3, "{sum}");
    }
}
