//! Solutions on windows of the frame, with starts on coarser cells: the same results as on the whole frame.

use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::Model;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Rolling, Spin, Step, StepKind, Tangential, Tilt};
use orthowear::omitted::AllowedOmissions;

use crate::common::{
    frp_friction, half_spaces, indent, press, relative, shift, solve_with, sphere, sphere_on_frp, steel, step,
};

fn same(model: &Model, steps: &[Step], method: Method) {
    let options = SolverOptions { tolerance: 1e-9, ..SolverOptions::default() };
    let windows = solve_with(model, steps, &options);
    let whole = solve_with(model, steps, &SolverOptions { method, ..options });
    assert_eq!([&windows.outcome, &whole.outcome], [&Outcome::Converged; 2]);
    assert!(windows.skipped.iter().any(|skip| skip.what.contains("away from the contact")));
    for (a, b) in windows.records.iter().zip(&whole.records) {
        assert!(a.certificate.natural_residual <= 1e-9);
        assert!(relative(a.normal_force, b.normal_force) < 1e-7, "{} {}", a.normal_force, b.normal_force);
        assert!((a.tangential_force[0] - b.tangential_force[0]).abs() < 1e-7 * b.normal_force);
        assert_eq!((a.contact_area, a.stick_area), (b.contact_area, b.stick_area), "{}", a.name);
    }
    let largest = whole.records.last().expect("steps").peak_pressure;
    for (a, b) in windows.state.tractions.iter().zip(&whole.state.tractions) {
        assert!((a - b).abs() < 1e-6 * largest, "{a} {b}");
    }
    for (a, b) in windows.state.gap.iter().zip(&whole.state.gap) {
        assert!((a - b).abs() < 1e-7 * 0.02, "{a} {b}");
    }
}

/// Truth: the solution is unique, because the problem is a contraction at these friction coefficients. Omitted cells do not
/// change the solution: forces agree to 1e-7 and tractions to 1e-6, at residuals of 1e-9.
#[test]
fn windows_change_nothing_with_friction() {
    let model = sphere_on_frp(30.0, 1.6, 64);
    let steps = [indent(0.002), shift(0.004, 0.6), indent(0.02), shift(-0.006, 0.0), press(60.0)];
    same(&model, &steps, Method::Newton);
}

/// Truth: the unique solution on the whole frame. The second of two contact areas appears outside the window of the first.
#[test]
fn windows_grow_to_spots_that_touch_later() {
    let spots = |x: f64, y: f64| {
        let to = |cx: f64, cy: f64| ((x - cx).powi(2) + (y - cy).powi(2)) / 10.0;
        to(-0.8, -0.9).min(to(0.5, 0.7) + 0.004)
    };
    let model = half_spaces(&steel(), None, (1.6, 64), spots);
    let steps = [indent(0.003), indent(0.008), press(40.0)].map(|step| Step { friction: false, ..step });
    same(&model, &steps, Method::ConjugateGradients);
}

fn pull(force: [f64; 2], increments: usize) -> Step {
    Step { tangential: Some(Tangential::Force(force)), increments, ..step("pull") }
}

/// Truth: the unique solution on the whole frame. For bodies of equal material, the solver computes the pressures before the
/// tangential tractions. It starts on coarser cells.
#[test]
fn pressures_first_change_nothing() {
    let mut model = half_spaces(&steel(), Some(&steel()), (0.8, 64), sphere(10.0));
    model.friction = frp_friction(30.0);
    let steps = [
        Step { friction: false, ..press(800.0) },
        pull([130.0, 30.0], 3),
        pull([-60.0, 0.0], 2),
        Step { increments: 2, ..press(1000.0) },
        shift(-0.003, 20.0),
        press(600.0),
    ];
    same(&model, &steps, Method::Newton);
    let options = SolverOptions::default();
    let [apart, whole] = [AllowedOmissions::ALL, AllowedOmissions::NONE]
        .map(|skip| solve_with(&model, &steps, &SolverOptions { skip, ..options }));
    let told = |run: &orthowear::evolution::RunResult| {
        run.skipped.iter().filter(|skip| skip.what.starts_with("normal components")).count()
    };
    assert_eq!([told(&apart), told(&whole)], [1, 0]);
}

/// Truth: the unique solution on the whole frame. The contact covers almost the whole frame.
#[test]
fn wide_contacts_begin_on_coarser_cells() {
    let mut model = half_spaces(&steel(), Some(&steel()), (0.39, 64), sphere(10.0));
    model.friction = orthowear::laws::friction::FrictionLaw::Coulomb { mu: 0.3 };
    let steps = [Step { friction: false, ..press(800.0) }, pull([200.0, 0.0], 1)];
    same(&model, &steps, Method::Newton);
}

/// Truth: the unique solution on the whole frame. The second step has no equilibrium on the window of the first step.
#[test]
fn a_window_too_small_is_no_verdict() {
    let tipping = |moment| Step { tilt: Some(Tilt::Moment(moment)), friction: false, ..press(100.0) };
    let model = half_spaces(&steel(), None, (0.5, 64), sphere(10.0));
    same(&model, &[tipping([0.0; 2]), tipping([0.0, 30.0])], Method::BarzilaiBorwein);
    let mut model = half_spaces(&steel(), None, (0.5, 64), sphere(10.0));
    model.friction = orthowear::laws::friction::FrictionLaw::Coulomb { mu: 0.3 };
    let indented = indent(0.0005);
    let pulled = Step { tangential: Some(Tangential::Force([250.0, 0.0])), ..indent(0.01) };
    same(&model, &[indented, pulled], Method::BarzilaiBorwein);
    let mut model = half_spaces(&steel(), Some(&steel()), (0.5, 64), sphere(10.0));
    model.friction = orthowear::laws::friction::FrictionLaw::Coulomb { mu: 0.3 };
    let spun = Step { spin: Some(Spin::Moment(50.0)), ..press(1000.0) };
    same(&model, &[press(1.0), spun], Method::BarzilaiBorwein);
}

/// Truth: the unique solution on the whole frame. In rolling, the slip of a cell refers to the upstream cell, which lies outside
/// the contact for cells at the leading edge. 96 cells allow coarser grids, 97 cells do not.
#[test]
fn rolling_on_a_window_is_rolling_on_the_frame() {
    for cells in [96, 97] {
        let mut model = half_spaces(&steel(), Some(&steel()), (0.6, cells), sphere(10.0));
        model.friction = orthowear::laws::friction::FrictionLaw::Coulomb { mu: 0.3 };
        let rolling = Rolling { quarter_turns: 0, creepage: [2e-3, 1e-3], spin: 0.0, distance: 1.0 };
        same(
            &model,
            &[press(800.0), Step { kind: StepKind::Rolling(rolling), ..step("roll") }],
            Method::Newton,
        );
    }
}

/// Truth: calculation by hand. For cells of size h, the four middle cells have their centres at h / 2 from the origin along x and
/// y. The gap there is h² / 4R. At this approach the bodies just touch.
#[test]
fn bodies_without_load_just_touch() {
    let model = half_spaces(&steel(), Some(&steel()), (0.5, 64), sphere(10.0));
    for steps in [vec![press(0.0)], vec![press(100.0), press(0.0)], vec![indent(0.003), press(0.0)]] {
        let run = solve_with(&model, &steps, &SolverOptions::default());
        let last = run.records.last().expect("a step");
        let touch = (1.0_f64 / 64.0).powi(2) / 40.0;
        assert!((last.approach - touch).abs() < 1e-15 && last.contact_area == 0.0, "{}", last.approach);
    }
    let run = solve_with(&model, &[indent(0.003), indent(0.0)], &SolverOptions::default());
    assert_eq!(run.records[1].approach, 0.0);
}
