//! Numerical stability at the limits of the parameters. Each run converges to a state that passes an independent audit, or
//! reports why it fails. docs/verification.md lists the named cases.

mod bounds;
mod ends;
pub mod random;
mod relations;
mod scenes;
mod step_sizes;
mod sweeps;
mod verdict;

use crate::audit;
use crate::mesh::writer;
use sweeps::{Case, End};
use verdict::{Run, Verdict};

fn ended(case: &Case) -> Verdict {
    let name = case.name();
    let verdict = verdict::run(&name, &case.scene, case.mesh.as_deref());
    match (&verdict, case.end) {
        (Verdict::Certified(_), End::Certified | End::Honest) | (Verdict::NotConverged(..), End::Honest) => {}
        (Verdict::Refused(message), End::Refused) => assert!(!message.is_empty(), "{name}"),
        (Verdict::Refused(message), _) => panic!("{name}: {message}"),
        (Verdict::NotConverged(reason, run), _) => panic!("{name}: {reason}, {:?}", run.records.last()),
        (Verdict::Certified(_), End::Refused) => panic!("{name} is not refused"),
    }
    verdict
}

fn runs<'c>(cases: &'c [Case], sweep: &str) -> Vec<(&'c str, Run)> {
    let of_sweep = cases.iter().filter(|case| case.sweep == sweep);
    let runs = of_sweep.filter_map(|case| match ended(case) {
        Verdict::Certified(run) => Some((case.value.as_str(), run)),
        _ => None,
    });
    let runs: Vec<_> = runs.collect();
    assert!(!runs.is_empty(), "{sweep}");
    runs
}

fn of<'r>(runs: &'r [(&str, Run)], value: &str) -> &'r Run {
    &runs.iter().find(|(known, _)| *known == value).unwrap_or_else(|| panic!("no run of {value}")).1
}

fn iterations(run: &Run) -> usize {
    run.records.iter().map(|record| record.iterations).sum()
}

/// Largest difference between the forces of two runs, divided by the normal force of `b`.
fn apart(a: &Run, b: &Run) -> f64 {
    assert_eq!(a.records.len(), b.records.len());
    let pairs = a.records.iter().zip(&b.records);
    let differences = pairs.map(|(a, b)| {
        let tangential = (0..2).map(|k| (a.tangential_force[k] - b.tangential_force[k]).abs());
        tangential.fold((a.normal_force - b.normal_force).abs(), f64::max) / b.normal_force
    });
    differences.fold(0.0, f64::max)
}
