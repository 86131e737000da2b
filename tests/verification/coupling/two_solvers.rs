//! Newton's method against the projected gradient with Barzilai-Borwein steps, which solves no Newton equations.

use super::block::{pairs, tied};
use super::half_spaces::difference;
use crate::common::{
    Silent, fretting, frp_friction, frp_wear, half_spaces, indent, press, shift, solve_with, sphere,
    sphere_on_frp, steel,
};
use orthowear::contact::{Method, SolverOptions};
use orthowear::coupling::{Coupling, surface_distance};
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Integrator, Step};
use orthowear::evolution::{Model, RunResult, run};
use orthowear::frame::{ContactFrame, GapShape, InitialGap};
use orthowear::laws::friction::FrictionLaw;

/// Asserts that Newton's method and Barzilai-Borwein steps converge, and that their tractions differ by less than 1e-6 of the
/// peak pressure.
fn same_as_bb(name: &str, model: &Model, steps: &[Step], tolerance: f64) {
    let by = |method| {
        let options = SolverOptions { tolerance, method, ..SolverOptions::default() };
        run(model, steps, &options, None, &mut Silent).expect("a run")
    };
    let (newton, bb) = (by(Method::Newton), by(Method::BarzilaiBorwein));
    let converged = |result: &RunResult| result.records.iter().all(|record| record.converged);
    assert!(converged(&newton) && converged(&bb), "{name}");
    assert!(newton.records.iter().all(|record| record.method == "newton"), "{name}");
    let peak = bb.records.last().expect("steps").peak_pressure;
    let pairs = newton.state.tractions.iter().zip(&bb.state.tractions);
    let error = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(error < 1e-6 * peak, "{name}: {error} of {peak}");
    for (a, b) in newton.records.iter().zip(&bb.records) {
        assert!(a.certificate.natural_residual <= tolerance, "{name}");
        assert!(
            difference(&[a.normal_force, a.worn_volume], &[b.normal_force, b.worn_volume]) < 1e-7,
            "{name}"
        );
    }
}

/// Truth: the state that the projected gradient with Barzilai-Borwein steps reaches. Newton's method reaches it for every pair of
/// bodies.
#[test]
fn every_pair_of_bodies_by_newton() {
    let frame = ContactFrame::grid([1.1, 0.9], [8, 7], [0.1, -0.2], 0.3).unwrap();
    for (name, mut pair) in pairs(&frame) {
        let gap = InitialGap::from(GapShape::Sphere { radius: 50.0 });
        let distance = surface_distance(&gap, &frame, pair[0].as_ref(), pair[1].as_ref()).expect("a gap");
        let coupled = tied(&mut pair, &frame, Coupling::Schur);
        let model = Model {
            frame: frame.clone(),
            initial_gap: coupled.initial_gap(&distance),
            flexibility: coupled.flexibility,
            loads: Vec::new(),
            floating: Vec::new(),
            friction: frp_friction(30.0),
            wear: frp_wear(30.0),
            wear_share: 1.0,
        };
        let steps = [indent(0.012), shift(0.004, 25.0), fretting(5000, 0.02, 2, Integrator::Sdirk2)];
        same_as_bb(name, &model, &steps, 1e-9);
    }
}

/// Truth: the states that the projected gradient with Barzilai-Borwein steps reaches, under prescribed normal forces.
#[test]
fn forces_by_newton() {
    let model = sphere_on_frp(30.0, 1.2, 20);
    same_as_bb("tilted", &model, &[press(150.0), shift(0.004, 20.0), press(400.0), press(90.0)], 1e-9);
    let bare = half_spaces(&steel(), None, (0.5, 20), sphere(10.0));
    same_as_bb("frictionless", &bare, &[press(700.0), press(20.0), indent(0.01)], 1e-9);
}

/// Truth: catalogue case `str-friction-large` (docs/verification.md). Each run has a certified result or reports that it did not
/// converge. Up to mu = 0.5 the solution is unique, and Newton's method and Barzilai-Borwein steps reach it.
#[test]
fn any_coefficient_by_newton() {
    for mu in [1e-12, 0.1, 0.5, 1.0, 1.5, 2.0] {
        let mut model = sphere_on_frp(30.0, 1.2, 16);
        model.friction = FrictionLaw::Coulomb { mu };
        let steps = [indent(0.02), shift(0.008, 45.0)];
        let options =
            SolverOptions { method: Method::Newton, max_iterations: 3000, ..SolverOptions::default() };
        let result = solve_with(&model, &steps, &options);
        for record in &result.records {
            assert!(!record.converged || record.certificate.natural_residual <= 1e-8, "mu {mu}");
            let energy = record.certificate.tangential_gap_energy.max(record.certificate.normal_gap_energy);
            assert!(!record.converged || energy < 1e-6, "mu {mu}");
        }
        match result.outcome {
            Outcome::NotConverged(reason) => assert!(mu > 0.5, "mu {mu}: {reason:?}"),
            outcome => assert_eq!(outcome, Outcome::Converged),
        }
        if mu <= 0.5 {
            same_as_bb("tilted", &model, &steps, 1e-9);
        }
    }
}
