//! Contact states under elliptic friction: independence of the two axes, and the laws in every cell. Cases are those of the
//! catalogue (docs/verification.md).

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, im7, indent, press, shift, solve_with, sphere, sphere_on_frp, steel};
use crate::observed::{audit, follow, press_and_pull, pull, radius};

/// Truth: case `ellipse-principal-partial-slip`. Equal bodies with nu = 0 under the normal force P are pulled along the first
/// axis of the ellipse by 0.6 mu1 P. For any mu2 they respond as under isotropic friction with mu1, to 1e-6. The ratio of stick
/// radius to contact radius is 0.7368062997, within one cell.
#[test]
fn the_other_axis_is_not_felt() {
    let material = Stiffness::isotropic(210e3, 0.0).expect("admissible");
    let (load, mu): (f64, f64) = (1000.0, 0.3);
    let a = (3.0 * load * 10.0 / (4.0 * 105e3)).cbrt();
    let (half_width, cells) = (1.2 * a, 48);
    let options = SolverOptions { tolerance: 1e-9, ..SolverOptions::default() };
    for turned in [0.0, 90.0] {
        let angle = f64::to_radians(turned);
        let runs = [0.1, 0.3, 0.6].map(|other| {
            let mut model = half_spaces(&material, Some(&material), (half_width, cells), sphere(10.0));
            model.friction = FrictionLaw::Elliptic { mu: [mu, other], angle };
            let force = 0.6 * mu * load;
            let result = solve_with(
                &model,
                &[press(load), pull([force * angle.cos(), force * angle.sin()])],
                &options,
            );
            assert_eq!(result.outcome, Outcome::Converged);
            result
        });
        let ratio = radius(runs[0].records[1].stick_area) / a;
        assert!((ratio - 0.7368062997).abs() < 2.4 / cells as f64, "{ratio}");
        let p_max = runs[0].records[1].peak_pressure;
        for other in &runs[1..] {
            for (x, y) in runs[0].state.tractions.iter().zip(&other.state.tractions) {
                assert!((x - y).abs() < 1e-6 * p_max, "{turned}");
            }
            let shifts = [runs[0].records[1].shift, other.records[1].shift];
            assert!(
                (0..2).all(|k| (shifts[0][k] - shifts[1][k]).abs() < 1e-6 * shifts[0][0].hypot(shifts[0][1]))
            );
        }
    }
}

/// Truth: case `ellipse-law-residuals`. Every cell of every converged state satisfies the contact and friction laws. Gaps,
/// pressures and dissipation are not negative. Tractions lie in the friction ellipse, and cells inside the ellipse stick. Slip
/// lies along the inward normal of the ellipse, within 0.1 degrees. Solver residuals of 1e-8 allow violations of 1e-6, relative
/// to the peak pressure and to a cell's displacement under this pressure.
#[test]
fn every_cell_obeys_the_laws() {
    let mut models: Vec<_> = [0.0, 30.0, 60.0, 90.0].map(|tilt| sphere_on_frp(tilt, 1.2, 24)).into();
    let mut skew = half_spaces(&im7(20.0), Some(&steel()), (1.2, 24), sphere(50.0));
    skew.friction = FrictionLaw::Elliptic { mu: [0.15, 0.6], angle: 0.7 };
    models.push(skew);
    let steps = [
        indent(0.02),
        shift(0.004, 45.0),
        shift(0.008, 45.0),
        shift(0.003, 120.0),
        Step { increments: 2, ..press_and_pull(300.0, [-40.0, 30.0]) },
        indent(0.012),
    ];
    for (number, model) in models.iter().enumerate() {
        let unit = model.flexibility.diagonal_blocks()[0][(2, 2)];
        let (result, fields) = follow(model, &steps, &SolverOptions::default());
        assert_eq!(result.outcome, Outcome::Converged, "model {number}");
        for (record, state) in result.records.iter().zip(&fields) {
            let found = audit(state, model.friction.ellipse(), unit);
            assert!(found.passes(1e-6), "model {number}, {} {}: {found:?}", record.name, record.increment);
        }
    }
    // The audit must detect one reversed traction, and the penetration of one cell.
    let (_, mut fields) = follow(&models[1], &steps[..3], &SolverOptions::default());
    let state = fields.last_mut().expect("fields");
    let n = state.gap.len() / 3;
    let unit = models[1].flexibility.diagonal_blocks()[0][(2, 2)];
    let sliding = (0..n).find(|i| state.status[*i] == 2).expect("a sliding cell");
    state.tractions[sliding] *= -1.0;
    assert!(!audit(state, models[1].friction.ellipse(), unit).passes(1e-6));
    state.tractions[sliding] *= -1.0;
    state.gap[2 * n] = -0.01;
    assert!(!audit(state, models[1].friction.ellipse(), unit).passes(1e-6));
}
