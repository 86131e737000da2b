//! Half-spaces: surface Green's function, polygon integrals, operators on the frame.

use std::f64::consts::PI;

use nalgebra::{Complex, Matrix3};
use orthowear::bem::half_space::{CrossBlocks, FftFlexibility, PatchIntegrator};
use orthowear::bem::half_space::{Side, SurfaceGreen};
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

/// Truth: Boussinesq and Cerruti, in the form of formulation 8.2 (all nine components, both sides). Tolerance
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
