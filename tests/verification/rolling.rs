//! Steady rolling: closed forms in plane strain, Kalker's linear coefficients, limits and symmetries. docs/verification.md lists
//! the named cases.

use std::f64::consts::PI;

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::{Rolling, Step, StepKind};
use orthowear::evolution::{Model, RunResult};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::omitted::AllowedOmissions;

use crate::common::{half_spaces, im7, press, rectangle, relative, solve, solve_with, sphere, steel, step};
use crate::periodic::repeated;

fn roll(quarter_turns: u8, creepage: [f64; 2], spin: f64) -> Step {
    let rolling = Rolling { quarter_turns, creepage, spin, distance: 1.0 };
    Step { kind: StepKind::Rolling(rolling), ..step("roll") }
}

/// Relative radius of curvature of two equal steel cylinders, mm.
const RADIUS: f64 = 20.0;
/// Load per length of the cylinders, N/mm.
const LOAD: f64 = 500.0;
const MU: f64 = 0.3;

/// Half-width of the Hertzian contact, mm.
fn half_width() -> f64 {
    let modulus = 0.5 * 210e3 / 0.91;
    (4.0 * LOAD * RADIUS / (PI * modulus)).sqrt()
}

fn cylinders(cells: usize) -> Model {
    let steel = steel();
    let frame = ([0.4, 0.5], [cells, 1], [false, true]);
    let mut model = repeated([Some(&steel), Some(&steel)], frame, |x, _| x * x / (2.0 * RADIUS));
    model.friction = FrictionLaw::Coulomb { mu: MU };
    model
}

fn converged(model: &Model, steps: &[Step]) -> RunResult {
    let result = solve(model, steps);
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.records.last());
    let certificate = result.records.last().expect("a record").certificate;
    assert!(certificate.natural_residual <= 1e-8 && certificate.energy_balance < 1e-10, "{certificate:?}");
    assert!(certificate.tangential_gap_energy.abs() < 1e-6, "{certificate:?}");
    result
}

/// Truth: case `carter-2d` (Johnson 1985, 8.3). The creepage is |ξ| = (μ a / R)(1 - c / a), to 2 %. The stick area has the
/// half-width c, the contact the half-width a. They obey c / a = sqrt(1 - Q / μP) for the load P and the tangential force Q. The
/// stick area reaches the leading edge. Body 2 slips in the direction of rolling and drags body 1 along.
#[test]
fn carter() {
    let model = cylinders(256);
    let a = half_width();
    for (ratio, c) in [(0.5, 0.5_f64.sqrt()), (0.75, 0.5)] {
        for quarter_turns in [0, 2] {
            let creep = MU * a / RADIUS * (1.0 - c);
            let result = converged(&model, &[press(LOAD), roll(quarter_turns, [creep, 0.0], 0.0)]);
            let record = &result.records[1];
            let sense = if quarter_turns == 0 { 1.0 } else { -1.0 };
            let q = sense * record.tangential_force[0] / (MU * LOAD);
            let found = MU * a / RADIUS * (1.0 - (1.0 - q).sqrt());
            assert!(relative(found, creep) < 2e-2, "{ratio} {quarter_turns}: {found} {creep}, Q {q}");
            let mut contact: Vec<u8> = result.state.status.iter().copied().filter(|s| *s > 0).collect();
            if quarter_turns == 0 {
                contact.reverse();
            }
            let stick = contact.iter().take_while(|s| **s == 1).count();
            assert!(contact[stick..].iter().all(|s| *s == 2), "{contact:?}");
            let h = 0.8 / 256.0;
            assert!((stick as f64 * h / 2.0 - c * a).abs() < 1.5 * h, "{} {}", stick as f64 * h / 2.0, c * a);
        }
    }
}

/// Truth: each increment of a growing creepage is a steady state. The last increment equals a single increment with the whole
/// creepage.
#[test]
fn increments_are_a_creep_curve() {
    let (model, creep) = (cylinders(100), 0.5 * MU * half_width() / RADIUS);
    let once = converged(&model, &[press(LOAD), roll(0, [creep, 0.0], 0.0)]);
    let curve = converged(&model, &[press(LOAD), Step { increments: 3, ..roll(0, [creep, 0.0], 0.0) }]);
    let (a, b) = (&once.records[1], &curve.records[3]);
    assert!(relative(b.tangential_force[0], a.tangential_force[0]) < 1e-6);
    let creepages: Vec<f64> =
        curve.records[1..].iter().map(|record| record.rolling.expect("rolling").creepage[0]).collect();
    (0..3).for_each(|i| assert!((creepages[i] - (i + 1) as f64 / 3.0 * creep).abs() < 1e-18));
    let forces: Vec<f64> = curve.records[1..].iter().map(|record| record.tangential_force[0]).collect();
    assert!(forces[0] < forces[1] && forces[1] < forces[2], "{forces:?}");
}

fn ball(stiffness: &Stiffness, cells: usize) -> Model {
    let mut model = half_spaces(stiffness, Some(stiffness), (0.3, cells), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: MU };
    model
}

/// Truth: case `kalker-circle`. Kalker (1990, table E.3) gives the coefficients to three digits. They agree to 2.5 %, with nu =
/// 0.4999 in place of 0.5. The creepage ξ causes the force Q = G a² C11 ξ (shear modulus G, contact radius a). C22, C23 and C33
/// have similar formulas. Results are forces on body 1, with signs opposite to Kalker's.
///
/// Creepages are a hundredth of the creepage at full sliding, which lowers the forces by 0.5 %. The rigid slip of a cell is
/// evaluated half a cell (h / 2) ahead of its centre. This changes the coupling C23 by C22 h / 4a, here 0.7 % of C23.
#[test]
fn kalker_circle() {
    let (load, e) = (300.0, 210e3);
    for (nu, [c11, c22, c23, c33]) in [
        (0.0, [3.4, 3.4, 1.33, f64::NAN]),
        (0.25, [4.12, 3.67, 1.47, 1.19]),
        (0.4999, [5.2, 3.98, 1.63, f64::NAN]),
    ] {
        let material = Stiffness::isotropic(e, nu).expect("admissible");
        let model = ball(&material, 200);
        let g = e / (2.0 * (1.0 + nu));
        let modulus = e / (2.0 * (1.0 - nu * nu));
        let a = (0.75 * load * 10.0 / modulus).cbrt();
        let small = 0.01 * MU * a / 10.0;
        let last = |creepage, spin| {
            let result = converged(&model, &[press(load), roll(0, creepage, spin)]);
            let record = &result.records[1];
            (record.tangential_force, record.moment[2])
        };
        let check = |found: f64, expected: f64, name: &str| {
            assert!(
                expected.is_nan() || relative(found, expected) < 2.5e-2,
                "nu {nu} {name}: {found} {expected}"
            );
        };
        let (force, _) = last([small, 0.0], 0.0);
        check(force[0] / (g * a * a * small), c11, "C11");
        let (force, moment) = last([0.0, small], 0.0);
        check(force[1] / (g * a * a * small), c22, "C22");
        check(-moment / (g * a.powi(3) * small), c23, "C23 by creepage");
        let (force, moment) = last([0.0, 0.0], small / a);
        check(force[1] / (g * a.powi(3) * small / a), c23, "C23 by spin");
        check(moment / (g * a.powi(4) * small / a), c33, "C33");
    }
}

/// Truth: if the creepage v is far beyond the limit of adhesion, every cell slides. The friction force on body 1 is Q = μP in the
/// direction of v. For a friction ellipse it is Q = P M² v / |M v| with M = diag(μ1, μ2).
#[test]
fn full_sliding() {
    let load = 300.0;
    let mut model = ball(&steel(), 24);
    for friction in [FrictionLaw::Coulomb { mu: 0.3 }, FrictionLaw::Elliptic { mu: [0.2, 0.4], angle: 0.0 }] {
        model.friction = friction;
        let mu = friction.ellipse().expect("friction").mu;
        let v = [0.3, 0.4];
        let record = &converged(&model, &[press(load), roll(0, v, 0.0)]).records[1];
        let norm = (mu[0] * v[0]).hypot(mu[1] * v[1]);
        for k in 0..2 {
            let expected = load * mu[k] * mu[k] * v[k] / norm;
            assert!(relative(record.tangential_force[k], expected) < 1e-2, "{record:?} {expected}");
        }
        assert_eq!(record.stick_area, 0.0);
    }
}

/// Truth: in plane strain the slip stays in the plane. Only the semi-axis of the friction ellipse along this plane affects the
/// result.
#[test]
fn an_ellipse_along_its_axis_is_coulomb() {
    let creep = [0.5 * MU * half_width() / RADIUS, 0.0];
    let mut model = cylinders(100);
    let coulomb = converged(&model, &[press(LOAD), roll(0, creep, 0.0)]);
    model.friction = FrictionLaw::Elliptic { mu: [MU, 0.7], angle: 0.0 };
    let elliptic = converged(&model, &[press(LOAD), roll(0, creep, 0.0)]);
    let (a, b) = (&coulomb.records[1], &elliptic.records[1]);
    assert!(relative(b.tangential_force[0], a.tangential_force[0]) < 1e-6);
    assert_eq!(a.stick_area, b.stick_area);
}

/// Truth: the fibres lie in the plane y = 0 of rolling, which is a plane of symmetry. The mirror y -> -y reverses lateral
/// creepage, spin, lateral force and moment.
#[test]
fn mirrored_rolling_on_cfrp() {
    let mut model = half_spaces(&im7(30.0), Some(&steel()), (0.5, 24), sphere(10.0));
    model.friction = FrictionLaw::Elliptic { mu: [0.3, 0.4], angle: 0.0 };
    let result = |side: f64| {
        converged(&model, &[press(100.0), roll(0, [4e-3, side * 3e-3], side * 8e-3)]).records[1].clone()
    };
    let (left, right) = (result(1.0), result(-1.0));
    let scale = left.normal_force;
    assert!((left.tangential_force[0] - right.tangential_force[0]).abs() < 1e-6 * scale);
    assert!((left.tangential_force[1] + right.tangential_force[1]).abs() < 1e-6 * scale);
    assert!((left.moment[2] + right.moment[2]).abs() < 1e-6 * scale);
    assert_eq!(left.stick_area, right.stick_area);
    assert!(left.stick_area > 0.0 && left.stick_area < left.contact_area);
}

/// Truth: in a steady state, friction dissipates the work per rolled distance, to rounding. This work is tangential force times
/// creepage plus spin moment times spin. With an energy law, the wear volume is k times the dissipation. It agrees only to 1e-2,
/// because tractions change direction within a cell at the edge of the stick area.
#[test]
fn wear_per_rolled_distance() {
    let mut model = ball(&steel(), 48);
    let k = 1e-9;
    model.wear = WearLaw::Energy { k };
    let (creepage, spin, distance) = ([2e-3, 1e-3], 2e-3, 40.0);
    let mut rolling = roll(0, creepage, spin);
    rolling.kind = StepKind::Rolling(Rolling { quarter_turns: 0, creepage, spin, distance });
    let result = converged(&model, &[press(300.0), rolling]);
    let (before, record) = (&result.records[0], &result.records[1]);
    let force = record.tangential_force;
    let work = (force[0] * creepage[0] + force[1] * creepage[1] + record.moment[2] * spin) * distance;
    let dissipated = record.dissipation - before.dissipation;
    assert!(relative(dissipated, work) < 1e-9, "{dissipated} {work}");
    let worn = record.worn_volume - before.worn_volume;
    assert!(relative(worn, k * dissipated) < 1e-2, "{worn} {}", k * dissipated);
    assert_eq!(record.max_wear_depth, before.max_wear_depth);
    let rolled = record.rolling.expect("rolling");
    assert_eq!((rolled.creepage, rolled.spin, rolled.distance), (creepage, spin, distance));
}

/// Truth: forces on cells of full and of half the size agree to 0.1 %. Tilted fibres couple normal and tangential displacements.
#[test]
fn rolling_on_tilted_fibres() {
    let rolled = |cells| {
        let mut model = half_spaces(&im7(30.0), Some(&steel()), (0.6, cells), sphere(10.0));
        model.friction = FrictionLaw::Coulomb { mu: 0.3 };
        converged(&model, &[press(200.0), roll(0, [0.002, 0.001], 0.0)]).records.remove(1)
    };
    let [coarse, fine] = [64, 128].map(rolled);
    assert_eq!(fine.method, "newton");
    for k in 0..2 {
        let apart = (fine.tangential_force[k] - coarse.tangential_force[k]).abs();
        assert!(apart < 1e-3 * fine.tangential_force[0].abs(), "{fine:?} {coarse:?}");
    }
}

/// Truth: `max_iterations` is the only limit on the iterations of a step. One semi-axis of the friction ellipse is some 300 times
/// smaller than the other, so the solution takes more than 500 iterations. The solution on windows equals the solution on the
/// whole frame.
#[test]
fn rolling_with_little_friction_across() {
    let mut model = rectangle(&steel(), Some(&steel()), ([0.8; 2], [72, 60]), sphere(10.0));
    model.friction = FrictionLaw::Elliptic { mu: [0.3, 0.0009], angle: 77_f64.to_radians() };
    let steps = [press(50.0), roll(0, [0.001, 0.0], 0.0)];
    let windows = converged(&model, &steps);
    let whole = solve_with(
        &model,
        &steps,
        &SolverOptions { skip: AllowedOmissions::NONE, ..SolverOptions::default() },
    );
    assert_eq!(whole.outcome, Outcome::Converged);
    let [a, b] = [&windows, &whole].map(|result| result.records[1].tangential_force);
    assert!((0..2).all(|k| (a[k] - b[k]).abs() < 1e-6 * a[0].hypot(a[1])), "{a:?} {b:?}");
    assert!(windows.records[1].iterations > 500, "{}", windows.records[1].iterations);
}
