//! Integrals of the surface Green's function Γ(φ) / r over polygons and rectangles.
//!
//! Case names refer to the catalogue in docs/verification.md.

use super::{Random, cfrp, green, pair, relative, steel};
use crate::crystals::{cfrp_of_tables, with_ratio};
use nalgebra::Matrix3;
use orthowear::bem::half_space::integrals::polygon;
use orthowear::bem::half_space::{CrossBlocks, FftFlexibility, PatchIntegrator, Side};
use orthowear::flexibility::Flexibility;
use std::f64::consts::PI;

const SQUARE: [[f64; 2]; 4] = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];

/// Truth: Love's displacement (1929) under a uniform pressure on a 4 x 4 square (case `load-uniform-square`). The tolerance is
/// 1e-13 for the closed form (rounding) and 1e-9 for the published values (10 digits).
#[test]
fn uniform_pressure_on_a_square() {
    let green = green(&steel(), Side::Lower);
    let reduced = 210e3 / (1.0 - 0.09);
    let corner_of = |a: f64, b: f64| 100.0 / (PI * reduced) * (a * (b / a).asinh() + b * (a / b).asinh());
    let cases = [
        ([0.0, 0.0], 4.0 * corner_of(2.0, 2.0), 0.001945146155),
        ([2.0, 2.0], corner_of(4.0, 4.0), 0.0009725730774),
        ([2.0, 0.0], 2.0 * corner_of(4.0, 2.0), 0.001327512171),
        (
            [3.0, 0.5],
            corner_of(5.0, 2.5) + corner_of(5.0, 1.5) - corner_of(1.0, 2.5) - corner_of(1.0, 1.5),
            f64::NAN,
        ),
    ];
    for (target, closed, published) in cases {
        let found = 100.0 * polygon::integrate(&green, &SQUARE, target)[(2, 2)];
        assert!((found / closed - 1.0).abs() < 1e-13, "{target:?}");
        assert!(published.is_nan() || (found / published - 1.0).abs() < 1e-9, "{target:?}");
    }
}

/// Truth: Cerruti's solution integrated over rectangles (Johnson 1985, section 3.6), published to 10 digits.
#[test]
fn uniform_shear_on_rectangles() {
    let green = green(&steel(), Side::Lower);
    let wide = [[-4.0, -1.0], [4.0, -1.0], [4.0, 1.0], [-4.0, 1.0]];
    let center = polygon::integrate(&green, &SQUARE, [0.0, 0.0]) * 100.0;
    let corner = polygon::integrate(&green, &SQUARE, [2.0, 2.0]) * 100.0;
    let wide = polygon::integrate(&green, &wide, [0.0, 0.0]) * 100.0;
    for (found, published) in [
        (center[(0, 0)], 0.002361963188),
        (corner[(0, 0)], 0.001180981594),
        (corner[(1, 0)].abs(), 0.000138514342),
        (wide[(0, 0)], 0.002197189607),
        (wide[(1, 1)], 0.001935938912),
    ] {
        assert!((found / published - 1.0).abs() < 1e-9, "{found} {published}");
    }
    assert!(center[(2, 0)].abs() < 1e-15 * center[(0, 0)]);
    // In front of a tangential traction along x, the surface of the lower body sinks.
    assert!(polygon::integrate(&green, &SQUARE, [3.0, 0.0])[(2, 0)] < 0.0);
}

/// Truth: the displacement under a uniform pressure p on a disc of radius a (Johnson 1985, section 3.4). The tolerance 5e-3 is
/// the published error of a disc that is made of square cells. On CFRP the displacement of the centre is p a times the mean of
/// the normal admittance W_nn. The disc is a polygon of 4000 sides, whose smaller area requires the tolerance 2e-6.
#[test]
fn uniform_pressure_on_a_disc() {
    let (radius, n) = (2.0, 160);
    let h = 4.0 * radius / n as f64;
    let isotropic = green(&steel(), Side::Lower);
    let operator = FftFlexibility::new([n, n], [h, h], &isotropic, CrossBlocks::Keep).expect("an operator");
    let center = |i: usize| (i as f64 + 0.5 - n as f64 / 2.0) * h;
    let pressure: Vec<f64> =
        (0..n * n).map(|k| if center(k / n).hypot(center(k % n)) < radius { 100.0 } else { 0.0 }).collect();
    let mut gap = vec![0.0; n * n];
    operator.apply_normal(&pressure, &mut gap);
    let at = |x: f64| {
        let position = x / h + n as f64 / 2.0 - 0.5;
        let (i, t) = (position.floor() as usize, position.fract());
        let row = |i: usize| 0.5 * (gap[i * n + n / 2] + gap[i * n + n / 2 - 1]);
        row(i) * (1.0 - t) + row(i + 1) * t
    };
    for (x, expected) in [(0.0, 0.001733333333), (1.0, 0.001619306793), (2.0, 0.001103474272)] {
        assert!((at(x) / expected - 1.0).abs() < 5e-3, "{x}: {} {expected}", at(x));
    }
    let sides = 4000;
    let disc: Vec<[f64; 2]> = (0..sides)
        .map(|k| 2.0 * PI * k as f64 / sides as f64)
        .map(|angle| [radius * angle.cos(), radius * angle.sin()])
        .collect();
    let cfrp = green(&cfrp_of_tables(), Side::Lower);
    let found = 10.0 * polygon::integrate(&cfrp, &disc, [0.0, 0.0])[(2, 2)];
    assert!((found / 0.003663079204 - 1.0).abs() < 2e-6);
}

/// Truth: the multipole expansion of the displacement at the distance r from a square of side L under the force F, F / (π E* r)
/// (1 + L² / (24 r²)). At r = 1e3 L and 1e6 L the integrals agree with the expansion to 1e-10. The exact edge formula has lost
/// digits at these distances. For CFRP on steel at 1e6 L, the displacement is Γ(φ) F / r to 1e-11.
#[test]
fn far_targets_do_not_cancel() {
    let reduced = 210e3 / (1.0 - 0.09);
    let isotropic = PatchIntegrator::new(&green(&steel(), Side::Lower));
    let aniso = PatchIntegrator::new(&pair(20.0));
    let side = 0.3;
    let half = side / 2.0;
    let square = [[-half, -half], [half, -half], [half, half], [-half, half]];
    for ratio in [1e3, 1e6] {
        let r = ratio * side;
        let expected = side * side / (PI * reduced * r) * (1.0 + 1.0 / (24.0 * ratio * ratio));
        for target in [[r, 0.0], [0.0, -r]] {
            for found in [isotropic.rectangle([side, side], target), isotropic.polygon(&square, target)] {
                assert!((found[(2, 2)] / expected - 1.0).abs() < 1e-10, "{ratio}");
            }
        }
    }
    let (r, phi) = (1e6 * side, 1.1f64);
    let point = aniso.green().gamma(phi) * (side * side / r);
    assert!(relative(&aniso.polygon(&square, [r * phi.cos(), r * phi.sin()]), &point) < 1e-11);
}

/// Truth: the integral over a polygon is the sum of the integrals over its parts, for any target point. The tolerance is 1e-13 of
/// the largest entry.
#[test]
fn parts_of_a_polygon_add_up() {
    let green = pair(35.0);
    let whole = [[0.0, 0.0], [1.2, -0.3], [1.7, 0.8], [0.9, 1.5], [-0.2, 0.9]];
    let middle = [0.8, 0.6];
    let part = |i: usize| [whole[i], whole[(i + 1) % 5], middle];
    let targets = [
        middle,
        whole[0],
        whole[3],
        [0.6, -0.15],
        [0.6, -0.15 + 1e-9],
        [0.3, 0.2],
        [-0.4, 0.1],
        [2.5, 3.0],
        [0.8, 0.6 + 1e-12],
    ];
    for target in targets {
        let sum: Matrix3<f64> = (0..5).map(|i| polygon::integrate(&green, &part(i), target)).sum();
        assert!(relative(&polygon::integrate(&green, &whole, target), &sum) < 1e-13, "{target:?}");
    }
}

/// Truth: the displacement by a patch is continuous across edges and vertices. Over a distance d it changes by the order of d
/// ln(1/d).
#[test]
fn field_is_continuous_at_edges_and_vertices() {
    let green = pair(35.0);
    let d = 1e-9;
    for target in [[2.0, 0.3], [2.0, 2.0], [-2.0, -2.0], [0.7, -2.0]] {
        let at = polygon::integrate(&green, &SQUARE, target);
        for shift in [[d, 0.0], [-d, 0.0], [0.0, d], [0.0, -d], [d, d]] {
            let moved = polygon::integrate(&green, &SQUARE, [target[0] + shift[0], target[1] + shift[1]]);
            assert!(relative(&moved, &at) < 50.0 * d, "{target:?}");
        }
    }
}

/// Integral of `f` over a triangle, which is split into four parts `depth` + 1 times.
fn integrate_over(
    triangle: [[f64; 2]; 3],
    f: &dyn Fn([f64; 2]) -> Matrix3<f64>,
    depth: usize,
) -> Matrix3<f64> {
    // Seven points, exact to degree 5 (Radon 1948).
    let rule = |[a, b, c]: [[f64; 2]; 3]| {
        let area = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]));
        let at = |u: f64, v: f64, w: f64| f([0, 1].map(|k| u * a[k] + v * b[k] + w * c[k]));
        let root = 15f64.sqrt();
        let mut sum = at(1.0 / 3.0, 1.0 / 3.0, 1.0 / 3.0) * (9.0 / 40.0);
        for sign in [1.0, -1.0] {
            let (near, weight) = ((6.0 + sign * root) / 21.0, (155.0 + sign * root) / 1200.0);
            let far = 1.0 - 2.0 * near;
            sum += (at(near, near, far) + at(near, far, near) + at(far, near, near)) * weight;
        }
        sum * area
    };
    let [a, b, c] = triangle;
    let middle = |p: [f64; 2], q: [f64; 2]| [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    let parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
    if depth == 0 {
        return parts.into_iter().map(rule).sum();
    }
    parts.into_iter().map(|part| integrate_over(part, f, depth - 1)).sum()
}

/// Truth: numerical quadrature of the Green's function G(x - y) over random triangles, with target points x outside. This test
/// fails if Γ is transposed. The tolerance 1e-9 covers the error of a rule of degree 5 on 4^5 parts.
#[test]
fn random_polygons_against_quadrature() {
    let green = pair(30.0);
    let integrator = PatchIntegrator::new(&green);
    let mut random = Random(3);
    for _ in 0..6 {
        let angle = 2.0 * PI * random.next();
        let corners = [0.0, 2.0 + random.next() * 0.5, 4.2 + random.next() * 0.5]
            .map(|a| [(a + angle).cos(), (a + angle).sin()]);
        let direction = 2.0 * PI * random.next();
        let target = [2.5 * direction.cos(), 2.5 * direction.sin()];
        let kernel = |y: [f64; 2]| {
            let x = [target[0] - y[0], target[1] - y[1]];
            green.gamma(x[1].atan2(x[0])) / x[0].hypot(x[1])
        };
        let expected = integrate_over(corners, &kernel, 4);
        assert!(relative(&polygon::integrate(&green, &corners, target), &expected) < 1e-9);
        assert!(relative(&integrator.polygon(&corners, target), &expected) < 1e-9);
    }
}

/// Truth: the integral in polar coordinates about a target inside the polygon, `∫ Γ(φ)^T R(φ) dφ`. Here R is the distance from
/// the target to the edge. The tolerance is 1e-11.
#[test]
fn targets_inside_against_polar_quadrature() {
    let green = pair(30.0);
    let corners = [[0.0, 0.0], [1.2, -0.3], [1.7, 0.8], [0.9, 1.5], [-0.2, 0.9]];
    for target in [[0.8, 0.6], [0.2, 0.3], [1.3, 0.2]] {
        let mut expected = Matrix3::zeros();
        for k in 0..5 {
            let (a, b) = (corners[k], corners[(k + 1) % 5]);
            let angle = |p: [f64; 2]| (p[1] - target[1]).atan2(p[0] - target[0]);
            let span = (angle(b) - angle(a)).rem_euclid(2.0 * PI);
            let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
            let distance = |phi: f64| {
                let (s, c) = phi.sin_cos();
                (ex * (a[1] - target[1]) - ey * (a[0] - target[0])) / (ex * s - ey * c)
            };
            let midpoint = |n: usize| -> Matrix3<f64> {
                let at = |j: usize| angle(a) + span * (j as f64 + 0.5) / n as f64;
                (0..n).map(|j| green.gamma(at(j)).transpose() * distance(at(j))).sum::<Matrix3<f64>>()
                    * (span / n as f64)
            };
            let [coarse, fine, finest] = [400, 800, 1600].map(midpoint);
            let (once, twice) = ((fine * 4.0 - coarse) / 3.0, (finest * 4.0 - fine) / 3.0);
            expected += (twice * 16.0 - once) / 15.0;
        }
        assert!(relative(&polygon::integrate(&green, &corners, target), &expected) < 1e-11, "{target:?}");
    }
}

/// Truth: the exact edge formula, whose rounding error at the distance r is 1e-16 (r / size)². Away from the patch, the
/// integrator uses Gauss points instead. The tolerance is 1e-11.
#[test]
fn gauss_points_agree_with_the_exact_formula() {
    let materials = [steel(), cfrp(0.0), cfrp(30.0), with_ratio(300.0)];
    for stiffness in materials {
        let green = green(&stiffness, Side::Lower);
        let integrator = PatchIntegrator::new(&green);
        for (a, b) in [(0.5, 0.5), (0.1, 1.0)] {
            let corners = [[-a, -b], [a, -b], [a, b], [-a, b]];
            for distance in [1.6, 3.0, 6.0, 12.0, 25.0, 60.0] {
                for k in 0..17 {
                    let phi = 0.005 + 2.0 * PI * k as f64 / 17.0;
                    let target = [distance * phi.cos(), distance * phi.sin()];
                    let exact = polygon::integrate(&green, &corners, target);
                    let rectangle = integrator.rectangle([2.0 * a, 2.0 * b], target);
                    assert!(relative(&rectangle, &exact) < 1e-11, "{distance} {phi}");
                    assert!(
                        relative(&integrator.polygon(&corners, target), &exact) < 1e-11,
                        "{distance} {phi}"
                    );
                }
            }
        }
    }
}
