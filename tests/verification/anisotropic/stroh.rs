//! The surface admittance from Stroh's eigenvectors, independent of the integrals in the library.
//!
//! Case names refer to the catalogue in docs/verification.md.

use nalgebra::{Complex, Matrix3, Matrix6, Rotation3, Vector3};
use orthowear::bem::half_space::green::barnett_lothe::BarnettLothe;
use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::material::Stiffness;

use crate::crystals::{cfrp_of_tables, cubic, topaz, with_ratio, zinc};

type C = Complex<f64>;

/// Contraction a_i c_ijkl b_l, a matrix with the indices j and k. The stiffness c_ijkl is taken from Voigt's matrix in the order
/// 11 22 33 23 13 12.
fn contract(c: &Matrix6<f64>, a: Vector3<f64>, b: Vector3<f64>) -> Matrix3<f64> {
    let voigt = |i: usize, j: usize| if i == j { i } else { 6 - i - j };
    Matrix3::from_fn(|j, k| {
        (0..9).map(|il| (il / 3, il % 3)).map(|(i, l)| a[i] * c[(voigt(i, j), voigt(k, l))] * b[l]).sum()
    })
}

/// Admittance W = i A B⁻¹ of the solid x3 > 0 for tractions harmonic along (cos w, sin w, 0) (Ting 1996). Stroh's matrix
/// [N1 N2; N3 N1ᵀ] has three eigenvalues p with Im p > 0. A and B are the upper and lower halves of the three eigenvectors.
fn admittance(stiffness: &Stiffness, w: f64) -> Matrix3<C> {
    let scale = stiffness.voigt().amax();
    let c = stiffness.voigt() / scale;
    let (m, n) = (Vector3::new(w.cos(), w.sin(), 0.0), Vector3::z());
    let (q, r, t) = (contract(&c, m, m), contract(&c, m, n), contract(&c, n, n));
    let inverse = t.try_inverse().expect("a positive definite stiffness");
    let (n1, n2, n3) = (-inverse * r.transpose(), inverse, r * inverse * r.transpose() - q);
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&n1);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&n2);
    matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&n3);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&n1.transpose());
    let (mut a, mut b) = (Matrix3::<C>::zeros(), Matrix3::<C>::zeros());
    let roots = matrix.complex_eigenvalues();
    let upper = roots.iter().filter(|p| p.im > 0.0);
    for (column, p) in upper.enumerate() {
        // Inverse iteration with a shift next to the eigenvalue.
        let shifted = matrix.map(|x| C::new(x, 0.0)) - Matrix6::identity() * (p + C::new(1e-13, 2e-13));
        let lu = shifted.lu();
        let mut v = nalgebra::Vector6::from_fn(|i, _| C::new(1.0 + 0.3 * i as f64, 0.7 - 0.2 * i as f64));
        for _ in 0..3 {
            v = lu.solve(&v).expect("a shift beside the eigenvalue");
            v /= C::new(v.norm(), 0.0);
        }
        a.set_column(column, &v.fixed_rows::<3>(0).into_owned());
        b.set_column(column, &v.fixed_rows::<3>(3).into_owned());
    }
    let inverse = b.try_inverse().expect("independent eigenvectors");
    (a * inverse).map(|h| h * C::new(0.0, 1.0 / scale))
}

fn distance(a: &Matrix3<C>, b: &Matrix3<C>) -> f64 {
    (a - b).map(|x| x.norm()).amax() / b.map(|x| x.norm()).amax()
}

/// Truth: the admittance from Stroh's eigenvectors, to 1e-9 (case `barnett-lothe-identities`). No direction is close to
/// degenerate roots, where the eigenvectors would lose accuracy.
#[test]
fn eigenvectors_agree_with_the_integrals() {
    let materials = [
        ("CFRP", cfrp_of_tables()),
        ("zinc", zinc(1.0)),
        ("copper", cubic(168.4, 121.4, 75.4)),
        ("topaz", topaz()),
    ];
    for (name, stiffness) in materials {
        for cut in [[0.4, -0.7, 1.1], [1.3, 0.2, -0.5]] {
            let turned = stiffness.rotated(Rotation3::from_euler_angles(cut[0], cut[1], cut[2]).matrix());
            let green = SurfaceGreen::new(&turned, Side::Upper).expect("a Green's function");
            for k in 0..36 {
                let w = 0.05 + 2.0 * std::f64::consts::PI * k as f64 / 36.0;
                let wanted = admittance(&turned, w);
                let [re, im] = BarnettLothe::new(&turned, Side::Upper, w).expect("tensors").admittance();
                let found = re.zip_map(&im, C::new);
                assert!(distance(&found, &wanted) < 1e-9, "{name} {w}: {:e}", distance(&found, &wanted));
                assert!(distance(&green.symbol(w), &wanted) < 1e-9, "{name} {w}");
            }
        }
    }
}

/// Truth: the admittance from Stroh's eigenvectors, to 1e-7 for E1 / E2 up to 1e4 (case `str-modulus-ratio`).
#[test]
fn eigenvectors_agree_for_extreme_ratios() {
    for ratio in [10.0, 100.0, 1e3, 1e4] {
        let stiffness = with_ratio(ratio);
        let green = SurfaceGreen::new(&stiffness, Side::Upper).expect("a Green's function");
        for w in [0.003, 0.02, 0.1, 0.4, 0.9, 1.3] {
            let apart = distance(&green.symbol(w), &admittance(&stiffness, w));
            assert!(apart < 1e-7, "{ratio} {w}: {apart:e}");
        }
    }
}
