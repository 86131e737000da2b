//! Wear on closed fretting paths (prescribed forces, ellipses) and under changing normal forces. docs/verification.md lists the
//! named cases.

use orthowear::contact::SolverOptions;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::evolution::step::{Drive, Integrator, JumpPolicy, Normal, Step};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::output::plot::loops::LoopCurve;

use crate::common::{fretting, half_spaces, indent, path_of, press, relative, solve, sphere};

/// Truth: on a circular path much larger than all elastic displacements, each cell slips along a regular polygon. For K
/// increments per half circle and the radius A, the polygon has 2K sides. The wear volume per cycle is V = i P 2K 2A sin(π/2K),
/// for any starting point. P is the load, i the specific wear rate.
#[test]
fn circles_in_gross_slip() {
    let (force, amplitude, intensity) = (100.0, 2.0, 1e-10);
    for angle in [0.0, 0.6] {
        let mut model = half_spaces(&crate::common::steel(), None, (0.4, 16), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.2 };
        model.wear = WearLaw::Archard { i: intensity };
        let mut cycles = fretting(100, amplitude, 1, Integrator::Sdirk2);
        let path = path_of(&mut cycles);
        (path.amplitude[1], path.angle, path.increments) = (amplitude, angle, 4);
        let run = solve(&model, &[press(force), cycles]);
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        let record = &run.records[1];
        let polygon = 8.0 * 2.0 * amplitude * (std::f64::consts::PI / 8.0).sin();
        let wanted = 100.0 * intensity * force * polygon;
        assert!(relative(record.worn_volume, wanted) < 2e-3, "{} {wanted}", record.worn_volume);
        let by_energy = record.worn_volume_by_energy.expect("wear follows friction");
        assert!(relative(by_energy, record.worn_volume) < 1e-8);
    }
}

/// Truth: an ellipse with semi-axes a, b at angle 0 and an ellipse with b, a at 90 degrees are the same path with different
/// starting points. On an isotropic body both wear the same volume.
#[test]
fn ellipses_may_begin_anywhere() {
    let volume = |amplitude: [f64; 2], angle: f64| {
        let mut model = half_spaces(&crate::common::steel(), None, (0.4, 16), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        model.wear = WearLaw::Archard { i: 1e-8 };
        let mut cycles = fretting(50, 0.01, 1, Integrator::Sdirk2);
        let path = path_of(&mut cycles);
        (path.amplitude, path.angle, path.increments) = (amplitude, angle, 4);
        let run = solve(&model, &[press(100.0), cycles]);
        assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
        run.records[1].worn_volume
    };
    let [one, other] = [volume([0.01, 0.004], 0.0), volume([0.004, 0.01], std::f64::consts::FRAC_PI_2)];
    assert!(relative(one, other) < 1e-3, "{one} {other}");
}

struct Loops;

impl Observer for Loops {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> orthowear::error::Result<()> {
        Ok(())
    }

    fn wants_loops(&self) -> bool {
        true
    }
}

/// Truth: equal spheres under the tangential force ±Q (Mindlin, Deresiewicz 1953). With x = Q/(μP) they dissipate (24/5) K μP
/// {1 - (1-x)^(5/3) - (5x/6) [1 + (1-x)^(2/3)]} per cycle. K is the displacement at full sliding. The amplitude of the
/// displacement is K [1 - (1-x)^(2/3)]. The area of the loop equals the dissipation.
#[test]
fn loops_dissipate_what_they_enclose() {
    let (radius, a, e_star, nu, mu, x) = (100.0, 1.0, 1e5, 0.0, 0.5, 0.6_f64);
    let force = 4.0 * e_star * a * a * a / (3.0 * radius);
    let young = 2.0 * e_star * (1.0 - nu * nu);
    let material = Stiffness::isotropic(young, nu).expect("an admissible material");
    let mut model = half_spaces(&material, Some(&material), (1.2, 64), sphere(radius));
    model.friction = FrictionLaw::Coulomb { mu };
    let mut cycles = fretting(10, x * mu * force, 1, Integrator::BackwardEuler);
    path_of(&mut cycles).drive = Drive::Force;
    let run = orthowear::evolution::run(
        &model,
        &[press(force), cycles],
        &SolverOptions::default(),
        None,
        &mut Loops,
    );
    let run = run.expect("a run without errors");
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    assert_eq!(run.fretting_loops.len(), 2);
    let shear = young / (2.0 * (1.0 + nu));
    let k = 3.0 * (2.0 - nu) * mu * force / (8.0 * shear * a);
    let y = 1.0 - x;
    let wanted = 4.8 * k * mu * force * (1.0 - y.powf(5.0 / 3.0) - 5.0 * x / 6.0 * (1.0 + y.powf(2.0 / 3.0)));
    for found in &run.fretting_loops {
        assert!(relative(found.dissipation, wanted) < 3e-2, "{} {wanted}", found.dissipation);
        let cycle = LoopCurve::of(found);
        assert!(relative(cycle.area().abs(), wanted) < 3e-2, "{} {wanted}", cycle.area());
        let half = found.points.len() / 2;
        for (there, back) in found.points.iter().zip(&found.points[half..]) {
            assert!((there[0] + back[0]).abs() < 1e-4 * k && (there[2] + back[2]).abs() < 1e-6 * force);
        }
        let amplitude = found.points.iter().map(|point| point[0]).fold(0.0, f64::max);
        assert!(relative(amplitude, k * (1.0 - y.powf(2.0 / 3.0))) < 1e-2, "{amplitude}");
    }
}

/// Truth: case `fretting-limit-profile`. Under a constant amplitude of the tangential force, the stick zone does not change. The
/// contact outside the stick zone wears until its pressure is zero.
#[test]
fn limit_of_fretting_under_force() {
    let (radius, a0, e_star, cells) = (100.0, 1.0, 1e5, 40);
    let force = 4.0 * e_star / (3.0 * radius);
    let (p0, delta0) = (1.5 * force / std::f64::consts::PI, a0 * a0 / radius);
    // Between bodies of equal material, tangential tractions do not change the pressures.
    let material = Stiffness::isotropic(2.0 * e_star, 0.0).expect("an admissible material");
    let mut model = half_spaces(&material, Some(&material), (1.7, cells), sphere(radius));
    model.friction = FrictionLaw::Coulomb { mu: 0.5 };
    model.wear = WearLaw::Archard { i: 1e-8 };
    // The amplitude Q gives the stick radius c with c / a0 = (1 - Q / (mu P))^(1/3) = 1/2.
    let mut cycles = fretting(2_000_000, 0.875 * 0.5 * force, 1, Integrator::Sdirk2);
    path_of(&mut cycles).drive = Drive::Force;
    cycles.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(1e-2);
    let run = solve(&model, &[press(force), Step { name: "fretting".into(), ..cycles }]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    let record = run.records.last().expect("records");
    let middle = cells / 2 * cells + cells / 2;
    let pressure = run.state.tractions[2 * cells * cells + middle] / p0;
    let stick = (record.stick_area / std::f64::consts::PI).sqrt();
    let volume = record.worn_volume * radius / a0.powi(4);
    let found = [record.approach / delta0, volume, pressure];
    for (found, wanted) in found.iter().zip([1.416_666_667, 2.109_356_644, 1.666_666_667]) {
        assert!(relative(*found, wanted) < 3e-2, "{found} {wanted}");
    }
    assert!((stick - 0.5).abs() < 3.4 / cells as f64, "{stick}");
}

/// Truth: in gross slip over a distance L, the normal force falls linearly from P to P'. The wear volume is i ½ (P + P') L for
/// the specific wear rate i. Cells lose contact on the way, which causes an error of second order in the length of the
/// increments. Elastic lag changes the slip by less than 2e-3.
#[test]
fn wear_under_a_falling_force() {
    let (from, to, distance, intensity) = (100.0, 40.0, 2.0, 1e-12);
    let mut model = half_spaces(&crate::common::steel(), None, (0.4, 32), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.2 };
    model.wear = WearLaw::Archard { i: intensity };
    let wanted = intensity * 0.5 * (from + to) * distance;
    let slide = crate::common::shift(distance, 0.0);
    let [coarse, fine] = [4, 16].map(|increments| {
        let slide = Step { normal: Some(Normal::Force(to)), increments, ..slide.clone() };
        let run = solve(&model, &[press(from), slide]);
        let worn = run.records.last().expect("a record").worn_volume - run.records[0].worn_volume;
        worn / wanted - 1.0
    });
    assert!(coarse.abs() < 5e-2 && fine.abs() < 3e-3 && fine.abs() < 0.15 * coarse.abs(), "{coarse} {fine}");
}

/// Truth: under a constant normal force P, gross slip over a distance L wears the volume i P L. This holds even if wear changes
/// the pressures strongly: the wear depth of a single increment is many times the approach. Elastic lag changes the slip by less
/// than 2e-3.
#[test]
fn heavy_wear_in_one_increment() {
    let (force, distance) = (200.0, 2.0);
    let mut model = half_spaces(&crate::common::steel(), None, (0.8, 32), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.3 };
    for intensity in [1e-7, 1e-6, 1e-5] {
        model.wear = WearLaw::Archard { i: intensity };
        let slide = Step { normal: Some(Normal::Force(force)), ..crate::common::shift(distance, 0.0) };
        let run = solve(&model, &[Step { wear: false, ..press(force) }, slide]);
        let end = run.records.last().expect("a record");
        let share = end.worn_volume / (intensity * force * distance);
        assert!((share - 1.0).abs() < 2e-3, "{intensity:e}: {share}");
        assert!(end.iterations < 200, "{intensity:e}: {}", end.iterations);
    }
}

/// Truth: body 2 moves by L = 1 mm and is lifted by 1 mm at the same time. The approach at the start is δ = 2 µm, so contact ends
/// after the share δ / (δ + 1 mm) of the motion. The wear volume is less than this share of i ½ P L.
#[test]
fn wear_of_a_lifted_body() {
    let (force, distance, intensity) = (100.0, 1.0, 1e-12);
    let mut model = half_spaces(&crate::common::steel(), None, (0.4, 16), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: 0.2 };
    model.wear = WearLaw::Archard { i: intensity };
    let lift = Step { normal: Some(Normal::Approach(-1.0)), ..crate::common::shift(distance, 0.0) };
    let run = solve(&model, &[press(force), lift]);
    let [pressed, lifted] = &run.records[..] else { panic!("two records") };
    let worn = lifted.worn_volume - pressed.worn_volume;
    let share = pressed.approach / (pressed.approach + 1.0);
    assert!(worn > 0.0 && worn < share * intensity * 0.5 * force * distance, "{worn:e} {share}");
}

/// Truth: method of dimensionality reduction (Popov 2014). For the approach δ of a sphere of radius R, springs at x stick under
/// ±u if G* u < μ E* (δ - x²/R). A shrinking stick zone thus has the squared radius R (δ - u G* / (μ E*)), independent of the
/// wear outside the stick zone.
#[test]
fn stick_zone_that_moves() {
    let (radius, e_star, mu, amplitude, cells) = (100.0, 1e5, 0.5, 0.0018, 48);
    let material = Stiffness::isotropic(2.0 * e_star, 0.0).expect("an admissible material");
    let mut model = half_spaces(&material, Some(&material), (1.2, cells), sphere(radius));
    model.friction = FrictionLaw::Coulomb { mu };
    model.wear = WearLaw::Archard { i: 6e-7 };
    let mut cycles = fretting(20_000, amplitude, 1, Integrator::Sdirk2);
    cycles.kind.cycles_mut().expect("cycles").jumps = JumpPolicy::Tolerance(3e-3);
    let lifted = Step { name: "fretting".into(), normal: Some(Normal::Approach(0.0061)), ..cycles };
    let run = solve(&model, &[indent(0.01), lifted]);
    assert_eq!(run.outcome, Outcome::Converged, "{:?}", run.warnings);
    // G* = E* for nu = 0.
    let stick_radius = |approach: f64| (radius * (approach - amplitude / mu)).sqrt();
    let side = 2.4 / cells as f64;
    let jumps: Vec<_> = run.records.iter().filter(|record| record.jump.is_some()).collect();
    for record in &jumps {
        let (found, wanted) =
            ((record.stick_area / std::f64::consts::PI).sqrt(), stick_radius(record.approach));
        assert!((found - wanted).abs() < 0.7 * side, "{}: {found} {wanted}", record.cycles_done);
    }
    let last = stick_radius(0.0061);
    assert!(stick_radius(jumps[0].approach) - last > 3.0 * side);
    let worn = &run.state.wear_depth;
    let place = |k: usize| (k as f64 + 0.5) * side - 1.2;
    let distance = |i: usize| place(i / cells).hypot(place(i % cells));
    let deepest = worn.iter().copied().fold(0.0, f64::max);
    // The wear depth is more than a twentieth of the first approach, 0.01 mm.
    assert!(deepest > 5e-4, "{deepest}");
    let inside =
        (0..cells * cells).filter(|&i| distance(i) < last - side).map(|i| worn[i]).fold(0.0, f64::max);
    assert!(inside < 1e-3 * deepest, "{inside} {deepest}");
}
