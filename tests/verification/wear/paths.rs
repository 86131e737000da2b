//! Closed paths: under forces, round ellipses.

use orthowear::friction::FrictionLaw;
use orthowear::history::step::{Drive, Integrator, Jumps, Outcome, Step};
use orthowear::material::Stiffness;
use orthowear::wear::WearLaw;

use crate::common::{fretting, half_spaces, path_of, press, relative, solve, sphere};

/// Truth: round a circle that is large against all elastic displacements each cell slips by the sides of the polygon: V = i P 2K 2A sin(π/2K),
/// wherever the circle begins; the volume by the friction energy is the same.
#[test]
fn circles_in_gross_slip() {
    let (force, amplitude, intensity) = (100.0, 2.0, 1e-10);
    for angle in [0.0, 0.6] {
        let mut model = half_spaces(&crate::common::steel(), None, (0.4, 16), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.2 };
        model.wear = WearLaw::Archard { i: intensity };
        let mut cycles = fretting(100, amplitude, 1, Integrator::Sdirk2);
        let path = path_of(&mut cycles);
        (path.amplitude[1], path.angle, path.increments) = (amplitude, angle, 4);
        let run = solve(&model, &[press(force), cycles]);
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        let record = &run.records[1];
        let polygon = 8.0 * 2.0 * amplitude * (std::f64::consts::PI / 8.0).sin();
        let wanted = 100.0 * intensity * force * polygon;
        assert!(relative(record.worn_volume, wanted) < 2e-3, "{} {wanted}", record.worn_volume);
        let by_energy = record.worn_volume_by_energy.expect("wear follows friction");
        assert!(relative(by_energy, record.worn_volume) < 1e-8);
    }
}

/// Truth: an ellipse with half-axes a, b from angle 0 is one with b, a from a quarter turn, on an isotropic body.
#[test]
fn ellipses_may_begin_anywhere() {
    let volume = |amplitude: [f64; 2], angle: f64| {
        let mut model = half_spaces(&crate::common::steel(), None, (0.4, 16), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        model.wear = WearLaw::Archard { i: 1e-8 };
        let mut cycles = fretting(50, 0.01, 1, Integrator::Sdirk2);
        let path = path_of(&mut cycles);
        (path.amplitude, path.angle, path.increments) = (amplitude, angle, 4);
        let run = solve(&model, &[press(100.0), cycles]);
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        run.records[1].worn_volume
    };
    let [one, other] = [volume([0.01, 0.004], 0.0), volume([0.004, 0.01], std::f64::consts::FRAC_PI_2)];
    assert!(relative(one, other) < 1e-3, "{one} {other}");
}

/// Truth: `fretting-limit-profile`: under a constant amplitude of the tangential force the stick zone stays as it is, and the rest wears to zero
/// pressure: approach, volume and pressure in the middle of the limit.
#[test]
fn limit_of_fretting_under_force() {
    let (radius, a0, e_star, cells) = (100.0, 1.0, 1e5, 40);
    let force = 4.0 * e_star / (3.0 * radius);
    let (p0, delta0) = (1.5 * force / std::f64::consts::PI, a0 * a0 / radius);
    // Equal bodies, of which tractions in the surface do not change the pressures.
    let material = Stiffness::isotropic(2.0 * e_star, 0.0).expect("an admissible material");
    let mut model = half_spaces(&material, Some(&material), (1.7, cells), sphere(radius));
    model.friction = FrictionLaw::Coulomb { mu: 0.5 };
    model.wear = WearLaw::Archard { i: 1e-8 };
    // c / a0 = (1 - Q / (mu P))^(1/3) = 1/2.
    let mut cycles = fretting(2_000_000, 0.875 * 0.5 * force, 1, Integrator::Sdirk2);
    path_of(&mut cycles).drive = Drive::Force;
    cycles.cycles.as_mut().expect("cycles").jumps = Jumps::Tolerance(1e-2);
    let run = solve(&model, &[press(force), Step { name: "fretting".into(), ..cycles }]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let record = run.records.last().expect("records");
    let middle = cells / 2 * cells + cells / 2;
    let pressure = run.state.tractions[2 * cells * cells + middle] / p0;
    let stick = (record.stick_area / std::f64::consts::PI).sqrt();
    let volume = record.worn_volume * radius / a0.powi(4);
    let found = [record.approach / delta0, volume, pressure];
    for (found, wanted) in found.iter().zip([1.416_666_667, 2.109_356_644, 1.666_666_667]) {
        assert!(relative(*found, wanted) < 3e-2, "{found} {wanted}");
    }
    assert!((stick - 0.5).abs() < 3.4 / cells as f64, "{stick}");
}
