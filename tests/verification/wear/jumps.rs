//! Jumps in unusual states: contact at zero approach, no contact, tolerances out of reach, weight of a body.

use orthowear::body::rigid_body_modes::RigidBodyMode;
use orthowear::body::{BodyLoad, LoadCase, UnconstrainedModes};
use orthowear::contact::SolverOptions;
use orthowear::error::{Error, Result};
use orthowear::evolution::observer::{CheckpointEvent, Observer};
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::evolution::step::{Integrator, JumpPolicy, Normal, Step, Tilt};
use orthowear::evolution::{Model, RunCheckpoint, run};
use orthowear::geometry::Side;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

use super::sliding::{half_space, press, slide_to};
use crate::common::{Silent, fretting, indent, relative, solve, sphere, step};

const MU: f64 = 0.4;

/// Observer that ends the run with an error after `entries` entries.
#[derive(Default)]
struct Kept {
    entries: usize,
    records: Vec<IncrementRecord>,
    warnings: String,
}

impl Observer for Kept {
    fn increment_done(&mut self, record: &IncrementRecord, _: &FrameState) -> Result<()> {
        self.records.push(record.clone());
        if self.records.len() < self.entries { Ok(()) } else { Err(Error::numerical("enough entries")) }
    }

    fn on_checkpoint(&mut self, _: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        self.warnings = serde_json::to_value(snapshot()).expect("JSON")["warnings"].to_string();
        Ok(())
    }
}

fn rubbed_sphere(i: f64, frame: (f64, usize), radius: f64) -> Model {
    let mut model = half_space(1e5, frame, sphere(radius));
    (model.friction, model.wear) = (FrictionLaw::Coulomb { mu: MU }, WearLaw::Archard { i });
    model
}

fn controlled(count: u64, amplitude: f64, tolerance: f64) -> Step {
    let mut step = fretting(count, amplitude, 1, Integrator::Sdirk2);
    step.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(tolerance);
    step
}

/// Truth: a step computes all of its cycles, in jumps of at least one cycle. This also holds for contact at zero approach.
#[test]
fn contact_at_an_approach_of_zero_wears_through_all_cycles() {
    let model = rubbed_sphere(1e-8, (0.6, 16), 20.0);
    let turned =
        Step { normal: Some(Normal::Approach(0.0)), tilt: Some(Tilt::Rotation([0.01, 0.0])), ..step("turn") };
    let mut kept = Kept { entries: 200, ..Kept::default() };
    let steps = [turned, controlled(1000, 0.02, 1e-3)];
    let result = run(&model, &steps, &SolverOptions::default(), None, &mut kept);
    let result = result.expect("a run of few jumps");
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    assert!(result.records[0].approach == 0.0 && result.records[0].normal_force > 0.0);
    let last = result.records.last().expect("records");
    assert!(last.cycles_done == 1000 && last.worn_volume > 0.0, "{last:?}");
    assert!(result.records.iter().filter_map(|record| record.jump).all(|jump| jump.length >= 1.0));
}

/// Truth: without contact there is no wear.
#[test]
fn fretting_without_contact_converges_without_wear() {
    for jumps in [JumpPolicy::Tolerance(1e-3), JumpPolicy::Number(2)] {
        let mut cycles = controlled(10, 0.002, 1e-3);
        cycles.kind.cycles_mut().expect("cycles").jumps = jumps;
        let result = solve(&rubbed_sphere(1e-8, (0.4, 16), 10.0), &[indent(-0.001), cycles]);
        assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
        let last = result.records.last().expect("records");
        assert_eq!((last.cycles_done, last.worn_volume, last.normal_force), (10, 0.0, 0.0));
        assert_eq!(last.certificate.natural_residual, 0.0);
        for (k, note) in result.warnings.iter().enumerate() {
            assert!(!result.warnings[..k].contains(note), "twice: {note}");
        }
        assert!(
            result
                .warnings
                .iter()
                .any(|note| note.contains("\"fretting\" (1): the bodies are not in contact"))
        );
        assert!(
            !result.warnings.iter().any(|note| note.contains("a millionth of its initial value")),
            "{:?}",
            result.warnings
        );
    }
}

/// Truth: a step that starts without contact gives a single warning for all its increments.
#[test]
fn steps_in_the_air_are_noted_once() {
    let step = Step { increments: 4, ..indent(-0.001) };
    let result = solve(&rubbed_sphere(1e-8, (0.4, 16), 10.0), &[step]);
    assert_eq!(result.records.len(), 4);
    assert_eq!(
        result.warnings.iter().filter(|note| note.contains("the bodies are not in contact")).count(),
        1
    );
}

/// Truth: explicit jumps are stable up to 2 λ_min(S_nn) / D cycles (docs/theory-wear.md). S_nn is the normal flexibility, D is
/// the wear depth per pressure and cycle. For i = 1e-3 this limit is less than one cycle.
#[test]
fn a_cycle_may_be_too_long_for_an_explicit_jump() {
    let run_with = |jumps: JumpPolicy| {
        let mut step = controlled(10, 0.01, 1e-3);
        let cycles = step.kind.cycles_mut().expect("cycles");
        (cycles.jumps, cycles.integrator) = (jumps, Integrator::Explicit);
        let steps = [indent(0.005), step];
        let model = rubbed_sphere(1e-3, (1.0, 16), 50.0);
        run(&model, &steps, &SolverOptions::default(), None, &mut Silent)
    };
    let error = run_with(JumpPolicy::Number(2)).expect_err("unstable").to_string();
    assert!(error.contains("at least one cycle") && !error.contains("jumps or more"), "{error}");
    let result = run_with(JumpPolicy::Tolerance(1e-3)).expect("a run of jumps of a cycle");
    let unstable =
        |note: &&String| note.contains("longer than the stability limit") && note.starts_with("WARNING");
    assert!(result.warnings.iter().any(|note| unstable(&note)), "{:?}", result.warnings);
}

/// Truth: a jump is repeated with a shorter length while its error exceeds the tolerance (docs/theory-wear.md). A tolerance of
/// 1e-25 is below the rounding errors of the wear rates, so no length meets this tolerance.
#[test]
fn jumps_above_the_tolerance_are_warned_of() {
    let warned = |tolerance: f64| {
        let steps = [indent(0.005), controlled(1_000_000_000_000_000, 0.02, tolerance)];
        let mut kept = Kept { entries: 5, ..Kept::default() };
        let _ =
            run(&rubbed_sphere(1e-20, (0.6, 12), 20.0), &steps, &SolverOptions::default(), None, &mut kept);
        let jumps = kept.records.iter().filter_map(|record| record.jump);
        (
            jumps.map(|jump| jump.rejected).max(),
            kept.warnings.matches("times the limit set by wear.tolerance").count(),
        )
    };
    assert_eq!(warned(1e-25), (Some(12), 1));
    let (rejected, count) = warned(1e-2);
    assert!(rejected < Some(12) && count == 0, "{rejected:?} {count}");
}

/// Truth: the weight of a body that is unconstrained along n acts as a prescribed force of the same size. Both runs therefore
/// take the same jumps.
#[test]
fn own_loads_and_prescribed_forces_take_the_same_jumps() {
    let force = 200.0;
    let run_with = |floats: bool| {
        let mut model = rubbed_sphere(1e-8, (1.0, 16), 20.0);
        let n = model.frame.n_cells();
        if floats {
            let gap = (0..3 * n).map(|k| f64::from(u8::from(k >= 2 * n))).collect();
            let relative_motion = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
            let modes = vec![RigidBodyMode { relative_motion, gap, load_work: vec![-force] }];
            model.loads.push(BodyLoad {
                side: Some(Side::Upper),
                case: LoadCase::default(),
                gap: vec![0.0; 3 * n],
            });
            model.floating.push(UnconstrainedModes {
                side: Side::Upper,
                modes,
                names: vec!["translation z".to_owned()],
            });
        }
        let first = if floats { Step { wear: false, ..step("press") } } else { press(force) };
        // Wear is small: the final wear depth is 4e-3 of the approach.
        let result = solve(&model, &[first, slide_to(20.0, 1e-5)]);
        assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
        let last = result.records.last().expect("records");
        assert!(relative(last.normal_force, force) < 1e-7, "{}", last.normal_force);
        println!("{} of {}", last.max_wear_depth, last.approach);
        result.records.iter().filter_map(|record| record.jump).map(|jump| jump.length).collect::<Vec<_>>()
    };
    let [held, floats] = [false, true].map(run_with);
    println!("{held:?} {floats:?}");
    assert!(held.len() > 3 && held.len() == floats.len(), "{held:?} {floats:?}");
    assert!(held.iter().zip(&floats).all(|(a, b)| relative(*a, *b) < 1e-4), "{held:?} {floats:?}");
}
