//! Half-spaces: surface Green's function, polygon integrals, operators on the frame.

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix3, Matrix6, Rotation3, Vector3};
use orthowear::bem::half_space::barnett_lothe::BarnettLothe;
use orthowear::bem::half_space::{CrossBlocks, DenseFlexibility, FftFlexibility, PatchIntegrator};
use orthowear::bem::half_space::{Side, SurfaceGreen, polygon};
use orthowear::error::Kind;
use orthowear::geometry::fibre_axes;
use orthowear::linalg::operator::Flexibility;
use orthowear::material::{Orthotropic, Stiffness};
use serde_json::Value;

fn steel() -> Stiffness {
    Stiffness::isotropic(210e3, 0.3).expect("steel")
}

fn cfrp(tilt_degrees: f64) -> Stiffness {
    let im7 = Orthotropic {
        e1: 167230.0,
        e2: 9544.0,
        e3: 9544.0,
        g12: 5292.0,
        g13: 5292.0,
        g23: 3483.0,
        nu12: 0.272,
        nu13: 0.272,
        nu23: 0.369,
    };
    Stiffness::orthotropic(&im7).expect("CFRP").rotated(&fibre_axes(tilt_degrees.to_radians(), 0.0))
}

fn green(stiffness: &Stiffness, side: Side) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, side).expect("a converged Green's function")
}

/// CFRP below steel.
fn pair(tilt_degrees: f64) -> SurfaceGreen {
    SurfaceGreen::sum(&[&green(&cfrp(tilt_degrees), Side::Lower), &green(&steel(), Side::Upper)])
}

fn matrix(value: &Value) -> Matrix3<f64> {
    Matrix3::from_fn(|i, j| value[i][j].as_f64().expect("a number of the table"))
}

fn relative(found: &Matrix3<f64>, expected: &Matrix3<f64>) -> f64 {
    (found - expected).amax() / expected.amax()
}

fn entries(value: &Value) -> impl Iterator<Item = (&str, &Value)> {
    value.as_object().expect("an object of the table").iter().map(|(key, entry)| (key.as_str(), entry))
}

/// Truth: an independent program (tests/data/half-space-table.json, 12 digits). Tolerance 1e-9 of the largest
/// entry of each matrix, as the table's series was cut there.
#[test]
fn kernels_agree_with_an_independent_program() {
    let table: Value = serde_json::from_str(include_str!("../data/half-space-table.json")).expect("JSON");
    for tilt in [30.0, 90.0] {
        let bodies = [("frp", green(&cfrp(tilt), Side::Lower)), ("comb", pair(tilt))];
        for (name, green) in &bodies {
            let expected = &table[tilt.to_string()][name];
            let integrator = PatchIntegrator::new(green);
            for (angle, w) in entries(&expected["M"]) {
                let found = green.symbol(angle.parse().expect("an angle"));
                let (re, im) = (found.map(|w| w.re), found.map(|w| w.im));
                assert!(relative(&re, &matrix(&w["re"])) < 1e-9, "{tilt} {name} Re M({angle})");
                let error = (im - matrix(&w["im"])).amax() / re.amax();
                assert!(error < 1e-9, "{tilt} {name} Im M({angle})");
            }
            for (angle, gamma) in entries(&expected["H"]) {
                let found = green.gamma(angle.parse().expect("an angle"));
                let error = relative(&found, &matrix(gamma));
                assert!(error < 1e-9, "{tilt} {name} H({angle}): {error:e}");
            }
            for (offset, cell) in entries(&expected["K"]) {
                let d: Vec<f64> = offset.split(',').map(|x| x.parse().expect("an offset")).collect();
                let error = relative(&integrator.rectangle([1.0, 1.0], [d[0], d[1]]), &matrix(cell));
                assert!(error < 1e-9, "{tilt} {name} K({offset}): {error:e}");
            }
        }
    }
}

/// Truth: Boussinesq and Cerruti, in the form of docs/theory-half-space.md (all nine components, both sides). Tolerance
/// 1e-13: closed form against rounding.
#[test]
fn isotropic_limit_is_boussinesq_and_cerruti() {
    let (e, nu) = (210e3, 0.3);
    let shear = e / (2.0 * (1.0 + nu));
    for side in [Side::Lower, Side::Upper] {
        let green = green(&steel(), side);
        for k in 0..24 {
            let phi = 0.1 + k as f64 * 2.0 * PI / 24.0;
            let r = [phi.cos(), phi.sin()];
            let odd = (1.0 - 2.0 * nu) * side.outward();
            let expected = Matrix3::from_fn(|i, j| match (i, j) {
                (2, 2) => 2.0 * (1.0 - nu),
                (2, j) => -odd * r[j],
                (i, 2) => odd * r[i],
                (i, j) => 2.0 * (1.0 - nu) * f64::from(u8::from(i == j)) + 2.0 * nu * r[i] * r[j],
            }) / (4.0 * PI * shear);
            assert!(relative(&green.gamma(phi), &expected) < 1e-13, "{side:?} at {phi}");
        }
    }
}

/// Truth: reciprocity, G(-x) = G(x)^T; W Hermitian and positive definite (the surface stores energy).
#[test]
fn green_is_reciprocal_and_the_admittance_positive() {
    for tilt in [0.0, 17.0, 30.0, 60.0, 90.0] {
        let green = pair(tilt);
        for k in 0..20 {
            let angle = 0.05 + 0.3 * k as f64;
            let gamma = green.gamma(angle);
            assert!(relative(&green.gamma(angle + PI), &gamma.transpose()) < 1e-13);
            let w: Matrix3<Complex<f64>> = green.symbol(angle);
            assert!((w - w.adjoint()).map(|x| x.norm()).amax() < 1e-13 * w.map(|x| x.norm()).amax());
            assert!(w.symmetric_eigenvalues().min() > 0.0, "tilt {tilt}, angle {angle}");
        }
    }
}

/// Truth: direct summation of the same kernels, and the symmetry of the operator. Tolerance 1e-13 of the largest
/// entry: rounding of the transforms.
#[test]
fn fft_equals_direct_sum() {
    for (cells, spacing) in [([7, 5], [0.1, 0.1]), ([12, 9], [0.2, 0.05]), ([1, 6], [1.0, 1.0])] {
        let green = pair(30.0);
        let integrator = PatchIntegrator::new(&green);
        let operator = FftFlexibility::new(cells, spacing, &green, CrossBlocks::Keep).expect("an operator");
        let n = operator.n_cells();
        let tractions: Vec<f64> = (0..3 * n).map(|k| ((k * 37 % 101) as f64 / 50.0 - 1.0).sin()).collect();
        let mut gap = vec![f64::NAN; 3 * n];
        operator.apply(&tractions, &mut gap);
        let mut direct = vec![0.0; 3 * n];
        for i in 0..n {
            for j in 0..n {
                let at = |k: usize| [(k / cells[1]) as f64 * spacing[0], (k % cells[1]) as f64 * spacing[1]];
                let block = integrator.rectangle(spacing, [at(i)[0] - at(j)[0], at(i)[1] - at(j)[1]]);
                for a in 0..3 {
                    for b in 0..3 {
                        direct[a * n + i] += block[(a, b)] * tractions[b * n + j];
                    }
                }
            }
        }
        let scale = direct.iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for (found, expected) in gap.iter().zip(&direct) {
            assert!((found - expected).abs() < 1e-13 * scale, "{cells:?}: {found} {expected}");
        }
    }
}

/// Equal numbers in [0, 1) on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| 2.0 * self.next() - 1.0).collect()
    }
}

fn voigt(entries: &[(usize, usize, f64)]) -> Stiffness {
    let mut c = Matrix6::zeros();
    for &(i, j, value) in entries {
        c[(i - 1, j - 1)] = value;
        c[(j - 1, i - 1)] = value;
    }
    Stiffness::from_voigt(c).expect("an admissible stiffness")
}

fn cubic(c11: f64, c12: f64, c44: f64) -> Stiffness {
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c11), (1, 2, c12), (1, 3, c12), (2, 3, c12)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, c44)]].concat())
}

/// Axis along 3; GPa.
fn zinc() -> Stiffness {
    let (c11, c33, c12, c13, c44) = (165.0, 61.8, 31.1, 50.0, 39.6);
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c33), (1, 2, c12), (1, 3, c13), (2, 3, c13)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, (c11 - c12) / 2.0)]].concat())
}

/// The CFRP of the published surface admittances: E = 140, 10, 9 GPa (MPa here).
fn cfrp_of_tables() -> Stiffness {
    let constants = Orthotropic {
        e1: 140e3,
        e2: 10e3,
        e3: 9e3,
        g12: 5.2e3,
        g13: 4.8e3,
        g23: 3.3e3,
        nu12: 0.30,
        nu13: 0.28,
        nu23: 0.45,
    };
    Stiffness::orthotropic(&constants).expect("CFRP")
}

/// Mean over the directions of W_nn, 2 / (indentation modulus).
fn mean_normal_admittance(green: &SurfaceGreen) -> f64 {
    (0..512).map(|k| green.symbol(2.0 * PI * k as f64 / 512.0)[(2, 2)].re).sum::<f64>() / 512.0
}

/// Truth: W from the Barnett-Lothe tensors by direct principal-value quadrature (docs/theory-half-space.md, staggered
/// trapezoid, exact for trigonometric polynomials), against the closed sum of the series. Tolerance 1e-12:
/// rounding of 512 terms.
#[test]
fn gamma_is_the_principal_value_integral() {
    for (tilt, side) in [(10.0, Side::Lower), (45.0, Side::Upper), (80.0, Side::Lower)] {
        let stiffness = cfrp(tilt);
        let green = green(&stiffness, side);
        let admittance =
            |angle: f64| BarnettLothe::new(&stiffness, side, angle).expect("converged tensors").admittance();
        for phi in [0.0, 0.7, 2.0, 4.4] {
            let n = 512;
            let principal = (0..n).fold(Matrix3::zeros(), |sum, j| {
                let offset = PI / 2.0 + (j as f64 + 0.5) * 2.0 * PI / n as f64;
                sum + admittance(phi + offset)[1] / offset.cos()
            }) * (2.0 * PI / n as f64);
            let expected = (admittance(phi + PI / 2.0)[0] - principal / (2.0 * PI)) / (2.0 * PI);
            assert!(relative(&green.gamma(phi), &expected) < 1e-12, "tilt {tilt}, {side:?}, {phi}");
        }
    }
}

/// Truth: identities of Barnett and Lothe (1973), Chadwick and Smith (1977): H L - S S = I, L S + S^T L = 0,
/// S H + H S^T = 0, H and L positive definite, for 50 random rotations of each material. Tolerance 1e-11, that of
/// the published check.
#[test]
fn barnett_lothe_identities() {
    let mut random = Random(7);
    for stiffness in [cfrp_of_tables(), zinc(), cubic(168.4, 121.4, 75.4), steel()] {
        for _ in 0..50 {
            let axis = Vector3::new(random.next() - 0.5, random.next() - 0.5, random.next() - 0.5);
            let turned = stiffness.rotated(Rotation3::new(axis * 6.0).matrix());
            let BarnettLothe { s, h, l } =
                BarnettLothe::new(&turned, Side::Lower, 6.0 * random.next()).expect("converged tensors");
            assert!((h * l - s * s - Matrix3::identity()).amax() < 1e-11);
            assert!((l * s + s.transpose() * l).amax() < 1e-11 * l.amax());
            assert!((s * h + h * s.transpose()).amax() < 1e-11 * h.amax());
            assert!(h.symmetric_eigenvalues().min() > 0.0 && l.symmetric_eigenvalues().min() > 0.0);
        }
    }
}

/// Truth: closed forms along the principal directions (Ting 1996) and published values at 30 degrees for a solid
/// x3 > 0 with the components in the axes of the solid, that is, our upper side. Tolerance 1e-12 for the closed
/// form, 1e-9 for values of 10 digits.
#[test]
fn orthotropic_surface_admittance() {
    let green = green(&cfrp_of_tables(), Side::Upper);
    let c = *cfrp_of_tables().voigt();
    let s = (c[(0, 0)] * c[(2, 2)]).sqrt();
    let l11 = (c[(0, 2)] + s)
        * (c[(4, 4)] * (s - c[(0, 2)]) / (c[(2, 2)] * (c[(0, 2)] + 2.0 * c[(4, 4)] + s))).sqrt();
    let closed = [1.0 / l11, 1.0 / (c[(3, 3)] * c[(5, 5)]).sqrt(), (c[(0, 0)] / c[(2, 2)]).sqrt() / l11];
    let along = green.symbol(0.0);
    for i in 0..3 {
        assert!((along[(i, i)].re / closed[i] - 1.0).abs() < 1e-12);
    }
    let re = Matrix3::new(
        4.842842794e-05,
        -2.216668652e-06,
        0.0,
        -2.216668652e-06,
        0.0002231833903,
        0.0,
        0.0,
        0.0,
        0.0001663888019,
    );
    let (xn, yn) = (2.415293808e-05, 1.356879742e-05);
    let im = Matrix3::new(0.0, 0.0, xn, 0.0, 0.0, yn, -xn, -yn, 0.0);
    let at_30 = green.symbol(PI / 6.0);
    assert!(relative(&at_30.map(|w| w.re), &re) < 1e-9);
    assert!(relative(&at_30.map(|w| w.im), &im) < 1e-9);
    assert!((along[(0, 2)].im / 2.242933046e-05 - 1.0).abs() < 1e-9);
    assert!((green.symbol(PI / 2.0)[(1, 2)].im / 5.9204783e-05 - 1.0).abs() < 1e-8);
}

/// Truth: point-force tensors of Willis (1966) and Barnett and Lothe (1975) for a solid x3 > 0, computed by an
/// independent program. Tolerance 1e-8 of the largest entry, that of the published check.
#[test]
fn point_force_on_cfrp_and_zinc() {
    let cfrp = green(&cfrp_of_tables(), Side::Upper);
    let expected_0 = Matrix3::new(
        3.185648401e-05,
        0.0,
        -7.069461022e-06,
        0.0,
        3.256772993e-05,
        0.0,
        7.069461022e-06,
        0.0,
        3.435338185e-05,
    );
    let expected_30 = Matrix3::new(
        1.232311183e-05,
        4.902424832e-07,
        -3.581525224e-06,
        4.902424832e-07,
        3.294704745e-05,
        -5.532599874e-06,
        3.581525224e-06,
        5.532599874e-06,
        3.170080633e-05,
    );
    assert!(relative(&cfrp.gamma(0.0), &expected_0) < 1e-8);
    assert!(relative(&cfrp.gamma(PI / 6.0), &expected_30) < 1e-8);
    let axis_along_x = zinc().rotated(Rotation3::from_axis_angle(&Vector3::y_axis(), PI / 2.0).matrix());
    let zinc = green(&axis_along_x, Side::Upper);
    let expected = Matrix3::new(
        4.363496896e-06,
        5.868139637e-07,
        -4.792602669e-07,
        5.868139637e-07,
        2.325227576e-06,
        -2.530115846e-07,
        4.792602669e-07,
        2.530115846e-07,
        2.142816642e-06,
    ) * 1e3;
    assert!(relative(&zinc.gamma(PI / 6.0), &expected) < 1e-8);
}

/// Truth: closed form for a transversely isotropic half-space with its axis along the normal (Elliott 1949;
/// Delafargue and Ulm 2004), M = 69.61813335 GPa for zinc. Tolerance 1e-10.
#[test]
fn indentation_modulus_of_zinc() {
    let (c11, c33, c13, c44): (f64, f64, f64, f64) = (165.0, 61.8, 50.0, 39.6);
    let modulus =
        2.0 * ((c11 * c33 - c13 * c13) / c11 / (1.0 / c44 + 2.0 / (c13 + (c11 * c33).sqrt()))).sqrt();
    let found = 2.0 / mean_normal_admittance(&green(&zinc(), Side::Lower));
    assert!((found / modulus - 1.0).abs() < 1e-10);
    assert!((found / 69.61813335 - 1.0).abs() < 1e-9);
}

/// Truth: moduli of cubic crystals after Vlassak and Nix (1993, 1994), GPa, 10 digits; the (111) surface needs a
/// stiffness without any symmetry plane along the axes. Tolerance 1e-8.
#[test]
fn indentation_modulus_of_cubic_crystals() {
    let copper = cubic(168.4, 121.4, 75.4);
    let silicon = cubic(165.7, 63.9, 79.6);
    let turned_to_normal = |stiffness: &Stiffness, direction: Vector3<f64>| {
        let rotation = Rotation3::rotation_between(&direction, &Vector3::z()).expect("not opposite");
        stiffness.rotated(rotation.matrix())
    };
    let cases = [
        (copper.clone(), 134.0130407),
        (turned_to_normal(&copper, Vector3::new(1.0, 1.0, 1.0)), 151.5844949),
        (turned_to_normal(&silicon, Vector3::new(1.0, 1.0, 0.0)), 172.8121713),
    ];
    for (stiffness, modulus) in cases {
        let found = 2.0 / mean_normal_admittance(&green(&stiffness, Side::Lower));
        assert!((found / modulus - 1.0).abs() < 1e-8, "{found} {modulus}");
    }
}

/// Stiffness with the ratio E1 / E2, fibre along x.
fn with_ratio(ratio: f64) -> Stiffness {
    let e2 = 10e3;
    let g23 = e2 / 2.6;
    let constants = Orthotropic {
        e1: ratio * e2,
        e2,
        e3: e2,
        g12: e2 / 2.0,
        g13: e2 / 2.0,
        g23,
        nu12: 0.3,
        nu13: 0.3,
        nu23: 0.3,
    };
    Stiffness::orthotropic(&constants).expect("an admissible material")
}

/// Truth: closed form along the fibre (Ting 1996) where the integrands are most peaked, and the tensors of single
/// directions against the series. Tolerance 1e-9 for E1 / E2 up to 1e4, as claimed.
#[test]
fn extreme_modulus_ratios_keep_nine_digits() {
    for ratio in [1.0, 10.0, 100.0, 1e3, 1e4] {
        let stiffness = with_ratio(ratio);
        let c = *stiffness.voigt();
        let s = (c[(0, 0)] * c[(2, 2)]).sqrt();
        let l11 = (c[(0, 2)] + s)
            * (c[(4, 4)] * (s - c[(0, 2)]) / (c[(2, 2)] * (c[(0, 2)] + 2.0 * c[(4, 4)] + s))).sqrt();
        let green = green(&stiffness, Side::Lower);
        let along = green.symbol(0.0);
        assert!((along[(0, 0)].re * l11 - 1.0).abs() < 1e-9, "{ratio}");
        let l33 = l11 * (c[(2, 2)] / c[(0, 0)]).sqrt();
        assert!((along[(2, 2)].re * l33 - 1.0).abs() < 1e-9, "{ratio}");
        for angle in [0.003, 0.05, 0.4, 1.3] {
            let tensors = BarnettLothe::new(&stiffness, Side::Lower, angle).expect("converged tensors");
            assert!(tensors.h.symmetric_eigenvalues().min() > 0.0);
            let [re, im] = tensors.admittance();
            let w = green.symbol(angle);
            assert!((w.map(|w| w.re) - re).amax() < 1e-9 * re.amax(), "{ratio} {angle}");
            assert!((w.map(|w| w.im) - im).amax() < 1e-9 * re.amax(), "{ratio} {angle}");
        }
    }
}

/// Truth: W_nn at 0.3 rad tends smoothly to 2 / E* as the anisotropy e vanishes (triple Stroh root at e = 0);
/// values of 10 digits from an independent program, tolerance 1e-9.
#[test]
fn nearly_isotropic_materials_are_no_special_case() {
    let normal_admittance = |e: f64| {
        let (young, nu) = (210e3, 0.3);
        let g = young / 2.6;
        let constants = Orthotropic {
            e1: young * (1.0 + e),
            e2: young,
            e3: young * (1.0 - e / 2.0),
            g12: g,
            g13: g,
            g23: g * (1.0 + e / 3.0),
            nu12: nu,
            nu13: nu,
            nu23: nu,
        };
        let stiffness = Stiffness::orthotropic(&constants).expect("an admissible material");
        green(&stiffness, Side::Lower).symbol(0.3)[(2, 2)].re
    };
    for (e, expected) in [(0.1, 8.973157906e-06), (1e-2, 8.696690039e-06), (1e-4, 8.666966315e-06)] {
        assert!((normal_admittance(e) / expected - 1.0).abs() < 1e-9, "{e}");
    }
    let isotropic = 2.0 * (1.0 - 0.3 * 0.3) / 210e3;
    for e in [1e-6, 1e-8, 1e-16, 0.0] {
        assert!((normal_admittance(e) / isotropic - 1.0).abs() < 0.5 * e + 1e-13, "{e}");
    }
}

const SQUARE: [[f64; 2]; 4] = [[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];

/// Truth: Love (1929), uniform pressure on a rectangle; centre, corner and middle of a side of a 4 x 4 square.
/// Tolerance 1e-13: closed form against rounding; 1e-9 for the published values (10 digits).
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

/// Truth: Cerruti's solution integrated over rectangles (Johnson 1985, section 3.6), published to 10 digits;
/// the normal displacement under shear has the sign of the outward normal and vanishes at the centre.
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
    // Ahead of a pull along x the surface of the lower body sinks, behind it rises.
    assert!(polygon::integrate(&green, &SQUARE, [3.0, 0.0])[(2, 0)] < 0.0);
}

/// Truth: uniform pressure on a disc (Johnson 1985, section 3.4) on a pixelised disc, 5e-3 as published for
/// pixels; and on CFRP the centre p a <W_nn> with a fine polygon, where the loss of area is the error.
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

/// Truth: multipole expansion of a square, F / (π E* r) (1 + L^2 / (24 r^2)), on an axis at 1e3 and 1e6 sides,
/// to 1e-10, where the exact edge formula has lost digits; and Γ(φ) / r for CFRP at 1e6 sides.
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

/// Truth: the integral over a polygon is the sum over its parts, wherever the target lies: inside, outside, on an
/// edge, on a vertex, next to an edge. Tolerance 1e-13 of the largest entry: rounding.
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

/// Truth: continuity across edges and vertices; the field of a patch has the modulus of continuity d ln(1/d).
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

/// `∫ f` over the triangle by Gauss points on a hierarchy of quartered triangles, refined until it stands.
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

/// Truth: quadrature of G(x - y) itself, point by point, over random triangles seen from outside; this settles
/// the transposition. Tolerance 1e-9: 4^6 triangles of degree 5 at a distance of about the size.
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

/// Truth: for a target inside, polar coordinates about it leave `∫ Γ(φ)^T R(φ) dφ` with the distance R to the
/// edge, integrated by the midpoint rule with two steps of Richardson in each sector. Tolerance 1e-11.
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

/// Truth: the exact edge formula, whose own error at the distance r is 1e-16 (r / size)^2, against the Gauss
/// points that replace it away from the patch; for narrow features of Γ too. Tolerance 1e-11.
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

/// Truth: Betti, v·S w = w·S v on a uniform grid, and S positive definite; the row-sum bound lies above the
/// largest eigenvalue and not far above. The normal operator is the nn block of the whole one.
#[test]
fn fft_operator_is_symmetric_positive_and_bounded() {
    let operator =
        FftFlexibility::new([9, 6], [0.1, 0.15], &pair(30.0), CrossBlocks::Keep).expect("an operator");
    let n = operator.n_cells();
    let column = |j: usize| {
        let mut unit = vec![0.0; 3 * n];
        unit[j] = 1.0;
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&unit, &mut gap);
        gap
    };
    let columns: Vec<Vec<f64>> = (0..3 * n).map(column).collect();
    let dense = nalgebra::DMatrix::from_fn(3 * n, 3 * n, |i, j| columns[j][i]);
    assert!((&dense - dense.transpose()).amax() < 1e-14 * dense.amax());
    let eigenvalues = dense.clone().symmetric_eigen().eigenvalues;
    assert!(eigenvalues.min() > 0.0);
    let bound = operator.spectral_bound();
    assert!(eigenvalues.max() <= bound && bound < 2.5 * eigenvalues.max(), "{bound} {}", eigenvalues.max());
    for (i, block) in operator.diagonal_blocks().iter().enumerate() {
        let found = Matrix3::from_fn(|a, b| dense[(a * n + i, b * n + i)]);
        assert!(relative(&found, block) < 1e-13);
    }
    let pressure = Random(5).vector(n);
    let mut normal = vec![0.0; n];
    operator.apply_normal(&pressure, &mut normal);
    for i in 0..n {
        let expected: f64 = (0..n).map(|j| dense[(2 * n + i, 2 * n + j)] * pressure[j]).sum();
        assert!((normal[i] - expected).abs() < 1e-14 * dense.amax() * n as f64);
    }
}

/// Truth: every row and column is transformed by itself, so one, two and three threads give the same bits.
#[test]
fn operators_give_the_same_bits_for_any_number_of_threads() {
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
        pool.install(|| {
            let green = pair(30.0);
            let (centers, cells, areas) = grid_polygons([9, 7], [0.1, 0.1]);
            let grid =
                FftFlexibility::new([40, 31], [0.1, 0.1], &green, CrossBlocks::Keep).expect("an operator");
            let dense = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
            let operators: [&dyn Flexibility; 2] = [&grid, &dense];
            let mut bits = Vec::new();
            for operator in operators {
                let tractions = Random(11).vector(3 * operator.n_cells());
                let mut gap = vec![0.0; tractions.len()];
                operator.apply(&tractions, &mut gap);
                bits.extend(gap.iter().map(|g| g.to_bits()));
                operator.apply_normal(&tractions[..operator.n_cells()], &mut gap[..operator.n_cells()]);
                bits.extend(gap.iter().map(|g| g.to_bits()));
            }
            bits
        })
    };
    let one = run(1);
    assert!(one == run(2) && one == run(3));
}

/// Truth: equal isotropic bodies do not couple normal and tangential components (the antisymmetric parts
/// cancel), unlike ones do, and equal tilted ones do through the even part of G_xn (docs/theory-half-space.md). Leaving the
/// vanishing blocks out changes the result by rounding only.
#[test]
fn vanishing_cross_blocks_may_be_skipped() {
    let equal = SurfaceGreen::sum(&[&green(&steel(), Side::Lower), &green(&steel(), Side::Upper)]);
    let make =
        |green: &SurfaceGreen, cross| FftFlexibility::new([16, 12], [0.1, 0.1], green, cross).expect("made");
    let (kept, skipped) = (make(&equal, CrossBlocks::Keep), make(&equal, CrossBlocks::SkipVanishing));
    assert!(kept.couples_normal_tangential() && !skipped.couples_normal_tangential());
    let tractions = Random(2).vector(3 * kept.n_cells());
    let (mut a, mut b) = (vec![0.0; tractions.len()], vec![0.0; tractions.len()]);
    kept.apply(&tractions, &mut a);
    skipped.apply(&tractions, &mut b);
    let scale = a.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-14 * scale));
    let tilted = SurfaceGreen::sum(&[&green(&cfrp(30.0), Side::Lower), &green(&cfrp(30.0), Side::Upper)]);
    let flat = SurfaceGreen::sum(&[&green(&cfrp(0.0), Side::Lower), &green(&cfrp(0.0), Side::Upper)]);
    assert!(tilted.couples_normal_tangential() && !flat.couples_normal_tangential());
    assert!(make(&pair(30.0), CrossBlocks::SkipVanishing).couples_normal_tangential());
}

/// Truth: the flexibility scales as length / modulus, whatever the units. Tolerance 1e-12.
#[test]
fn units_do_not_matter() {
    let scaled = |modulus: f64, length: f64| {
        let stiffness = Stiffness::from_voigt(cfrp(30.0).voigt() * modulus).expect("an admissible stiffness");
        let green = green(&stiffness, Side::Lower);
        let operator = FftFlexibility::new([6, 5], [0.1 * length, 0.2 * length], &green, CrossBlocks::Keep)
            .expect("made");
        let mut gap = vec![0.0; 90];
        operator.apply(&Random(4).vector(90), &mut gap);
        gap.iter().map(|g| g * modulus / length).collect::<Vec<_>>()
    };
    let reference = scaled(1.0, 1.0);
    let scale = reference.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    for (modulus, length) in [(1e6, 1e-3), (1e-3, 1e6), (1e9, 1e-9)] {
        let found = scaled(modulus, length);
        assert!(found.iter().zip(&reference).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    }
}

type Polygons = (Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>, Vec<f64>);

/// Centres, corners and areas of a uniform grid in the order of a grid frame.
fn grid_polygons(cells: [usize; 2], spacing: [f64; 2]) -> Polygons {
    let [a, b] = spacing.map(|h| h / 2.0);
    let centers: Vec<[f64; 2]> = (0..cells[0] * cells[1])
        .map(|k| [(k / cells[1]) as f64 * spacing[0], (k % cells[1]) as f64 * spacing[1]])
        .collect();
    let corners = |[x, y]: [f64; 2]| vec![[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]];
    let polygons = centers.iter().map(|&c| corners(c)).collect();
    let areas = vec![spacing[0] * spacing[1]; centers.len()];
    (centers, polygons, areas)
}

/// Truth: the FFT operator on the same grid. Tolerance 1e-12 of the largest entry.
#[test]
fn dense_operator_on_a_grid_is_the_fft_operator() {
    let green = pair(30.0);
    let (centers, cells, areas) = grid_polygons([14, 11], [0.1, 0.07]);
    let dense = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
    let fft = FftFlexibility::new([14, 11], [0.1, 0.07], &green, CrossBlocks::Keep).expect("an operator");
    let n = dense.n_cells();
    let tractions = Random(9).vector(3 * n);
    let (mut a, mut b) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
    dense.apply(&tractions, &mut a);
    fft.apply(&tractions, &mut b);
    let scale = b.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(a.iter().zip(&b).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    dense.apply_normal(&tractions[..n], &mut a[..n]);
    fft.apply_normal(&tractions[..n], &mut b[..n]);
    assert!(a[..n].iter().zip(&b[..n]).all(|(x, y)| (x - y).abs() < 1e-12 * scale));
    assert!(relative(&dense.diagonal_blocks()[5], &fft.diagonal_blocks()[5]) < 1e-12);
    assert!(dense.spectral_bound() > 0.5 * fft.spectral_bound());
}

/// Truth: A S symmetric and positive definite on an irregular frame (a distorted grid split into triangles), and
/// the field of a uniform pressure over its square is Love's, to the order of the asymmetry of collocation.
#[test]
fn dense_operator_on_triangles() {
    let green = green(&steel(), Side::Lower);
    let m = 8;
    let node = |i: usize, j: usize| {
        let (x, y) = (i as f64 / m as f64, j as f64 / m as f64);
        let bump = 0.04 * (PI * x).sin() * (PI * y).sin();
        [x + bump, y - bump]
    };
    let mut cells = Vec::new();
    for i in 0..m {
        for j in 0..m {
            let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
            cells.extend([vec![a, b, c], vec![a, c, d]]);
        }
    }
    let centers: Vec<[f64; 2]> =
        cells.iter().map(|t| [0, 1].map(|c| (t[0][c] + t[1][c] + t[2][c]) / 3.0)).collect();
    let area = |t: &Vec<[f64; 2]>| {
        0.5 * ((t[1][0] - t[0][0]) * (t[2][1] - t[0][1]) - (t[1][1] - t[0][1]) * (t[2][0] - t[0][0]))
    };
    let areas: Vec<f64> = cells.iter().map(area).collect();
    let operator = DenseFlexibility::new(&centers, &cells, &areas, &green).expect("an operator");
    let n = operator.n_cells();
    let mut random = Random(21);
    let weighted = |a: &[f64], b: &[f64]| -> f64 { (0..3 * n).map(|k| areas[k % n] * a[k] * b[k]).sum() };
    for _ in 0..5 {
        let (v, w) = (random.vector(3 * n), random.vector(3 * n));
        let (mut sv, mut sw) = (vec![0.0; 3 * n], vec![0.0; 3 * n]);
        operator.apply(&v, &mut sv);
        operator.apply(&w, &mut sw);
        let energy = weighted(&v, &sv);
        assert!(energy > 0.0 && (weighted(&v, &sw) - weighted(&w, &sv)).abs() < 1e-13 * energy);
    }
    let mut gap = vec![0.0; n];
    operator.apply_normal(&vec![1.0; n], &mut gap);
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let worst = (0..n)
        .map(|i| (gap[i] / polygon::integrate(&green, &square, centers[i])[(2, 2)] - 1.0).abs())
        .fold(0.0, f64::max);
    assert!(worst < 5e-3, "{worst}");
}

/// Truth: what cannot be meant or cannot be stored is refused, with the right kind of error.
#[test]
fn unusable_frames_are_refused() {
    let green = green(&steel(), Side::Lower);
    let grid = |cells, spacing| {
        let error = FftFlexibility::new(cells, spacing, &green, CrossBlocks::Keep).err().expect("a refusal");
        (error.kind(), error.to_string())
    };
    assert_eq!(grid([0, 4], [0.1, 0.1]).0, Kind::Input);
    assert_eq!(grid([4, 4], [0.1, f64::NAN]).0, Kind::Input);
    assert_eq!(grid([4, 4], [-0.1, 0.1]).0, Kind::Input);
    let (kind, message) = grid([1_000_000, 1_000_000], [0.1, 0.1]);
    assert!(kind == Kind::Resources && message.contains("bytes") && message.contains("fewer cells"));
    let (centers, cells, areas) = grid_polygons([2, 2], [1.0, 1.0]);
    let dense = |centers: &[[f64; 2]], cells: &[Vec<[f64; 2]>], areas: &[f64]| {
        DenseFlexibility::new(centers, cells, areas, &green).err().expect("a refusal").kind()
    };
    assert_eq!(dense(&centers, &cells, &areas[1..]), Kind::Input);
    assert_eq!(dense(&[], &[], &[]), Kind::Input);
    assert_eq!(dense(&centers, &cells, &[1.0, 0.0, 1.0, 1.0]), Kind::Input);
    let line = vec![vec![[0.0, 0.0], [1.0, 0.0]]; 4];
    assert_eq!(dense(&centers, &line, &areas), Kind::Input);
    let clockwise: Vec<Vec<[f64; 2]>> = cells.iter().map(|c| c.iter().rev().copied().collect()).collect();
    assert_eq!(dense(&centers, &clockwise, &areas), Kind::Input);
    let many = 300_000;
    let huge = dense(&vec![[0.0, 0.0]; many], &vec![cells[0].clone(); many], &vec![1.0; many]);
    assert_eq!(huge, Kind::Resources);
}
