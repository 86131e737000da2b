//! Contact of half-spaces against closed forms and an independent program.
//!
//! Case names refer to the catalogue in docs/verification.md.

use std::sync::Arc;

use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::records::{Divergence, Outcome};
use orthowear::evolution::step::{Normal, Step, Tangential};
use orthowear::flexibility::Flexibility;
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;
use orthowear::omitted::AllowedOmissions;

use crate::common::{
    Silent, half_spaces, indent, press, rectangle, reference, relative, shift, solve, solve_with, sphere,
    sphere_on_frp, step,
};

const TILTS: [&str; 4] = ["0", "30", "60", "90"];

fn value(case: &serde_json::Value, state: &str, quantity: &str) -> f64 {
    case[state][quantity]["value"].as_f64().expect("a number in the data file")
}

/// Truth: the exact Hertz ellipse of an anisotropic pair (independent program, exact to 1e-9). The tolerance 3e-4 is the error of
/// 64 x 64 constant cells.
#[test]
fn frictionless_indentation_matches_the_exact_ellipse() {
    let data = reference();
    for tilt in TILTS {
        let model = sphere_on_frp(tilt.parse().expect("a number"), 1.2, 64);
        let result = solve(&model, &[Step { friction: false, ..indent(0.02) }]);
        let exact = data["cases"][tilt]["exact"]["P"].as_f64().expect("a number");
        let found = &result.records[0];
        assert!(relative(found.normal_force, exact) < 3e-4, "tilt {tilt}: {} {exact}", found.normal_force);
        assert_eq!(found.tangential_force, [0.0, 0.0]);
        assert!(found.tangential_force[0].abs() < 1e-9 * exact);
    }
}

/// Truth: an independent program on 256 x 256 cells. The normal force and the larger tangential force agree to 5e-4. This
/// tolerance covers the discretisation errors of both solutions, on 256 x 256 and 64 x 64 cells. Forces that vanish by symmetry
/// are zero to 1e-9.
#[test]
fn friction_and_shift_match_the_independent_program() {
    let data = reference();
    for tilt in TILTS {
        let case = &data["cases"][tilt];
        let model = sphere_on_frp(tilt.parse().expect("a number"), 1.2, 64);
        for angle in [0.0, 45.0] {
            let result = solve(&model, &[indent(0.02), shift(0.008, angle)]);
            assert_eq!(result.outcome, Outcome::Converged);
            for (record, state) in
                result.records.iter().zip(["FR", if angle == 0.0 { "FR_T0" } else { "FR_T45" }])
            {
                let force = [record.tangential_force[0], record.tangential_force[1], record.normal_force];
                let wanted = ["Q1", "Q2", "P"].map(|q| value(case, state, q));
                let dominant = if wanted[0].abs() >= wanted[1].abs() { 0 } else { 1 };
                for (k, (found, wanted)) in force.into_iter().zip(wanted).enumerate() {
                    if wanted.abs() < 1e-9 {
                        assert!(found.abs() < 1e-9 * force[2], "tilt {tilt} {state} component {k}: {found}");
                    } else if k == 2 || k == dominant {
                        assert!(relative(found, wanted) < 5e-4, "tilt {tilt} {state} {k}: {found} {wanted}");
                    }
                }
                assert!(record.certificate.natural_residual <= 1e-8);
                assert!(record.certificate.tangential_gap_energy > -1e-12);
                assert!(record.certificate.tangential_gap_energy < 1e-8);
                assert!(record.certificate.energy_balance < 1e-12, "{}", record.certificate.energy_balance);
                assert!(record.dissipation >= 0.0);
            }
        }
    }
}

/// Truth: Hertz's solution under a prescribed force, with the approach delta and the peak pressure p0 of case `hertz-circular`.
/// With 40 cells across the contact, the catalogue's tolerances are 2e-3 for delta and 1e-2 for p0. The order of convergence of
/// delta is at least 1.
#[test]
fn hertz_circular() {
    let (delta, p0, a) = (0.010_184_09, 4688.341, 0.319_125_2);
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    let mut errors = Vec::new();
    for cells in [25, 50, 100] {
        let model = half_spaces(&steel, None, (1.25 * a, cells), sphere(10.0));
        let result = solve(&model, &[press(1000.0)]);
        let found = &result.records[0];
        assert_eq!(result.outcome, Outcome::Converged);
        assert!(relative(found.normal_force, 1000.0) < 1e-12);
        errors.push(relative(found.approach, delta));
        if cells == 50 {
            assert!(relative(found.approach, delta) < 2e-3, "delta {}", found.approach);
            assert!(relative(found.peak_pressure, p0) < 1e-2, "p0 {}", found.peak_pressure);
            let radius = (found.contact_area / std::f64::consts::PI).sqrt();
            assert!((radius - a).abs() < 2.5 * a / 50.0, "a {radius}");
            let again = solve(&model, &[indent(found.approach)]);
            assert!(relative(again.records[0].normal_force, 1000.0) < 1e-6);
        }
    }
    let order = (errors[0] / errors[2]).ln() / 4.0_f64.ln();
    assert!(order >= 1.0, "errors {errors:?}, order {order}");
}

/// Truth: the elliptic Hertz contacts `hertz-elliptic-2to1` and `hertz-elliptic-10to1`. The tolerances of the approach delta are
/// 3e-3 and 5e-3. The tolerance is 1e-2 for the peak pressure and one cell for the semi-axes.
#[test]
fn hertz_elliptic() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    for (r1, r2, a, b, delta, p0, tolerance, cells) in [
        (20.0, 10.0, 0.448_122_8, 0.282_584_3, 0.009_013_046, 3770.477, 3e-3, [50, 50]),
        (100.0, 10.0, 0.931_091_9, 0.206_934_7, 0.006_475_759, 2478.081, 5e-3, [96, 48]),
    ] {
        let gap = move |x: f64, y: f64| x * x / (2.0 * r1) + y * y / (2.0 * r2);
        let model = rectangle(&steel, None, ([1.2 * a, 1.2 * b], cells), gap);
        let result = solve(&model, &[press(1000.0)]);
        let found = &result.records[0];
        assert!(relative(found.approach, delta) < tolerance, "{} {delta}", found.approach);
        assert!(relative(found.peak_pressure, p0) < 1e-2, "{} {p0}", found.peak_pressure);
        // The computed semi-axes are the distances from the centre to the farthest edges of cells in contact.
        let spacing = model.frame.grid.expect("a grid").spacing;
        let n = model.frame.n_cells();
        let mut reach = [0.0_f64; 2];
        for (cell, center) in model.frame.centers.iter().enumerate() {
            if result.state.tractions[2 * n + cell] > 0.0 {
                reach =
                    [reach[0].max(center.x + 0.5 * spacing[0]), reach[1].max(center.y + 0.5 * spacing[1])];
            }
        }
        assert!(
            (reach[0] - a).abs() <= spacing[0] && (reach[1] - b).abs() <= spacing[1],
            "{reach:?} {a} {b}"
        );
    }
}

/// Truth: the solution of Cattaneo and Mindlin, which is exact for nu = 0. Equal spheres have R = 10 mm, P = 1000 N, mu = 0.3 and
/// E = 210 GPa. The tangential force Q is 0.3 or 0.9 mu P. With 40 cells per diameter, the tangential displacement agrees with
/// the closed form to 5e-3. Q changes the peak pressure p0 and the approach by less than 1e-8. The error of the traction at the
/// centre is below 1e-2 of mu p0.
#[test]
fn cattaneo_mindlin() {
    let (e, radius, load, mu) = (210e3_f64, 10.0, 1000.0, 0.3);
    let material = Stiffness::isotropic(e, 0.0).expect("an admissible material");
    let reduced = e / 2.0;
    let a = (3.0 * load * radius / (4.0 * reduced)).cbrt();
    let shear = e / 2.0;
    for share in [0.3, 0.9] {
        let mut model = half_spaces(&material, Some(&material), (1.25 * a, 50), sphere(radius));
        model.friction = FrictionLaw::Coulomb { mu };
        let pull = Step { tangential: Some(Tangential::Force([share * mu * load, 0.0])), ..step("pull") };
        let options = SolverOptions { tolerance: 1e-10, ..SolverOptions::default() };
        let result = solve_with(&model, &[press(load), pull], &options);
        assert_eq!(result.outcome, Outcome::Converged);
        let (before, after) = (&result.records[0], &result.records[1]);
        let wanted =
            3.0 * mu * load / (16.0 * a) * (2.0 * 2.0 / shear) * (1.0 - (1.0_f64 - share).powf(2.0 / 3.0));
        assert!(relative(after.shift[0], wanted) < 5e-3, "Q {share}: {} {wanted}", after.shift[0]);
        assert!(after.shift[1].abs() < 1e-9);
        assert!(relative(after.tangential_force[0], share * mu * load) < 1e-10);
        assert!(relative(after.peak_pressure, before.peak_pressure) < 1e-8);
        assert!(relative(after.approach, before.approach) < 1e-8);
        let stick = (after.stick_area / std::f64::consts::PI).sqrt();
        let c = a * (1.0_f64 - share).cbrt();
        // At the centre q = mu p0 (1 - c / a), with the radius c of the stick zone and the radius a of the contact. Near the
        // centre q is smooth.
        let (n, middle) = (model.frame.n_cells(), 25 * 50 + 25);
        let peak = 3.0 * load / (2.0 * std::f64::consts::PI * a * a);
        let q = -result.state.tractions[middle];
        assert!(n == 2500 && (q - mu * peak * (1.0 - c / a)).abs() < 1e-2 * mu * peak, "{q}");
        assert!((stick - c).abs() < 2.5 * a / 50.0, "c {stick} {c}");
    }
}

/// Truth: Cattaneo-Mindlin for nu = 0.3 (case `cattaneo-mindlin`). The classical solution neglects transverse slip, hence the
/// tolerance of 2 %.
#[test]
fn cattaneo_mindlin_with_lateral_contraction() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    for (share, shift) in [(0.3, 0.001_246_296), (0.9, 0.004_620_354)] {
        let mut model = half_spaces(&steel, Some(&steel), (1.25 * 0.402_072_6, 50), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let pull = Step { tangential: Some(Tangential::Force([share * 300.0, 0.0])), ..step("pull") };
        let result = solve(&model, &[press(1000.0), pull]);
        assert!(relative(result.records[1].shift[0], shift) < 2e-2, "{} {shift}", result.records[1].shift[0]);
        assert!(relative(result.records[0].peak_pressure, 2953.469) < 1e-2);
    }
}

/// Truth: Uzawa's method and Barzilai-Borwein steps converge to the same state (docs/theory-contact.md), to 1e-7 of the largest
/// pressure at residual 1e-9.
#[test]
fn uzawa_and_barzilai_borwein_agree() {
    let model = sphere_on_frp(30.0, 1.2, 16);
    let steps = [indent(0.02), shift(0.008, 30.0)];
    let states = [Method::Uzawa, Method::BarzilaiBorwein].map(|method| {
        let options = SolverOptions { method, tolerance: 1e-9, ..SolverOptions::default() };
        let result = solve_with(&model, &steps, &options);
        assert_eq!(result.outcome, Outcome::Converged);
        result
    });
    let p_max = states[0].records[1].peak_pressure;
    for (u, b) in states[0].state.tractions.iter().zip(&states[1].state.tractions) {
        assert!((u - b).abs() < 1e-7 * p_max);
    }
    assert!(states[0].records[1].iterations > 3 * states[1].records[1].iterations);
}

/// Truth: invariance under a change of units. Units that are powers of four do not change the rounding, so even the number of
/// iterations stays the same.
#[test]
fn units_do_not_matter() {
    let run = |length: f64, stress: f64| {
        let material = Stiffness::isotropic(210e3 * stress, 0.3).expect("steel");
        let mut model = half_spaces(&material, None, (1.2 * length, 24), sphere(50.0 * length));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let result = solve(&model, &[indent(0.02 * length), shift(0.003 * length, 20.0)]);
        let record = result.records[1].clone();
        (record.normal_force / (stress * length * length), record.iterations)
    };
    let reference = run(1.0, 1.0);
    for (length, stress) in
        [(2f64.powi(-10), 2f64.powi(20)), (2f64.powi(20), 2f64.powi(-10)), (2f64.powi(-30), 1.0)]
    {
        let found = run(length, stress);
        assert!(relative(found.0, reference.0) < 1e-9);
        assert_eq!(found.1, reference.1);
    }
}

/// Truth: on isotropic bodies the tangential force rotates with the direction of the tangential displacement.
#[test]
fn isotropic_answers_turn_with_the_shift() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    let mut model = half_spaces(&steel, None, (1.2, 24), sphere(50.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let forces: Vec<[f64; 2]> = [0.0, 90.0, 180.0]
        .map(|angle| solve(&model, &[indent(0.02), shift(0.003, angle)]).records[1].tangential_force)
        .to_vec();
    assert!(relative(forces[1][1], forces[0][0]) < 1e-7);
    assert!(relative(-forces[2][0], forces[0][0]) < 1e-7);
}

/// Truth: a tangential force beyond mu P has no equilibrium. The run ends with gross sliding and keeps the record of this step.
#[test]
fn gross_sliding_is_reported() {
    let steel = Stiffness::isotropic(210e3, 0.0).expect("steel");
    let mut model = half_spaces(&steel, Some(&steel), (0.5, 24), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    for (share, outcome) in
        [(0.99, Outcome::Converged), (1.01, Outcome::NotConverged(Divergence::GrossSliding))]
    {
        let pull = Step { tangential: Some(Tangential::Force([share * 300.0, 0.0])), ..step("pull") };
        let result = solve(&model, &[press(1000.0), pull]);
        assert_eq!(result.outcome, outcome);
        assert_eq!(result.records.len(), 2);
    }
}

/// Truth: the associated slip rule. In gross sliding, the slip is normal to the friction ellipse. The coefficients of friction
/// are 0.1 along x and 0.2 along y, and the force acts at 45 degrees. The slip is then parallel to (1 / 0.1², 1 / 0.2²), at 14.04
/// degrees: (cos, sin) = (0.970, 0.243).
#[test]
fn gross_sliding_follows_the_associated_rule() {
    let steel = Stiffness::isotropic(210e3, 0.0).expect("steel");
    // Normal and tangential tractions are coupled only if the other body is rigid.
    for partner in [Some(&steel), None] {
        let mut model = half_spaces(&steel, partner, (0.5, 24), sphere(10.0));
        model.friction = FrictionLaw::Elliptic { mu: [0.1, 0.2], angle: 0.0 };
        let pull = Step { tangential: Some(Tangential::Force([300.0, 300.0])), ..step("pull") };
        let result = solve(&model, &[press(1000.0), pull]);
        assert_eq!(result.outcome, Outcome::NotConverged(Divergence::GrossSliding));
        let told = "body 2 slides along (0.970, 0.243, 0.000)";
        assert!(result.warnings.iter().any(|w| w.contains(told)), "{:?}", result.warnings);
    }
}

/// Truth: a tangential force below mu P has an equilibrium on a frame of any width. P is the normal force of the final state. The
/// first iterates carry much less normal force, but the solver must not report gross sliding.
#[test]
fn a_wide_frame_does_not_slide_by_itself() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    for half_width in [1.2, 4.8] {
        let mut model = half_spaces(&steel, Some(&steel), (half_width, 48), sphere(50.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let both = |force: f64| Step { tangential: Some(Tangential::Force([force, 0.0])), ..indent(0.02) };
        let held = solve(&model, &[both(800.0)]);
        assert_eq!(held.outcome, Outcome::Converged, "half-width {half_width}");
        assert!(relative(held.records[0].tangential_force[0], 800.0) < 1e-8);
        let beyond = solve(&model, &[both(1100.0)]);
        assert_eq!(beyond.outcome, Outcome::NotConverged(Divergence::GrossSliding));
        let record = &beyond.records[0];
        assert!(relative(record.tangential_force[0], 0.3 * record.normal_force) < 1e-6);
    }
}

/// Truth: a tangential force has no equilibrium if the bodies do not touch.
#[test]
fn a_lost_contact_is_reported() {
    let model = sphere_on_frp(30.0, 1.2, 12);
    let apart = Step { tangential: Some(Tangential::Force([300.0, 0.0])), ..indent(-0.01) };
    let result = solve(&model, &[apart]);
    assert_eq!(result.outcome, Outcome::NotConverged(Divergence::ContactLost));
    assert_eq!(result.records[0].normal_force, 0.0);
}

/// Truth: case `str-zero-load`. The squares of tiny forces must not underflow.
#[test]
fn tiny_forces_are_carried() {
    let model = sphere_on_frp(30.0, 1.2, 12);
    for force in [1e-60, 1e-20, 1e-6] {
        let result = solve(&model, &[press(force)]);
        assert_eq!(result.outcome, Outcome::Converged, "{force}");
        assert!(relative(result.records[0].normal_force, force) < 1e-10);
    }
}

/// An operator that returns NaN in one entry of the gap.
struct Damaged(Arc<dyn Flexibility>);

impl Flexibility for Damaged {
    fn n_cells(&self) -> usize {
        self.0.n_cells()
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        self.0.apply(tractions, gap);
        gap[7] = f64::NAN;
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        self.0.apply_normal(pressure, normal_gap);
        normal_gap[7] = f64::NAN;
    }

    fn diagonal_blocks(&self) -> orthowear::flexibility::per_cell::PerCell<nalgebra::Matrix3<f64>> {
        self.0.diagonal_blocks()
    }
}

/// Truth: case `rel-nan-guard`. NaN ends the run with an error. A friction coefficient without a finite inverse is refused.
#[test]
fn not_a_number_is_an_error() {
    for friction in [true, false] {
        let mut model = sphere_on_frp(0.0, 1.2, 8);
        model.flexibility = Arc::new(Damaged(model.flexibility));
        let steps = [Step { friction, ..indent(0.02) }];
        let run = orthowear::evolution::run(&model, &steps, &SolverOptions::default(), None, &mut Silent);
        assert!(run.is_err(), "friction {friction}");
    }
    let mut model = sphere_on_frp(0.0, 1.2, 8);
    model.friction = FrictionLaw::Coulomb { mu: 5e-324 };
    let run =
        orthowear::evolution::run(&model, &[indent(0.02)], &SolverOptions::default(), None, &mut Silent);
    assert!(run.expect_err("no inverse").to_string().contains("friction coefficient"));
}

/// Truth: case `rel-nonconvergence-is-loud`. A run that reaches the iteration limit ends as not converged and keeps its last
/// record.
#[test]
fn too_few_iterations_are_loud() {
    let model = sphere_on_frp(30.0, 1.2, 16);
    for max_iterations in [1, 2, 3] {
        let options = SolverOptions { max_iterations, ..SolverOptions::default() };
        let result = solve_with(&model, &[indent(0.02), shift(0.008, 0.0)], &options);
        assert_eq!(result.outcome, Outcome::NotConverged(Divergence::Iterations));
        assert_eq!(result.records.len(), 1);
        assert!(!result.records[0].converged);
        assert!(result.records[0].certificate.natural_residual > 1e-8);
    }
}

/// Truth: omitted work does not affect the result. At the residual 1e-9, forces agree to 1e-6.
#[test]
fn skipping_changes_nothing() {
    let model = sphere_on_frp(30.0, 1.2, 24);
    let steps = [Step { friction: false, ..indent(0.02) }, shift(0.008, 0.0)];
    let [with, without] = [AllowedOmissions::ALL, AllowedOmissions::NONE].map(|skip| {
        let options = SolverOptions { skip, tolerance: 1e-9, ..SolverOptions::default() };
        solve_with(&model, &steps, &options)
    });
    assert!(with.skipped.len() >= 2);
    assert!(without.skipped.is_empty());
    for (a, b) in with.records.iter().zip(&without.records) {
        assert!(relative(a.normal_force, b.normal_force) < 1e-6);
        assert!((a.tangential_force[0] - b.tangential_force[0]).abs() < 1e-6 * a.normal_force);
        assert!((a.moment[1] - b.moment[1]).abs() < 1e-6 * a.normal_force);
    }
}

/// Truth: case `str-zero-load`. Without a load the force and the contact area are exactly zero. This also holds for a lifted
/// body.
#[test]
fn nothing_prescribed_is_nothing() {
    let model = sphere_on_frp(30.0, 1.2, 8);
    for step in [indent(0.0), indent(-0.01), press(0.0)] {
        let result = solve(&model, &[step]);
        assert_eq!(result.outcome, Outcome::Converged);
        assert_eq!(result.records[0].normal_force, 0.0);
        assert_eq!(result.records[0].contact_area, 0.0);
    }
}

/// Truth: controls that a step does not prescribe keep their values. Of a tangential force in two increments, half acts after the
/// first increment.
#[test]
fn what_a_step_does_not_name_stays() {
    let steel = Stiffness::isotropic(210e3, 0.0).expect("steel");
    let mut model = half_spaces(&steel, Some(&steel), (0.5, 24), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let pull = Step { tangential: Some(Tangential::Force([100.0, 0.0])), increments: 2, ..step("pull") };
    let result =
        solve(&model, &[press(1000.0), pull, Step { normal: Some(Normal::Force(1200.0)), ..step("more") }]);
    let last = result.records.last().expect("records");
    assert!(relative(last.normal_force, 1200.0) < 1e-10);
    assert!(relative(last.tangential_force[0], 100.0) < 1e-8);
    assert!(relative(result.records[1].tangential_force[0], 50.0) < 1e-8);
}

#[test]
fn a_tangential_force_needs_friction() {
    let steel = Stiffness::isotropic(210e3, 0.0).expect("steel");
    let model = half_spaces(&steel, None, (0.5, 8), sphere(10.0));
    let pull = Step { tangential: Some(Tangential::Force([1.0, 0.0])), ..step("pull") };
    let error =
        orthowear::evolution::run(&model, &[press(10.0), pull], &SolverOptions::default(), None, &mut Silent)
            .expect_err("nothing carries the force");
    assert!(error.to_string().contains("friction"), "{error}");
}
