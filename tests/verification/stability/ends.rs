//! Sweeps in which each run has a required outcome, and few further results are known. docs/verification.md lists the named
//! cases. The audit checks the contact and friction conditions of a state in each cell.

use super::{End, Verdict, ended, iterations, of, runs, sweeps};
use crate::common::{relative, usual_or_finest};
use orthowear::evolution::records::Divergence;

/// Truth: case `str-modulus-ratio`, E1 / E2 from 1 to 1e4. Every run takes less than five times as many iterations as the run
/// with E1 / E2 = 1.
#[test]
fn modulus_ratios() {
    let cases = sweeps::modulus_ratio();
    for sweep in ["E1 / E2, half-space", "E1 / E2, finite elements"] {
        let runs = runs(&cases, sweep);
        let least = iterations(&runs[0].1);
        for (value, run) in &runs {
            assert!(iterations(run) < 5 * least, "{sweep} {value}: {} {least}", iterations(run));
        }
    }
}

/// Truth: case `str-friction-large`. Without friction, tangential tractions are exactly zero. Coefficients of 1e-100 and 1e-12
/// give the normal force without friction, to 1e-7. Runs converge for coefficients of isotropic friction up to 1 (0.5 on finite
/// elements) and of elliptic friction up to 0.5. Runs with larger coefficients pass the audit or report a reason.
#[test]
fn coefficients_of_friction() {
    let cases = sweeps::coefficients();
    for case in cases.iter().filter(|case| case.sweep == "mu1, mu2") {
        ended(case);
    }
    for sweep in ["mu, half-space", "mu, finite elements"] {
        let runs = runs(&cases, sweep);
        let none = of(&runs, "0.0");
        let n = none.tractions.len() / 3;
        assert!(none.tractions[..2 * n].iter().all(|q| *q == 0.0), "{sweep}");
        for small in ["1e-100", "1e-12"] {
            for (found, wanted) in of(&runs, small).records.iter().zip(&none.records) {
                assert!(relative(found.normal_force, wanted.normal_force) < 1e-7, "{sweep} {small}");
            }
        }
    }
}

/// Truth: case `str-aspect-ratio`. Runs with flat elements or elongated grid cells pass the audit for aspect ratios up to 1000.
/// Runs with slender elements pass the audit up to 10. Beyond 10 they may stop at the iteration limit.
#[test]
fn aspect_ratios() {
    for case in sweeps::aspect_ratios() {
        if let Verdict::NotConverged(reason, _) = ended(&case) {
            assert_eq!(reason, Divergence::Iterations, "{}", case.name());
        }
    }
}

/// Truth: runs on frames of 1 x 1 to 2048 x 2 cells pass the audit. A frame without cells is refused.
#[test]
fn frames_of_few_cells() {
    sweeps::frames().iter().for_each(|case| drop(ended(case)));
}

/// Truth: case `str-zero-load`. Without prescribed loads all results are exactly zero. Runs reach prescribed forces down to
/// 1e-99: normal forces to 1e-10, tangential forces to 1e-7 of the normal force. Displacements down to 1e-99 change no force by
/// more than 1e-6 of the normal force. Prescribed values of 5e-324, the smallest double, are refused.
#[test]
fn nothing_and_next_to_nothing() {
    let cases = sweeps::nothing();
    for case in &cases {
        let run = match ended(case) {
            Verdict::Certified(run) => run,
            Verdict::Refused(message) => {
                assert!(message.contains("5e-324") && message.contains("1e-100"), "{message}");
                continue;
            }
            Verdict::NotConverged(..) => unreachable!("ended() says so"),
        };
        let value: f64 = case.value.parse().expect("a number");
        if case.sweep == "force, pull" {
            for record in &run.records {
                assert!((record.normal_force - value).abs() <= 1e-10 * value, "{value}: {record:?}");
            }
            let pull = run.records[1].tangential_force;
            assert!(
                (pull[0] - 0.2 * value).abs() <= 1e-7 * value && pull[1].abs() <= 1e-7 * value,
                "{pull:?}"
            );
        }
        if value == 0.0 && case.sweep != "shift" {
            assert!(run.tractions.iter().all(|t| *t == 0.0), "{}", case.name());
            assert!(run.records.iter().all(|record| record.contact_area == 0.0 && record.dissipation == 0.0));
        }
    }
    let shifts = runs(&cases, "shift");
    for (value, run) in &shifts {
        let apart = super::apart(run, of(&shifts, "0.0"));
        assert!(apart < 1e-6, "shift {value}: {apart:e}");
    }
}

/// Truth: 60 random scenes (every third one without `--thorough`) pass the audit or report a reason. Allowed reasons are gross
/// sliding, lost contact with zero normal force, and, in at most one of ten scenes, the iteration limit.
#[test]
fn drawn_scenes() {
    let cases: Vec<_> = sweeps::drawn().into_iter().step_by(usual_or_finest(3, 1)).collect();
    assert!(cases.iter().all(|case| case.end == End::Honest));
    let mut unsolved = 0;
    for case in &cases {
        if let Verdict::NotConverged(reason, run) = ended(case) {
            assert!(
                [Divergence::Iterations, Divergence::GrossSliding, Divergence::ContactLost].contains(&reason),
                "{reason:?}"
            );
            unsolved += usize::from(reason == Divergence::Iterations);
            let last = run.records.last().expect("a record");
            assert!(
                reason != Divergence::ContactLost || last.normal_force == 0.0,
                "{}: {last:?}",
                case.name()
            );
        }
    }
    assert!(10 * unsolved <= cases.len(), "{unsolved} of {} without an answer", cases.len());
}
