//! From coarse to fine cells and on windows of the frame: the same answers as on the whole frame at once.

use orthowear::contact::{Method, SolverOptions};
use orthowear::history::Model;
use orthowear::history::step::{Outcome, Step};

use crate::common::{half_spaces, indent, press, relative, shift, solve_with, sphere_on_frp, steel};

/// Runs with windows and on the whole frame by `method`; compares forces, areas and tractions.
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

/// Truth: the state has one solution (a contraction at these coefficients of friction): whatever cells are left out on the
/// way, forces agree to 1e-7 and tractions to 1e-6 at residuals of 1e-9. The contact grows, shrinks and moves.
#[test]
fn windows_change_nothing_with_friction() {
    let model = sphere_on_frp(30.0, 1.6, 64);
    let steps = [indent(0.002), shift(0.004, 0.6), indent(0.02), shift(-0.006, 0.0), press(60.0)];
    same(&model, &steps, Method::Newton);
}

/// Truth: as above; two spots far apart, of which the second touches in the second step only, outside the window of the first.
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
