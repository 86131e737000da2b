//! The field inside a half-space due to a point force on its surface.

use std::f64::consts::PI;
use std::sync::LazyLock;

use super::{Random, cfrp, green, relative, steel};
use crate::common::usual_or_finest;
use nalgebra::{Matrix3, Rotation3, Vector3};
use orthowear::bem::green_tensor::{GreenTensor, TractionOperator};
use orthowear::bem::half_space::{PointForceField, PointForceIntegral, Side};
use orthowear::material::{Orthotropic, Stiffness};

/// A material without symmetry planes parallel to the surface or to the coordinate planes.
fn odd() -> Stiffness {
    Stiffness::orthotropic(&Orthotropic {
        e1: 150e3,
        e2: 20e3,
        e3: 9e3,
        g12: 7e3,
        g13: 5e3,
        g23: 3.5e3,
        nu12: 0.25,
        nu13: 0.3,
        nu23: 0.35,
    })
    .expect("an admissible material")
    .rotated(Rotation3::from_euler_angles(0.4, 0.9, -1.3).matrix())
}

/// Names, stiffnesses and tabulated fields of the materials. All tests share them, because a table takes about a second to
/// compute.
static TABLES: LazyLock<Vec<(String, Stiffness, PointForceField)>> = LazyLock::new(|| {
    let azimuth = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.6);
    let tilts = usual_or_finest(&[30.0, 90.0][..], &[0.0, 30.0, 80.0, 90.0]);
    let tilted = tilts.iter().map(|&tilt| (format!("CFRP at {tilt}"), cfrp(tilt)));
    let others = [("CFRP at 45, turned", cfrp(45.0).rotated(azimuth.matrix())), ("odd", odd())];
    let others = others.map(|(name, stiffness)| (name.to_owned(), stiffness));
    let with_field = |(name, stiffness)| {
        let field = field(&stiffness);
        (name, stiffness, field)
    };
    tilted.chain(others).map(with_field).collect()
});

fn field(stiffness: &Stiffness) -> PointForceField {
    PointForceField::new(stiffness).expect("a field")
}

fn direct(stiffness: &Stiffness) -> PointForceIntegral {
    PointForceIntegral::new(stiffness, &green(stiffness, Side::Lower))
}

fn direction(random: &mut Random, z: f64) -> Vector3<f64> {
    let (phi, sin) = (2.0 * PI * random.next(), (1.0 - z * z).sqrt());
    Vector3::new(sin * phi.cos(), sin * phi.sin(), -z)
}

fn steepest(gradient: &[Matrix3<f64>; 3]) -> f64 {
    gradient.iter().map(Matrix3::amax).fold(0.0, f64::max)
}

fn apart(a: &GreenTensor, b: &GreenTensor) -> f64 {
    steepest(&[0, 1, 2].map(|k| a.gradient[k] - b.gradient[k]))
}

/// Truth: the direct integral over directions, compared with the closed form for isotropic materials. The tolerance 1e-10 covers
/// the error of the integral, which is up to 1e-11 near the surface. On the surface the displacement is Γ(φ) / r, to 1e-12.
#[test]
fn closed_forms_are_the_direct_integral() {
    for nu in [0.3, 0.0, 0.45] {
        let stiffness = Stiffness::isotropic(70e3, nu).expect("a material");
        let (closed, direct, green) = (field(&stiffness), direct(&stiffness), green(&stiffness, Side::Lower));
        assert_eq!(closed.error(), 0.0);
        let mut random = Random(11);
        for k in 0..60 {
            let z = if k % 3 == 0 { 0.02 } else { 1.0 } * (1.0 - random.next());
            let x = direction(&mut random, z) * (0.1 + 5.0 * random.next());
            let (found, wanted) = (closed.at(&x), direct.at(&x).expect("convergence"));
            assert!(relative(&found.value, &wanted.value) < 1e-10);
            assert!(apart(&found, &wanted) < 1e-10 * steepest(&wanted.gradient), "at {x}");
            let phi: f64 = 2.0 * PI * random.next();
            let found = closed.at(&Vector3::new(2.5 * phi.cos(), 2.5 * phi.sin(), 0.0)).value;
            assert!(relative(&found, &(green.gamma(phi) / 2.5)) < 1e-12);
        }
    }
}

/// Truth: central differences of the displacement. The tolerance covers the third derivative of the displacement and rounding.
#[test]
fn gradients_are_limits_of_differences() {
    let closed = field(&steel());
    for x in [[0.5, 0.3, -0.4], [-1.0, 0.2, -0.05], [0.0, 0.0, -0.7]].map(Vector3::from) {
        let at = closed.at(&x);
        for k in 0..3 {
            let mut step = Vector3::zeros();
            step[k] = 1e-4;
            let difference = (closed.at(&(x + step)).value - closed.at(&(x - step)).value) / 2e-4;
            assert!((at.gradient[k] - difference).amax() < 1e-6 * steepest(&at.gradient), "along {k} at {x}");
        }
    }
}

/// Truth: the direct integral at random points, many of them close to the surface or to the inward normal. The error is below
/// twice the error that the table states. The factor of two is needed because the stated error is a maximum over other points.
#[test]
fn tables_are_the_direct_integral() {
    for (name, stiffness, table) in TABLES.iter() {
        let direct = direct(stiffness);
        assert!(table.error() > 0.0 && table.error() <= 1e-7, "{name}: {}", table.error());
        let mut random = Random(5);
        let (mut largest, mut scale, mut value) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..900 {
            let u = 1.0 - random.next();
            let z = [0.003 + 0.997 * u, 1e-3 + 0.02 * u, 1.0 - 5e-4 * u * u][k % 3];
            let x = direction(&mut random, z);
            let distance = 0.1 + 5.0 * random.next();
            let wanted = direct.at(&x).expect("convergence");
            let mut found = table.at(&(x * distance));
            found.value *= distance;
            found.gradient.iter_mut().for_each(|part| *part *= distance * distance);
            largest = largest.max(apart(&found, &wanted));
            scale = scale.max(steepest(&wanted.gradient));
            value = value.max(relative(&found.value, &wanted.value));
        }
        assert!(
            largest < 2.0 * table.error() * scale,
            "{name}: {:e}, stated {:e}",
            largest / scale,
            table.error()
        );
        assert!(value < 2e-7, "{name}: value {value:e}");
    }
}

/// Truth: on the surface the displacement is Γ(φ) / r. Its derivatives along the surface are limits of finite differences. The
/// surface carries no traction.
#[test]
fn the_surface_is_free() {
    let steel = [("steel".to_owned(), steel(), field(&steel()))];
    for (name, stiffness, field) in TABLES.iter().chain(&steel) {
        let green = green(stiffness, Side::Lower);
        let traction = TractionOperator::new(stiffness, &Vector3::z());
        let size = stiffness.voigt().amax();
        for k in 0..40 {
            let (phi, r): (f64, f64) = (-3.0 + 0.15 * k as f64, 0.3 + 0.1 * k as f64);
            let x = Vector3::new(r * phi.cos(), r * phi.sin(), 0.0);
            let at = field.at(&x);
            let scale = steepest(&at.gradient);
            assert!(relative(&at.value, &(green.gamma(phi) / r)) < 1e-12, "{name}");
            assert!(traction.apply(&at).amax() < 1e-13 * size * scale, "{name}: {}", traction.apply(&at));
            // Rounding of a coordinate must not move a point off the surface.
            assert_eq!(field.at(&(x + Vector3::z() * 1e-11)), at);
            let h = 1e-4 * r;
            for (axis, step) in [Vector3::x() * h, Vector3::y() * h].into_iter().enumerate() {
                let difference = (field.at(&(x + step)).value - field.at(&(x - step)).value) / (2.0 * h);
                assert!((at.gradient[axis] - difference).amax() < 2e-5 * scale, "{name} along {axis}");
            }
            let below = field.at(&(x - Vector3::z() * (1e-7 * r)));
            assert!(apart(&below, &at) < 2e-6 * scale, "{name}: {:e}", apart(&below, &at) / scale);
        }
    }
}

/// Truth: the tractions on a hemisphere around the force balance the force.
#[test]
fn tractions_on_a_hemisphere_balance_the_force() {
    for (name, stiffness, field) in TABLES.iter() {
        let mut sum = Matrix3::zeros();
        let around = 256;
        for (z, weight) in legendre(96) {
            for k in 0..around {
                let phi = 2.0 * PI * k as f64 / around as f64;
                let sin = (1.0 - z * z).sqrt();
                let n = Vector3::new(sin * phi.cos(), sin * phi.sin(), -z);
                sum += TractionOperator::new(stiffness, &n).apply(&field.at(&n))
                    * (weight * 2.0 * PI / around as f64);
            }
        }
        assert!((sum + Matrix3::identity()).amax() < 2e-7, "{name}: {sum}");
    }
}

fn legendre(n: usize) -> Vec<(f64, f64)> {
    let polynomial = |x: f64| {
        let (mut before, mut p) = (1.0, x);
        for k in 2..=n {
            let k = k as f64;
            (before, p) = (p, ((2.0 * k - 1.0) * x * p - (k - 1.0) * before) / k);
        }
        (p, n as f64 * (x * p - before) / (x * x - 1.0))
    };
    (0..n)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
            for _ in 0..8 {
                let (p, slope) = polynomial(x);
                x -= p / slope;
            }
            let (_, slope) = polynomial(x);
            (0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Truth: the direct integral at random points for E1 / E2 = 3000. Half of the points lie within 0.03 of the direction of the
/// fibre. The error is below twice the error that the table states.
#[test]
fn stiff_fibres_have_the_error_that_their_table_states() {
    let tilt = 29_f64.to_radians();
    let stiffness = Stiffness::transversely_isotropic(3e6, 1e3, 400.0, 0.3, 0.3)
        .expect("a material")
        .rotated(Rotation3::from_axis_angle(&Vector3::y_axis(), -tilt).matrix());
    let (table, direct) = (field(&stiffness), direct(&stiffness));
    assert!(table.error() > 0.0 && table.error() < 1e-3, "{}", table.error());
    let mut random = Random(7);
    let (mut largest, mut scale) = (0.0_f64, 0.0_f64);
    for k in 0..200 {
        let sign = if k % 4 < 2 { 1.0 } else { -1.0 };
        let fibre = Vector3::new(sign * tilt.cos(), 0.0, -tilt.sin());
        let x = direction(&mut random, 0.01 + 0.99 * f64::from(k) / 200.0);
        let x = if k % 2 == 0 { x } else { (fibre + x * 0.03).normalize() };
        let wanted = direct.at(&x).expect("convergence");
        largest = largest.max(apart(&table.at(&x), &wanted));
        scale = scale.max(steepest(&wanted.gradient));
    }
    assert!(largest < 2.0 * table.error() * scale, "{:e}, stated {:e}", largest / scale, table.error());
}

/// Truth: any number of threads gives the same bits.
#[test]
fn tables_do_not_depend_on_threads() {
    let stiffness =
        Stiffness::transversely_isotropic(20e3, 9544.0, 5292.0, 0.272, 0.369).expect("a material");
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| field(&stiffness))
    };
    let [one, three] = [1, 3].map(with);
    assert_eq!(one.error(), three.error());
    let mut random = Random(3);
    for _ in 0..200 {
        let z = random.next();
        let x = direction(&mut random, z);
        assert_eq!(one.at(&x), three.at(&x));
    }
}
