//! The surface Green's function Γ(φ) / r, its admittance W, limits and published indentation moduli.
//!
//! Case names refer to the catalogue in docs/verification.md.

use super::{Random, cfrp, entries, green, matrix, pair, relative, steel};
use crate::crystals::{
    admittance_along_1, cfrp_of_tables, cubic, modulus_along_the_axis, nearly_isotropic, with_ratio, zinc,
};
use nalgebra::{Complex, Matrix3, Rotation3, Vector3};
use orthowear::bem::half_space::green::barnett_lothe::BarnettLothe;
use orthowear::bem::half_space::{PatchIntegrator, Side, SurfaceGreen};
use orthowear::material::Stiffness;
use serde_json::Value;
use std::f64::consts::PI;

/// Truth: values of an independent program with 12 digits (tests/data/half-space-table.json). The table has the admittance M = W,
/// the Green's function H = Γ on the unit circle and the integrals K of the Green's function over cells. The tolerance is 1e-9 of
/// the largest entry, because that program truncated its series. For Re M and Im M the tolerance refers to the largest entry of
/// Re M.
#[test]
fn kernels_agree_with_an_independent_program() {
    let table: Value = serde_json::from_str(include_str!("../../data/half-space-table.json")).expect("JSON");
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

/// Truth: the solutions of Boussinesq and Cerruti, in the form of docs/theory-half-space.md. The tolerance 1e-13 covers rounding.
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

/// Truth: reciprocity, Γ(φ + π) = Γ(φ)^T. The admittance W is Hermitian and positive definite.
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

/// Mean of the normal admittance W_nn over all directions, equal to 2 / (indentation modulus).
fn mean_normal_admittance(green: &SurfaceGreen) -> f64 {
    (0..512).map(|k| green.symbol(2.0 * PI * k as f64 / 512.0)[(2, 2)].re).sum::<f64>() / 512.0
}

/// Truth: Γ as a principal-value integral of the admittance from Barnett-Lothe tensors. The staggered trapezoidal rule is exact
/// for trigonometric polynomials (docs/theory-half-space.md). The tolerance 1e-12 covers rounding.
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

/// Truth: identities of the Barnett-Lothe tensors S, H, L for 50 random rotations per material (Barnett and Lothe 1973, Chadwick
/// and Smith 1977). H L - S S = I, L S + S^T L = 0 and S H + H S^T = 0. H and L are positive definite. The tolerance is 1e-11, as
/// in the published check.
#[test]
fn barnett_lothe_identities() {
    let mut random = Random(7);
    for stiffness in [cfrp_of_tables(), zinc(1.0), cubic(168.4, 121.4, 75.4), steel()] {
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

/// Truth: the admittance along the fibre in closed form (Ting 1996), and published values at 0, 30 and 90 degrees. The values
/// hold for a solid x3 > 0 in its own axes, which is the upper body here. The tolerance is 1e-12 for the closed form, 1e-9 for
/// values of 10 digits and 1e-8 for the value of 8 digits.
#[test]
fn orthotropic_surface_admittance() {
    let green = green(&cfrp_of_tables(), Side::Upper);
    let closed = admittance_along_1(&cfrp_of_tables());
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

/// Truth: point-force tensors of Willis (1966) and Barnett and Lothe (1975) for a solid x3 > 0, computed by an independent program.
/// Tolerance 1e-8 of the largest entry, as in the published check.
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
    let axis_along_x = zinc(1.0).rotated(Rotation3::from_axis_angle(&Vector3::y_axis(), PI / 2.0).matrix());
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

/// Truth: the closed form of the indentation modulus M of a transversely isotropic half-space with its axis along the normal
/// (Elliott 1949; Delafargue and Ulm 2004). The published value for zinc is M = 69.61813335 GPa (case `ti-axis-normal-zinc`). The
/// tolerance is 1e-10 for the closed form and 1e-9 for the published value.
#[test]
fn indentation_modulus_of_zinc() {
    let modulus = modulus_along_the_axis(&zinc(1.0));
    let found = 2.0 / mean_normal_admittance(&green(&zinc(1.0), Side::Lower));
    assert!((found / modulus - 1.0).abs() < 1e-10);
    assert!((found / 69.61813335 - 1.0).abs() < 1e-9);
}

/// Truth: indentation moduli of cubic crystals after Vlassak and Nix (1993, 1994), GPa, 10 digits. For the (111) surface, no
/// coordinate plane is a symmetry plane of the stiffness. The tolerance is 1e-8.
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

/// Truth: along the fibre, the closed form of the admittance (Ting 1996). The integrands are most peaked in this direction. In
/// other directions, the truth is the admittance from Barnett-Lothe tensors of this direction alone. The tolerance is 1e-9 for E1
/// / E2 up to 1e4.
#[test]
fn extreme_modulus_ratios_keep_nine_digits() {
    for ratio in [1.0, 10.0, 100.0, 1e3, 1e4] {
        let stiffness = with_ratio(ratio);
        let closed = admittance_along_1(&stiffness);
        let green = green(&stiffness, Side::Lower);
        let along = green.symbol(0.0);
        for i in [0, 2] {
            assert!((along[(i, i)].re / closed[i] - 1.0).abs() < 1e-9, "{ratio}");
        }
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

/// Truth: the normal admittance W_nn at 0.3 rad tends smoothly to 2 / E* as the anisotropy e vanishes, although e = 0 has a
/// triple Stroh root. The other values have 10 digits and come from an independent program. Their tolerance is 1e-9.
#[test]
fn nearly_isotropic_materials_are_no_special_case() {
    let normal_admittance = |e: f64| green(&nearly_isotropic(e), Side::Lower).symbol(0.3)[(2, 2)].re;
    for (e, expected) in [(0.1, 8.973157906e-06), (1e-2, 8.696690039e-06), (1e-4, 8.666966315e-06)] {
        assert!((normal_admittance(e) / expected - 1.0).abs() < 1e-9, "{e}");
    }
    let isotropic = 2.0 * (1.0 - 0.3 * 0.3) / 210e3;
    for e in [1e-6, 1e-8, 1e-16, 0.0] {
        assert!((normal_admittance(e) / isotropic - 1.0).abs() < 0.5 * e + 1e-13, "{e}");
    }
}
