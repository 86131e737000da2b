//! Runs whose contact reaches the edge of the frame and which continue on a larger frame.

use orthowear::contact::SolverOptions;
use orthowear::error::Result;
use orthowear::evolution::observer::{CheckpointEvent, Observer};
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::evolution::step::{Integrator, Step};
use orthowear::evolution::{FRAME_EDGE, Model, RunCheckpoint, RunResult, Suspended, run};
use orthowear::laws::wear::WearLaw;
use serde_json::Value;

use super::sliding::{half_space, last, press, slide_to};
use crate::common::{Silent, fretting, frp_wear, indent, relative, shift, solve, sphere, sphere_on_frp};

fn places(model: &Model, larger: &Model) -> Vec<usize> {
    model.frame.grid.expect("a grid").indices_in(&larger.frame.grid.expect("a grid"))
}

/// Runs the steps on the first model. Each time the contact reaches the edge of the frame, the run continues on the next model.
/// Returns the result and the number of models used.
fn growing(models: &[Model], steps: &[Step]) -> (RunResult, usize) {
    let options = SolverOptions::default();
    let mut result = solve(&models[0], steps);
    let mut taken = 1;
    while let Some(Suspended::FrameEdge(snapshot)) = result.suspended.take() {
        assert_eq!(result.outcome, FRAME_EDGE);
        let places = places(&models[taken - 1], &models[taken]);
        let snapshot = snapshot.transfer_to(&places, &models[taken], steps, None).expect("a state");
        result = run(&models[taken], steps, &options, Some(snapshot), &mut Silent).expect("a run");
        taken += 1;
    }
    (result, taken)
}

/// Truth: case `wear-sphere-elastic` of docs/verification.md. It gives contact radius a, approach, and pressure and wear depth at
/// the centre, at the dimensionless sliding distances τ = 1 and 10. The initial half-width of the frame is 1.35 times the unworn
/// contact radius a0. The contact reaches the edge of a frame once before τ = 1 (a / a0 = 1.408). Before τ = 10 (a / a0 = 2.31)
/// it does so twice.
#[test]
fn elastic_sphere() {
    let (radius, e_star) = (100.0, 1e5);
    let force = 4.0 * e_star / (3.0 * radius);
    let (p0, delta0) = (1.5 * force / std::f64::consts::PI, 1.0 / radius);
    for (tau, frames, [a, p, h, delta]) in
        [(1.0, 2, [1.408, 0.4656, 0.6786, 1.3561]), (10.0, 3, [2.31, 0.1308, 2.5229, 2.8966])]
    {
        let models = [(1.35, 48), (2.025, 72), (2.7, 96)].map(|frame| {
            let mut model = half_space(e_star, frame, sphere(radius));
            model.wear = WearLaw::Archard { i: 1e-8 };
            model
        });
        let steps = [press(force), slide_to(tau * delta0 / (1e-8 * p0), 1e-3)];
        let (run, taken) = growing(&models, &steps);
        assert_eq!(taken, frames, "{tau}");
        let cells = 24 * (taken + 1);
        let middle = cells / 2 * cells + cells / 2;
        let record = last(&run);
        let found = (record.contact_area / std::f64::consts::PI).sqrt();
        assert!((found - a).abs() < 0.0563, "{found} {a}");
        let pressure = run.state.tractions[2 * cells * cells + middle];
        assert!(relative(pressure / p0, p) < 1e-2, "{} {p}", pressure / p0);
        assert!(relative(run.state.wear_depth[middle] / delta0, h) < 1e-2);
        assert!(relative(record.approach / delta0, delta) < 1e-2, "{} {delta}", record.approach / delta0);
        assert!(!run.records.iter().any(|record| record.contact_touches_edge));
    }
}

/// Models on a small and a large frame, and steps. The steps are an indentation, fretting until the contact outgrows the small
/// frame, and a tangential displacement along y.
fn fretted(amplitude: f64, cycles: u64) -> ([Model; 2], [Step; 3]) {
    let models = [(1.2, 16), (1.8, 24)].map(|(half_width, cells)| {
        let mut model = sphere_on_frp(30.0, half_width, cells);
        model.wear = frp_wear(30.0);
        model
    });
    let across = Step { wear: false, ..shift(0.004, 90.0) };
    (models, [indent(0.02), fretting(cycles, amplitude, 8, Integrator::Sdirk2), across])
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    let largest = b.iter().fold(0.0_f64, |largest, b| largest.max(b.abs()));
    a.iter().zip(b).fold(0.0_f64, |apart, (a, b)| apart.max((a - b).abs())) / largest
}

/// Relative tolerance of fields in partial slip. The stick zone follows from strokes, whose accuracy limits the accuracy of these
/// fields.
const STROKES: f64 = 1e-6;

/// Truth: a run on the large frame from the start. The run continued on this frame has the same jumps. Forces, contact area,
/// dissipation and wear volume agree to 1e-7. Fields agree to 1e-7 in gross slip and to [`STROKES`] in partial slip.
#[test]
fn as_on_the_large_frame_from_the_start() {
    // In the last case the contact reaches the edge during the first jump.
    for (amplitude, cycles, tolerance) in
        [(0.004, 10_000_000, STROKES), (0.08, 300_000, 1e-7), (0.008, 12_000_000, STROKES)]
    {
        let (models, steps) = fretted(amplitude, cycles);
        let (run, taken) = growing(&models, &steps);
        let whole = solve(&models[1], &steps);
        assert_eq!((taken, &run.outcome, &whole.outcome), (2, &Outcome::Converged, &Outcome::Converged));
        assert_eq!(run.records.len(), whole.records.len());
        for (found, wanted) in run.records.iter().zip(&whole.records) {
            let length = |record: &IncrementRecord| record.jump.map(|jump| jump.length);
            assert_eq!((length(found), found.cycles_done), (length(wanted), wanted.cycles_done));
            for (a, b) in [
                (found.normal_force, wanted.normal_force),
                (found.contact_area, wanted.contact_area),
                (found.dissipation, wanted.dissipation),
            ] {
                assert!(a == b || relative(a, b) < 1e-7, "{amplitude}, {}: {a} {b}", found.increment);
            }
            let [a, b] = [found, wanted].map(|record| record.worn_volume);
            assert!(a == b || relative(a, b) < 1e-7, "{amplitude}: {a} {b}");
        }
        let [a, b] = [&run.state, &whole.state];
        for (a, b) in [(&a.tractions, &b.tractions), (&a.wear_depth, &b.wear_depth), (&a.gap, &b.gap)] {
            assert!(apart(a, b) < tolerance, "{amplitude}: {:e}", apart(a, b));
        }
    }
}

struct States(Vec<RunCheckpoint>);

impl Observer for States {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        Ok(())
    }

    fn on_checkpoint(&mut self, moment: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        if moment == CheckpointEvent::Entry {
            self.0.push(snapshot());
        }
        Ok(())
    }
}

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .expect("an array")
        .iter()
        .map(|x| x.as_f64().or(x.as_bool().map(f64::from)).expect("a number"))
        .collect()
}

/// Truth: in the cells of the smaller frame, the transfer to the larger frame does not change the fields, bit by bit. New cells
/// have no wear and no traction. Their tangential gap and elastic displacement agree with the run on the large frame, to 1e-7.
#[test]
fn states_are_carried_over() {
    let (models, steps) = fretted(0.004, 10_000_000);
    let options = SolverOptions::default();
    let stopped = solve(&models[0], &steps);
    let mut states = States(Vec::new());
    run(&models[1], &steps, &options, None, &mut states).expect("a run");
    let entries = stopped.records.len();
    let same = states.0.into_iter().find(|state| state.records().len() == entries).expect("an entry");
    let snapshot = stopped.suspended.expect("a state").into_checkpoint();
    let places = places(&models[0], &models[1]);
    let larger = snapshot.clone().transfer_to(&places, &models[1], &steps, None).expect("a state");
    let [before, after, same] =
        [snapshot, larger, same].map(|state| serde_json::to_value(state).expect("JSON"));
    let (n_before, n) = (16 * 16, 24 * 24);
    let new: Vec<usize> = (0..n).filter(|cell| !places.contains(cell)).collect();
    let fields = [
        ("/state/tractions", true),
        ("/state/wear_depth", true),
        ("/state/depth_errors", true),
        ("/state/elastic", false),
        ("/state/slip_reference", false),
        ("/progress/WearStep/cycle/contact/scaled", true),
        ("/progress/WearStep/cycle/stick_zone/mask", true),
        ("/progress/WearStep/cycle/stick_zone/gap", false),
        ("/progress/WearStep/wear_rate", true),
    ];
    for (name, nothing) in fields {
        let [old, carried, wanted] = [&before, &after, &same]
            .map(|state| numbers(state.pointer(name).unwrap_or_else(|| panic!("no {name}"))));
        let planes = old.len() / n_before;
        assert_eq!(carried.len(), planes * n, "{name}");
        let largest = wanted.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        for plane in 0..planes {
            for (cell, &place) in places.iter().enumerate() {
                let [a, b] = [carried[plane * n + place], old[plane * n_before + cell]].map(f64::to_bits);
                assert_eq!(a, b, "{name}: plane {plane} of cell {cell}");
            }
            // New cells do not stick, so their stick gap has no effect.
            for &cell in new.iter().filter(|_| !name.ends_with("/stick_zone/gap")) {
                let [a, b] = [&carried, &wanted].map(|field| field[plane * n + cell]);
                assert!(!nothing || (a == 0.0 && b == 0.0), "{name}: plane {plane} of cell {cell}");
                assert!((a - b).abs() <= 1e-7 * largest, "{name}: plane {plane} of cell {cell}: {a} {b}");
            }
        }
    }
    for same in [
        "/state/rigid_motion",
        "/state/cycles_done",
        "/state/dissipation",
        "/progress/WearStep/completed",
        "/progress/WearStep/step_controller",
    ] {
        assert_eq!(before.pointer(same), after.pointer(same), "{same}");
        assert!(after.pointer(same).is_some(), "{same}");
    }
    assert!(larger_misfits(&models, &steps), "a state of another frame");
}

fn larger_misfits(models: &[Model; 2], steps: &[Step]) -> bool {
    let snapshot = solve(&models[0], steps).suspended.expect("a state").into_checkpoint();
    let short = vec![0; 10];
    let beyond = vec![24 * 24; 16 * 16];
    snapshot.clone().transfer_to(&short, &models[1], steps, None).is_err()
        && snapshot.transfer_to(&beyond, &models[1], steps, None).is_err()
}

/// Truth: each discarded jump adds its computational work (solves, iterations, operator applications) once to the next entry.
/// This also holds if the discarded jump is the first jump of the step.
#[test]
fn each_jump_tried_again_adds_its_work_once() {
    let options = SolverOptions::default();
    for (amplitude, cycles) in [(0.004, 10_000_000), (0.008, 12_000_000)] {
        let (models, steps) = fretted(amplitude, cycles);
        let places = places(&models[0], &models[1]);
        let same: Vec<usize> = (0..models[0].frame.n_cells()).collect();
        let work_after = |tries: usize| {
            let mut snapshot = solve(&models[0], &steps).suspended.expect("a state").into_checkpoint();
            for _ in 1..tries {
                let again = snapshot.transfer_to(&same, &models[0], &steps, None).expect("a state");
                let stopped = run(&models[0], &steps, &options, Some(again), &mut Silent).expect("a run");
                snapshot = stopped.suspended.expect("a state").into_checkpoint();
            }
            let snapshot = snapshot.transfer_to(&places, &models[1], &steps, None).expect("a state");
            let whole = run(&models[1], &steps, &options, Some(snapshot), &mut Silent).expect("a run");
            let jumps = whole.records.iter().filter(|record| record.jump.is_some());
            jumps.fold([0; 3], |[solves, iterations, applications], record| {
                let jump = record.jump.expect("a jump");
                [
                    solves + jump.solves,
                    iterations + record.iterations,
                    applications + record.operator_applications,
                ]
            })
        };
        let [once, twice, thrice] = [1, 2, 3].map(work_after);
        for (what, k) in [("solves", 0), ("iterations", 1), ("applications", 2)] {
            assert!(twice[k] > once[k], "{amplitude}, {what}: {} {}", twice[k], once[k]);
            assert_eq!(thrice[k] - twice[k], twice[k] - once[k], "{amplitude}, {what}");
        }
    }
}
