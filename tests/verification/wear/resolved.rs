//! Resolved cycles, which measure the wear between the reversal points: corrected wear and estimated errors.

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::{IncrementRecord, Outcome};
use orthowear::evolution::step::{
    Correction, Drive, Integrator, JumpPolicy, Normal, ResolvedCycleSettings, Step, Tangential,
};
use orthowear::evolution::{Model, RunResult};
use orthowear::geometry::fibre_axes;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;

use crate::common::{
    fretting, frp_wear, half_spaces, im7, indent, path_of, press, relative, solve, solve_with, sphere,
    sphere_on_frp, steel, step, usual_or_finest,
};
use crate::observed::{follow, pressure_times_path};

fn always(tolerance: f64) -> Option<ResolvedCycleSettings> {
    Some(ResolvedCycleSettings {
        increments: None,
        tolerance,
        correction: Correction::Always,
        error_warning: f64::INFINITY,
    })
}

/// Run of the reference scene on 32 x 32 cells, with `increments` per stroke. The cycles are resolved if `resolve` is given.
fn reference_scene(
    tilt: f64,
    mut cycles: Step,
    increments: usize,
    resolve: Option<ResolvedCycleSettings>,
) -> RunResult {
    let path = path_of(&mut cycles);
    (path.increments, path.resolved_cycles) = (increments, resolve);
    let mut model = sphere_on_frp(tilt, 1.5, 32);
    model.wear = frp_wear(tilt);
    let run = solve(&model, &[indent(0.02), cycles]);
    assert_eq!(run.outcome, Outcome::Converged);
    run
}

/// Truth: a run that solves the path points of 16 increments per stroke together, in every stage. The corrected wear volume
/// agrees to 1e-3 with this run, and to 1.5e-3 with the volume by the friction energy. With 16 increments the wear volume is 0.25
/// % smaller than with single increments at tilt 90, and the same at tilt 0.
#[test]
#[ignore = "10 s; usual: controlled_jumps_with_resolved_cycles"]
fn factors_stand_for_ends_between() {
    for (tilt, range) in [(0.0, 0.0..1e-4), (90.0, 1.5e-3..4e-3)] {
        let volume = |increments: usize, resolve: Option<ResolvedCycleSettings>| {
            let cycles = fretting(100_000, 0.08, 4, Integrator::Sdirk2);
            let run = reference_scene(tilt, cycles, increments, resolve);
            let last = run.records.last().expect("records").clone();
            (last.worn_volume, last.worn_volume_by_energy.expect("wear follows friction"))
        };
        let ((alone, _), (together, _)) = (volume(1, None), volume(16, None));
        let (found, by_energy) = volume(1, always(1e-3));
        assert!(range.contains(&relative(together, alone)), "tilt {tilt}: {together} {alone}");
        assert!(relative(found, together) < 1e-3, "tilt {tilt}: {found} {together}");
        assert!(relative(found, by_energy) < 1.5e-3, "tilt {tilt}: {found} {by_energy}");
    }
}

/// Truth: an independent program. At tilt 90, resolved strokes initially wear 0.4 % less per cycle than single increments.
#[test]
fn rate_of_resolved_strokes() {
    let rate = |resolve: Option<ResolvedCycleSettings>| {
        let run = reference_scene(90.0, fretting(1, 0.08, 1, Integrator::BackwardEuler), 1, resolve);
        run.records[1].worn_volume - run.records[0].worn_volume
    };
    let change = rate(always(5e-4)) / rate(None) - 1.0;
    assert!((-0.0047..-0.0033).contains(&change), "{change}");
}

/// Truth: under a constant force and with little wear, the slip between the reversal points does not change. One resolved cycle
/// is then enough. At tilt 90 and a constant approach, wear reduces the load, and every jump needs a resolved cycle.
#[test]
fn a_cycle_is_resolved_where_slip_has_changed() {
    let resolved = |first: Step, count: u64| -> Vec<Option<usize>> {
        let mut cycles = fretting(count, 0.08, 4, Integrator::Sdirk2);
        path_of(&mut cycles).resolved_cycles = always(1e-3);
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

/// Truth: a run with many jumps. The change of the correction factors during a jump is part of the estimated error. With few
/// jumps, the estimated error is 0.2 to 5 times the difference from the run with many jumps.
#[test]
fn drift_is_in_the_estimated_error() {
    let run = |jumps: usize| {
        let run = reference_scene(90.0, fretting(100_000, 0.08, jumps, Integrator::Sdirk2), 1, always(1e-3));
        run.records.last().expect("records").clone()
    };
    let (few, many) = (run(4), run(24));
    let error = (few.worn_volume - many.worn_volume).abs();
    assert!((0.2..5.0).contains(&(few.worn_volume_error / error)), "{} {error}", few.worn_volume_error);
}

/// Truth: without wear no cycle is resolved, so the settings of resolved cycles change no bit of the results.
#[test]
fn nothing_is_resolved_without_wear() {
    let run = |resolve: Option<ResolvedCycleSettings>| {
        let mut cycles = fretting(1000, 0.08, 2, Integrator::Sdirk2);
        path_of(&mut cycles).resolved_cycles = resolve;
        let steps = [indent(0.02), Step { wear: false, ..cycles }];
        let result = solve_with(&sphere_on_frp(30.0, 1.5, 16), &steps, &SolverOptions::default());
        let jumps = result.records.iter().filter_map(|record| record.jump).collect::<Vec<_>>();
        (result.state.tractions, jumps)
    };
    assert_eq!(run(always(1e-3)), run(None));
}

/// Truth: a run of 16 jumps that solves the path points of 8 increments per stroke together. The wear volumes agree to 2e-3.
#[test]
fn controlled_jumps_with_resolved_cycles() {
    let mut cycles = fretting(100_000, 0.08, 1, Integrator::Sdirk2);
    cycles.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(1e-3);
    let found = reference_scene(90.0, cycles, 1, always(1e-3));
    let together = reference_scene(90.0, fretting(100_000, 0.08, 16, Integrator::Sdirk2), 8, None);
    let volume = |run: &RunResult| run.records.last().expect("records").worn_volume;
    assert!(relative(volume(&found), volume(&together)) < 2e-3, "{} {}", volume(&found), volume(&together));
}

/// A cycle in partial slip, or close to partial slip, of a steel sphere on CFRP under 200 N. Fibre angles (tilt, azimuth) and
/// path angle are in degrees. The amplitude is in N for a prescribed force, otherwise in mm.
struct PartialSlip {
    fibre: [f64; 2],
    angle: f64,
    mu: f64,
    drive: Drive,
    amplitude: f64,
}

impl PartialSlip {
    /// Random scenes of benchmarks/fretting whose tractions become steady within ten cycles.
    const SCENES: [Self; 3] = [
        Self { fibre: [-75.9, 97.5], angle: 338.1, mu: 0.66, drive: Drive::Force, amplitude: 67.8 },
        // No cell sticks at a reversal point, but slip is far from uniform along the stroke.
        Self { fibre: [-10.8, 137.2], angle: 0.8, mu: 0.31, drive: Drive::Shift, amplitude: 0.00578 },
        Self { fibre: [-12.5, 149.4], angle: 241.3, mu: 0.58, drive: Drive::Shift, amplitude: 0.00538 },
    ];

    /// Contact model. Wear is so small that the shape of the bodies does not change.
    fn model(&self) -> Model {
        let [tilt, azimuth] = self.fibre.map(f64::to_radians);
        let cfrp = im7(0.0).rotated(&fibre_axes(tilt, azimuth));
        let mut model = half_spaces(&cfrp, Some(&steel()), (1.25, 12), sphere(50.0));
        model.friction = FrictionLaw::Coulomb { mu: self.mu };
        model.wear = WearLaw::Frp { i_l: 1e-16, i_t: 2e-16, i_n: 3e-16, tilt, azimuth };
        model
    }

    fn pressed(&self) -> Step {
        let tangential = (self.drive == Drive::Force).then_some(Tangential::Force([0.0; 2]));
        Step { tangential, increments: 4, wear: false, ..press(200.0) }
    }

    /// Steps of ten cycles: a press, then one step for each stroke.
    fn strokes(&self, increments: usize) -> Vec<Step> {
        let (sin, cos) = self.angle.to_radians().sin_cos();
        let to = |sign: f64| {
            let end = [cos, sin].map(|part| sign * self.amplitude * part);
            let tangential = match self.drive {
                Drive::Shift => Tangential::Shift(end),
                Drive::Force => Tangential::Force(end),
            };
            Step { tangential: Some(tangential), increments, ..step(&format!("to {sign}")) }
        };
        std::iter::once(self.pressed())
            .chain((0..21).map(|k| to(if k % 2 == 0 { 1.0 } else { -1.0 })))
            .collect()
    }

    /// Wear volume of the last of ten cycles, computed stroke by stroke.
    fn marched(&self, increments: usize) -> f64 {
        self.marched_run(increments).0
    }

    fn marched_run(&self, increments: usize) -> (f64, RunResult) {
        let run = solve(&self.model(), &self.strokes(increments));
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        let worn = |strokes_before_last: usize| {
            run.records[run.records.len() - 1 - strokes_before_last * increments].worn_volume
        };
        (worn(0) - worn(2), run)
    }

    fn cycle(&self, increments: usize, correction: Option<Correction>) -> (IncrementRecord, RunResult) {
        let mut cycles = fretting(1, self.amplitude, 1, Integrator::Sdirk2);
        let path = path_of(&mut cycles);
        (path.drive, path.angle, path.increments) = (self.drive, self.angle.to_radians(), increments);
        path.resolved_cycles = correction.map(|correction| ResolvedCycleSettings {
            increments: None,
            tolerance: 1e-3,
            correction,
            error_warning: f64::INFINITY,
        });
        let run = solve(&self.model(), &[self.pressed(), cycles]);
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        (run.records.last().expect("records").clone(), run)
    }
}

/// Truth: strokes in 16 and 32 increments, one after the other until they are steady, extrapolated with first order. With default
/// settings the wear of a cycle agrees to 1.5 %, while the error of single increments exceeds 2 %. With both settings the
/// estimate is at least a third of the error. For single increments it is at most three times the error. [`Correction::Never`]
/// leaves the wear of single increments unchanged.
#[test]
fn wear_in_partial_slip_by_default() {
    for scene in PartialSlip::SCENES.into_iter().take(usual_or_finest(2, 3)) {
        let truth = 2.0 * scene.marched(32) - scene.marched(16);
        let error = |record: &IncrementRecord| (record.worn_volume - truth).abs() / truth;
        let claimed = |record: &IncrementRecord| record.worn_volume_error / truth;
        let (found, _) = scene.cycle(1, Some(Correction::WhereNeeded));
        assert!(error(&found) < 1.5e-2, "{:?}: {}", scene.fibre, error(&found));
        assert!(claimed(&found) > error(&found) / 3.0, "{:?}: {}", scene.fibre, claimed(&found));
        let ((single, run), (plain, _)) = (scene.cycle(1, Some(Correction::Never)), scene.cycle(1, None));
        assert!(error(&single) > 2e-2, "{:?}: {}", scene.fibre, error(&single));
        assert!((1.0 / 3.0..3.0).contains(&(claimed(&single) / error(&single))), "{:?}", scene.fibre);
        assert_eq!(single.worn_volume.to_bits(), plain.worn_volume.to_bits());
        assert!(
            run.warnings.iter().any(|text| text.contains("with 1 increment per stroke and with")),
            "{:?}",
            run.warnings
        );
    }
}

/// Truth: strokes one after the other in single increments, until they are steady. Increments and cycles treat cells that open
/// differently. The reference wear therefore follows from the states at the ends of the last two strokes. Under 0.999 of the
/// friction limit no cell sticks through a cycle, and equilibrium alone does not fix the position of body 2. The tolerance, 1e-2,
/// is the change by the last of ten cycles.
#[test]
fn cycles_without_sticking_cells() {
    let scene =
        PartialSlip { fibre: [40.0, 35.0], angle: 70.0, mu: 0.5, drive: Drive::Force, amplitude: 99.9 };
    let (model, strokes) = (scene.model(), scene.strokes(1));
    let (run, states) = follow(&model, &strokes, &SolverOptions::default());
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let rate = model.wear.specific_rate(None).expect("wear");
    let wanted = pressure_times_path(&model.frame, &states[states.len() - 3..], rate.path_per_slip());
    let (found, _) = scene.cycle(1, None);
    assert_eq!(found.stick_area, 0.0);
    assert!(relative(found.worn_volume, wanted) < 1e-2, "{} {wanted}", found.worn_volume);
}

/// Truth: ten cycles of strokes, one after the other, in the same number of increments. The wear of a cycle agrees to 1.5 %,
/// because the tractions are not quite steady after ten cycles. The tractions at the + reversal point agree to 1 % of the largest
/// pressure. Path points that are solved together have an error above 2 % in the wear ([`wear_in_partial_slip_by_default`]).
#[test]
fn given_increments_follow_the_strokes() {
    let scene = &PartialSlip::SCENES[0];
    let (wanted, marched) = scene.marched_run(8);
    let mut cycles = fretting(1, scene.amplitude, 1, Integrator::Sdirk2);
    let path = path_of(&mut cycles);
    (path.drive, path.angle) = (scene.drive, scene.angle.to_radians());
    path.resolved_cycles = always(1e-3).map(|used| ResolvedCycleSettings { increments: Some(8), ..used });
    let run = solve(&scene.model(), &[scene.pressed(), cycles]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let record = run.records.last().expect("records");
    assert!(relative(record.worn_volume, wanted) < 1.5e-2, "{} {wanted}", record.worn_volume);
    assert_eq!(record.jump.as_ref().and_then(|jump| jump.resolved), Some(8));
    let apart = run.state.tractions.iter().zip(&marched.state.tractions).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    assert!(apart < 1e-2 * record.peak_pressure, "{apart} {}", record.peak_pressure);
}

/// Truth: 36 cycles of the same increments, one after the other. On this ellipse of the force no cell sticks through a cycle, and
/// tractions become steady slowly: the wear of the eighth cycle is more than 1 % too large. The last eight cycles change the wear of
/// a cycle by less than 5e-4, and each three cycles nearly halve the change, so the remaining change is below 1e-4. Wear and
/// tractions of the resolved cycle agree with the last cycle. Apart from this change, the error of the wear is at most twice the
/// estimate.
#[test]
fn resolved_cycles_are_steady() {
    let (amplitude, increments) = ([91.0, 38.2], 16);
    let scene = PartialSlip {
        fibre: [-70.0, 143.0],
        angle: 211.0,
        mu: 0.5,
        drive: Drive::Force,
        amplitude: amplitude[0],
    };
    let (sin, cos) = scene.angle.to_radians().sin_cos();
    let to = |point: usize| {
        let phase = std::f64::consts::PI * point as f64 / increments as f64;
        let [along, across] = [amplitude[0] * phase.cos(), amplitude[1] * phase.sin()];
        let force = [along * cos - across * sin, along * sin + across * cos];
        Step { tangential: Some(Tangential::Force(force)), increments: 1, ..step(&format!("to {point}")) }
    };
    let first = Step { increments, ..to(0) };
    let steps: Vec<Step> =
        [scene.pressed(), first].into_iter().chain((1..=36 * 2 * increments).map(to)).collect();
    let marched = solve(&scene.model(), &steps);
    assert_eq!(marched.outcome, Outcome::Converged, "{:?}", marched.warnings);
    let worn = |before_last: usize| {
        marched.records[marched.records.len() - 1 - before_last * 2 * increments].worn_volume
    };
    let wanted = worn(0) - worn(1);
    let worn_by = |cycle: usize| worn(36 - cycle) - worn(37 - cycle);
    let changes = [8, 28, 32].map(|cycle| worn_by(cycle) / wanted - 1.0);
    assert!(changes[0] > 1e-2 && changes[1].abs() < 5e-4, "{changes:?}");

    let mut cycles = fretting(1, scene.amplitude, 1, Integrator::Sdirk2);
    let path = path_of(&mut cycles);
    (path.drive, path.angle) = (scene.drive, scene.angle.to_radians());
    (path.amplitude, path.increments) = (amplitude, 8);
    path.resolved_cycles =
        always(1e-3).map(|used| ResolvedCycleSettings { increments: Some(increments), ..used });
    let run = solve(&scene.model(), &[scene.pressed(), cycles]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let record = run.records.last().expect("records");
    assert!(relative(record.worn_volume, wanted) < 3e-4, "{} {wanted}", record.worn_volume);
    let error = (record.worn_volume - wanted).abs();
    let claimed = record.worn_volume_error_by_source.settling;
    assert!(error < 2.0 * claimed + 1e-4 * wanted && claimed < 2e-4 * wanted, "{error} {claimed} {wanted}");
    let apart = run.state.tractions.iter().zip(&marched.state.tractions).map(|(a, b)| (a - b).abs());
    let apart = apart.fold(0.0, f64::max);
    assert!(apart < 2e-3 * record.peak_pressure, "{apart} {}", record.peak_pressure);
}

/// Truth: 40 cycles of strokes in 8 increments, one after the other. At 0.991 of the force that friction carries, each cycle moves
/// body 2 by the same distance, although some cells slip by less than a thousandth of the amplitude per stroke. From the 30th to
/// the 40th cycle the wear of a cycle and the motion change by less than 3e-4 and 1 %. Increment k of K ends at the share
/// 1 - (1 - k/K)^2 of a stroke.
#[test]
fn ratcheting_near_gross_sliding() {
    let (amplitude, increments) = (181.0, 8);
    let scene = PartialSlip { fibre: [30.0, 20.0], angle: 0.0, mu: 0.0, drive: Drive::Force, amplitude };
    let [tilt, azimuth] = scene.fibre.map(f64::to_radians);
    let cfrp = im7(0.0).rotated(&fibre_axes(tilt, azimuth));
    let mut model = half_spaces(&cfrp, Some(&steel()), (1.3, 12), sphere(50.0));
    model.friction = FrictionLaw::Frp { mu_l: 0.4, mu_t: 0.5, mu_n: 0.55, tilt, azimuth };
    model.wear = WearLaw::Frp { i_l: 5e-16, i_t: 6.25e-16, i_n: 6.875e-16, tilt, azimuth };
    let pressed = || Step { increments: 1, normal: Some(Normal::Force(400.0)), ..scene.pressed() };

    let to = |point: usize| {
        let (stroke, part) = (point / increments, (point % increments) as f64 / increments as f64);
        let sign = if stroke % 2 == 0 { 1.0 } else { -1.0 };
        let force = sign * amplitude * (1.0 - 2.0 * (1.0 - (1.0 - part).powi(2)));
        Step { tangential: Some(Tangential::Force([force, 0.0])), ..step(&format!("to {point}")) }
    };
    let first = Step { increments, ..to(0) };
    let steps: Vec<Step> = [pressed(), first].into_iter().chain((1..=40 * 2 * increments).map(to)).collect();
    let marched = solve(&model, &steps);
    assert_eq!(marched.outcome, Outcome::Converged, "{:?}", marched.warnings);
    let before_last = |cycles: usize| &marched.records[marched.records.len() - 1 - cycles * 2 * increments];
    let cycle = |last: usize| {
        let [end, start] = [last, last + 1].map(before_last);
        (end.worn_volume - start.worn_volume, end.shift[0] - start.shift[0])
    };
    let ((wanted, motion), (wear_before, motion_before)) = (cycle(0), cycle(10));
    assert!(relative(wear_before, wanted) < 3e-4, "{wear_before} {wanted}");
    assert!(relative(motion_before, motion) < 1e-2 && motion > 1e-4, "{motion_before} {motion}");

    let mut cycles = fretting(1, amplitude, 1, Integrator::Sdirk2);
    let path = path_of(&mut cycles);
    path.drive = Drive::Force;
    path.resolved_cycles =
        always(1e-3).map(|used| ResolvedCycleSettings { increments: Some(increments), ..used });
    let run = solve(&model, &[pressed(), cycles]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let found = run.records.last().expect("records").worn_volume;
    assert!(relative(found, wanted) < 5e-4, "{found} {wanted}");
}

/// Truth: if the whole contact slides far, the wear needs no correction. Wear and tractions then equal the results of single
/// increments, bit by bit. The difference found in a resolved cycle adds to the estimated error.
#[test]
fn gross_slip_keeps_single_increments() {
    let run = |correction: Option<Correction>| {
        let resolve = correction.map(|correction| ResolvedCycleSettings {
            increments: None,
            tolerance: 1e-3,
            correction,
            error_warning: f64::INFINITY,
        });
        reference_scene(0.0, fretting(100_000, 0.08, 4, Integrator::Sdirk2), 1, resolve)
    };
    let (plain, found) = (run(None), run(Some(Correction::WhereNeeded)));
    assert_eq!(found.state.wear_depth, plain.state.wear_depth);
    assert_eq!(found.state.tractions, plain.state.tractions);
    let error = |run: &RunResult| run.records.last().expect("records").worn_volume_error;
    assert!(error(&found) > error(&plain));
    assert!(!found.warnings.iter().any(|text| text.contains("per stroke")), "{:?}", found.warnings);
}

/// Truth: the perimeter of a regular 16-gon is 16 sin(π/16) / π times the circumference of its circumscribed circle. In gross
/// slip a path of 16 chords therefore wears 0.64 % less than the circle. Resolved cycles correct this difference.
#[test]
fn ellipses_in_gross_slip_are_corrected() {
    let volume = |resolve: Option<ResolvedCycleSettings>| {
        let mut cycles = fretting(1, 0.4, 1, Integrator::BackwardEuler);
        let path = path_of(&mut cycles);
        (path.amplitude, path.increments, path.resolved_cycles) = ([0.4, 0.4], 8, resolve);
        let mut model = half_spaces(&steel(), Some(&steel()), (1.0, 8), sphere(50.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.2 };
        model.wear = WearLaw::Archard { i: 1e-12 };
        let run = solve(&model, &[Step { wear: false, ..press(100.0) }, cycles]);
        assert_eq!(run.outcome, Outcome::Converged);
        run.records.last().expect("records").worn_volume
    };
    let corrected = Some(ResolvedCycleSettings {
        increments: None,
        tolerance: 1e-3,
        correction: Correction::WhereNeeded,
        error_warning: f64::INFINITY,
    });
    let sixteenth = std::f64::consts::PI / 16.0;
    let polygon = sixteenth.sin() / sixteenth;
    assert!(
        (volume(None) / volume(corrected) - polygon).abs() < 1e-3,
        "{}",
        volume(None) / volume(corrected)
    );
}
