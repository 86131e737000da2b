//! Rotations of body 2 and moments on body 2.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::{Divergence, IncrementRecord, Outcome};
use orthowear::evolution::step::{Integrator, Spin, Step, Tangential, Tilt};
use orthowear::evolution::{RunResult, run};
use orthowear::laws::friction::FrictionLaw;

use crate::common::{
    Silent, fretting, half_spaces, im7, indent, press, relative, shift, solve, sphere, steel, step,
};

const RADIUS: f64 = 10.0;

fn rotate(angles: [f64; 2]) -> Step {
    Step { tilt: Some(Tilt::Rotation(angles)), ..step("rotate") }
}

fn tip(moments: [f64; 2]) -> Step {
    Step { tilt: Some(Tilt::Moment(moments)), ..step("tip") }
}

fn twist(angle: f64) -> Step {
    Step { spin: Some(Spin::Twist(angle)), ..step("twist") }
}

fn spin(moment: f64) -> Step {
    Step { spin: Some(Spin::Moment(moment)), ..step("spin") }
}

fn last(result: &RunResult) -> &IncrementRecord {
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    result.records.last().expect("records")
}

fn near(found: [f64; 2], wanted: [f64; 2], within: f64) {
    assert!((0..2).all(|k| (found[k] - wanted[k]).abs() <= within), "{found:?} {wanted:?}");
}

/// Truth: small rotations (a, b) about x and y through the centre of the frame move a paraboloid of radius R. Its lowest point
/// moves to R (b, -a), and is R (a^2 + b^2) / 2 deeper. A paraboloid with this lowest point gives the same forces and peak
/// pressure, to 1e-6 at residuals of 1e-8.
#[test]
fn a_rotated_sphere_is_a_shifted_one() {
    let (a, b) = (0.003, -0.008);
    let centre = [RADIUS * b, -RADIUS * a];
    let moved = move |x: f64, y: f64| sphere(RADIUS)(x - centre[0], y - centre[1]);
    let deeper = 0.5 * RADIUS * (a * a + b * b);
    for friction in [FrictionLaw::None, FrictionLaw::Coulomb { mu: 0.3 }] {
        let mut rotated = half_spaces(&im7(30.0), Some(&steel()), (0.5, 32), sphere(RADIUS));
        let mut shifted = half_spaces(&im7(30.0), Some(&steel()), (0.5, 32), moved);
        (rotated.friction, shifted.friction) = (friction, friction);
        for (turned, straight) in [(indent(0.01 - deeper), indent(0.01)), (press(200.0), press(200.0))] {
            let turned = Step { tilt: Some(Tilt::Rotation([a, b])), ..turned };
            let (found, wanted) = (solve(&rotated, &[turned]), solve(&shifted, &[straight]));
            let (found, wanted) = (last(&found), last(&wanted));
            assert!(relative(found.normal_force, wanted.normal_force) < 1e-6, "{found:?} {wanted:?}");
            assert!(relative(found.peak_pressure, wanted.peak_pressure) < 1e-6);
            assert!((found.approach + deeper - wanted.approach).abs() < 1e-7, "{found:?} {wanted:?}");
            let scale = wanted.normal_force;
            near(found.tangential_force, wanted.tangential_force, 1e-6 * scale);
            (0..3).for_each(|k| assert!((found.moment[k] - wanted.moment[k]).abs() < 1e-6 * scale));
            near(found.rotation, [a.to_degrees(), b.to_degrees()], 1e-14);
        }
    }
}

/// Truth: a frictionless sphere under the force P and the moments M rolls until its contact is below the resultant force. The
/// lowest point of the sphere is then at (M_y, -M_x) / P, and its rotation is (M_x, M_y) / (P R). The discretisation error is
/// 1e-3 with 12 cells along the contact radius. The state is the same after removing and restoring the moment in increments, and
/// under the prescribed rotation.
#[test]
fn a_sphere_rolls_under_a_moment() {
    let (force, moment) = (400.0, [12.0, 30.0]);
    let model = half_spaces(&steel(), None, (0.48, 48), sphere(RADIUS));
    let wanted = moment.map(|m| (m / (force * RADIUS)).to_degrees());
    let result = solve(&model, &[press(force), tip(moment)]);
    let found = last(&result);
    near(found.rotation, wanted, 1e-3 * wanted[1]);
    near([found.moment[0], found.moment[1]], moment, 1e-7 * moment[1]);
    assert!(relative(found.normal_force, force) < 1e-8);

    let back = Step { increments: 3, ..tip([0.0, 0.0]) };
    let again = Step { increments: 2, ..tip(moment) };
    let held = solve(
        &model,
        &[
            press(force),
            tip(moment),
            back,
            again,
            rotate([0.0; 2]),
            rotate(found.rotation.map(f64::to_radians)),
        ],
    );
    let found_again = last(&held);
    let halves: Vec<f64> = held.records[2..5].iter().map(|record| record.moment[1]).collect();
    assert!(relative(halves[0], 20.0) < 1e-6 && relative(halves[1], 10.0) < 1e-6, "{halves:?}");
    near(held.records[4].rotation, [0.0; 2], 1e-6 * wanted[1]);
    near(held.records[6].rotation, found.rotation, 1e-6 * wanted[1]);
    near([found_again.moment[0], found_again.moment[1]], moment, 1e-5 * moment[1]);
}

/// Truth: case `lubkin-torsion` of docs/verification.md. A rigid sphere under a constant force P has the contact radius a and the
/// peak pressure p0. The torque is 0.897338429 of the torque of full slip, (3 pi / 16) mu P a. The sphere then sticks inside c =
/// a / 2 and rotates by 0.47272981 mu p0 / G. The tolerance of c is one cell, of the angle 1e-2. Torsion does not change the
/// pressure, to 1e-6 at residuals of 1e-8. Ten increments give the same twist as one increment, to 2e-3, because the torque only
/// grows.
#[test]
fn lubkin() {
    let (force, mu, g) = (1000.0, 0.3, 210e3 / 2.6);
    let (a, p0) = (0.319_125_2, 4688.341);
    let cells = 50;
    let mut model = half_spaces(&steel(), None, (1.25 * a, cells), sphere(RADIUS));
    model.friction = FrictionLaw::Coulomb { mu };
    let torque = 0.897_338_429 * 3.0 * std::f64::consts::PI / 16.0 * mu * force * a;
    let angle = 0.472_729_81 * mu * p0 / g;
    let pressed = Step { friction: false, ..press(force) };
    let result = solve(&model, &[pressed.clone(), spin(torque)]);
    let found = last(&result);
    assert!(relative(found.twist.to_radians(), angle) < 1e-2, "{} {angle}", found.twist.to_radians());
    assert!(relative(found.moment[2], torque) < 1e-7);
    let cell = 2.5 * a / cells as f64;
    let c = (found.stick_area / std::f64::consts::PI).sqrt();
    assert!((c - 0.5 * a).abs() < cell, "{c} {}", 0.5 * a);
    assert!(relative(found.peak_pressure, result.records[0].peak_pressure) < 1e-6);

    let many = solve(&model, &[pressed.clone(), Step { increments: 10, ..spin(torque) }]);
    assert!(relative(last(&many).twist, found.twist) < 2e-3, "{} {}", last(&many).twist, found.twist);
    let by_twist = solve(&model, &[pressed, twist(found.twist.to_radians())]);
    assert!(relative(last(&by_twist).moment[2], torque) < 1e-6);
}

/// Truth: Masing's rule. Reversal of the torque T to -T reverses the twist, and another reversal closes the loop. The tolerance
/// is 1e-6, because the edge of the contact is compliant and magnifies the residual of the solver.
#[test]
fn a_torsional_loop_closes() {
    let mut model = half_spaces(&steel(), None, (0.4, 32), sphere(RADIUS));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let torque = 0.7 * 3.0 * std::f64::consts::PI / 16.0 * 0.3 * 1000.0 * 0.319;
    let pressed = Step { friction: false, ..press(1000.0) };
    let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
    let steps = [pressed, spin(torque), spin(-torque), spin(torque)];
    let result = run(&model, &steps, &options, None, &mut Silent).expect("a run");
    let angles: Vec<f64> = result.records.iter().map(|record| record.twist).collect();
    assert!(last(&result).dissipation > 0.0);
    assert!(relative(-angles[2], angles[1]) < 1e-6 && relative(angles[3], angles[1]) < 1e-6, "{angles:?}");
}

/// Truth: equilibrium. A sphere with the load P and the contact radius a spins under a moment beyond (3 pi / 16) mu P a. A punch
/// tips over if the resultant force lies outside its outline. In both cases the run does not converge and reports the reason.
#[test]
fn too_large_a_moment_is_reported() {
    let mut model = half_spaces(&steel(), None, (0.4, 24), sphere(RADIUS));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let full = 3.0 * std::f64::consts::PI / 16.0 * 0.3 * 1000.0 * 0.319_125_2;
    let spun = solve(&model, &[press(1000.0), spin(1.02 * full)]);
    assert_eq!(spun.outcome, Outcome::NotConverged(Divergence::GrossSliding));
    assert_eq!(spun.records.len(), 2);
    assert!(spun.warnings.iter().any(|note| note.contains("spins about n")), "{:?}", spun.warnings);
    assert!(relative(spun.records[1].moment[2], full) < 5e-3, "{}", spun.records[1].moment[2]);

    let flat = half_spaces(&steel(), None, (1.0, 16), |_, _| 0.0);
    let held = solve(&flat, &[Step { tilt: Some(Tilt::Moment([0.0, 80.0])), ..press(100.0) }]);
    assert_eq!(held.outcome, Outcome::Converged);
    let off = solve(&flat, &[Step { tilt: Some(Tilt::Moment([0.0, 120.0])), ..press(100.0) }]);
    assert_eq!(off.outcome, Outcome::NotConverged(Divergence::ContactLost));
    assert_eq!(off.records.len(), 1);
    assert!(off.warnings.iter().any(|note| note.contains("tips about y")), "{:?}", off.warnings);
}

/// Truth: statics. Pressures on one side of the centre of the frame balance a zero moment only if all are zero. Body 2 therefore
/// rotates until it loses contact. The angle is about the approach divided by the lever arm, 0.7 mm. Small rotations give a
/// warning, rotations above 0.1 rad end the run.
#[test]
fn a_zero_moment_beside_the_contact_opens_it() {
    for (approach, small) in [(0.02, true), (0.2, false)] {
        let model = half_spaces(&steel(), None, (1.0, 16), |x, y| sphere(1.0)(x - 0.7, y));
        let result = solve(&model, &[Step { tilt: Some(Tilt::Moment([0.0; 2])), ..indent(approach) }]);
        let large = Outcome::NotConverged(Divergence::LargeRotation);
        assert_eq!(result.outcome, if small { Outcome::Converged } else { large });
        let record = &result.records[0];
        assert!(record.converged == small && record.contact_area == 0.0);
        assert!((record.rotation[1].to_radians() < -0.1) != small, "{record:?}");
        let told = if small { "moment rotates body 2 by" } else { "body 2 is rotated by" };
        assert!(result.warnings.iter().any(|note| note.contains(told)), "{:?}", result.warnings);
    }
}

/// Truth: contact on a flat gap is homogeneous of degree one, so the rotation is proportional to the loads. The run converges for
/// rotations below 0.1 rad. Larger rotations end the run, although the punch stays in contact.
#[test]
fn rotations_in_contact_are_limited() {
    let flat = half_spaces(&steel(), None, (1.0, 8), |_, _| 0.0);
    let under = |scale: f64| {
        solve(&flat, &[Step { tilt: Some(Tilt::Moment([0.0, 20.0 * scale])), ..press(100.0 * scale) }])
    };
    let unit = last(&under(1.0)).rotation[1].to_radians();
    let below = under(0.099 / unit);
    assert!(relative(last(&below).rotation[1].to_radians(), 0.099) < 1e-6);
    let above = under(0.101 / unit);
    assert_eq!(above.outcome, Outcome::NotConverged(Divergence::LargeRotation));
    assert!(above.records[0].contact_area > 0.0 && !above.records[0].converged);
}

/// Truth: controls that a step does not name keep their values. This holds for rotations and moments, also during cycles.
#[test]
fn what_a_step_does_not_name_stays() {
    let mut model = half_spaces(&steel(), None, (0.5, 32), sphere(RADIUS));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let steps = [
        Step { tilt: Some(Tilt::Moment([5.0, 0.0])), ..press(400.0) },
        shift(0.001, 0.0),
        twist(1e-4),
        shift(0.0, 0.0),
        fretting(10, 0.002, 1, Integrator::Sdirk2),
    ];
    let result = solve(&model, &steps);
    assert_eq!(last(&result).cycles_done, 10);
    for record in &result.records {
        assert!(relative(record.normal_force, 400.0) < 1e-6);
        assert!(relative(record.moment[0], 5.0) < 1e-5, "{} {:?}", record.name, record.moment);
    }
    let twists: Vec<f64> = result.records.iter().map(|record| record.twist.to_radians()).collect();
    assert!(twists[2..].iter().all(|angle| (angle - 1e-4).abs() < 1e-15), "{twists:?}");
    assert!(result.records[1].rotation[0] > 0.0);
    assert!(
        matches!(result.records[4].stroke_ends, Some([plus, _]) if (plus.twist.to_radians() - 1e-4).abs() < 1e-15)
    );
}

/// Truth: without friction, no traction can balance a spin moment. Only a spin moment of zero is allowed.
#[test]
fn a_spin_moment_needs_friction() {
    let model = half_spaces(&steel(), None, (0.5, 8), sphere(RADIUS));
    let free = solve(&model, &[press(10.0), spin(0.0)]);
    assert_eq!(last(&free).twist, 0.0);
    let error = run(&model, &[press(10.0), spin(1.0)], &SolverOptions::default(), None, &mut Silent)
        .expect_err("nothing carries the moment");
    assert!(error.to_string().contains("spin moment"), "{error}");
}

/// Truth: results equal the prescribed forces and moments, here with inclined fibres and a rotated friction ellipse.
#[test]
fn forces_and_moments_act_together() {
    let mut model = half_spaces(&im7(30.0), Some(&steel()), (0.6, 32), sphere(RADIUS));
    model.friction = FrictionLaw::Elliptic { mu: [0.3, 0.5], angle: 0.4 };
    let all = Step {
        tangential: Some(Tangential::Force([20.0, -12.0])),
        tilt: Some(Tilt::Moment([3.0, -2.0])),
        spin: Some(Spin::Moment(4.0)),
        increments: 2,
        ..press(200.0)
    };
    let result = solve(&model, &[all]);
    let found = last(&result);
    near(found.tangential_force, [20.0, -12.0], 1e-5);
    near([found.moment[0], found.moment[1]], [3.0, -2.0], 1e-5);
    assert!((found.moment[2] - 4.0).abs() < 1e-5 && relative(found.normal_force, 200.0) < 1e-7, "{found:?}");
    assert!(found.certificate.natural_residual <= 1e-8);
    assert!(found.certificate.tangential_gap_energy.abs() < 1e-8);
}

/// Truth: without a normal force, rotated bodies touch without pressure. The run gives no warning about this.
#[test]
fn turned_bodies_without_load_just_touch() {
    for friction in [FrictionLaw::None, FrictionLaw::Coulomb { mu: 0.3 }] {
        let mut model = half_spaces(&im7(30.0), Some(&steel()), (0.5, 24), sphere(RADIUS));
        model.friction = friction;
        let turned = [rotate([0.003, -0.002]), Step { normal: press(0.0).normal, ..rotate([0.001, 0.004]) }];
        for steps in
            [vec![press(0.0), turned[0].clone()], vec![press(50.0), turned[0].clone(), turned[1].clone()]]
        {
            let result = solve(&model, &steps);
            let found = last(&result);
            assert!(found.contact_area == 0.0 && found.normal_force == 0.0, "{found:?}");
            assert!(found.certificate.natural_residual == 0.0, "{found:?}");
            let doubts = |note: &&String| !note.starts_with("friction depends on the load path");
            assert_eq!(result.warnings.iter().find(doubts), None);
        }
    }
}
