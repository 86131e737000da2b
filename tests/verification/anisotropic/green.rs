//! Published indentation moduli, admittances and Green's functions of anisotropic half-spaces; identities of Barnett-Lothe
//! tensors.
//!
//! Case names refer to the catalogue in docs/verification.md.

use nalgebra::{Matrix3, Rotation3, Vector3};
use orthowear::bem::half_space::green::barnett_lothe::BarnettLothe;
use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::material::Stiffness;
use std::f64::consts::PI;

use crate::common::relative;
use crate::crystals::{cfrp_of_tables, cubic, topaz, zinc};

fn green(stiffness: &Stiffness, side: Side) -> SurfaceGreen {
    SurfaceGreen::new(stiffness, side).expect("a converged Green's function")
}

/// Stiffness of a material that is rotated by `degrees` about y. A rotation by 90 degrees puts material axis 3 along x and axis 1
/// along the normal.
pub fn about_y(stiffness: &Stiffness, degrees: f64) -> Stiffness {
    stiffness.rotated(Rotation3::from_axis_angle(&Vector3::y_axis(), degrees.to_radians()).matrix())
}

/// Indentation modulus 2 / w. Here w is the mean of the normal surface admittance W_nn over the directions in the surface.
fn modulus(stiffness: &Stiffness) -> f64 {
    let green = green(stiffness, Side::Lower);
    2.0 * 512.0 / (0..512).map(|k| green.symbol(2.0 * PI * k as f64 / 512.0)[(2, 2)].re).sum::<f64>()
}

/// Truth: the indentation moduli of case `indentation-modulus-orthotropic` (Vlassak et al. 2003), published with 10 digits. The
/// relative tolerance is 1e-9.
#[test]
fn indentation_moduli_of_orthotropic_half_spaces() {
    for (name, stiffness, published) in [
        ("CFRP, normal 3", cfrp_of_tables(), 10.9197748e3),
        ("CFRP, normal along the fibre", about_y(&cfrp_of_tables(), 90.0), 48.07360982e3),
        ("topaz, normal 3", topaz(), 290.4927743),
    ] {
        let found = modulus(&stiffness);
        assert!(relative(found, published) < 1e-9, "{name}: {found} {published}");
    }
}

/// Truth: the real part of the surface admittance W along and across the fibre (case
/// `surface-admittance-orthotropic-closed-form`). The published values have 10 digits. The tolerance is therefore 1e-9 of the
/// largest entry, instead of the catalogue's 1e-10.
#[test]
fn admittance_along_and_across_the_fibre() {
    let green = green(&cfrp_of_tables(), Side::Upper);
    let diagonals = [
        (0.0, [4.23897167e-05, 0.0002414022748, 0.000151675001]),
        (PI / 2.0, [0.0002001601923, 0.0002046290822, 0.0002158486641]),
    ];
    for (angle, diagonal) in diagonals {
        let re = green.symbol(angle).map(|w| w.re);
        let error = (re - Matrix3::from_diagonal(&diagonal.into())).amax();
        assert!(error < 1e-9 * re.amax(), "{angle}: {error:e}");
    }
}

/// Truth: the Green's function G at unit distance along x and y (cases `half-space-green-cfrp` and
/// `half-space-green-zinc-axis-in-surface`; Willis 1966; Barnett and Lothe 1975). The tolerance is 1e-8 of the largest entry. G
/// also satisfies reciprocity, G(x) = G(-x)^T.
#[test]
fn point_forces_along_the_axes() {
    let symmetric =
        |[a, b, c]: [f64; 3], (xz, yz): (f64, f64)| Matrix3::new(a, 0.0, xz, 0.0, b, yz, -xz, -yz, c);
    let cfrp = green(&cfrp_of_tables(), Side::Upper);
    let zinc = green(&about_y(&zinc(1e3), 90.0), Side::Upper);
    for (name, green, angle, published) in [
        (
            "CFRP",
            &cfrp,
            0.0,
            symmetric([3.185648401e-05, 3.256772993e-05, 3.435338185e-05], (-7.069461022e-06, 0.0)),
        ),
        (
            "CFRP",
            &cfrp,
            PI / 2.0,
            symmetric([6.746532949e-06, 3.842036531e-05, 2.413982615e-05], (0.0, -5.963053201e-06)),
        ),
        (
            "zinc",
            &zinc,
            0.0,
            symmetric([4.019064219e-06, 2.000211412e-06, 2.000211412e-06], (-4.349785638e-07, 0.0)),
        ),
        (
            "zinc",
            &zinc,
            PI / 2.0,
            symmetric([4.572226672e-06, 3.090987495e-06, 2.798208157e-06], (0.0, -1.425871448e-06)),
        ),
    ] {
        let found = green.gamma(angle);
        let error = (found - published).amax() / published.amax();
        assert!(error < 1e-8, "{name} {angle}: {error:e}");
        assert!((green.gamma(angle + PI) - found.transpose()).amax() < 1e-13 * found.amax());
    }
}

/// Truth: case `barnett-lothe-identities`. The tensors S, H and L depend only on the plane that is spanned by the normal n and
/// the direction m. The direction m has the angle w in the surface. Hence L(w) = L(w + pi) and H(w) = H(w + pi). If the body is
/// rotated about m x n, the tensors rotate with the body. The tolerance is 1e-11 as published, but 1e-9 for H(w) = H(w + pi).
#[test]
fn barnett_lothe_tensors_belong_to_the_plane() {
    let materials = [cfrp_of_tables(), zinc(1.0), cubic(165.7, 63.9, 79.6), topaz()];
    for stiffness in materials {
        let turned = stiffness.rotated(Rotation3::from_euler_angles(0.4, -0.7, 1.1).matrix());
        let scale = turned.voigt().amax();
        for k in 0..36 {
            let w = 2.0 * PI * k as f64 / 36.0;
            let of = |w: f64, c: &Stiffness| BarnettLothe::new(c, Side::Lower, w).expect("converged tensors");
            let (here, opposite) = (of(w, &turned), of(w + PI, &turned));
            assert!((here.l - opposite.l).amax() < 1e-11 * scale, "{w}");
            assert!((here.h - opposite.h).amax() * scale < 1e-9, "{w}");
        }
        // m lies along x and n along z, so m x n is parallel to y.
        let angle = 0.6;
        let about = Rotation3::from_axis_angle(&Vector3::y_axis(), angle);
        let tensors = |c: &Stiffness| BarnettLothe::new(c, Side::Lower, 0.0).expect("converged tensors");
        let (still, moved) = (tensors(&turned), tensors(&turned.rotated(about.matrix())));
        let back = |t: Matrix3<f64>| about.matrix().transpose() * t * about.matrix();
        assert!((back(moved.l) - still.l).amax() < 1e-11 * scale);
        assert!((back(moved.h) - still.h).amax() < 1e-11 * still.h.amax());
        assert!((back(moved.s) - still.s).amax() < 1e-11);
    }
}
