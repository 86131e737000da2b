//! Controls at the border of what makes sense: nothing prescribed, one cell, two spots.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Spin, Step, Tilt};
use orthowear::laws::friction::FrictionLaw;

use crate::common::{half_spaces, indent, press, relative, solve, solve_with, sphere, steel, step};

/// Two equal spheres of radius 5 at x = -1 and x = 1 under one punch, the second lower by `height`.
fn spots(height: f64) -> impl Fn(f64, f64) -> f64 {
    move |x: f64, y: f64| {
        let round = |at: f64| ((x - at).powi(2) + y * y) / 10.0;
        round(-1.0).min(round(1.0) + height)
    }
}

/// Forces left and right of the middle.
fn halves(state: &[f64], centers: &[nalgebra::Vector3<f64>], area: f64) -> [f64; 2] {
    let n = centers.len();
    let mut sums = [0.0; 2];
    for (center, p) in centers.iter().zip(&state[2 * n..]) {
        sums[usize::from(center.x > 0.0)] += p * area;
    }
    sums
}

/// Truth: case `str-two-spots`: equal heights share the load to 1e-10 (mirror images); 1e-6 of height changes the shares by
/// no more than Hertz's slope times it, in proportion to it. A punch that may tilt stands on both: by statics with the same
/// load but for the levers, which change as the spheres roll by R h / 2 when it leans by h / 2 (a share of 2.5 h, to 20 %
/// with so few cells; without tilting it is fifty times that); 1e-7 where heights are equal.
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

/// Truth: case `str-single-node-contact`: where one cell touches, it carries the load exactly (1e-10); without levers nothing
/// resists rotations about axes through it, and a moment of zero is balanced by the cell under the centre.
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

/// Truth: case `str-zero-load`: rotations and moments of zero, or of the smallest numbers, change nothing (1e-7 of the
/// force and of the slope of the surface, with residuals of 1e-8).
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
            // Without contact there is nothing to balance.
            let open = solve(&model, &[Step { tilt: turned.tilt, ..indent(-0.01) }]);
            assert_eq!(open.records[0].normal_force, 0.0);
        }
    }
}
