//! Sweeps whose results are related by known laws. docs/verification.md lists the named cases.

use super::scenes::{SceneText, isotropic};
use super::sweeps::{self, POISSON, SCALES};
use super::{Run, Verdict, apart, ended, of, runs, verdict};
use crate::common::relative;

/// Truth: case `str-near-incompressible`. Without friction, the force on a half-space is proportional to E* = E / (1 - nu^2), to
/// 1e-7 (residual 1e-8).
///
/// With friction, forces are compared relative to the force at nu = 0.3. On a clamped block (12 wide, 6 high) of mean-dilatation
/// elements, this ratio agrees with the ratio on the half-space to 5 %. Other elements agree with mean-dilatation elements to 2
/// %, or the run has a locking warning. Standard hexahedra and tetrahedra have the warning from nu = 0.45 on, enhanced hexahedra
/// from 0.499 on. At nu = 0.4999, elements with a warning are more than 5 % off.
#[test]
fn nearly_incompressible() {
    let scaled = POISSON.map(|nu| {
        let scene =
            SceneText { friction: "law = \"none\"".to_owned(), ..SceneText::half_space(&isotropic(nu)) };
        let scene = SceneText { steps: "[[steps]]\napproach = 0.02\n".to_owned(), ..scene };
        let Verdict::Certified(run) = verdict::run("without friction", &scene.text(), None) else {
            panic!("nu {nu}")
        };
        run.records[0].normal_force * (1.0 - nu * nu)
    });
    assert!(scaled.iter().all(|force| relative(*force, scaled[0]) < 1e-7), "{scaled:?}");

    let cases = sweeps::poisson();
    let growth = |runs: &[(&str, Run)], i: usize| {
        runs[i].1.records[0].normal_force / runs[0].1.records[0].normal_force
    };
    let half_space = runs(&cases, "nu, half-space");
    let mean_dilatation = runs(&cases, "nu, hex8-bbar");
    for (i, nu) in POISSON.iter().enumerate() {
        let off = relative(growth(&mean_dilatation, i), growth(&half_space, i));
        assert!(off < 0.05, "{nu}: {off}");
    }
    for (sweep, locks_from) in
        [("nu, hex8", 0.45), ("nu, tet4", 0.45), ("nu, hex8-eas", 0.499), ("nu, hex8-bbar", f64::INFINITY)]
    {
        let runs = runs(&cases, sweep);
        for (i, (nu, (_, run))) in POISSON.iter().zip(&runs).enumerate() {
            let mut warnings = run.warnings.iter();
            let told = warnings.any(|warning| warning.starts_with("WARNING") && warning.contains("lock"));
            assert_eq!(told, *nu >= locks_from, "{sweep} {nu}: {:?}", run.warnings);
            let off = relative(growth(&runs, i), growth(&mean_dilatation, i));
            assert!(told || off < 0.02, "{sweep} {nu}: {off}");
            assert!(*nu < 0.4999 || !told || off > 0.05, "{sweep} {nu}: {off}");
        }
    }
    for case in cases.iter().filter(|case| case.end == sweeps::End::Refused) {
        let Verdict::Refused(message) = ended(case) else { unreachable!("ended() says so") };
        assert!(message.contains("Poisson's ratio"), "{message}");
    }
}

/// Truth: a fibre is a line without orientation, so opposite directions give the same forces. The forces are continuous, so
/// angles that differ by at most 1e-6 degrees give the same forces. The tolerance is 1e-6 of the normal force, for residuals of
/// 1e-8. Tilts beyond 90 degrees are refused.
#[test]
fn fibres_at_any_angle() {
    let cases = sweeps::tilts();
    let runs = runs(&cases, "fibre's tilt, azimuth");
    for (a, b) in [
        ("1e-12, 0.0", "0.0, 0.0"),
        ("-1e-12, 0.0", "0.0, 0.0"),
        ("1e-6, 0.0", "0.0, 0.0"),
        ("89.999999999999, 0.0", "90.0, 0.0"),
        ("89.999999, 0.0", "90.0, 0.0"),
        ("-90.0, 0.0", "90.0, 0.0"),
        ("30.0, 1e-12", "30.0, 0.0"),
        ("30.0, 90.000000000001", "30.0, 90.0"),
        ("30.0, 180.0", "-30.0, 0.0"),
        ("30.0, 179.999999", "30.0, 180.0"),
    ] {
        let apart = apart(of(&runs, a), of(&runs, b));
        assert!(apart < 1e-6, "{a} and {b}: {apart:e}");
    }
    for case in cases.iter().filter(|case| case.end == sweeps::End::Refused) {
        let Verdict::Refused(message) = ended(case) else { unreachable!("ended() says so") };
        assert!(message.contains("tilt") && message.contains("90"), "{message}");
    }
}

/// Truth: dimensional analysis (case `str-units-scale`). The same contact in other units has the same dimensionless forces,
/// displacements and areas, to 1e-9. The number of iterations is the same.
#[test]
fn units_and_sizes() {
    let cases = sweeps::units();
    for sweep in ["units of length, stress, half-space", "units of length, stress, finite elements"] {
        let runs = runs(&cases, sweep);
        let dimensionless = |run: &Run, [length, stress]: [f64; 2]| -> Vec<f64> {
            let force = stress * length * length;
            let records = run.records.iter().flat_map(|record| {
                let [qx, qy] = record.tangential_force.map(|q| q / force);
                let [dx, dy] = record.shift.map(|shift| shift / length);
                let area = record.contact_area / (length * length);
                [record.normal_force / force, qx, qy, dx, dy, record.approach / length, area]
            });
            records.collect()
        };
        let wanted = dimensionless(&runs[0].1, SCALES[0]);
        for ((value, run), scale) in runs.iter().zip(SCALES) {
            let found = dimensionless(run, scale);
            for (i, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
                // Components perpendicular to the load are sums of terms that cancel. Their tolerance refers to the size of the
                // forces (100) and displacements (0.01).
                let size = wanted.abs().max(if i % 7 < 3 { 100.0 } else { 0.0 }).max(if i % 7 < 5 {
                    0.01
                } else {
                    0.0
                });
                assert!((found - wanted).abs() < 1e-9 * size, "{sweep} {value}, {i}: {found} {wanted}");
            }
            let counts = |run: &Run| run.records.iter().map(|record| record.iterations).collect::<Vec<_>>();
            assert_eq!(counts(run), counts(&runs[0].1), "{sweep} {value}");
        }
    }
}
