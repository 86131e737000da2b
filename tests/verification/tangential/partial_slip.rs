//! Partial slip with exact solutions: proportional loading, and indenters other than spheres. docs/verification.md lists the
//! named cases.

use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, press, relative, solve, sphere};
use crate::observed::{press_and_pull, pull, radius};

/// Truth: case `oblique-proportional-loading` (Mindlin and Deresiewicz 1953). The tangential force Q = q0 P with q0 = 0.2 grows
/// with P from zero. Only the outermost ring of cells slips, because the gaps of these cells close during the increment. For nu =
/// 0 the tangential tractions are q0 p, to 2e-2 of the peak pressure. With 100 increments the ratio of displacement to approach
/// is q0 (2 - nu) / (2 (1 - nu)), to 5e-3. With 25 increments the error is more than twice as large, because wider rings slip.
#[test]
fn forces_of_constant_direction_below_the_cone_do_not_slip() {
    for nu in [0.0, 0.3] {
        let material = Stiffness::isotropic(210e3, nu).expect("admissible");
        let a = (3.0_f64 * 1000.0 * 10.0 * 2.0 * (1.0 - nu * nu) / (4.0 * 210e3)).cbrt();
        let (half_width, cells) = (1.1 * a, 44);
        let cell = 2.0 * half_width / cells as f64;
        let mut model = half_spaces(&material, Some(&material), (half_width, cells), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        let ratios = [25, 100].map(|count| {
            let steps: Vec<Step> = (1..=count)
                .map(|k| 1000.0 * (f64::from(k) / f64::from(count)).powi(3))
                .map(|load| press_and_pull(load, [0.2 * load, 0.0]))
                .collect();
            let result = solve(&model, &steps);
            assert_eq!(result.outcome, Outcome::Converged);
            let last = result.records.last().expect("records");
            let ring = (a / f64::from(count)).max(cell) + 0.5 * cell;
            assert!(radius(last.stick_area) > radius(last.contact_area) - ring, "nu {nu}, {count}");
            let n = model.frame.n_cells();
            for i in (0..n).filter(|i| nu == 0.0 && count == 100 && result.state.status[*i] == 1) {
                let [q, p] = [0, 2].map(|plane| result.state.tractions[plane * n + i]);
                assert!((q.abs() - 0.2 * p).abs() < 2e-2 * last.peak_pressure, "cell {i}: {q} {p}");
            }
            last.shift[0] / last.approach
        });
        let wanted = 0.2 * (2.0 - nu) / (2.0 * (1.0 - nu));
        let errors = ratios.map(|ratio| relative(ratio, wanted));
        assert!(errors[1] < 5e-3 && errors[1] < 0.5 * errors[0], "nu {nu}: {ratios:?} {wanted}");
    }
}

/// Truth: case `jaeger-ciavarella-cone` (Jaeger 1998; Ciavarella 1998). Equal bodies of nu = 0 with a conical gap of 5 degrees
/// carry Q = 0.5 mu P. Stick radius c and contact radius a obey c / a = sqrt(1 - Q / mu P) within one cell. The approach delta
/// and the displacement D obey D G* / (mu delta E*) = 1 - c / a, to 1e-2.
#[test]
fn cone_in_partial_slip() {
    let material = Stiffness::isotropic(210e3, 0.0).expect("admissible");
    let (reduced, shear) = (105e3, 105e3);
    let slope = 5f64.to_radians().tan();
    // Sneddon's solution for the slope angle b: P = (pi/2) E* a² tan b, delta = (pi/2) a tan b. Equal bodies have 1/G* = 2 (2 -
    // nu) / (4 G).
    let a = 1.0;
    let load = 0.5 * std::f64::consts::PI * reduced * a * a * slope;
    let (cells, half_width, mu) = (64, 1.15, 0.3);
    let mut model = half_spaces(&material, Some(&material), (half_width, cells), |x, y| slope * x.hypot(y));
    model.friction = FrictionLaw::Coulomb { mu };
    let result = solve(&model, &[press(load), pull([0.5 * mu * load, 0.0])]);
    assert_eq!(result.outcome, Outcome::Converged);
    let record = &result.records[1];
    let cell = 2.0 * half_width / cells as f64;
    let c = radius(record.stick_area);
    assert!((c - a * 0.5_f64.sqrt()).abs() < cell, "{c}");
    assert!((radius(record.contact_area) - a).abs() < cell);
    let combined = 1.0 / (2.0 * 2.0 / (4.0 * shear));
    let found = record.shift[0] * combined / (mu * record.approach * reduced);
    assert!(relative(found, 0.2928932188) < 1e-2, "{found}");
}
