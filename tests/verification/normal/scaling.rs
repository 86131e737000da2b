//! Scaling laws and dimensional analysis of Hertz contact. Cases are those of the catalogue (docs/verification.md).

use orthowear::evolution::records::Outcome;

use crate::common::{half_spaces, press, relative, solve, sphere};
use crate::observed::radius;
use orthowear::material::Stiffness;

fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let (mx, my) = logs.iter().fold((0.0, 0.0), |m, (x, y)| (m.0 + x / n, m.1 + y / n));
    let covariance: f64 = logs.iter().map(|(x, y)| (x - mx) * (y - my)).sum();
    covariance / logs.iter().map(|(x, _)| (x - mx).powi(2)).sum::<f64>()
}

/// Truth: case `hertz-scaling-law`. The load P grows as delta^(3/2) with the approach delta, and the contact radius as P^(1/3).
/// In logarithmic scales, the first slope is 1.500 +- 0.01, as in the catalogue. The second slope is 1/3 +- 0.02. Its tolerance
/// is larger, because the smallest contact radius is only 6 cells.
#[test]
fn force_grows_with_the_power_three_halves() {
    let steel = Stiffness::isotropic(210e3, 0.3).expect("steel");
    let largest = 0.687_53;
    let model = half_spaces(&steel, None, (1.1 * largest, 128), sphere(10.0));
    let steps = [10.0, 100.0, 1000.0, 10_000.0].map(press);
    let result = solve(&model, &steps);
    assert_eq!(result.outcome, Outcome::Converged);
    let forces: Vec<(f64, f64)> = result.records.iter().map(|r| (r.approach, r.normal_force)).collect();
    let radii: Vec<(f64, f64)> =
        result.records.iter().map(|r| (r.normal_force, radius(r.contact_area))).collect();
    assert!((slope(&forces) - 1.5).abs() < 0.01, "{}", slope(&forces));
    assert!((slope(&radii) - 1.0 / 3.0).abs() < 0.02, "{}", slope(&radii));
}

/// Truth: cases `hertz-scaling-law` and `str-units-scale`. The same contact in other units has the same dimensionless solution,
/// to 1e-9 and in the same number of iterations. The dimensionless solution also stays the same for twice the size under four
/// times the force, and for a million times the stiffness and force.
#[test]
fn units_and_sizes_leave_dimensionless_answers_alone() {
    // `length` is the unit of length in mm, and `stress` the unit of stress in MPa. `size` multiplies all lengths, `stiff` the
    // modulus.
    let run = |length: f64, stress: f64, (size, stiff): (f64, f64)| {
        let steel = Stiffness::isotropic(210e3 * stiff / stress, 0.3).expect("steel");
        let unit = size / length;
        let model = half_spaces(&steel, None, (0.4 * unit, 40), sphere(10.0 * unit));
        let result = solve(&model, &[press(1000.0 * stiff * unit * unit / stress)]);
        assert_eq!(result.outcome, Outcome::Converged, "{length} {stress}");
        let record = &result.records[0];
        let values = [
            record.approach / unit,
            record.peak_pressure * stress / stiff,
            record.contact_area / (unit * unit),
            record.normal_force * stress / (stiff * unit * unit),
        ];
        (values, record.iterations)
    };
    let reference = run(1.0, 1.0, (1.0, 1.0));
    let systems = [(1e3, 1e-6), (1e-3, 1.0), (1e-6, 1e3), (1e6, 1e3), (1.0, 1.0)];
    let sizes = [(1.0, 1.0), (1e-9, 1.0), (2.0, 1.0), (1.0, 1e6), (1e-11, 1e5), (1e12, 1e-12)];
    for (length, stress) in systems {
        for size in sizes {
            let found = run(length, stress, size);
            for (value, wanted) in found.0.iter().zip(reference.0) {
                assert!(relative(*value, wanted) < 1e-9, "{length} {stress} {size:?}: {value} {wanted}");
            }
            assert_eq!(found.1, reference.1, "{length} {stress} {size:?}");
        }
    }
}
