//! Jump lengths that follow from estimated errors, and limits on jump lengths.

use orthowear::contact::SolverOptions;
use orthowear::evolution::RunResult;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Integrator, JumpPolicy, Step};

use crate::common::{
    fretting, frp_wear, indent, path_of, reference, relative, solve, solve_with, sphere_on_frp,
};

fn controlled(tolerance: f64) -> Step {
    let mut step = fretting(100_000, 0.08, 1, Integrator::Sdirk2);
    step.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(tolerance);
    step
}

fn reference_scene(tilt: f64, cells: usize, cycles: Step) -> RunResult {
    let mut model = sphere_on_frp(tilt, 1.5, cells);
    model.wear = frp_wear(tilt);
    solve(&model, &[indent(0.02), cycles])
}

/// Truth: an independent program with incremental slip and one increment per stroke. Wear volume, load and largest wear depth
/// after 100 000 cycles agree to 2e-3 at the default tolerance. The run takes at most 40 contact solutions.
#[test]
fn default_tolerance_meets_the_reference() {
    let data = reference();
    for tilt in ["0", "90"] {
        let case = &data["wear"][tilt];
        let result = reference_scene(tilt.parse().expect("a number"), 64, controlled(1e-3));
        assert_eq!(result.outcome, Outcome::Converged);
        let last = result.records.last().expect("records");
        assert_eq!(last.cycles_done, 100_000);
        for (name, found) in
            [("V", last.worn_volume), ("P_end", last.normal_force), ("wmax", last.max_wear_depth)]
        {
            let wanted = case[name].as_f64().expect("a number");
            assert!(relative(found, wanted) < 2e-3, "tilt {tilt}, {name}: {found} {wanted}");
        }
        let solves: usize = result.records.iter().filter_map(|r| r.jump).map(|jump| jump.solves).sum();
        assert!(solves <= 40, "tilt {tilt}: {solves} solves");
        let by_energy = last.worn_volume_by_energy.expect("wear follows friction");
        assert!(relative(by_energy, last.worn_volume) < 1e-10, "{by_energy} {}", last.worn_volume);
    }
}

/// Root mean square of `a` - `b` over the cells where `b` is positive.
fn mean_square(a: &[f64], b: &[f64]) -> f64 {
    let worn: Vec<f64> = a.iter().zip(b).filter(|(_, b)| **b > 0.0).map(|(a, b)| (a - b).powi(2)).collect();
    (worn.iter().sum::<f64>() / worn.len() as f64).sqrt()
}

/// Truth: a run with 96 jumps. The root-mean-square error of the wear depth is below the tolerance times the largest wear depth.
/// The ratio of estimated to actual error is between 0.2 and 5.
#[test]
fn estimates_are_near_the_errors() {
    for tilt in [0.0, 90.0] {
        let fine = reference_scene(tilt, 32, fretting(100_000, 0.08, 96, Integrator::Sdirk2));
        let deepest = fine.records.last().expect("records").max_wear_depth;
        for tolerance in [1e-2, 1e-3] {
            let run = reference_scene(tilt, 32, controlled(tolerance));
            let error = mean_square(&run.state.wear_depth, &fine.state.wear_depth);
            assert!(error < tolerance * deepest, "tilt {tilt}: {error:e} of {deepest:e} at {tolerance:e}");
            let estimate = run.records.last().expect("records").wear_depth_error;
            let ratio = estimate / error;
            assert!((0.2..5.0).contains(&ratio), "tilt {tilt}, {tolerance:e}: {estimate:e} for {error:e}");
        }
    }
}

/// Truth: implicit jumps together complete all cycles, in whole numbers of cycles. Explicit jumps do not exceed the critical
/// length.
#[test]
fn jumps_fill_the_cycles() {
    let run = reference_scene(0.0, 16, controlled(1e-2));
    let lengths: Vec<f64> =
        run.records.iter().filter_map(|record| record.jump).map(|jump| jump.length).collect();
    assert_eq!(lengths.iter().sum::<f64>(), 100_000.0);
    assert!(lengths.iter().all(|length| length.fract() == 0.0), "{lengths:?}");
    let mut explicit = controlled(1e-2);
    explicit.kind.cycles_mut().expect("cycles").integrator = Integrator::Explicit;
    let run = reference_scene(0.0, 16, explicit);
    let jumps: Vec<_> = run.records.iter().filter_map(|record| record.jump).collect();
    let critical = jumps[0].critical_length.expect("explicit jumps have one");
    assert!(jumps.iter().all(|jump| jump.length <= critical), "{jumps:?}");
}

/// Truth: contact problems are solved to residuals of 1e-8. A wear tolerance of 1e-12 is out of reach and gives a warning.
#[test]
fn tolerances_finer_than_contacts_are_solved() {
    for (tolerance, warned) in [(1e-12, true), (1e-2, false)] {
        let mut cycles = controlled(tolerance);
        cycles.kind.cycles_mut().expect("cycles").count = 2.0;
        let run = reference_scene(0.0, 16, cycles);
        let found = run
            .warnings
            .iter()
            .any(|warning| warning.contains("too small for the accuracy of the contact solution"));
        assert_eq!(found, warned, "{:?}", run.warnings);
    }
}

/// Truth: explicit jumps of more than 2 λ_min(S_nn) / D cycles are refused (docs/theory-wear.md). S_nn is the normal flexibility,
/// D is the wear depth per pressure and cycle. For D = 1.6e-10 mm/MPa this limit is 39 500 cycles. The actual D is smaller by the
/// elastic part of the stroke, and the actual limit is larger.
#[test]
fn explicit_jumps_have_a_critical_length() {
    let explicit = |count: u64, jumps: usize| fretting(count, 0.08, jumps, Integrator::Explicit);
    let run = reference_scene(0.0, 50, explicit(20_000, 1));
    let critical = run.records[1].jump.expect("a jump").critical_length.expect("an explicit one has it");
    assert!((39_500.0..44_000.0).contains(&critical), "{critical}");
    let mut model = sphere_on_frp(0.0, 1.5, 50);
    model.wear = frp_wear(0.0);
    let steps = [indent(0.02), explicit(100_000, 2)];
    let error = orthowear::evolution::run(
        &model,
        &steps,
        &SolverOptions::default(),
        None,
        &mut crate::common::Silent,
    )
    .expect_err("jumps beyond the critical one");
    assert!(error.to_string().contains("Take 3 jumps"), "{error}");
}

/// Truth: an independent program. 4 increments per stroke reduce the initial wear rate compared with 1 increment. At tilt 0 the
/// reduction is less than 1e-4, at tilt 90 about 0.3 %.
#[test]
fn strokes_in_several_increments() {
    for (tilt, range) in [(0.0, -1e-4..1e-4), (90.0, -0.0045..-0.0020)] {
        let rate = |increments: usize| {
            let mut cycle = fretting(1, 0.08, 1, Integrator::BackwardEuler);
            path_of(&mut cycle).increments = increments;
            let mut model = sphere_on_frp(tilt, 1.5, 32);
            model.wear = frp_wear(tilt);
            let run = solve_with(&model, &[indent(0.02), cycle], &SolverOptions::default());
            assert_eq!(run.outcome, Outcome::Converged);
            run.records[1].worn_volume - run.records[0].worn_volume
        };
        let change = rate(4) / rate(1) - 1.0;
        assert!(range.contains(&change), "tilt {tilt}: {change}");
    }
}
