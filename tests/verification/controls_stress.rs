//! Prescribed motions and forces in limiting cases: zero values, a single cell in contact, two contact spots.
//!
//! Case names refer to the catalogue in docs/verification.md.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Spin, Step, Tilt};
use orthowear::laws::friction::FrictionLaw;

use crate::common::{half_spaces, indent, press, relative, solve, solve_with, sphere, steel, step};

/// Gap of two equal spheres of radius 5 mm at x = -1 and x = 1. The gap of the sphere at x = 1 is larger by `height`.
fn spots(height: f64) -> impl Fn(f64, f64) -> f64 {
    move |x: f64, y: f64| {
        let round = |at: f64| ((x - at).powi(2) + y * y) / 10.0;
        round(-1.0).min(round(1.0) + height)
    }
}

fn halves(state: &[f64], centers: &[nalgebra::Vector3<f64>], area: f64) -> [f64; 2] {
    let n = centers.len();
    let mut sums = [0.0; 2];
    for (center, p) in centers.iter().zip(&state[2 * n..]) {
        sums[usize::from(center.x > 0.0)] += p * area;
    }
    sums
}

/// Truth: the relative difference of the loads on two spots (case `str-two-spots`). For equal heights it is below 1e-10, because
/// the spots are mirror images. Otherwise it is proportional to the difference h of the heights.
///
/// A punch that is free to tilt balances the moments of the two loads about its centre. The difference h tilts the punch by h /
/// 2, which moves both contacts by R h / 2 = 2.5 h (R = 5). The lever arms become 1 - 2.5 h and 1 + 2.5 h. The relative
/// difference of the loads is therefore 2.5 h. The tolerance is 20 % for these few cells, plus 1e-7. Without tilting, the
/// difference of the loads is more than forty times larger.
#[test]
fn two_spots_share_the_load() {
    let options = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
    let share = |height: f64, step: Step| {
        let model = half_spaces(&steel(), None, (1.5, 48), spots(height));
        let result = solve_with(&model, &[step], &options);
        assert_eq!(result.outcome, Outcome::Converged);
        let [left, right] = halves(&result.state.tractions, &model.frame.centers, model.frame.areas[0]);
        (left - right) / (left + right)
    };
    assert!(share(0.0, press(500.0)).abs() < 1e-10, "{}", share(0.0, press(500.0)));
    let [one, two] = [1e-6, 2e-6].map(|height| share(height, press(500.0)));
    assert!(one > 0.0 && relative(two, 2.0 * one) < 1e-2, "{one} {two}");
    let free = Step { tilt: Some(Tilt::Moment([0.0; 2])), ..press(500.0) };
    for height in [0.0, 1e-6, 1e-4] {
        let share = share(height, free.clone());
        assert!((share - 2.5 * height).abs() < 1e-7 + 0.5 * height, "{height}: {share:e}");
    }
    assert!(one > 1e-4, "{one:e}");
}

/// Truth: case `str-single-node-contact`. A single cell in contact carries the load to 1e-10. The cell lies at the centre and has
/// no lever arm. It can balance only a moment of zero.
#[test]
fn one_cell_carries_everything() {
    let model = half_spaces(&steel(), None, (1.0, 9), sphere(10.0));
    for force in [1.0, 1e-12] {
        for control in [None, Some(Tilt::Moment([0.0; 2])), Some(Tilt::Rotation([0.0; 2]))] {
            let result = solve(&model, &[Step { tilt: control, ..press(force) }]);
            assert_eq!(result.outcome, Outcome::Converged, "{force} {control:?}");
            let found = &result.records[0];
            assert!(relative(found.normal_force, force) < 1e-10, "{found:?}");
            assert!(relative(found.contact_area, model.frame.areas[0]) < 1e-12, "{found:?}");
            assert!((0..2).all(|k| found.moment[k].abs() < 1e-10 * force), "{:?}", found.moment);
        }
    }
}

/// Truth: case `str-zero-load`. Rotations and moments of zero, or of the smallest doubles, have no effect. The tolerance is 1e-7
/// of the force and 1e-6 rad for the rotations, at residuals of 1e-8.
#[test]
fn nothing_turned_is_nothing() {
    let mut model = half_spaces(&steel(), None, (0.5, 12), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let plain = solve(&model, &[indent(0.01)]).records[0].clone();
    for least in [0.0, f64::MIN_POSITIVE, 5e-324] {
        for (tilt, spin) in [
            (Tilt::Rotation([least; 2]), Spin::Twist(least)),
            (Tilt::Rotation([least; 2]), Spin::Moment(least)),
            (Tilt::Moment([least; 2]), Spin::Twist(least)),
            (Tilt::Moment([least; 2]), Spin::Moment(least)),
        ] {
            let turned = Step { tilt: Some(tilt), spin: Some(spin), ..step("turn") };
            let result = solve(&model, &[indent(0.01), turned.clone()]);
            assert_eq!(result.outcome, Outcome::Converged, "{tilt:?} {spin:?}");
            let found = &result.records[1];
            assert!(relative(found.normal_force, plain.normal_force) < 1e-7, "{tilt:?} {found:?}");
            assert!(found.rotation.iter().all(|angle| angle.abs() < 1e-6) && found.twist.abs() < 1e-6);
            // Without contact no moment acts.
            let open = solve(&model, &[Step { tilt: turned.tilt, ..indent(-0.01) }]);
            assert_eq!(open.records[0].normal_force, 0.0);
        }
    }
}
