//! Wear: reference cycles, identities, orders of convergence, limits. docs/verification.md lists the named cases.

mod broken;
mod control;
mod growth;
mod jumps;
mod moved;
mod paths;
mod resolved;
mod sliding;

use orthowear::contact::{Method, SolverOptions};
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Integrator, JumpPolicy, Step};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::omitted::AllowedOmissions;

use crate::common::{
    fretting, frp_wear, half_spaces, im7, indent, path_of, press, reference, relative, shift, solve,
    solve_with, sphere, sphere_on_frp, steel, step,
};

/// Energy wear coefficient k = i / mu of the reference scene (specific wear rate i, friction coefficient mu), 1/MPa.
const K: f64 = 1.25e-9;

fn worn_sphere(
    tilt: f64,
    cells: usize,
    jumps: usize,
    integrator: Integrator,
) -> orthowear::evolution::RunResult {
    let mut model = sphere_on_frp(tilt, 1.5, cells);
    model.wear = frp_wear(tilt);
    solve(&model, &[indent(0.02), fretting(100_000, 0.08, jumps, integrator)])
}

/// Truth: an independent program computes all 100 000 cycles, with incremental slip and one increment per stroke. Wear volume and
/// final load agree to 1 % with 8 jumps. With the FRP laws of friction and wear, the wear volume is k times the dissipation, to
/// 1e-10. The dissipation is summed from tractions and slips, independently of the wear update.
#[test]
fn reference_cycles() {
    let data = reference();
    for tilt in ["0", "90"] {
        let case = &data["wear"][tilt];
        let result = worn_sphere(tilt.parse().expect("a number"), 48, 8, Integrator::Sdirk2);
        assert_eq!(result.outcome, Outcome::Converged);
        let last = result.records.last().expect("records");
        assert_eq!(last.cycles_done, 100_000);
        let volume = case["V"].as_f64().expect("a number");
        assert!(relative(last.worn_volume, volume) < 1e-2, "tilt {tilt}: {} {volume}", last.worn_volume);
        let load = case["P_end"].as_f64().expect("a number");
        assert!(relative(last.normal_force, load) < 1e-2, "tilt {tilt}: {} {load}", last.normal_force);
        let identity = relative(last.worn_volume, K * last.dissipation);
        assert!(identity < 1e-10, "tilt {tilt}: volume against k x dissipation {identity:e}");
    }
}

/// Truth: backward Euler is of first order. SDIRK2 with the slip at the stages is of second order (docs/theory-wear.md). Errors
/// are differences from a run with 64 jumps.
#[test]
fn orders_of_the_integrators() {
    let depth = |jumps, integrator| {
        worn_sphere(90.0, 16, jumps, integrator).records.last().expect("records").max_wear_depth
    };
    let fine = depth(64, Integrator::Sdirk2);
    for (integrator, jumps, least, most) in
        [(Integrator::BackwardEuler, 4, 0.8, 1.3), (Integrator::Sdirk2, 2, 1.6, 2.8)]
    {
        let errors = [jumps, 2 * jumps, 4 * jumps].map(|n| relative(depth(n, integrator), fine));
        let order = (errors[0] / errors[2]).ln() / 4.0_f64.ln();
        assert!(order > least && order < most, "{integrator:?}: errors {errors:?}, order {order}");
    }
}

/// Truth: Archard's law under Coulomb friction gives the wear volume V = (i / mu) x dissipation, to 1e-10. The slip is at most
/// the rigid motion of body 2. V is therefore at most 4 N i P D (N cycles, amplitude D, load P). The amplitude is much larger
/// than the elastic displacements, so V is at least 0.8 of this bound.
#[test]
fn archard_volume_is_proportional_to_dissipation() {
    let steel = crate::common::steel();
    let mut model = half_spaces(&steel, None, (0.6, 24), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.5 };
    model.wear = WearLaw::Archard { i: 1e-8 };
    let result = solve(&model, &[press(500.0), fretting(1000, 0.02, 2, Integrator::Sdirk2)]);
    let last = result.records.last().expect("records");
    assert_eq!(result.outcome, Outcome::Converged);
    let since = last.dissipation - result.records[0].dissipation;
    let volume = last.worn_volume - result.records[0].worn_volume;
    assert!(relative(volume, 1e-8 / 0.5 * since) < 1e-10, "{volume} {since}");
    // Elastic displacements make the slip smaller than the rigid motion.
    let rigid = 1000.0 * 4.0 * 1e-8 * 500.0 * 0.02;
    assert!(volume < rigid && volume > 0.8 * rigid, "{volume} {rigid}");
    assert!(relative(last.normal_force, 500.0) < 1e-10);
}

/// Truth: at the fixed approach delta, the wear volume is at most pi R delta^2, the overlap of a rigid sphere of radius R. The
/// wear depth tends to the positive part of delta - h for the initial gap h.
#[test]
fn the_limit_shape_is_the_rigid_overlap() {
    let mut model = sphere_on_frp(0.0, 1.6, 20);
    model.wear = WearLaw::Frp { i_l: 1e-7, i_t: 1.25e-7, i_n: 1.375e-7, tilt: 0.0, azimuth: 0.0 };
    let result = solve(&model, &[indent(0.02), fretting(100_000, 0.08, 12, Integrator::BackwardEuler)]);
    assert_eq!(result.outcome, Outcome::Converged);
    let n = model.frame.n_cells();
    for cell in 0..n {
        let overlap = (0.02 - model.initial_gap[2 * n + cell]).max(0.0);
        assert!((result.state.wear_depth[cell] - overlap).abs() < 2e-4, "cell {cell}");
    }
    assert!(result.records.last().expect("records").worn_volume < std::f64::consts::PI * 50.0 * 0.02 * 0.02);
}

/// Truth: with the energy law, the wear volume is k times the friction energy. A step without friction therefore adds no wear,
/// before and after wear with friction. Archard's law with the same wear rate adds wear in each of these steps.
#[test]
fn no_friction_energy_wears_nothing() {
    let mut model = half_spaces(&steel(), None, (0.8, 16), sphere(50.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.6 };
    let smooth = |step: Step| Step { friction: false, ..step };
    let cycles = || fretting(1000, 0.01, 2, Integrator::Sdirk2);
    let steps =
        [smooth(indent(0.005)), smooth(shift(0.01, 0.0)), smooth(cycles()), cycles(), smooth(cycles())];
    let mut volumes = |wear: WearLaw| {
        model.wear = wear;
        let result = solve(&model, &steps);
        assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
        let by_energy = result.records.last().expect("records").worn_volume_by_energy;
        let ends = [0, 1000, 2000, 3000].map(|cycles| {
            result.records.iter().rfind(|record| record.cycles_done == cycles).expect("an entry")
        });
        (ends.map(|record| [record.worn_volume, 1e-8 * record.dissipation]), by_energy)
    };
    let (by_energy, last) = volumes(WearLaw::Energy { k: 1e-8 });
    assert_eq!(by_energy[..2], [[0.0; 2]; 2]);
    assert!(by_energy[2][0] > 0.0 && by_energy[3] == by_energy[2], "{by_energy:?}");
    assert!(
        by_energy.iter().all(|[volume, energy]| (volume - energy).abs() <= 1e-6 * volume),
        "{by_energy:?}"
    );
    assert!(last.is_some_and(|volume| relative(volume, by_energy[3][1]) < 1e-12), "{last:?}");
    let (archard, last) = volumes(WearLaw::Archard { i: 6e-9 });
    assert!(archard[0][0] > 0.0 && archard.windows(2).all(|pair| pair[1][0] > pair[0][0]) && last.is_none());
}

/// Truth: a stroke in partial slip wears only the slip annulus. The wear volume is k times the dissipation.
#[test]
fn partial_slip_wears_only_the_annulus() {
    let steel = crate::common::steel();
    let mut model = half_spaces(&steel, Some(&steel), (1.3, 32), sphere(50.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.6 };
    model.wear = WearLaw::Energy { k: 1e-8 };
    let result = solve(&model, &[indent(0.02), fretting(10_000, 0.002, 4, Integrator::Sdirk2)]);
    assert_eq!(result.outcome, Outcome::Converged);
    let last = result.records.last().expect("records");
    assert!(last.stick_area > 0.1 && last.stick_area < 0.95 * last.contact_area);
    let middle = 16 * 32 + 16;
    assert!(result.state.wear_depth[middle] < 1e-6 * last.max_wear_depth);
    let first = &result.records[0];
    let (volume, energy) = (last.worn_volume - first.worn_volume, last.dissipation - first.dissipation);
    assert!(relative(volume, 1e-8 * energy) < 1e-6, "{volume} {energy}");
}

/// Truth: case `wear-two-body-split`. The wear volumes of the two bodies have the prescribed ratio and add up to the total.
#[test]
fn wear_is_shared_as_told() {
    let mut model = sphere_on_frp(0.0, 1.2, 12);
    model.wear = frp_wear(0.0);
    model.wear_share = 0.75;
    let result = solve(&model, &[indent(0.02), shift(0.05, 0.0)]);
    let last = result.records.last().expect("records");
    assert!(last.worn_volume > 0.0);
    assert!(relative(last.worn_volume_by_body[0], 3.0 * last.worn_volume_by_body[1]) < 1e-12);
    assert!(relative(last.worn_volume_by_body.iter().sum(), last.worn_volume) < 1e-12);
}

/// Truth: a step without wear has no wear volume. A run without omitted work (`AllowedOmissions::NONE`), which does not reuse
/// earlier solutions, gives the same wear volume and force to 1e-6.
#[test]
fn wear_off_and_cold_starts() {
    let mut model = sphere_on_frp(0.0, 1.4, 12);
    model.wear = frp_wear(0.0);
    let off = Step { wear: false, ..fretting(1000, 0.08, 2, Integrator::Sdirk2) };
    let result = solve(&model, &[Step { wear: false, ..indent(0.02) }, off]);
    assert_eq!(result.records.last().expect("records").worn_volume, 0.0);
    let steps = [indent(0.02), fretting(50_000, 0.08, 2, Integrator::Sdirk2), shift(0.0, 0.0), step("rest")];
    let [warm, cold] = [AllowedOmissions::ALL, AllowedOmissions::NONE].map(|skip| {
        let options = SolverOptions { skip, ..SolverOptions::default() };
        solve_with(&model, &steps, &options).records.last().expect("records").clone()
    });
    assert!(relative(warm.worn_volume, cold.worn_volume) < 1e-6);
    assert!(relative(warm.normal_force, cold.normal_force) < 1e-6);
}

/// Truth: case `rel-nonconvergence-is-loud`. If a stage of a jump reaches the iteration limit, the run reports it. Otherwise the
/// iteration limit does not change the wear volume.
#[test]
fn an_unconverged_stage_is_loud() {
    let mut model = sphere_on_frp(90.0, 1.5, 16);
    model.wear = frp_wear(90.0);
    let steps = [indent(0.02), fretting(100_000, 0.02, 1, Integrator::Sdirk2)];
    let free = solve(&model, &steps);
    assert_eq!(free.outcome, Outcome::Converged);
    for max_iterations in (60..400).step_by(20) {
        let options = SolverOptions { max_iterations, ..SolverOptions::default() };
        let cut = solve_with(&model, &steps, &options);
        if cut.outcome == Outcome::Converged {
            let (a, b) = (free.records.last().expect("records"), cut.records.last().expect("records"));
            assert_eq!(a.worn_volume, b.worn_volume, "{max_iterations} iterations changed the answer unsaid");
        } else {
            assert!(!cut.records.last().expect("records").converged);
        }
    }
}

/// Truth: at a fixed approach, wear removes at most the overlap of the rigid bodies, for any number of cycles. The wear volume by
/// energy is missing if part of the wear happens without friction.
#[test]
fn nothing_is_left_to_wear() {
    let mut model = sphere_on_frp(0.0, 1.6, 16);
    model.wear = frp_wear(0.0);
    let mut cycles = fretting(1_000_000_000, 0.08, 1, Integrator::Sdirk2);
    cycles.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(1e-2);
    let smooth = Step { friction: false, name: "smooth".into(), ..fretting(10, 0.08, 1, Integrator::Sdirk2) };
    let result = solve(&model, &[indent(0.02), cycles]);
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    let worn = result.records.iter().rfind(|record| record.name == "fretting").expect("an entry");
    assert_eq!(worn.cycles_done, 1_000_000_000);
    let areas = &model.frame.areas;
    let overlap = |i: usize| (0.02 - model.initial_gap[2 * 256 + i]).max(0.0) * areas[i];
    let all: f64 = (0..256).map(overlap).sum();
    assert!(relative(worn.worn_volume, all) < 1e-4, "{} {all}", worn.worn_volume);
    assert!(result.warnings.iter().any(|note| note.contains("wear is neglected")), "{:?}", result.warnings);
    assert!(worn.worn_volume_by_energy.is_some());
    let result = solve(&model, &[indent(0.02), smooth]);
    assert_eq!(result.outcome, Outcome::Converged);
    assert_eq!(result.records.last().expect("records").worn_volume_by_energy, None);
}

/// Truth: a jump of any length removes at most the rigid overlap pi R approach^2, and the wear depth is at most the approach. A
/// jump that is too long for second order gives a warning.
#[test]
fn jumps_of_any_length_stay_within_the_overlap() {
    let mut model = sphere_on_frp(0.0, 1.6, 20);
    model.wear = frp_wear(0.0);
    let bound = std::f64::consts::PI * 50.0 * 0.02 * 0.02;
    let mut last = 0.0;
    for (count, jumps) in [(1_000_000, 4), (10_000_000, 2), (30_000_000, 4)] {
        let steps = [indent(0.02), fretting(count, 0.08, jumps, Integrator::Sdirk2)];
        let options = SolverOptions { tolerance: 1e-6, ..SolverOptions::default() };
        let result = solve_with(&model, &steps, &options);
        let record = result.records.last().expect("records");
        assert_eq!(result.outcome, Outcome::Converged, "{count} cycles in {jumps} jumps");
        assert!(record.worn_volume < bound * (1.0 + 1e-3), "{count}: {} {bound}", record.worn_volume);
        assert!(record.max_wear_depth < 0.02 * (1.0 + 1e-3), "{count}: {}", record.max_wear_depth);
        assert!(record.worn_volume > last);
        last = record.worn_volume;
        if jumps == 2 {
            assert!(result.warnings.iter().any(|w| w.contains("Backward Euler")), "{:?}", result.warnings);
        }
    }
}

/// Truth: explicit jumps below the critical length converge to the implicit result with first order.
#[test]
fn explicit_agrees_below_the_critical_jump() {
    let volume =
        |jumps, integrator| worn_sphere(0.0, 16, jumps, integrator).records.last().expect("r").worn_volume;
    let fine = volume(16, Integrator::Sdirk2);
    let errors = [8, 16].map(|jumps| relative(volume(jumps, Integrator::Explicit), fine));
    assert!(errors[0] < 2e-2 && errors[1] < 0.65 * errors[0], "{errors:?}");
}

/// Truth: 24 strokes computed one after the other. The reversal points of the cycle equal the ends of the last two strokes.
/// Tangential forces agree to 0.2 % of their range. The last strokes have converged to less than 0.1 % of this range.
#[test]
fn stroke_ends_follow_from_strokes() {
    let mut model = half_spaces(&im7(30.0), None, (0.7, 24), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.4 };
    let strokes = (0..24).map(|k| shift(0.002, if k % 2 == 0 { 0.0 } else { 180.0 }));
    let strokes: Vec<Step> = std::iter::once(indent(0.02)).chain(strokes).collect();
    let one_by_one = solve(&model, &strokes).records;
    let wanted = [&one_by_one[23], &one_by_one[24]];
    let range = wanted[0].tangential_force[0] - wanted[1].tangential_force[0];
    for method in [Method::Auto, Method::BarzilaiBorwein] {
        let options = SolverOptions { method, ..SolverOptions::default() };
        let cycle =
            solve_with(&model, &[indent(0.02), fretting(1, 0.002, 1, Integrator::BackwardEuler)], &options);
        assert_eq!(cycle.outcome, Outcome::Converged);
        let ends = cycle.records[1].stroke_ends.expect("ends of strokes");
        for (found, wanted) in ends.iter().zip(wanted) {
            let apart = (found.tangential_force[0] - wanted.tangential_force[0]).abs();
            assert!(
                apart < 2e-3 * range,
                "{method:?} {} {}",
                found.tangential_force[0],
                wanted.tangential_force[0]
            );
            assert!(relative(found.normal_force, wanted.normal_force) < 1e-3, "{method:?} {found:?}");
            assert!(found.stick_area > 0.0 && found.stick_area < 0.9 * found.contact_area, "{found:?}");
        }
    }
}

/// Truth: 12 strokes computed one after the other. The reversal points of the cycle equal the ends of the last two strokes.
/// Tangential forces agree to 1 % of their range, normal forces to 0.3 %. Some cells slip by only a thousandth of the amplitude.
/// The reversal points converge only if the solver removes these cells from the stick zone.
#[test]
fn cells_that_creep_are_let_go() {
    let model = sphere_on_frp(30.0, 1.5, 24);
    let strokes = (0..12).map(|k| shift(0.004, if k % 2 == 0 { 60.0 } else { 240.0 }));
    let strokes: Vec<Step> = std::iter::once(indent(0.02)).chain(strokes).collect();
    let one_by_one = solve(&model, &strokes).records;
    let mut cycle = fretting(1, 0.004, 1, Integrator::BackwardEuler);
    path_of(&mut cycle).angle = 60_f64.to_radians();
    let run = solve(&model, &[indent(0.02), cycle]);
    assert_eq!(run.outcome, Outcome::Converged);
    let ends = run.records[1].stroke_ends.expect("ends of strokes");
    let wanted = [&one_by_one[11], &one_by_one[12]];
    let apart = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    let range = apart(wanted[0].tangential_force, wanted[1].tangential_force);
    for (found, wanted) in ends.iter().zip(wanted) {
        let distance = apart(found.tangential_force, wanted.tangential_force);
        assert!(distance < 1e-2 * range, "{found:?} {:?}", wanted.tangential_force);
        let normal = [found.normal_force, wanted.normal_force];
        assert!(relative(normal[0], normal[1]) < 3e-3, "{normal:?}");
    }
}

/// Truth: wear volume and forces do not depend on the method that solves the two reversal points, or on omitted work.
#[test]
fn worn_volumes_do_not_depend_on_the_solver() {
    let mut model = half_spaces(&im7(60.0), Some(&im7(45.0)), (1.0, 32), sphere(14.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.6 };
    model.wear = WearLaw::Archard { i: 2e-5 };
    let mut cycles = fretting(1000, 5.4e-4, 1, Integrator::Sdirk2);
    path_of(&mut cycles).angle = 40_f64.to_radians();
    let worn = |options: SolverOptions| {
        let result = solve_with(&model, &[press(1.125), cycles.clone()], &options);
        assert_eq!(result.outcome, Outcome::Converged);
        let record = &result.records[1];
        assert!(record.stick_area > 0.0, "{record:?}");
        [record.worn_volume, record.tangential_force[0], record.tangential_force[1], record.peak_pressure]
    };
    let usual = worn(SolverOptions::default());
    for options in [
        SolverOptions { skip: AllowedOmissions::NONE, ..SolverOptions::default() },
        SolverOptions { method: Method::BarzilaiBorwein, ..SolverOptions::default() },
    ] {
        for (found, wanted) in worn(options).iter().zip(usual) {
            assert!(relative(*found, wanted) < 1e-4, "{found} {wanted}");
        }
    }
}

/// Truth: cycles stop when wear extends the contact to the edge of the frame (docs/theory-wear.md). They do not stop if the
/// contact reaches the edge from the start.
#[test]
fn contact_that_begins_at_the_rim_wears() {
    let mut model = half_spaces(&steel(), None, (0.5, 8), |_, _| 0.0);
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let run = solve(&model, &[press(50.0), fretting(10, 0.01, 2, Integrator::BackwardEuler)]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    assert_eq!(run.records.last().expect("records").cycles_done, 10);
    assert_eq!(
        run.warnings.iter().filter(|note| note.contains("edge of the frame")).count(),
        2,
        "{:?}",
        run.warnings
    );
}
