//! Nearly incompressible half-spaces: the surface admittance W against closed forms.
//!
//! Case names refer to the catalogue in docs/verification.md.

use nalgebra::{Matrix3, Rotation3, Vector3};
use orthowear::bem::half_space::green::barnett_lothe::BarnettLothe;
use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::material::{Orthotropic, Stiffness};
use std::f64::consts::PI;

use super::green::about_y;
use crate::crystals::{admittance_along_1, modulus_along_the_axis};

fn green(stiffness: &Stiffness, side: Side) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, side).expect("a converged Green's function")
}

/// Truth: Re W = ((1 - nu) (m m + n n) + t t) / G (case `str-near-incompressible`; Ting 1996). The unit vectors m, t and n point
/// along the wave, across the wave and along the normal. The entries of Im W between m and n are (1 - 2 nu) / (2 G), with
/// opposite signs. The tolerance of G W is 1e-15 (10 + lambda / G). It grows with Lamé's constant lambda, because lambda is
/// rounded.
#[test]
fn isotropic_half_spaces_up_to_incompressible() {
    let young = 210e3;
    for nu in [0.3, 0.45, 0.49, 0.499, 0.4999, 0.49999] {
        let stiffness = Stiffness::isotropic(young, nu).expect("admissible");
        let shear = young / (2.0 * (1.0 + nu));
        let tolerance = 1e-15 * (10.0 + 2.0 * nu / (1.0 - 2.0 * nu));
        for side in [Side::Lower, Side::Upper] {
            let green = green(&stiffness, side);
            for k in 0..16 {
                let (sin, cos) = (0.1 + 2.0 * PI * f64::from(k) / 16.0).sin_cos();
                let (m, t, n) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0), Vector3::z());
                let along = m * m.transpose() + n * n.transpose();
                let re = (along * (1.0 - nu) + t * t.transpose()) / shear;
                let found = green.symbol(sin.atan2(cos));
                let error = (found.map(|w| w.re) - re).amax() * shear;
                assert!(error < tolerance, "nu {nu}: {error:e}");
                let coupling: Matrix3<f64> = n * m.transpose() - m * n.transpose();
                let im = coupling * (0.5 * (1.0 - 2.0 * nu) * side.outward() / shear);
                let error = (found.map(|w| w.im) - im).amax() * shear;
                assert!(error < tolerance, "nu {nu}, {side:?}: {error:e}");
            }
        }
    }
}

/// Stiffness of rubber with fibres along axis 1. nu12 = nu13 = (1 - c) / 2 and nu23 = 1 - E2 / (2 E1) - c with c =
/// `compressible`. The material is incompressible for c = 0.
fn fibres_in_rubber(compressible: f64) -> Stiffness {
    let (e1, e2) = (50e3, 10e3);
    let (nu12, nu23) = (0.5 * (1.0 - compressible), 1.0 - e2 / (2.0 * e1) - compressible);
    let g23 = e2 / (2.0 * (1.0 + nu23));
    let constants = Orthotropic { e1, e2, e3: e2, g12: 4e3, g13: 4e3, g23, nu12, nu13: nu12, nu23 };
    Stiffness::orthotropic(&constants).expect("admissible")
}

/// Truth: closed forms of the admittance along and across the fibre (Ting 1996) and of the indentation modulus with the fibre
/// along the normal (Elliott 1949). The identities of Barnett and Lothe hold for any rotation of the material. The tolerance is
/// 1e-14 plus 1e-15 times the condition number of the stiffness.
#[test]
fn fibres_in_rubber_up_to_incompressible() {
    for compressible in [1e-1, 1e-2, 1e-3, 1e-4, 1e-5] {
        let stiffness = fibres_in_rubber(compressible);
        let eigenvalues = stiffness.voigt().symmetric_eigenvalues();
        let tolerance = 1e-14 + 1e-15 * eigenvalues.max() / eigenvalues.min();
        let quarter = stiffness.rotated(Rotation3::from_axis_angle(&Vector3::z_axis(), -PI / 2.0).matrix());
        let green_of = green(&stiffness, Side::Upper);
        for (angle, closed) in [
            (0.0, admittance_along_1(&stiffness)),
            (PI / 2.0, {
                let [along, across, normal] = admittance_along_1(&quarter);
                [across, along, normal]
            }),
        ] {
            let found = green_of.symbol(angle);
            for (i, value) in closed.iter().enumerate() {
                let error = (found[(i, i)].re / value - 1.0).abs();
                assert!(error < tolerance, "{compressible} {angle} {i}: {error:e}");
            }
        }
        let upright = about_y(&stiffness, 90.0);
        let error =
            green(&upright, Side::Lower).symbol(0.4)[(2, 2)].re * modulus_along_the_axis(&upright) / 2.0;
        assert!((error - 1.0).abs() < tolerance, "{compressible}: {error:e}");
        for k in 0..12 {
            let turned =
                stiffness.rotated(Rotation3::from_euler_angles(0.4 * f64::from(k), -0.7, 1.1).matrix());
            let BarnettLothe { s, h, l } =
                BarnettLothe::new(&turned, Side::Lower, 0.3).expect("converged tensors");
            assert!((h * l - s * s - Matrix3::identity()).amax() < tolerance);
            assert!((l * s + s.transpose() * l).amax() < tolerance * l.amax());
            assert!((s * h + h * s.transpose()).amax() < tolerance * h.amax());
        }
    }
}

/// Truth: the volumetric Poisson's ratio nu of an isotropic material is its Poisson's ratio. For fibres in rubber of
/// compressibility c, 1 - 2 nu = 2 c (1 / E1 + 1 / E2) / (1 / E1 + 2 / E2). The tolerance 1e-10 covers the rounding of the
/// compliance.
#[test]
fn volumes_that_hardly_change() {
    for nu in [-0.5, 0.0, 0.3, 0.49, 0.4999] {
        let stiffness = Stiffness::isotropic(210e3, nu).expect("admissible");
        assert!((stiffness.volumetric_poisson_ratio() - nu).abs() < 1e-10, "{nu}");
    }
    let (e1, e2) = (50e3, 10e3);
    for compressible in [1e-1, 1e-3, 1e-5] {
        let upright = fibres_in_rubber(compressible);
        let exact = 0.5 - compressible * (1.0 / e1 + 1.0 / e2) / (1.0 / e1 + 2.0 / e2);
        let found = [upright.volumetric_poisson_ratio(), about_y(&upright, 90.0).volumetric_poisson_ratio()];
        assert!(found.iter().all(|nu| (nu - exact).abs() < 1e-10), "{compressible}: {found:?} {exact}");
    }
}
