//! Frictional indentation: stick radius and stiffness (Spence 1968, 1975).

use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Normal, Step};
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, indent, relative, solve, sphere, step};
use crate::observed::radius;

/// Known values of case `spence-self-similar` (docs/verification.md): nu, mu, c/a, kappa and DR. c/a is the ratio of stick radius
/// to contact radius. kappa is the ratio of the forces of a flat punch with and without friction. DR = R delta / a² for a sphere
/// of radius R at the approach delta.
const CASES: [[f64; 5]; 4] = [
    [0.3, 0.2, 0.69828, 1.01927, 1.01487],
    [0.25, 0.2, 0.57556, 1.02328, 1.01782],
    [0.0, 0.5, 0.81265, 1.07479, 1.05997],
    [0.3, 0.3, 0.89596, 1.0243, 1.01948],
];

/// Truth: a flat punch keeps its contact area, so a single increment gives the same state as many increments. c / a agrees within
/// one cell. kappa agrees to 3e-3, because the errors at the edge are equal with and without friction and cancel.
#[test]
fn flat_punch() {
    for [nu, mu, ratio, kappa, _] in CASES {
        let material = Stiffness::isotropic(210e3, nu).expect("admissible");
        let cells = 64;
        let flat = |x: f64, y: f64| if x.hypot(y) < 1.0 { 0.0 } else { 1.0 };
        let mut model = half_spaces(&material, None, (1.05, cells), flat);
        let bare = solve(&model, &[indent(1e-3)]).records[0].normal_force;
        model.friction = FrictionLaw::Coulomb { mu };
        let result = solve(&model, &[indent(1e-3)]);
        assert_eq!(result.outcome, Outcome::Converged);
        let record = &result.records[0];
        let a = radius(record.contact_area);
        let found = radius(record.stick_area) / a;
        assert!((found - ratio).abs() < 2.1 / cells as f64, "nu {nu}, mu {mu}: c/a {found} {ratio}");
        assert!(
            relative(record.normal_force / bare, kappa) < 3e-3,
            "nu {nu}, mu {mu}: {}",
            record.normal_force / bare
        );
    }
}

/// Truth: a sphere pressed in increments. c / a agrees within one cell. Some 36 cells lie along the contact diameter. The force
/// is kappa DR (4/3) E* a³ / R with a² = R delta / DR, to 3e-3. At half of the approach, c / a is the same.
#[test]
fn sphere_in_increments() {
    for [nu, mu, ratio, kappa, dr] in CASES {
        let material = Stiffness::isotropic(210e3, nu).expect("admissible");
        let reduced = 210e3 / (1.0 - nu * nu);
        let (r, depth): (f64, f64) = (10.0, 0.01);
        let a = (r * depth / dr).sqrt();
        let cells = 40;
        let half_width = 1.1 * a;
        let mut model = half_spaces(&material, None, (half_width, cells), sphere(r));
        model.friction = FrictionLaw::Coulomb { mu };
        let press = Step { normal: Some(Normal::Approach(depth)), increments: 30, ..step("press") };
        let result = solve(&model, &[press]);
        assert_eq!(result.outcome, Outcome::Converged, "nu {nu}, mu {mu}");
        let cell = 2.0 * half_width / cells as f64;
        for (record, scale) in [(&result.records[29], 1.0_f64), (&result.records[14], 0.5)] {
            let found = radius(record.stick_area) / radius(record.contact_area);
            let one_cell = cell / (a * scale.sqrt());
            assert!((found - ratio).abs() < one_cell, "nu {nu}, mu {mu}: c/a {found} {ratio}");
        }
        let force = kappa * dr * 4.0 / 3.0 * reduced * a.powi(3) / r;
        let found = result.records[29].normal_force;
        assert!(relative(found, force) < 3e-3, "nu {nu}, mu {mu}: {found} {force}");
    }
}
