//! Cycles resolved now and then, which say what wears between the ends that are solved together.

use orthowear::contact::SolverOptions;
use orthowear::history::RunResult;
use orthowear::history::record::Outcome;
use orthowear::history::step::{Integrator, Jumps, Step};

use crate::common::{fretting, frp_wear, indent, path_of, press, relative, solve, solve_with, sphere_on_frp};

/// Cycles of the reference scene on coarser cells: so many increments per stroke, or those and resolved cycles.
fn reference_scene(tilt: f64, mut cycles: Step, increments: usize, resolve: Option<f64>) -> RunResult {
    let path = path_of(&mut cycles);
    (path.increments, path.resolve) = (increments, resolve);
    let mut model = sphere_on_frp(tilt, 1.5, 32);
    model.wear = frp_wear(tilt);
    let run = solve(&model, &[indent(0.02), cycles]);
    assert_eq!(run.outcome, Outcome::Converged);
    run
}

/// Truth: all ends of 16 increments per stroke solved together in every stage (what wears in a step by its tolerance, against the
/// 0.25 % less that they wear than single increments at tilt 90, and the nothing at tilt 0), and the volume by the friction energy.
#[test]
fn factors_stand_for_ends_between() {
    for (tilt, least) in [(0.0, 0.0), (90.0, 1.5e-3)] {
        let volume = |increments: usize, resolve: Option<f64>| {
            let cycles = fretting(100_000, 0.08, 4, Integrator::Sdirk2);
            let run = reference_scene(tilt, cycles, increments, resolve);
            let last = run.records.last().expect("records").clone();
            (last.worn_volume, last.worn_volume_by_energy.expect("wear follows friction"))
        };
        let ((alone, _), (together, _)) = (volume(1, None), volume(16, None));
        let (found, by_energy) = volume(1, Some(1e-3));
        assert!(relative(together, alone) >= least, "tilt {tilt}: {together} {alone}");
        assert!(relative(found, together) < 1e-3, "tilt {tilt}: {found} {together}");
        assert!(relative(found, by_energy) < 1.5e-3, "tilt {tilt}: {found} {by_energy}");
    }
}

/// Truth: resolved strokes wear 0.4 % less per cycle than single increments at tilt 90, at the start (an independent program).
#[test]
fn rate_of_resolved_strokes() {
    let rate = |resolve: Option<f64>| {
        let run = reference_scene(90.0, fretting(1, 0.08, 1, Integrator::BackwardEuler), 1, resolve);
        run.records[1].worn_volume - run.records[0].worn_volume
    };
    let change = rate(Some(5e-4)) / rate(None) - 1.0;
    assert!((-0.0047..-0.0033).contains(&change), "{change}");
}

/// Truth: where the slip from end to end stands still, under a constant force and with next to no wear, one resolved cycle is enough;
/// where wear takes the load away at tilt 90 it is not. Increments per stroke are at least twice those between the ends.
#[test]
fn a_cycle_is_resolved_where_slip_has_changed() {
    let resolved = |first: Step, count: u64| -> Vec<Option<usize>> {
        let mut cycles = fretting(count, 0.08, 4, Integrator::Sdirk2);
        path_of(&mut cycles).resolve = Some(1e-3);
        let mut model = sphere_on_frp(90.0, 1.5, 32);
        model.wear = frp_wear(90.0);
        let run = solve(&model, &[first, cycles]);
        assert_eq!(run.outcome, Outcome::Converged);
        run.records.iter().filter_map(|record| record.jump).map(|jump| jump.resolved).collect()
    };
    let still = resolved(press(300.0), 40);
    assert!(still[0].is_some_and(|increments| increments >= 2), "{still:?}");
    assert_eq!(still[1..], [None; 3]);
    let moving = resolved(indent(0.02), 100_000);
    assert!(moving.iter().all(Option::is_some), "{moving:?}");
}

/// Truth: what the drift of the factors makes of the worn volume is part of its estimated error: the one of few jumps covers the
/// distance to many.
#[test]
fn drift_is_in_the_estimated_error() {
    let run = |jumps: usize| {
        let run = reference_scene(90.0, fretting(100_000, 0.08, jumps, Integrator::Sdirk2), 1, Some(1e-3));
        run.records.last().expect("records").clone()
    };
    let (few, many) = (run(4), run(24));
    let error = (few.worn_volume - many.worn_volume).abs();
    assert!((0.2..5.0).contains(&(few.worn_volume_error / error)), "{} {error}", few.worn_volume_error);
}

/// Truth: bits do not depend on a resolved cycle that finds nothing new: without wear there is none.
#[test]
fn nothing_is_resolved_without_wear() {
    let run = |resolve: Option<f64>| {
        let mut cycles = fretting(1000, 0.08, 2, Integrator::Sdirk2);
        path_of(&mut cycles).resolve = resolve;
        let steps = [indent(0.02), Step { wear: false, ..cycles }];
        let result = solve_with(&sphere_on_frp(30.0, 1.5, 16), &steps, &SolverOptions::default());
        let jumps = result.records.iter().filter_map(|record| record.jump).collect::<Vec<_>>();
        (result.state.tractions, jumps)
    };
    assert_eq!(run(Some(1e-3)), run(None));
}

/// Truth: controlled jumps with resolved cycles converge, and their volume is within the tolerance of many jumps with all ends
/// solved together.
#[test]
fn controlled_jumps_with_resolved_cycles() {
    let mut cycles = fretting(100_000, 0.08, 1, Integrator::Sdirk2);
    cycles.cycles.as_mut().expect("cycles").jumps = Jumps::Tolerance(1e-3);
    let found = reference_scene(90.0, cycles, 1, Some(1e-3));
    let together = reference_scene(90.0, fretting(100_000, 0.08, 16, Integrator::Sdirk2), 8, None);
    let volume = |run: &RunResult| run.records.last().expect("records").worn_volume;
    assert!(relative(volume(&found), volume(&together)) < 2e-3, "{} {}", volume(&found), volume(&together));
}
