//! Friction coefficients from 0 to 2 (case `str-friction-large` of docs/verification.md). Each run converges to a state that
//! passes the audit, or reports why it does not converge.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Normal, Step};
use orthowear::evolution::{Model, RunResult};
use orthowear::frame::ContactFrame;
use orthowear::laws::friction::{FrictionEllipse, FrictionLaw};
use orthowear::material::Stiffness;

use crate::common::{
    half_spaces, im7, indent, press, relative, shift, solve, sphere, sphere_on_frp, steel, step,
};
use crate::coupling::finite_block::{block, under_a_sphere};
use crate::observed::{audit, follow, pull};

const COEFFICIENTS: [f64; 7] = [0.0, 1e-12, 0.1, 0.5, 1.0, 1.5, 2.0];

/// Solves the steps and audits every converged state. A run need not converge.
fn audited(model: &Model, mu: f64, steps: &[Step]) -> RunResult {
    let unit = model.flexibility.diagonal_blocks()[0][(2, 2)];
    let ellipse = (mu > 0.0).then_some(FrictionEllipse { mu: [mu; 2], angle: 0.0 });
    let options = SolverOptions { max_iterations: 3000, ..SolverOptions::default() };
    let (result, fields) = follow(model, steps, &options);
    for (record, state) in result.records.iter().zip(&fields) {
        if record.converged {
            assert!(record.certificate.natural_residual <= 1e-8, "mu {mu}");
            let found = audit(state, ellipse, unit);
            assert!(found.passes(1e-6), "mu {mu}, {}: {found:?}", record.name);
        }
    }
    match result.outcome {
        Outcome::Converged => assert!(result.records.iter().all(|r| r.converged)),
        Outcome::NotConverged(_) => {}
        Outcome::Interrupted => panic!("nobody interrupts"),
    }
    result
}

/// Truth: in every converged state, contact and friction laws hold in each cell, to 1e-6. mu = 0 gives the normal force without
/// friction to 1e-10, mu = 1e-12 to 1e-7. The first model is Spence's indentation by a rigid sphere. The second model has tilted
/// fibres, on which a tangential displacement causes the strongest coupling of normal and tangential displacements. Up to mu = 1
/// both models converge.
#[test]
fn any_coefficient_is_certified_or_refused() {
    let steel = steel();
    let bare = half_spaces(&steel, None, (0.4, 24), sphere(10.0));
    let pressed = Step { normal: Some(Normal::Approach(0.01)), increments: 5, ..step("press") };
    let frictionless = solve(&bare, std::slice::from_ref(&pressed));
    let wanted = frictionless.records[4].normal_force;
    for mu in COEFFICIENTS {
        let mut spence = half_spaces(&steel, None, (0.4, 24), sphere(10.0));
        spence.friction = FrictionLaw::Coulomb { mu };
        let result = audited(&spence, mu, std::slice::from_ref(&pressed));
        assert!(mu > 1.0 || result.outcome == Outcome::Converged, "mu {mu}: {:?}", result.outcome);
        if mu <= 1e-12 {
            let found = result.records[4].normal_force;
            // The solver for mu = 1e-12 is not the solver for mu = 0, and has a residual of 1e-8.
            let tolerance = if mu == 0.0 { 1e-10 } else { 1e-7 };
            assert!(relative(found, wanted) < tolerance, "mu {mu}: {found} {wanted}");
        }
        let n = spence.frame.n_cells();
        if mu == 0.0 {
            assert!(result.state.tractions[..2 * n].iter().all(|q| *q == 0.0));
        }
        let mut tilted = sphere_on_frp(30.0, 1.2, 16);
        tilted.friction = FrictionLaw::Coulomb { mu };
        let result = audited(&tilted, mu, &[indent(0.02), shift(0.008, 45.0)]);
        let told = result.warnings.iter().any(|note| note.contains("several solutions"));
        assert_eq!(told, mu >= 1.0);
        assert!(mu > 1.0 || result.outcome == Outcome::Converged, "mu {mu}: {:?}", result.outcome);
    }
}

/// Truth: Cattaneo's and Mindlin's spheres, nu = 0. Without coupling of normal and tangential displacements, there is a solution
/// for every mu. The displacement for Q = 0.3 mu P agrees to 5e-3 at 40 cells per diameter.
#[test]
fn uncoupled_bodies_have_an_answer_for_every_coefficient() {
    let material = Stiffness::isotropic(210e3, 0.0).expect("admissible");
    let a = (3.0_f64 * 1000.0 * 10.0 / (4.0 * 105e3)).cbrt();
    for mu in COEFFICIENTS.into_iter().filter(|mu| *mu > 0.0) {
        let mut model = half_spaces(&material, Some(&material), (1.2 * a, 48), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu };
        let result = audited(&model, mu, &[press(1000.0), pull([0.3 * mu * 1000.0, 0.0])]);
        assert_eq!(result.outcome, Outcome::Converged, "mu {mu}");
        let compliance = 2.0 * 2.0 / 105e3;
        let wanted = 3.0 * mu * 1000.0 / (16.0 * a) * compliance * (1.0 - 0.7_f64.powf(2.0 / 3.0));
        assert!(
            relative(result.records[1].shift[0], wanted) < 5e-3,
            "mu {mu}: {}",
            result.records[1].shift[0]
        );
    }
}

/// Truth: a finite-element block of CFRP with tilted fibres. In every converged state, contact and friction laws hold in each
/// cell, to 1e-6. mu = 0 gives the normal force without friction to 1e-10, mu = 1e-12 to 1e-7. Up to mu = 0.5 all runs converge.
#[test]
fn any_coefficient_on_finite_elements() {
    let frame = ContactFrame::grid([1.2; 2], [12; 2], [0.0; 2], 0.0).expect("a grid");
    let mut model = under_a_sphere(&mut block(&im7(30.0), (6.0, 4, 6), &frame), &frame);
    let pressed = Step { normal: Some(Normal::Approach(0.02)), increments: 2, ..step("press") };
    let steps = [pressed, shift(0.008, 45.0)];
    let frictionless = solve(&model, &steps[..1]).records[1].normal_force;
    let n = model.frame.n_cells();
    for mu in COEFFICIENTS {
        model.friction = FrictionLaw::Coulomb { mu };
        let result = audited(&model, mu, &steps);
        assert!(mu > 0.5 || result.outcome == Outcome::Converged, "mu {mu}: {:?}", result.outcome);
        if mu <= 1e-12 {
            let found = result.records[1].normal_force;
            let tolerance = if mu == 0.0 { 1e-10 } else { 1e-7 };
            assert!(relative(found, frictionless) < tolerance, "mu {mu}: {found} {frictionless}");
        }
        assert!(mu > 0.0 || result.state.tractions[..2 * n].iter().all(|q| *q == 0.0));
    }
}
