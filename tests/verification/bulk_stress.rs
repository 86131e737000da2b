//! Bulk stress of half-spaces. Its strain displaces the surface, which causes slip if friction acts.

use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{HalfSpaceBody, LoadCase};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple};
use orthowear::error::Result;
use orthowear::evolution::observer::{CheckpointEvent, Observer};
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::evolution::step::{Drive, Integrator, Step, Tangential};
use orthowear::evolution::{Model, RunCheckpoint, RunResult, run};
use orthowear::frame::{ContactFrame, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::common::{Silent, fretting, im7, path_of, press, relative, solve_with, sphere, steel, step};
use crate::observed::{follow, pressure_times_path};

const NAME: &str = "bulk";

/// Two half-spaces with the contact gap `gap`. The body on `side` has the bulk `stress` as the load `NAME`.
fn model(
    [lower, upper]: [&Stiffness; 2],
    frame: ContactFrame,
    (side, stress): (Side, [f64; 3]),
    mu: f64,
    gap: impl Fn(f64, f64) -> f64,
) -> Model {
    let body = |stiffness, own| {
        let body = HalfSpaceBody::new(stiffness, own, &frame).expect("a half-space");
        if own == side {
            let case = LoadCase { name: Some(NAME.to_owned()), preload: false };
            body.with_bulk_stress(stress, case, &frame).expect("an admissible stress")
        } else {
            body
        }
    };
    let (mut lower, mut upper) = (body(lower, Side::Lower), body(upper, Side::Upper));
    let coupled =
        couple(&mut lower, &mut upper, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let distance: Vec<f64> = frame.centers.iter().map(|center| gap(center.x, center.y)).collect();
    let initial_gap = coupled.initial_gap(&distance);
    Model {
        frame,
        flexibility: coupled.flexibility,
        initial_gap,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::Coulomb { mu },
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

fn tight() -> SolverOptions {
    SolverOptions { tolerance: 1e-11, ..SolverOptions::default() }
}

fn pressed(force: f64) -> Step {
    Step {
        tangential: Some(Tangential::Force([0.0; 2])),
        loads: vec![(NAME.to_owned(), 0.0)],
        ..press(force)
    }
}

fn loaded(amplitude: f64) -> Step {
    Step { loads: vec![(NAME.to_owned(), amplitude)], ..step("bulk") }
}

fn pulled(force: f64) -> Step {
    Step { tangential: Some(Tangential::Force([force, 0.0])), ..step("pull") }
}

/// Line contact of equal cylinders: Young's modulus (MPa), Poisson's ratio, effective radius (mm), coefficient of friction μ,
/// load per length P (N/mm).
const E: f64 = 72.1e3;
const NU: f64 = 0.33;
const RADIUS: f64 = 50.0;
const MU: f64 = 0.65;
const LOAD: f64 = 135.75;
/// Hertz's peak pressure p0 (MPa), and the unit (μ p0 a)² / E* of the dissipation per length. Here a is half the contact width.
const PEAK: f64 = 186.98182456784932;
const DISSIPATION_UNIT: f64 = 0.07799878009579982;

fn line(cells: usize, share: f64, side: Side) -> Model {
    let material = Stiffness::isotropic(E, NU).expect("aluminium");
    let frame = ContactFrame::grid([0.6, 0.5], [cells, 1], [0.0; 2], 0.0).expect("a grid");
    let stress = share * PEAK;
    let gap = |x: f64, _| x * x / (2.0 * RADIUS);
    let bulk = (side, [stress, NU * stress, 0.0]);
    model([&material; 2], frame.with_periodicity([false, true]), bulk, MU, gap)
}

/// Dissipation of each step after the first step, divided by `DISSIPATION_UNIT`, and the numbers of cells at the end. The three
/// numbers count slip with positive traction, stick, and slip with negative traction along x.
fn legs(model: &Model, steps: &[Step]) -> (Vec<f64>, [usize; 3]) {
    let result = solve_with(model, steps, &tight());
    let end = |step: &Step| result.records.iter().rfind(|record| record.name == step.name).expect("a step");
    assert!(result.records.iter().all(|record| record.converged), "{:?}", result.outcome);
    let totals: Vec<f64> = steps.iter().map(|step| end(step).dissipation).collect();
    let state = &result.state;
    let count = |holds: &dyn Fn(usize) -> bool| (0..state.status.len()).filter(|&i| holds(i)).count();
    let slips = |i: usize| state.status[i] == 2;
    let cells = [
        count(&|i| slips(i) && state.tractions[i] > 0.0),
        count(&|i| state.status[i] == 1),
        count(&|i| slips(i) && state.tractions[i] < 0.0),
    ];
    (totals.windows(2).map(|pair| (pair[1] - pair[0]) / DISSIPATION_UNIT).collect(), cells)
}

/// Truth: an independent program with the same 64 cells. The tangential force Q = 0.5 μP and the bulk stress 0.4 μ p0 act
/// together or in either order. The test compares the dissipation of each step and the numbers of cells with backward slip, stick
/// and forward slip. Results with one and with ten increments agree.
#[test]
fn order_of_loads_in_line_contact() {
    let model = line(64, 0.4 * MU, Side::Lower);
    let force = 0.5 * MU * LOAD;
    let together = Step { loads: loaded(1.0).loads, ..pulled(force) };
    for increments in [1, 10] {
        let steps = |later: &[Step]| -> Vec<Step> {
            let later = later.iter().map(|step| Step { increments, ..step.clone() });
            std::iter::once(pressed(LOAD)).chain(later).collect()
        };
        for (steps, wanted, cells) in [
            (steps(std::slice::from_ref(&together)), vec![0.030344993279665], [0, 35, 15]),
            (steps(&[loaded(1.0), pulled(force)]), vec![0.000960524832768, 0.030344993279665], [0, 35, 15]),
            (steps(&[pulled(force), loaded(1.0)]), vec![0.022302439150419, 0.017515546544450], [1, 39, 10]),
        ] {
            let (found, status) = legs(&model, &steps);
            assert_eq!(status, cells, "{increments}");
            for (found, wanted) in found.iter().zip(&wanted) {
                assert!(relative(*found, *wanted) < 1e-6, "{increments}: {found} {wanted}");
            }
        }
    }
}

fn ball(lower: &Stiffness, stress: f64, cells: usize) -> Model {
    let frame = ContactFrame::grid([1.25; 2], [cells; 2], [0.0; 2], 0.0).expect("a grid");
    model([lower, &steel()], frame, (Side::Lower, [stress, 0.0, 0.0]), 0.5, sphere(50.0))
}

fn press_and_load(increments: usize) -> [Step; 2] {
    [pressed(200.0), Step { loads: loaded(1.0).loads, increments, ..pulled(50.0) }]
}

fn pressed_and_loaded(model: &Model, increments: usize) -> RunResult {
    solve_with(model, &press_and_load(increments), &tight())
}

/// Work of friction (N mm) in an increment, with the tractions at the end of the increment.
fn friction_work(frame: &ContactFrame, state: &FrameState) -> f64 {
    let n = frame.n_cells();
    let work = |i: usize| state.tractions[i] * state.slip[i] + state.tractions[n + i] * state.slip[n + i];
    -(0..n).map(|i| frame.areas[i] * work(i)).sum::<f64>()
}

/// Truth: an independent program with the same 32 x 32 cells and increments. A ball lies on IM7 with tilted fibres or on steel.
/// The bulk stress along x and a tangential force act together. The program computes the dissipation from the tractions at the
/// end of each increment.
#[test]
fn ball_on_a_strained_half_space() {
    for (lower, stress, increments, shift, approach, dissipation) in [
        (steel(), 100.0, 1, 0.0007359547584822511, 0.0032270342557311838, 0.001981615097219223),
        (im7(30.0), 100.0, 1, 0.006646733734524964, 0.0145684704871653, 0.09480206551282072),
        (im7(60.0), 50.0, 1, 0.009312376354767718, 0.0103063007503118, 0.06705583254920908),
        (im7(30.0), 100.0, 16, 0.006632652508353084, 0.0145722818231795, f64::NAN),
    ] {
        let model = ball(&lower, stress, 32);
        let (result, states) = follow(&model, &press_and_load(increments), &tight());
        let last = result.records.last().expect("records");
        assert!(relative(last.shift[0], shift) < 1e-7, "{} {shift}", last.shift[0]);
        assert!(relative(last.approach, approach) < 1e-7, "{} {approach}", last.approach);
        let found: f64 = states[1..].iter().map(|state| friction_work(&model.frame, state)).sum();
        assert!(dissipation.is_nan() || relative(found, dissipation) < 1e-6, "{found} {dissipation}");
        assert_eq!(last.loads[NAME], 1.0);
    }
}

/// Truth: the limit of the dissipation for many increments, extrapolated from the work with the pressures at the ends of the
/// increments. The error of this work is of first order. The run uses the mean pressures of the increments, and its error is less
/// than half as large. On tilted fibres the pressures change as the ball slides.
#[test]
fn dissipation_takes_mean_pressures() {
    let model = ball(&im7(30.0), 100.0, 32);
    let [coarse, fine, finer] = [4, 8, 16].map(|increments| {
        let (result, states) = follow(&model, &press_and_load(increments), &tight());
        let [first, last] = [result.records.first(), result.records.last()]
            .map(|record| record.expect("a record").dissipation);
        [last - first, states[1..].iter().map(|state| friction_work(&model.frame, state)).sum::<f64>()]
    });
    let limit = 2.0 * finer[1] - fine[1];
    let errors = [coarse, fine, finer].map(|found| found.map(|dissipation| dissipation / limit - 1.0));
    assert!(errors.iter().all(|[mean, end]| mean.abs() < 4e-3 && end.abs() > 2.0 * mean.abs()), "{errors:?}");
}

/// Truth: a closed form for equal spheres with Poisson's ratio 0 and shear modulus G, under a tangential force Q and a bulk
/// stress s. The stick disc has the radius c = a (1 - Q/μP)^(1/3) and is displaced by e = s a / (π μ p0). The tangential
/// displacement is π μ p0 / (4 G a) (2 (a² - c²) + e²). With 64 cells its error is below 0.6 times the error with 32 cells.
#[test]
fn moved_stick_disc() {
    let material = Stiffness::isotropic(210e3, 0.0).expect("a material");
    let (force, mu, stress) = (200.0_f64, 0.5, 100.0);
    let modulus = 210e3 / 2.0;
    let radius = (3.0 * force * 50.0 / (4.0 * modulus)).cbrt();
    let peak = 3.0 * force / (2.0 * std::f64::consts::PI * radius * radius);
    let stick = radius * (1.0 - 50.0 / (mu * force)).cbrt();
    let moved = stress * radius / (std::f64::consts::PI * mu * peak);
    let wanted = std::f64::consts::PI * mu * peak / (4.0 * 105e3 * radius)
        * (2.0 * (radius * radius - stick * stick) + moved * moved);
    let error = |cells: usize| {
        let frame = ContactFrame::grid([0.6; 2], [cells; 2], [0.0; 2], 0.0).expect("a grid");
        let bulk = (Side::Lower, [stress, 0.0, 0.0]);
        let model = model([&material; 2], frame, bulk, mu, sphere(50.0));
        let result = pressed_and_loaded(&model, 1);
        relative(result.records.last().expect("records").shift[0], wanted)
    };
    let (coarse, fine) = (error(32), error(64));
    assert!(fine < 3e-4 && fine < 0.6 * coarse, "{coarse} {fine}");
}

/// Truth: equal bulk stress in two bodies of one material strains both surfaces equally and has no effect. Bulk stress in body 2
/// acts as the opposite bulk stress in body 1.
#[test]
fn stress_of_both_bodies() {
    let force = 0.5 * MU * LOAD;
    let steps = [pressed(LOAD), loaded(1.0), pulled(force)];
    let (lower, _) = legs(&line(64, -0.4 * MU, Side::Lower), &steps);
    let (upper, _) = legs(&line(64, 0.4 * MU, Side::Upper), &steps);
    lower.iter().zip(&upper).for_each(|(lower, upper)| assert!(relative(*upper, *lower) < 1e-9));
    let (mut both, none) = (line(64, 0.4 * MU, Side::Lower), line(64, 0.0, Side::Lower));
    both.loads.extend(line(64, 0.4 * MU, Side::Upper).loads);
    let [both, none] = [both, none].map(|model| legs(&model, &steps).0);
    both.iter().zip(&none).for_each(|(both, none)| assert!((both - none).abs() < 1e-12, "{both} {none}"));
}

/// Cycles of a tangential force with a bulk stress in phase. Amplitudes and mean values are fractions of μP (force) and μ p0
/// (stress). Returns the dissipation per cycle, divided by `DISSIPATION_UNIT`, and the number of sticking cells at the + reversal
/// point.
fn cycle(cells: usize, [force, stress]: [f64; 2], mean: [f64; 2]) -> (f64, usize) {
    let model = line(cells, MU, Side::Lower);
    let [force, mean_force] = [force, mean[0]].map(|share| share * MU * LOAD);
    let mut fretting = fretting(2, force, 1, Integrator::Sdirk2);
    path_of(&mut fretting).drive = Drive::Force;
    fretting.cyclic_loads = vec![(NAME.to_owned(), stress)];
    let about = Step { loads: loaded(mean[1]).loads, ..pulled(mean_force) };
    let result = solve_with(&model, &[pressed(LOAD), about, fretting], &tight());
    let [before, last] = &result.records[result.records.len() - 2..] else { panic!("two records") };
    assert!(last.converged, "{:?}", result.outcome);
    let stick = last.stroke_ends.expect("reversal points")[0].stick_area / model.frame.areas[0];
    ((last.dissipation - before.dissipation) / (2.0 * DISSIPATION_UNIT), stick.round() as usize)
}

/// Truth: an independent program with 20 increments per stroke and the same cells. The dissipation of a steady-state cycle
/// depends on the amplitudes alone, not on the mean values. It is four times the dissipation of the first loading (Masing).
#[test]
fn cycles_in_phase() {
    for (cells, amplitudes, mean, wanted, stick) in [
        (128, [0.5, 0.2], [0.0, 0.0], 0.09680586224440099, Some(71)),
        (128, [0.5, 0.4], [0.0, 0.0], 0.1206331407149729, Some(70)),
        (256, [0.3, 0.2], [0.2, 0.1], 0.021452368292267345, None),
        (256, [0.5, 0.2], [0.0, 0.4], 0.09719150680892816, None),
    ] {
        let (found, stuck) = cycle(cells, amplitudes, mean);
        assert!(relative(found, wanted) < 1e-6, "{amplitudes:?} {mean:?}: {found} {wanted}");
        assert!(stick.is_none_or(|cells| stuck == cells), "{amplitudes:?}: {stuck}");
    }
    let model = line(128, 0.4 * MU, Side::Lower);
    let both = Step { loads: loaded(1.0).loads, ..pulled(0.5 * MU * LOAD) };
    let (first, _) = legs(&model, &[pressed(LOAD), both]);
    assert!(relative(cycle(128, [0.5, 0.4], [0.0; 2]).0, 4.0 * first[0]) < 1e-6, "{first:?}");
}

/// Truth: a steady-state cycle of a bulk stress alone dissipates four times as much as the first loading (Masing). Body 2 is
/// either fixed along x or free of tangential force. The results are equal, because the contact is symmetric.
#[test]
fn cycles_of_bulk_stress_alone() {
    let model = line(128, MU, Side::Lower);
    let stress = 0.8;
    let (first, _) = legs(&model, &[pressed(LOAD), loaded(stress)]);
    let dissipation = |drive: Drive| {
        let mut fretting = fretting(2, 0.0, 1, Integrator::Sdirk2);
        path_of(&mut fretting).drive = drive;
        fretting.cyclic_loads = vec![(NAME.to_owned(), stress)];
        let result = solve_with(&model, &[pressed(LOAD), loaded(0.0), fretting], &tight());
        let [before, last] = &result.records[result.records.len() - 2..] else { panic!("two records") };
        assert!(last.converged, "{:?}", result.outcome);
        let ends = last.stroke_ends.expect("reversal points");
        assert!(ends.iter().all(|end| end.tangential_force[0].abs() < 1e-6 * LOAD), "{ends:?}");
        (last.dissipation - before.dissipation) / (2.0 * DISSIPATION_UNIT)
    };
    let [held, free] = [Drive::Shift, Drive::Force].map(dissipation);
    println!("{held} {free} {first:?}");
    assert!(first[0] > 1e-3 && relative(held, 4.0 * first[0]) < 1e-4, "{held} {first:?}");
    assert!(relative(free, held) < 1e-6, "{held} {free}");
}

/// Truth: plain steps instead of a cycle. The tangential force of a centred ball stays zero up to rounding. The solver must
/// nevertheless recognise the steady state after the first cycles. The cycle dissipates as much as two plain steps, up to the
/// tolerance 1e-3 of the steady state.
#[test]
fn a_centred_ball_under_cycles_of_bulk_stress() {
    let aluminium = Stiffness::isotropic(E, NU).expect("aluminium");
    let model = ball(&aluminium, 100.0, 24);
    let mut fretting = fretting(10, 0.0, 1, Integrator::Sdirk2);
    fretting.cyclic_loads = vec![(NAME.to_owned(), 1.0)];
    let first = [pressed(200.0), Step { tangential: Some(Tangential::Shift([0.0; 2])), ..loaded(0.0) }];
    let strokes = (0..10).map(|k| loaded(if k % 2 == 0 { 1.0 } else { -1.0 }));
    let marched = solve_with(&model, &first.iter().cloned().chain(strokes).collect::<Vec<_>>(), &tight());
    let end = |back: usize| marched.records[marched.records.len() - 1 - back].dissipation;
    let result = solve_with(&model, &[&first[..], &[fretting]].concat(), &tight());
    assert!(!result.warnings.iter().any(|text| text.contains("steady-state")), "{:?}", result.warnings);
    let [before, last] = &result.records[result.records.len() - 2..] else { panic!("two records") };
    let found = (last.dissipation - before.dissipation) / 10.0;
    assert!(found > 0.0 && relative(found, end(0) - end(2)) < 1e-3, "{found} {}", end(0) - end(2));
}

/// Truth: strokes as plain steps, one after the other, up to a steady-state cycle. The dissipation of these steps is computed
/// from the states at the ends of the strokes, because increments and cycles treat opening cells differently. On tilted fibres
/// the two strokes have different stick zones. Body 2 therefore advances in every cycle, and no cell sticks through a cycle.
#[test]
fn ratcheting_in_phase() {
    let frame = ContactFrame::grid([0.95; 2], [16; 2], [0.0; 2], 0.0).expect("a grid");
    let bulk = (Side::Lower, [60.0, 10.0, 20.0]);
    let model = model([&im7(30.0), &steel()], frame, bulk, 0.5, sphere(50.0));
    let (center, amplitude, angle, stress) = ([-40.0, -15.0], 30.0, 15.0_f64.to_radians(), -0.8);
    let about = |share: f64| Step {
        tangential: Some(Tangential::Force([
            center[0] + share * amplitude * angle.cos(),
            center[1] + share * amplitude * angle.sin(),
        ])),
        ..loaded(0.3 + share * stress)
    };
    let first = [pressed(150.0), about(0.0)];
    let strokes = (0..24).map(|k| about(if k % 2 == 0 { 1.0 } else { -1.0 }));
    let (marched, states) =
        follow(&model, &first.iter().cloned().chain(strokes).collect::<Vec<_>>(), &tight());
    let last_cycle = &states[states.len() - 3..];
    let wanted = pressure_times_path(&model.frame, last_cycle, |slip| 0.5 * slip[0].hypot(slip[1]));
    let mut fretting = fretting(1, amplitude, 1, Integrator::Sdirk2);
    (path_of(&mut fretting).drive, path_of(&mut fretting).angle) = (Drive::Force, angle);
    fretting.cyclic_loads = vec![(NAME.to_owned(), stress)];
    let found = solve_with(&model, &[first.as_slice(), &[fretting]].concat(), &tight());
    let [before, last] = &found.records[found.records.len() - 2..] else { panic!("two records") };
    assert!(relative(last.dissipation - before.dissipation, wanted) < 1e-4, "{wanted} {last:?}");
    assert!(last.iterations < 2000, "{}", last.iterations);
    // The fields belong to the + reversal point.
    assert!(
        (found.state.load_amplitudes[0] - (0.3 + stress)).abs() < 1e-15,
        "{:?}",
        found.state.load_amplitudes
    );
    // In plain steps body 2 advances through twelve cycles. In the run with a cycle it advances in the first strokes only.
    let marched_to = marched.records.last().expect("records").shift;
    assert!(last.shift[0] < 0.0 && last.shift[0] > marched_to[0], "{:?} {marched_to:?}", last.shift);
}

/// Truth: a run that resumes from a checkpoint gives the same bits, because the amplitudes are part of the state. A step without
/// amplitudes changes no load.
#[test]
fn resumed_amplitudes() {
    struct Keeper(Vec<RunCheckpoint>);
    impl Observer for Keeper {
        fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
            Ok(())
        }

        fn on_checkpoint(
            &mut self,
            _: CheckpointEvent,
            checkpoint: &dyn Fn() -> RunCheckpoint,
        ) -> Result<()> {
            self.0.push(checkpoint());
            Ok(())
        }
    }
    let model = line(32, 0.4 * MU, Side::Lower);
    let steps = [pressed(LOAD), Step { increments: 3, ..loaded(0.75) }, pulled(0.5 * MU * LOAD)];
    let mut keeper = Keeper(Vec::new());
    let whole = run(&model, &steps, &SolverOptions::default(), None, &mut keeper).expect("a run");
    assert_eq!(whole.records.last().expect("records").loads[NAME], 0.75);
    let unfinished = |checkpoint: &RunCheckpoint| checkpoint.records().len() < whole.records.len();
    let checkpoints: Vec<RunCheckpoint> = keeper.0.into_iter().filter(unfinished).collect();
    assert!(checkpoints.len() >= 5, "{}", checkpoints.len());
    for checkpoint in checkpoints {
        let resumed =
            run(&model, &steps, &SolverOptions::default(), Some(checkpoint), &mut Silent).expect("a run");
        assert_eq!(resumed.state.tractions, whole.state.tractions);
        assert_eq!(resumed.state.slip, whole.state.slip);
    }
}
