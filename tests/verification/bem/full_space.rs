//! Point forces in a full space: isotropic and orthotropic values, equilibrium, tabulated fields against integrals over directions.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use orthowear::bem::full_space::{BarnettField, FullSpaceField};
use orthowear::bem::green_tensor::TractionOperator;
use orthowear::geometry::Point;
use orthowear::material::Stiffness;
use orthowear::quadrature::gauss_legendre;

use super::Random;
use crate::common::{im7, steel, tabulated_cfrp as cfrp};

fn symmetric([xx, yy, zz, yz, xz, xy]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

fn largest(fields: [&Matrix3<f64>; 3]) -> f64 {
    fields.into_iter().map(Matrix3::amax).fold(0.0, f64::max)
}

/// Truth: displacements and tractions of unit forces by an independent program, with ten digits. For steel the displacements are
/// Kelvin's solution. Tractions are given at the first point, on the plane that is normal to its position vector. The
/// displacement decreases as 1 / distance and is equal at x and -x.
#[test]
fn tabulated_values() {
    let points = [[1.0, 2.0, 2.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]].map(Point::from);
    let of_steel = [
        [
            2.241562439e-07,
            2.632532631e-07,
            2.632532631e-07,
            5.212935904e-08,
            2.606467952e-08,
            2.606467952e-08,
        ],
        [6.333717123e-07, 6.333717123e-07, 9.852448858e-07, 0.0, 0.0, 0.0],
        [9.852448858e-07, 6.333717123e-07, 6.333717123e-07, 0.0, 0.0, 0.0],
    ];
    let of_cfrp = [
        [
            1.076543835e-06,
            4.792919606e-06,
            5.174871737e-06,
            1.278050499e-06,
            5.141173882e-08,
            4.893697946e-08,
        ],
        [2.992336948e-06, 1.015037246e-05, 1.999459204e-05, 0.0, 0.0, 0.0],
        [1.5928242e-05, 1.49915917e-05, 1.581356378e-05, 0.0, 0.0, 0.0],
    ];
    let tractions = [
        Matrix3::new(
            -0.004631493053,
            -0.00421044823,
            -0.00421044823,
            -0.00421044823,
            -0.0109471654,
            -0.00842089646,
            -0.00421044823,
            -0.00842089646,
            -0.0109471654,
        ),
        Matrix3::new(
            -0.001728176983,
            -0.00297345547,
            -0.003177842088,
            -0.0006466561048,
            -0.009112671126,
            -0.008291291838,
            -0.0006565026087,
            -0.007867557536,
            -0.009608479882,
        ),
    ];
    for ((stiffness, values), traction) in [(steel(), of_steel), (cfrp(), of_cfrp)].iter().zip(tractions) {
        let field = FullSpaceField::new(stiffness).unwrap();
        let integrals = BarnettField::new(stiffness);
        for (x, value) in points.iter().zip(values) {
            let wanted = symmetric(*value);
            for found in [field.at(x).value, integrals.at(x).unwrap().value] {
                assert!((found - wanted).amax() < 1e-9 * wanted.amax(), "{x} {found} {wanted}");
            }
            let twice = field.at(&(x * 2.0)).value * 2.0;
            assert!((twice - field.at(&-x).value).amax() < 1e-15 * wanted.amax());
        }
        let map = TractionOperator::new(stiffness, &points[0].normalize());
        let found = map.apply(&field.at(&points[0]));
        assert!((found - traction).amax() < 1e-7 * traction.amax(), "{found} {traction}");
    }
}

/// Truth: Kelvin's solution. The integrals over directions give this solution for isotropic materials.
#[test]
fn isotropic_limit() {
    let stiffness = steel();
    let (closed, integrals) = (FullSpaceField::new(&stiffness).unwrap(), BarnettField::new(&stiffness));
    let mut random = Random(7);
    for _ in 0..50 {
        let x = Point::from_fn(|_, _| random.next() - 0.5);
        let (found, wanted) = (integrals.at(&x).unwrap(), closed.at(&x));
        assert!((found.value - wanted.value).amax() < 1e-10 * wanted.value.amax(), "{x}");
        for k in 0..3 {
            let size = largest([0, 1, 2].map(|k| &wanted.gradient[k]));
            assert!((found.gradient[k] - wanted.gradient[k]).amax() < 1e-10 * size, "{x}");
        }
    }
}

/// Truth: integrals over directions. The tabulated field agrees with the integrals within twice the error that the table states.
/// The stated error is below 1e-8. Finite differences of the displacement confirm its derivatives. One material is a hundred
/// times stiffer along its fibre.
#[test]
fn tables() {
    let stiff_fibre = Stiffness::transversely_isotropic(500e3, 5e3, 4e3, 0.25, 0.4).unwrap();
    for (stiffness, most) in [(cfrp(), 1e-8), (im7(30.0), 1e-8), (stiff_fibre, 1e-8)] {
        let table = FullSpaceField::new(&stiffness).unwrap();
        let integrals = BarnettField::new(&stiffness);
        let mut random = Random(3);
        let (mut apart, mut steepest): (f64, f64) = (0.0, 0.0);
        let (mut off, mut size): (f64, f64) = (0.0, 0.0);
        for _ in 0..4000 {
            let x = Point::from_fn(|_, _| random.next() - 0.5);
            let r = x.norm();
            let (found, wanted) = (table.at(&x), integrals.at(&x).unwrap());
            off = off.max((found.value - wanted.value).amax() * r);
            size = size.max(wanted.value.amax() * r);
            for k in 0..3 {
                apart = apart.max((found.gradient[k] - wanted.gradient[k]).amax() * r * r);
                steepest = steepest.max(wanted.gradient[k].amax() * r * r);
            }
        }
        assert!(table.error() < most && off.max(apart) > 0.0);
        let stated = 2.0 * table.error();
        assert!(off < stated * size && apart < stated * steepest, "{off} {size} {apart} {steepest} {stated}");
        for x in [[0.3, -0.2, 0.7], [1.0, 1e-9, 0.0], [0.0, 0.0, -1.0], [-0.4, 0.6, 1e-3]].map(Point::from) {
            let step = 1e-3;
            for k in 0..3 {
                let at = |s: f64| integrals.at(&(x + Vector3::ith(k, s * step))).unwrap().value;
                let slope = ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * step);
                let found = table.at(&x).gradient[k];
                assert!(
                    (found - slope).amax() < 4.0 * most * steepest / x.norm_squared(),
                    "{x} {found} {slope}"
                );
            }
        }
    }
}

/// Integral of the tractions of a unit force at the origin over an ellipsoid around `middle`, by `n` x `2 n` points.
fn flux(
    (field, stiffness): (&FullSpaceField, &Stiffness),
    (middle, half_axes): (Point, Point),
    n: usize,
) -> Matrix3<f64> {
    let mut sum = Matrix3::zeros();
    let step = PI / n as f64;
    for (z, weight) in gauss_legendre(n) {
        for k in 0..2 * n {
            let (sin, cos) = (step * k as f64).sin_cos();
            let rho = (1.0 - z * z).sqrt();
            let unit = Vector3::new(rho * cos, rho * sin, z);
            // Area vector of the ellipsoid, as the image of the unit sphere.
            let [a, b, c] = half_axes.into();
            let area = unit.component_mul(&Vector3::new(b * c, a * c, a * b)) * (weight * step);
            let x = middle + unit.component_mul(&half_axes);
            sum += TractionOperator::new(stiffness, &area.normalize()).apply(&field.at(&x)) * area.norm();
        }
    }
    sum
}

/// Truth: equilibrium. The tractions on a closed surface around a force balance the force. If a closed surface does not enclose
/// the force, its tractions sum to zero.
#[test]
fn equilibrium() {
    // Tractions in the anisotropic material vary over shorter distances than in steel and need more points.
    for (stiffness, n) in [(steel(), 30), (im7(30.0), 90)] {
        let field = FullSpaceField::new(&stiffness).unwrap();
        let ones = Point::from_element(1.0);
        let shapes = [
            (Point::zeros(), ones, Matrix3::identity()),
            (Point::new(0.1, -0.2, 0.1), Point::new(1.0, 1.2, 0.9), Matrix3::identity()),
            (Point::new(3.0, 1.0, 0.0), ones, Matrix3::zeros()),
        ];
        for (middle, half_axes, force) in shapes {
            let found = flux((&field, &stiffness), (middle, half_axes), n) + force;
            assert!(found.amax() < 2e-8, "{middle} {found}");
        }
        let mut cube = Matrix3::zeros();
        let line = gauss_legendre(90);
        for (axis, sign) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let normal = Vector3::ith(axis, sign);
            let map = TractionOperator::new(&stiffness, &normal);
            for (u, by_u) in &line {
                for (v, by_v) in &line {
                    let mut x = normal;
                    x[(axis + 1) % 3] = *u;
                    x[(axis + 2) % 3] = *v;
                    cube += map.apply(&field.at(&x)) * (by_u * by_v);
                }
            }
        }
        assert!((cube + Matrix3::identity()).amax() < 2e-8, "{cube}");
    }
}
