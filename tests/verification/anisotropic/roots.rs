//! The surface admittance W of materials and directions close to degenerate Stroh roots.
//!
//! Case names refer to the catalogue in docs/verification.md.

use orthowear::bem::half_space::{Side, SurfaceGreen};
use orthowear::material::Stiffness;
use std::f64::consts::FRAC_PI_2;

use super::green::about_y;
use crate::common::steel;
use crate::crystals::{nearly_isotropic, zinc};

/// Truth: case `str-near-degenerate-roots`. The axis of a transversely isotropic solid lies along x. Waves along y then have a
/// triple Stroh root, but W depends smoothly on the angle. The test compares W at the angles +d and -d from y. Half the
/// difference of the two values is at most 2 d. Their mean differs by at most 10 d² from W at d = 0. Both bounds are relative to
/// the largest entry of W, plus 1e-9.
#[test]
fn directions_next_to_a_degenerate_plane() {
    let green = SurfaceGreen::new(&about_y(&zinc(1.0), 90.0), Side::Lower).expect("a Green's function");
    let at = green.symbol(FRAC_PI_2);
    let scale = at.map(|w| w.norm()).amax();
    for d in [1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-3] {
        let (left, right) = (green.symbol(FRAC_PI_2 - d), green.symbol(FRAC_PI_2 + d));
        let mean = (left + right).map(|w| 0.5 * w) - at;
        let half_difference = (right - left).map(|w| (0.5 * w).norm()).amax();
        assert!(mean.map(|w| w.norm()).amax() < (10.0 * d * d + 1e-9) * scale, "{d}");
        assert!(half_difference < (2.0 * d + 1e-9) * scale, "{d}: {half_difference}");
    }
}

/// Truth: cases `aniso-near-isotropic-limit` and `str-near-degenerate-roots`. All entries of W tend linearly to the isotropic W
/// as the anisotropy e tends to zero. The bound, relative to the largest entry, is 2 e + 1e-9.
#[test]
fn all_components_tend_to_the_isotropic_ones() {
    let symbol = |stiffness: &Stiffness| {
        SurfaceGreen::new(stiffness, Side::Lower).expect("a Green's function").symbol(0.3)
    };
    let isotropic = symbol(&steel());
    let scale = isotropic.map(|w| w.norm()).amax();
    for k in 1..=16 {
        let e = 10f64.powi(-k);
        let found = symbol(&nearly_isotropic(e));
        let apart = (found - isotropic).map(|w| w.norm()).amax();
        assert!(apart < (2.0 * e + 1e-9) * scale, "{e}: {apart:e}");
    }
}
