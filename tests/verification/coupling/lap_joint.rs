//! Half of a bolted double lap joint. The outer strap is a cantilever and very flexible, so the flexibility has a condition
//! number of 1e7. The middle strap rests on its plane of symmetry.

use std::collections::HashMap;

use super::bricks::{spec, support};
use crate::common::{Silent, indent, shift, step};
use crate::fem_meshes::{add_cells, block};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::FeBody;
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::element::ElementKind;
use orthowear::evolution::records::{Divergence, Outcome};
use orthowear::evolution::step::{Step, Tangential};
use orthowear::evolution::{Model, RunResult, run};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;
use orthowear::mesh::faces::outer_faces;

/// Number of elements along the overlap, and along the rest of each strap.
const ELEMENTS: usize = 40;

/// A strap of length 60 mm, thickness 2 mm and width 1 mm. It begins at (`x`, `z`). The straps overlap for 0 <= x <= 20 mm.
fn strap(x: f64, z: f64) -> Mesh {
    let ends = [x, if x < 0.0 { 0.0 } else { 20.0 }, x + 60.0];
    let place = |t: f64| {
        let half = usize::from(t > 0.5);
        ends[half] + (2.0 * t - half as f64) * (ends[half + 1] - ends[half])
    };
    let mut mesh =
        block(ElementKind::Hex8, [2 * ELEMENTS, 1, 8], [1.0, 1.0, 2.0], |[t, y, h]| [place(t), y, z + h]);
    let part = |mesh: &Mesh, z: f64, [first, last]: [f64; 2]| -> Vec<usize> {
        let inside = |&node: &usize| {
            let [x, _, height] = mesh.points[node];
            (height - z).abs() < 1e-9 && x > first - 1e-9 && x < last + 1e-9
        };
        let faces = outer_faces(mesh);
        faces
            .iter()
            .filter(|face| face.nodes.iter().all(inside))
            .flat_map(|face| face.nodes.clone())
            .collect()
    };
    let (contact, washer) = (part(&mesh, 0.0, [0.0, 20.0]), part(&mesh, z + 2.0, [6.0, 14.0]));
    add_cells(&mut mesh, ElementKind::Quad4, "contact", contact);
    add_cells(&mut mesh, ElementKind::Quad4, "washer", washer);
    mesh
}

/// The two straps, pressed together by 50 MPa under the washer. The far end of the outer strap is fixed.
fn straps() -> Model {
    straps_fixed([true; 3])
}

/// Like [`straps`], but the far end of the outer strap is fixed only along the axes `fixed`.
fn straps_fixed(fixed: [bool; 3]) -> Model {
    let aluminium = Stiffness::isotropic(70e3, 0.3).expect("an admissible material");
    let mut middle = spec(strap(0.0, -2.0), &aluminium);
    middle.supports = vec![
        support("x1", [true; 3], [0.0; 3]),
        support("z0", [false, false, true], [0.0; 3]),
        support("body", [false, true, false], [0.0; 3]),
    ];
    let mut outer = spec(strap(-40.0, 0.0), &aluminium);
    outer.supports = vec![support("x0", fixed, [0.0; 3]), support("body", [false, true, false], [0.0; 3])];
    outer.pressures = vec![("washer".to_owned(), 50.0)];
    let frame =
        ContactFrame::from_nodes(&middle.mesh, "contact", Side::Lower, [0.0; 2], 0.0, &HashMap::new())
            .expect("a frame");
    let mut bodies = [(middle, Side::Lower), (outer, Side::Upper)]
        .map(|(spec, side)| FeBody::new(spec, "contact", side, &frame).expect("a body"));
    let [middle, outer] = &mut bodies;
    let distance = surface_distance(&InitialGap::from(GapShape::Flat), &frame, middle, outer).expect("a gap");
    let coupled = couple(middle, outer, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    Model {
        initial_gap: coupled.initial_gap(&distance),
        frame,
        flexibility: coupled.flexibility,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::Coulomb { mu: 0.3 },
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

fn clamp() -> Step {
    Step { friction: false, ..indent(0.0) }
}

fn solve(model: &Model, steps: &[Step]) -> RunResult {
    run(model, steps, &SolverOptions::default(), None, &mut Silent).expect("a run")
}

/// Truth: an independent program in plane strain, with the uncertainty of the last digit in brackets. The clamping force is
/// 400.089 N. After a displacement of 0.04 mm in eight increments the friction force is 63.132(7) N, the normal force 400.0619 N
/// and the dissipation 7.47e-3(4) N mm. With elements of 0.5 mm, the forces differ by less than 0.1 % and the dissipation by less
/// than 1 %. From the second stroke on, the hysteresis loop is closed. The dissipated work never decreases.
#[test]
fn clamped_straps_slip_along_their_ends() {
    let model = straps();
    let pulled = |angle: f64| Step { increments: 8, ..shift(0.04, angle) };
    let steps = [clamp(), pulled(180.0), pulled(0.0), pulled(180.0), pulled(0.0)];
    let result = solve(&model, &steps);
    assert!(result.records.iter().all(|record| record.converged), "{:?}", result.records.last());
    let forces = |i: usize| [result.records[i].normal_force, result.records[i].tangential_force[0]];
    let near = |found: f64, wanted: f64, share: f64| (found - wanted).abs() <= share * wanted.abs();
    assert!(near(forces(0)[0], 400.089, 1e-4), "{:?}", forces(0));
    let [normal, friction] = forces(8);
    assert!(near(normal, 400.0619, 1e-4) && near(-friction, 63.132, 1e-3), "{normal} {friction}");
    let dissipation = result.records[8].dissipation;
    assert!(near(dissipation, 7.47e-3, 1e-2), "{dissipation}");
    let (first, second) = (forces(16)[1], forces(32)[1]);
    assert!(near(first, second, 1e-6), "{first} {second}");
    let dissipated = result.records.windows(2).all(|pair| pair[1].dissipation >= pair[0].dissipation);
    assert!(dissipated);
}

/// Truth: if all cells slip, the friction force is mu N and opposes the slip. A tangential displacement of 1 mm makes the whole
/// overlap slip. Other runs prescribe forces. A force of 0.9999 times this friction force has an equilibrium, a force of 1.0001
/// times has none.
#[test]
fn straps_slide_at_their_friction_limit() {
    let model = straps();
    let shifted = solve(&model, &[clamp(), Step { increments: 4, ..shift(1.0, 180.0) }]);
    let slid = shifted.records.last().expect("a record");
    let limit = -slid.tangential_force[0];
    assert!((limit - 0.3 * slid.normal_force).abs() < 1e-7 * limit, "{limit} {}", slid.normal_force);
    let pulled = |share: f64| {
        let force = Some(Tangential::Force([-share * limit, 0.0]));
        solve(&model, &[clamp(), Step { tangential: force, ..step("pull") }])
    };
    let held = pulled(0.9999);
    assert_eq!(held.outcome, Outcome::Converged);
    let record = &held.records[1];
    assert!((record.tangential_force[0] + 0.9999 * limit).abs() < 1e-7 * limit && record.stick_area > 0.0);
    let beyond = pulled(1.0001);
    assert_eq!(beyond.outcome, Outcome::NotConverged(Divergence::GrossSliding));
    assert!((beyond.records[1].tangential_force[0] + limit).abs() < 1e-7 * limit);
    assert!(beyond.warnings.iter().any(|w| w.contains("body 2 slides along -x")), "{:?}", beyond.warnings);
}

/// Prescribes the force `force` on the outer strap along x, in `increments`. A second run prescribes the tangential displacements
/// of the first run. Asserts that both runs converge with the same forces.
///
/// The tolerance is 1e-6 of the force, at residuals of at most 1e-8.
fn check_forces_against_shifts(model: &Model, force: f64, increments: usize) {
    let tangential = Some(Tangential::Force([force, 0.0]));
    let pulled = solve(model, &[clamp(), Step { tangential, increments, ..step("pull") }]);
    assert_eq!(pulled.outcome, Outcome::Converged);
    assert!((pulled.records[increments].tangential_force[0] - force).abs() < 1e-6 * force.abs());
    let shifts = pulled.records[1..].iter().map(|record| record.shift[0]);
    let steps: Vec<Step> = std::iter::once(clamp()).chain(shifts.map(|to| shift(to, 0.0))).collect();
    let shifted = solve(model, &steps);
    assert_eq!(shifted.outcome, Outcome::Converged);
    for (one, other) in pulled.records.iter().zip(&shifted.records).skip(1) {
        let apart = one.tangential_force[0] - other.tangential_force[0];
        assert!(apart.abs() < 1e-6 * force.abs(), "{:?} {:?}", one.tangential_force, other.tangential_force);
    }
}

/// Truth: a prescribed tangential displacement and its friction force have the same state. The forces are 0.8 and 0.25 of the
/// friction limit.
#[test]
fn forces_and_shifts_give_the_same_states() {
    check_forces_against_shifts(&straps(), -96.0, 8);
    check_forces_against_shifts(&straps(), -30.0, 4);
}

/// Truth: a prescribed tangential displacement and its friction force have the same state. The force is half the friction limit,
/// and acts in one increment. The far end of the strap is free normal to the contact, so the contact alone carries the strap.
#[test]
fn a_free_end_follows_the_force() {
    check_forces_against_shifts(&straps_fixed([true, false, false]), 60.0, 1);
}

/// Truth: Newton's method converges in a few steps, with at most 100 iterations per increment. Supports fix both straps along y,
/// so a force along y changes only the tractions. The matrix has a small additional compliance along y. With the full local
/// compliance the increments would take 900 to 2000 iterations.
#[test]
fn a_force_along_a_fixed_direction_takes_few_iterations() {
    let force = Some(Tangential::Force([52.0, 30.0]));
    let result = solve(&straps(), &[clamp(), Step { tangential: force, increments: 4, ..step("pull") }]);
    assert_eq!(result.outcome, Outcome::Converged);
    let iterations: Vec<usize> = result.records[1..].iter().map(|record| record.iterations).collect();
    assert!(iterations.iter().all(|n| *n <= 100), "{iterations:?}");
}
