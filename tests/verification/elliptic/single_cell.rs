//! Contacts of a single cell against closed forms. Cases are those of the catalogue (docs/verification.md).

use std::sync::Arc;

use nalgebra::Matrix3;
use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::records::{Divergence, Outcome};
use orthowear::evolution::step::{Normal, Step, Tangential};
use orthowear::evolution::{Model, RunResult};
use orthowear::flexibility::Flexibility;
use orthowear::frame::ContactFrame;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

use crate::common::{press, relative, shift, solve, solve_with, step};
use crate::observed::pull;

/// Flexibility matrix S of a single cell of unit area, in the axes x, y, n.
struct OneCell(Matrix3<f64>);

impl Flexibility for OneCell {
    fn n_cells(&self) -> usize {
        1
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        let product = self.0 * nalgebra::Vector3::from_column_slice(tractions);
        gap.copy_from_slice(product.as_slice());
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        normal_gap[0] = self.0[(2, 2)] * pressure[0];
    }

    fn diagonal_blocks(&self) -> orthowear::flexibility::per_cell::PerCell<Matrix3<f64>> {
        orthowear::flexibility::per_cell::PerCell::Same(self.0, 1)
    }
}

fn cell(flexibility: Matrix3<f64>, friction: FrictionLaw) -> Model {
    Model {
        frame: ContactFrame::grid([0.5; 2], [1; 2], [0.0; 2], 0.0).expect("a frame of one cell"),
        flexibility: Arc::new(OneCell(flexibility)),
        initial_gap: vec![0.0; 3],
        loads: Vec::new(),
        floating: Vec::new(),
        friction,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Model of one cell that is practically rigid in the surface. Friction has mu1 = 0.1 at `turned` degrees from x, and mu2 = 0.2
/// perpendicular to this direction.
fn block(turned: f64) -> Model {
    let friction = FrictionLaw::Elliptic { mu: [0.1, 0.2], angle: f64::to_radians(turned) };
    cell(Matrix3::from_diagonal(&[1e-12, 1e-12, 1.0].into()), friction)
}

/// Truth: case `ellipse-sliding-direction` (Zmitrowicz 1981). A block under the normal force 1 moves at the angle theta from the
/// first axis of the friction ellipse. `cases` lists its friction force along and across this axis, to 1e-10.
#[test]
fn a_block_moved_in_a_given_direction() {
    let cases = [
        (0.0, [0.1, 0.0]),
        (30.0, [0.06546536707, 0.1511857892]),
        (60.0, [0.02773500981, 0.1921537846]),
        (90.0, [0.0, 0.2]),
    ];
    for turned in [0.0, 20.0, -75.0] {
        for (theta, [along, across]) in cases {
            let result = solve(&block(turned), &[press(1.0), shift(1.0, turned + theta)]);
            assert_eq!(result.outcome, Outcome::Converged);
            let (sin, cos) = f64::to_radians(turned).sin_cos();
            let wanted = [cos * along - sin * across, sin * along + cos * across];
            let found = result.records[1].tangential_force;
            for k in 0..2 {
                assert!((found[k] - wanted[k]).abs() < 1e-10, "{turned} {theta}: {found:?} {wanted:?}");
            }
            // The force along the motion equals the effective friction coefficient, because the normal force is 1.
            let along_way = sin_cos(turned + theta, found);
            let (s, c) = f64::to_radians(theta).sin_cos();
            assert!(relative(along_way, (0.1 * c).hypot(0.2 * s)) < 1e-10, "{turned} {theta}");
        }
    }
}

fn sin_cos(angle: f64, force: [f64; 2]) -> f64 {
    let (s, c) = angle.to_radians().sin_cos();
    c * force[0] + s * force[1]
}

/// Truth: case `ellipse-critical-pull` (Zmitrowicz 1989), to 1e-8. The critical pull is the largest force that friction balances,
/// at 30 or 60 degrees from the first axis of the ellipse. A block that moves along the published direction of slip has a
/// friction force with the direction and size of the critical pull.
#[test]
fn a_block_pulled_in_a_given_direction() {
    for (pulled, critical, slips) in [(30.0, 0.1109400392, 8.213210702), (60.0, 0.1511857892, 23.41322445)] {
        for turned in [0.0, 35.0] {
            let (s, c) = f64::to_radians(pulled + turned).sin_cos();
            let friction = FrictionLaw::Elliptic { mu: [0.1, 0.2], angle: f64::to_radians(turned) };
            let model = cell(Matrix3::from_diagonal(&[1.0, 1.0, 1.0].into()), friction);
            // The published value has 10 digits.
            let (sp, cp) = f64::to_radians(pulled).sin_cos();
            let exact = 1.0 / (cp / 0.1).hypot(sp / 0.2);
            assert!(relative(exact, critical) < 1e-9);
            for (share, outcome) in [
                (1.0 - 1e-8, Outcome::Converged),
                (1.0 + 1e-8, Outcome::NotConverged(Divergence::GrossSliding)),
            ] {
                let force = exact * share;
                let result = solve(&model, &[press(1.0), pull([force * c, force * s])]);
                assert_eq!(result.outcome, outcome, "{pulled} {turned} {share}");
            }
            let moved = solve(&block(turned), &[press(1.0), shift(1.0, turned + slips)]);
            let [x, y] = moved.records[1].tangential_force;
            assert!(relative(x.hypot(y), critical) < 1e-8, "{pulled}");
            assert!((y.atan2(x).to_degrees() - pulled - turned).abs() < 1e-6, "{pulled}");
        }
    }
}

/// Klarbring's contact point as a model of one cell. Its stiffness for the displacements (u_t, u_n) is K = [[1, -1.5], [-1.5,
/// 4]], with u_t tangential and u_n into the obstacle. The model has the flexibility K⁻¹ and the normal gap -u_n.
fn klarbring(mu: f64) -> Model {
    let determinant = 4.0 - 2.25;
    let (tt, tn, nn) = (4.0 / determinant, 1.5 / determinant, 1.0 / determinant);
    let flexibility = Matrix3::new(tt, 0.0, -tn, 0.0, 1.0, 0.0, -tn, 0.0, nn);
    cell(flexibility, FrictionLaw::Coulomb { mu })
}

/// Step that prescribes the displacement K⁻¹ F, which the point has without contact under the force F = (-1, 1.2).
fn loaded() -> Step {
    Step {
        normal: Some(Normal::Approach(-0.3 / 1.75)),
        tangential: Some(Tangential::Shift([-2.2 / 1.75, 0.0])),
        ..step("load")
    }
}

/// Final displacement (u_t, u_n) and reaction (R_t, N) of the point.
fn point(result: &RunResult) -> [f64; 4] {
    let state = &result.state;
    [state.gap[0], -state.gap[2], state.tractions[0], state.tractions[2]]
}

/// Truth: case `non-unique-single-node` (Klarbring 1990). For mu = 1 an open, a sticking and a slipping state satisfy the contact
/// and friction laws. The result is one of these states to 1e-9, and the same state in every run. For mu = 0.5 only the open
/// state is a solution.
#[test]
fn a_point_with_three_answers() {
    let answers =
        [[-1.257142857142857, -0.171428571428571, 0.0, 0.0], [0.0, 0.0, 1.0, 1.2], [-0.4, 0.0, 0.6, 0.6]];
    let close = |a: &[f64; 4], b: &[f64; 4]| a.iter().zip(b).all(|(x, y)| (x - y).abs() < 1e-9);
    let options = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
    for method in [Method::Auto, Method::BarzilaiBorwein, Method::Uzawa] {
        let options = SolverOptions { method, ..options };
        for mu in [1.0, 0.5] {
            let runs = [0, 1].map(|_| solve_with(&klarbring(mu), &[loaded()], &options));
            assert_eq!(runs[0].outcome, Outcome::Converged, "mu {mu} {method:?}");
            let [first, again] = [point(&runs[0]), point(&runs[1])];
            assert_eq!(first.map(f64::to_bits), again.map(f64::to_bits));
            let allowed = if mu == 1.0 { &answers[..] } else { &answers[..1] };
            assert!(allowed.iter().any(|answer| close(&first, answer)), "mu {mu} {method:?}: {first:?}");
        }
    }
}

/// Truth: case `str-friction-large` for Klarbring's point, with mu from 0 to 2. Converged states satisfy the contact and friction
/// laws. Above mu = 1 the run may report that it did not converge.
#[test]
fn a_point_with_any_coefficient() {
    for mu in [0.0, 1e-12, 0.1, 0.5, 1.0, 1.5, 2.0] {
        let model = klarbring(mu);
        let pressed = Step { normal: Some(Normal::Approach(0.4)), ..step("press") };
        let options = SolverOptions { max_iterations: 3000, ..SolverOptions::default() };
        let bb = SolverOptions { method: Method::BarzilaiBorwein, ..options };
        for options in [options, bb] {
            point_is_certified(mu, &solve_with(&model, &[pressed.clone(), loaded()], &options));
        }
    }
}

fn point_is_certified(mu: f64, result: &RunResult) {
    for record in &result.records {
        assert!(!record.converged || record.certificate.natural_residual <= 1e-8, "mu {mu}");
    }
    let [_, depth, q, p] = point(result);
    match result.outcome {
        Outcome::Converged => {
            assert!(p >= 0.0 && depth < 1e-8 && (p * depth).abs() < 1e-8, "mu {mu}");
            assert!(q.abs() <= mu * p + 1e-8, "mu {mu}: {q} {p}");
            assert!(mu > 0.0 || q == 0.0);
        }
        Outcome::NotConverged(reason) => assert!(mu > 1.0, "mu {mu}: {reason:?}"),
        Outcome::Interrupted => panic!("nobody interrupts"),
    }
}
