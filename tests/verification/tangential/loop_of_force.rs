//! Hysteresis under a cyclic tangential force or displacement (Mindlin and Deresiewicz 1953; case `mindlin-deresiewicz-loop` of
//! docs/verification.md).

use orthowear::contact::SolverOptions;
use orthowear::evolution::records::{FrameState, Outcome};
use orthowear::evolution::step::Step;
use orthowear::evolution::{Model, RunResult};
use orthowear::laws::friction::FrictionLaw;
use orthowear::material::Stiffness;

use crate::common::{half_spaces, press, relative, shift, sphere};
use crate::observed::{follow, pull};

const LOAD: f64 = 1000.0;
const MU: f64 = 0.3;
/// Increments per quarter of a loop.
const QUARTER: usize = 40;

/// Contact radius, displacement D0 at the onset of full sliding, and tangential compliance S = 2 (2 - nu) / G.
fn scales(nu: f64) -> (f64, f64, f64) {
    let reduced = 210e3 / (1.0 - nu * nu) / 2.0;
    let a = (3.0 * LOAD * 10.0 / (4.0 * reduced)).cbrt();
    let compliance = 2.0 * (2.0 - nu) / (210e3 / (2.0 * (1.0 + nu)));
    (a, 3.0 * MU * LOAD / (16.0 * a) * compliance, compliance)
}

fn spheres(nu: f64) -> Model {
    let material = Stiffness::isotropic(210e3, nu).expect("admissible");
    let mut model = half_spaces(&material, Some(&material), (1.1 * scales(nu).0, 44), sphere(10.0));
    model.friction = FrictionLaw::Coulomb { mu: MU };
    model
}

/// Presses the spheres and applies `to(1)` in a quarter of a loop. Then goes `loops` times to `to(-1)` and back to `to(1)`.
fn loops(model: &Model, to: &dyn Fn(f64) -> Step, loops: usize) -> (RunResult, Vec<FrameState>) {
    let mut steps = vec![press(LOAD), Step { increments: QUARTER, ..to(1.0) }];
    for _ in 0..loops {
        steps.extend([-1.0, 1.0].map(|end| Step { increments: 2 * QUARTER, ..to(end) }));
    }
    let options = SolverOptions { tolerance: 1e-9, ..SolverOptions::default() };
    let (result, fields) = follow(model, &steps, &options);
    assert_eq!(result.outcome, Outcome::Converged);
    (result, fields)
}

/// Area of the loop of force over displacement between the records `from` and `to`, by the trapezoidal rule.
fn area(result: &RunResult, from: usize, to: usize) -> f64 {
    (from..to)
        .map(|k| (&result.records[k], &result.records[k + 1]))
        .map(|(a, b)| 0.5 * (a.tangential_force[0] + b.tangential_force[0]) * (b.shift[0] - a.shift[0]))
        .sum()
}

fn dissipated(model: &Model, fields: &[FrameState], from: usize, to: usize) -> f64 {
    let n = model.frame.n_cells();
    let increment = |k: usize| -> f64 {
        let (before, after) = (&fields[k].tractions, &fields[k + 1].tractions);
        (0..2 * n)
            .map(|i| -0.5 * (before[i] + after[i]) * fields[k + 1].slip[i] * model.frame.areas[i % n])
            .sum()
    };
    (from..to).map(increment).sum()
}

/// Energy dissipated in a cycle of the tangential force ±Q* with z = Q* / (mu P).
fn dissipation(nu: f64, z: f64) -> f64 {
    let (a, _, compliance) = scales(nu);
    9.0 * (MU * LOAD).powi(2) / (10.0 * a)
        * compliance
        * (1.0 - (1.0 - z).powf(5.0 / 3.0) - 5.0 * z / 6.0 * (1.0 + (1.0 - z).powf(2.0 / 3.0)))
}

/// Truth: the solution is exact for nu = 0, here under a force up to 0.6 mu P. The dissipation of a cycle, the largest
/// displacement and the displacement at Q = 0 on the way back agree to 1e-2. The second loop equals the first one to 1e-6. The
/// work of tractions on slip equals the area of the loop to 1e-6.
#[test]
fn loops_under_a_force() {
    let model = spheres(0.0);
    let top = 0.6 * MU * LOAD;
    let (result, fields) = loops(&model, &|end| pull([end * top, 0.0]), 2);
    let (start, cycle) = (QUARTER, 4 * QUARTER);
    let (_, slide, _) = scales(0.0);
    let largest = slide * (1.0 - 0.4_f64.powf(2.0 / 3.0));
    let at_zero = largest - 2.0 * slide * (1.0 - 0.7_f64.powf(2.0 / 3.0));
    assert!(relative(result.records[start].shift[0], largest) < 1e-2);
    let zero = result.records[start + QUARTER].shift[0];
    assert!((zero - at_zero).abs() < 1e-2 * largest, "{zero} {at_zero}");
    let work = area(&result, start, start + cycle);
    assert!(relative(work, dissipation(0.0, 0.6)) < 1e-2, "{work} {}", dissipation(0.0, 0.6));
    let slipped = dissipated(&model, &fields, start, start + cycle);
    assert!(relative(slipped, work) < 1e-6, "{slipped} {work}");
    for k in 0..=cycle {
        let (first, second) =
            (result.records[start + k].shift[0], result.records[start + cycle + k].shift[0]);
        // The first loop ends where the initial loading ended, so both loops are the same.
        assert!((first - second).abs() < 1e-6 * largest, "{k}: {first} {second}");
    }
}

/// Truth: the dissipation under a displacement between ±D0, at the onset of full sliding (z = 1), to 1e-2.
#[test]
fn loops_to_the_verge_of_sliding() {
    let model = spheres(0.0);
    let (_, slide, _) = scales(0.0);
    let to = |end: f64| shift(slide, if end > 0.0 { 0.0 } else { 180.0 });
    let (result, fields) = loops(&model, &to, 1);
    let (start, cycle) = (QUARTER, 4 * QUARTER);
    let work = area(&result, start, start + cycle);
    assert!(relative(work, dissipation(0.0, 1.0)) < 1e-2, "{work} {}", dissipation(0.0, 1.0));
    let slipped = dissipated(&model, &fields, start, start + cycle);
    assert!(relative(slipped, work) < 1e-6, "{slipped} {work}");
    assert!(relative(result.records[start].tangential_force[0], MU * LOAD) < 1e-2);
}

/// Truth: values of the classical solution for nu = 0.3, to 3 %. The classical solution neglects slip perpendicular to the force.
#[test]
fn loops_with_lateral_contraction() {
    let model = spheres(0.3);
    let (start, cycle) = (QUARTER, 4 * QUARTER);
    let (result, _) = loops(&model, &|end| pull([end * 0.6 * MU * LOAD, 0.0]), 1);
    let work = area(&result, start, start + cycle);
    assert!(relative(work, 0.09671688831) < 3e-2, "{work}");
    assert!(relative(result.records[start].shift[0], 0.002692017759) < 3e-2);
}

/// Truth: values of the classical solution for nu = 0.3 under a displacement between ±D0 (z = 1), to 3 %.
#[test]
fn loops_to_the_verge_of_sliding_with_lateral_contraction() {
    let model = spheres(0.3);
    let (_, slide, _) = scales(0.3);
    assert!(relative(slide, 0.005889129) < 1e-6, "{slide}");
    let to = |end: f64| shift(slide, if end > 0.0 { 0.0 } else { 180.0 });
    let (result, _) = loops(&model, &to, 1);
    let (start, cycle) = (QUARTER, 4 * QUARTER);
    let work = area(&result, start, start + cycle);
    assert!(relative(work, 1.413391) < 3e-2, "{work}");
    assert!(relative(result.records[start].tangential_force[0], MU * LOAD) < 3e-2);
    // On the way back the force is zero at the displacement D0 - 2 D0 (1 - 2^(-2/3)), which lies between two increments.
    let back = &result.records[start..=start + 2 * QUARTER];
    let crossing = back.windows(2).find(|pair| pair[1].tangential_force[0] <= 0.0).expect("the force turns");
    let [(x0, q0), (x1, q1)] = [0, 1].map(|k| (crossing[k].shift[0], crossing[k].tangential_force[0]));
    let at_zero = x0 + (x1 - x0) * q0 / (q0 - q1);
    assert!((at_zero - 0.001530709).abs() < 3e-2 * slide, "{at_zero}");
}
