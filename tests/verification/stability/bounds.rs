//! Noise in the gap, and loads as small as the smallest floating-point numbers. docs/verification.md lists the named cases.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::run;
use orthowear::evolution::step::{Normal, Step};
use orthowear::laws::friction::{FrictionEllipse, FrictionLaw};

use super::random::Random;
use crate::common::{Silent, half_spaces, im7, indent, press, shift, solve, sphere, sphere_on_frp, step};
use crate::observed::{audit, follow, pull};

const APPROACH: f64 = 0.02;

/// Truth: a larger gap in any cell reduces the force, because a flat punch on the same contact area has positive pressure
/// everywhere. Noise of at most e changes the force at most as much as a change of the approach by e, to 1e-7.
#[test]
fn noise_in_the_gap() {
    for share in [0.0, f64::EPSILON, 1e-12, 1e-9, 1e-6, 1e-3] {
        let noise = share * APPROACH;
        let mut random = Random(5);
        let cells = 24;
        let mut model = half_spaces(&im7(30.0), None, (1.2, cells), sphere(50.0));
        let n = model.frame.n_cells();
        let force = |model: &orthowear::evolution::Model, approach: f64| {
            let result = solve(model, &[indent(approach)]);
            assert_eq!(result.outcome, Outcome::Converged);
            result.records[0].normal_force
        };
        let [low, high] = [force(&model, APPROACH - noise), force(&model, APPROACH + noise)];
        model.initial_gap[2 * n..].iter_mut().for_each(|gap| *gap += noise * random.between(-1.0, 1.0));
        let found = force(&model, APPROACH);
        assert!(found > low * (1.0 - 1e-7) && found < high * (1.0 + 1e-7), "{share:e}: {low} {found} {high}");
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let steps = [indent(APPROACH), shift(0.008, 20.0)];
        let (result, states) = follow(&model, &steps, &SolverOptions::default());
        assert_eq!(result.outcome, Outcome::Converged, "{share:e}");
        let unit = model.flexibility.diagonal_blocks()[0][(2, 2)];
        let ellipse = FrictionEllipse { mu: [0.3; 2], angle: 0.0 };
        for state in &states {
            let found = audit(state, Some(ellipse), unit);
            assert!(found.passes(1e-6), "{share:e}: {found:?}");
        }
    }
}

/// Truth: case `str-zero-load`. Converged states carry the prescribed force to 1e-10. Their tangential force stays within the
/// friction limit, to 1e-7. Loads are refused if the squares of the pressures underflow.
#[test]
fn the_smallest_doubles() {
    let model = sphere_on_frp(30.0, 1.2, 12);
    for least in [5e-324, f64::MIN_POSITIVE, 1e-300, 1e-200, 1e-150, 1e-130] {
        let gently = Step { normal: Some(Normal::Force(least)), increments: 3, ..step("press") };
        for (steps, force) in [
            (vec![press(least)], least),
            (vec![gently, pull([0.2 * least, 0.0])], least),
            (vec![press(300.0), pull([least, least])], 300.0),
            (vec![press(300.0), shift(least, 30.0)], 300.0),
            (vec![indent(least), shift(least, 0.0)], 0.0),
        ] {
            let result = match run(&model, &steps, &SolverOptions::default(), None, &mut Silent) {
                Ok(result) => result,
                Err(error) => {
                    assert!(force < 1e-130 && error.to_string().contains("units"), "{least:e}: {error}");
                    continue;
                }
            };
            for record in &result.records {
                let json = serde_json::to_string(record).expect("a record has a form");
                assert!(!json.contains("null"), "{least:e}: {json}");
                let [qx, qy] = record.tangential_force;
                assert!(qx.hypot(qy) <= 0.55 * (1.0 + 1e-7) * record.normal_force, "{least:e}: {record:?}");
            }
            let found = result.records.last().map_or(f64::NAN, |record| record.normal_force);
            match result.outcome {
                Outcome::Converged => {
                    assert!((found - force).abs() <= 1e-10 * force, "{least:e}: {found} {force}");
                }
                outcome => assert!(least < 1e-130, "{least:e} {force}: {outcome:?}"),
            }
        }
    }
}
