//! Bodies with unconstrained rigid-body modes (free bodies).

use super::bricks::{Brick, rollers, spec, straight, support, wavy};
use crate::common::{Silent, step};
use nalgebra::{DMatrix, Vector3};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, FeBody, Loading, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::evolution::records::{Divergence, Outcome};
use orthowear::evolution::step::{Normal, Step, Tangential};
use orthowear::evolution::{Model, RunResult, run};
use orthowear::fem::{FeModel, FeSpec};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;
use orthowear::mesh::gmsh;
use orthowear::omitted::AllowedOmissions;

const TIGHT: SolverOptions = SolverOptions {
    tolerance: 1e-11,
    method: orthowear::contact::Method::Auto,
    max_iterations: 20_000,
    skip: AllowedOmissions::ALL,
};

fn material(e: f64, nu: f64) -> Stiffness {
    Stiffness::isotropic(e, nu).expect("an admissible material")
}

/// A block over [-2, 2] x [-1.5, 1.5] above z = 0, with its contact face at the bottom.
fn upper_mesh(distortion: fn([f64; 2]) -> [f64; 2], height: f64) -> Mesh {
    Brick {
        width: [2.0, 1.5],
        z: [0.0, height],
        cells: [4, 4, 3],
        contact_on_top: false,
        distortion,
        tetrahedra: false,
    }
    .mesh()
}

fn model(
    [body1, body2]: [&mut dyn ElasticBody; 2],
    frame: &ContactFrame,
    gap: GapShape,
    friction: FrictionLaw,
) -> Model {
    let gap = InitialGap::from(gap);
    let distance = surface_distance(&gap, frame, body1, body2).expect("a gap");
    let coupled = couple(body1, body2, frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let initial_gap = coupled.initial_gap(&distance);
    Model {
        frame: frame.clone(),
        flexibility: coupled.flexibility,
        initial_gap,
        loads: coupled.loads,
        floating: coupled.floating,
        friction,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

/// Runs a free body on a rigid plane. The cells of the frame are the contact faces of the body.
fn on_rigid(spec: FeSpec, friction: FrictionLaw, steps: &[Step]) -> (FeBody, RunResult) {
    let frame = ContactFrame::from_faces(&spec.mesh, "contact", Side::Upper, [0.0; 2], 0.0).expect("a frame");
    let mut body = FeBody::new(spec, "contact", Side::Upper, &frame).expect("a body");
    let model = model([&mut RigidBody, &mut body], &frame, GapShape::Flat, friction);
    let result = run(&model, steps, &TIGHT, None, &mut Silent).expect("a run");
    (body, result)
}

/// Resultant force, and resultant moment about the origin, of `forces` at `points`.
fn resultant(points: &[[f64; 3]], forces: &[[f64; 3]]) -> [Vector3<f64>; 2] {
    points.iter().zip(forces).fold([Vector3::zeros(); 2], |[force, moment], (x, f)| {
        let (x, f) = (Vector3::from(*x), Vector3::from(*f));
        [force + f, moment + x.cross(&f)]
    })
}

/// Stiffness matrix without grounding springs. Column j contains the nodal forces of the stresses due to a unit displacement of
/// dof j.
fn dense_stiffness(model: &FeModel) -> DMatrix<f64> {
    let n = model.mesh().n_points();
    let mut k = DMatrix::zeros(3 * n, 3 * n);
    for dof in 0..3 * n {
        let mut u = vec![[0.0; 3]; n];
        u[dof / 3][dof % 3] = 1.0;
        let forces = model.internal_forces(&u).expect("sound elements");
        forces.iter().flatten().enumerate().for_each(|(i, f)| k[(i, dof)] = *f);
    }
    k
}

/// Truth: the condensed stiffness of a free body has exactly six zero modes, its rigid motions (case `condensed-rigid-modes` of
/// docs/verification.md, to 1e-10 of the largest entry). The flexibility of a free body is a generalised inverse. The condensed
/// stiffness times this flexibility reproduces every force in equilibrium.
#[test]
fn a_free_body_has_six_zero_modes() {
    let mut free = spec(upper_mesh(wavy, 1.0), &material(210e3, 0.3));
    free.body_force = [1.0, -2.0, 3.0];
    let contact = free.mesh.group_nodes("contact").expect("a group");
    let body = FeModel::new(free).expect("a body").condense(&contact).expect("a factor");
    let model = body.model();
    let points = &model.mesh().points;
    let k = dense_stiffness(model);
    let (inner, outer): (Vec<usize>, Vec<usize>) =
        (0..3 * points.len()).partition(|dof| !contact.contains(&(dof / 3)));
    let pick = |rows: &[usize], columns: &[usize]| k.select_rows(rows).select_columns(columns);
    let solved =
        pick(&inner, &inner).cholesky().expect("held at its contact nodes").solve(&pick(&inner, &outer));
    let condensed = pick(&outer, &outer) - pick(&outer, &inner) * solved;
    let modes = DMatrix::from_fn(outer.len(), 6, |i, j| {
        let mut axis = Vector3::zeros();
        axis[j % 3] = 1.0;
        let moved = if j < 3 { axis } else { axis.cross(&Vector3::from(points[outer[i] / 3])) };
        moved[outer[i] % 3]
    });
    let scale = condensed.amax();
    assert!((&condensed * &modes).amax() < 1e-10 * scale);
    let values = nalgebra::SymmetricEigen::new(condensed.clone()).eigenvalues;
    assert_eq!(values.iter().filter(|value| value.abs() < 1e-10 * scale).count(), 6);
    assert!(values.iter().all(|value| *value > -1e-10 * scale));
    assert_eq!(model.rigid_body_modes().expect("a floating body").n_modes(), 6);

    let any = DMatrix::from_fn(outer.len(), 1, |i, _| ((7 * i + 3) % 11) as f64 - 5.0);
    let gram = modes.transpose() * &modes;
    let balanced = &any - &modes * gram.cholesky().expect("independent").solve(&(modes.transpose() * &any));
    let flexibility = DMatrix::from_fn(outer.len(), outer.len(), |i, j| body.flexibility().at(i, j));
    assert!((&condensed * flexibility * &balanced - &balanced).amax() < 1e-9 * balanced.amax());

    let u = body.solve(any.as_slice()).expect("a displacement");
    let mut rest = model.internal_forces(&u).expect("sound elements");
    for (node, force) in rest.iter_mut().enumerate() {
        (0..3).for_each(|c| force[c] -= model.loads().forces()[node][c]);
    }
    outer.iter().zip(any.iter()).for_each(|(dof, f)| rest[dof / 3][dof % 3] -= f);
    // The residual balances the resultant of the forces. It is distributed like the mass of the body, not at single nodes.
    let [force, _] = resultant(points, &rest);
    let largest = rest.iter().flatten().fold(0.0f64, |m, f| m.max(f.abs()));
    assert!(force.norm() > 1.0 && largest < 0.1 * force.norm(), "{force} {largest}");
}

/// Truth: the stacked blocks of case `two-blocks-stack` (docs/verification.md), with an unconstrained upper block. A uniform
/// pressure p shortens blocks of height L1 and L2 by p (L1/E1 + L2/E2). The approach is the mean displacement of the upper block,
/// p (L1/E1 + L2/(2 E2)). The elements represent this solution exactly, so the tolerance is 1e-9.
///
/// The solver adds grounding springs to the stiffness of a free body. With reversed node numbers these springs lie at other
/// nodes, without effect on the result.
#[test]
fn a_floating_block_on_another() {
    let (p, l1, e1, l2, e2) = (10.0, 5.0, 210e3, 8.0, 70e3);
    let lower = Brick {
        width: [2.0, 1.5],
        z: [-l1, 0.0],
        cells: [4, 4, 3],
        contact_on_top: true,
        distortion: straight,
        tetrahedra: false,
    };
    let straightened = upper_mesh(straight, l2);
    let guided = vec![
        support("pin", [true, true, false], [0.0; 3]),
        support("second-pin", [false, true, false], [0.0; 3]),
    ];
    for (mesh, supports, free) in [
        (straightened.clone(), vec![], 6),
        (backwards(straightened.clone()), vec![], 6),
        (straightened, guided, 3),
    ] {
        let mut below = spec(lower.mesh(), &material(e1, 0.3));
        below.supports = rollers();
        let mut above = spec(mesh, &material(e2, 0.33));
        above.supports = supports;
        above.pressures = vec![("base".into(), p)];
        let frame =
            ContactFrame::from_faces(&below.mesh, "contact", Side::Lower, [0.0; 2], 0.0).expect("a frame");
        let mut body1 = FeBody::new(below, "contact", Side::Lower, &frame).expect("a body");
        let mut body2 = FeBody::new(above, "contact", Side::Upper, &frame).expect("a body");
        assert_eq!(body2.rigid_body_modes().expect("a floating body").modes.len(), free);
        let model = model([&mut body1, &mut body2], &frame, GapShape::Flat, FrictionLaw::None);
        let result = run(&model, &[step("rest")], &TIGHT, None, &mut Silent).expect("a run");
        assert_eq!(result.outcome, Outcome::Converged);
        let record = &result.records[0];
        let defect = record.certificate.operator_defect.expect("factors at hand");
        assert!(defect < 1e-10, "{defect:e}");
        let n = frame.n_cells();
        for pressure in &result.state.tractions[2 * n..] {
            assert!((pressure / p - 1.0).abs() < 1e-9, "{pressure}");
        }
        assert!((record.normal_force / (p * 12.0) - 1.0).abs() < 1e-12);
        assert_eq!(
            free > 3,
            result.warnings.iter().any(|w| w.contains("nothing resists and no load drives the")),
            "{:?}",
            result.warnings
        );
        if free < 6 {
            // The block is guided at two corners, so its lateral contraction also changes its mean displacement.
            continue;
        }
        let mean = p * (l1 / e1 + 0.5 * l2 / e2);
        assert!((record.approach / mean - 1.0).abs() < 1e-9, "{} {mean}", record.approach);
        let loading =
            Loading { tractions: &result.state.tractions, amplitudes: &result.state.load_amplitudes };
        let u = body2.recover(loading).expect("fields").displacement;
        let top = body2.condensed().model().mesh().group_nodes("base").expect("a group");
        for node in top {
            let lowering = record.approach - u[node][2];
            assert!((lowering / 0.001_380_952_381 - 1.0).abs() < 1e-9, "{lowering}");
        }
    }
}

fn backwards(mut mesh: Mesh) -> Mesh {
    let last = mesh.n_points() - 1;
    mesh.points.reverse();
    mesh.blocks.iter_mut().flat_map(|block| &mut block.nodes).for_each(|node| *node = last - *node);
    mesh
}

/// Truth: case `incline-block` (docs/verification.md). A block of weight W on an incline of angle a carries N = W cos a and T = W
/// sin a, to 1e-9. Friction holds the block up to atan(0.3) = 16.699 degrees. At 16.8 degrees it slides down the slope. Friction
/// then carries the fraction tan(16.699°) / tan(16.8°) of the load, to 1e-3.
#[test]
fn a_block_on_an_incline() {
    for (degrees, holds) in [(16.0_f64, true), (16.6, true), (16.8, false)] {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let mut block = spec(upper_mesh(straight, 1.0), &material(70e3, 0.33));
        block.body_force = [2.0 * sin, 0.0, -2.0 * cos];
        let weight = 2.0 * 12.0;
        let (body, result) = on_rigid(block, FrictionLaw::Coulomb { mu: 0.3 }, &[step("rest")]);
        let record = &result.records[0];
        if holds {
            assert_eq!(result.outcome, Outcome::Converged, "{degrees} {:?}", record.certificate);
            assert!((record.normal_force / (weight * cos) - 1.0).abs() < 1e-9);
            assert!((record.tangential_force[0] / (weight * sin) - 1.0).abs() < 1e-9);
            assert!(record.tangential_force[1].abs() < 1e-9 * weight);
            balances(&body, &result);
        } else {
            assert_eq!(result.outcome, Outcome::NotConverged(Divergence::GrossSliding));
            let said = result.warnings.iter().find(|w| w.contains("gross sliding")).expect("a message");
            assert!(said.contains("body 2 slides along x"), "{said}");
            let percent: f64 = said
                .split("friction transmits at most ")
                .nth(1)
                .unwrap()
                .split(' ')
                .next()
                .unwrap()
                .parse()
                .unwrap();
            assert!((percent / (100.0 * 0.3 * cos / sin) - 1.0).abs() < 1e-3, "{said}");
        }
    }
}

/// Asserts that the contact forces and the other loads of the body are in equilibrium, to 1e-9.
fn balances(body: &FeBody, result: &RunResult) {
    let model = body.condensed().model();
    let points = &model.mesh().points;
    let mut forces = model.loads().forces().to_vec();
    let contact = body.contact_forces(&result.state.tractions);
    for (f, &node) in contact.chunks_exact(3).zip(body.map().nodes()) {
        (0..3).for_each(|c| forces[node][c] += f[c]);
    }
    let size: f64 = forces.iter().map(|f| Vector3::from(*f).norm()).sum();
    let [force, moment] = resultant(points, &forces);
    assert!(force.norm() < 1e-9 * size && moment.norm() < 1e-9 * size, "{force} {moment} {size}");
}

/// Truth: equilibrium of an eccentric, oblique load and prescribed forces. A translated block with its frame has the same
/// tractions to 1e-9 of the largest pressure, with and without friction.
#[test]
fn an_eccentric_load_tilts_a_block() {
    let run_at = |offset: [f64; 3], friction: FrictionLaw, slope: f64| {
        let mut mesh = upper_mesh(wavy, 1.0);
        let corner = mesh.points.iter().map(|x| x[0] + x[1] + x[2]).fold(f64::MIN, f64::max);
        assert!((corner - 4.5).abs() < 1e-12);
        mesh.points.iter_mut().for_each(|x| (0..3).for_each(|c| x[c] += offset[c]));
        let mut block = spec(mesh, &material(70e3, 0.33));
        block.pressures = vec![("base".into(), 5.0)];
        let frame =
            ContactFrame::from_faces(&block.mesh, "contact", Side::Upper, [offset[0] + 0.3, offset[1]], 0.2)
                .unwrap();
        let mut body = FeBody::new(block, "contact", Side::Upper, &frame).unwrap();
        let model = model([&mut RigidBody, &mut body], &frame, GapShape::Flat, friction);
        let force = Step {
            normal: Some(Normal::Force(100.0)),
            tangential: (slope > 0.0).then_some(Tangential::Force([30.0 * slope, -20.0 * slope])),
            ..step("press")
        };
        let result = run(&model, &[force], &TIGHT, None, &mut Silent).unwrap();
        assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
        let record = &result.records[0];
        assert!((record.normal_force / 160.0 - 1.0).abs() < 1e-12, "{}", record.normal_force);
        // The resultant of the pressure passes through the middle of the face. The prescribed force passes through the centre of
        // the frame.
        let (s, c) = 0.2_f64.sin_cos();
        let (arm_x, arm_y) = (-0.3 * c, 0.3 * s);
        let wanted = [-60.0 * arm_y, 60.0 * arm_x, 0.0];
        for k in 0..3 {
            assert!((record.moment[k] - wanted[k]).abs() < 1e-8, "{:?} {wanted:?}", record.moment);
        }
        result
    };
    for (friction, slope) in [(FrictionLaw::None, 0.0), (FrictionLaw::Coulomb { mu: 0.4 }, 1.0)] {
        let here = run_at([0.0; 3], friction, slope);
        let there = run_at([7.0, -3.0, 0.0], friction, slope);
        let largest = here.records[0].peak_pressure;
        for (a, b) in here.state.tractions.iter().zip(&there.state.tractions) {
            assert!((a - b).abs() < 1e-9 * largest, "{a} {b}");
        }
    }
}

/// Truth: limit analysis. Among all motions with equal work of the load, friction does the least work in the motion of gross
/// sliding. The tractions then balance a fraction of the load, which the message of the solver states.
///
/// The force acts beside the middle of the contact face and exceeds the friction limit. The friction force has the direction of
/// this force and no moment about its point of action, to 1e-4 of the force. The solver iterates until the work is accurate to
/// 1e-8. The tractions are then accurate to the square root, 1e-4.
#[test]
fn friction_in_sliding_balances_a_fraction_of_the_load() {
    let mut block = spec(upper_mesh(wavy, 1.0), &material(70e3, 0.33));
    block.pressures = vec![("base".into(), 5.0)];
    let frame = ContactFrame::from_faces(&block.mesh, "contact", Side::Upper, [0.6, -0.4], 0.2).unwrap();
    let mut body = FeBody::new(block, "contact", Side::Upper, &frame).unwrap();
    let friction = FrictionLaw::Elliptic { mu: [0.5, 0.2], angle: 0.7 };
    let model = model([&mut RigidBody, &mut body], &frame, GapShape::Flat, friction);
    let load = [30.0, -40.0];
    let pull = Step { tangential: Some(Tangential::Force(load)), ..step("pull") };
    let result = run(&model, &[pull], &TIGHT, None, &mut Silent).unwrap();
    assert_eq!(result.outcome, Outcome::NotConverged(Divergence::GrossSliding), "{:?}", result.warnings);
    let record = &result.records[0];
    let carried = record.tangential_force;
    let fraction = (carried[0] * load[0] + carried[1] * load[1]) / 2500.0;
    assert!(fraction > 0.1 && fraction < 0.9, "{fraction}");
    let across = (carried[0] * load[1] - carried[1] * load[0]) / 50.0;
    assert!(across.abs() < 5e-3 && record.moment[2].abs() < 5e-3, "{carried:?} {:?}", record.moment);
    let said = result.warnings.iter().find(|w| w.contains("gross sliding")).expect("a message");
    assert!(said.contains("(at frame.center) and spins about -n"), "{said}");
    let percent: f64 = said.split("at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((percent - 100.0 * fraction).abs() < 0.01, "{said} {fraction}");
}

/// Truth: mirror images. A free lower body below a rigid plane carries the same pressures as a free upper body above the plane,
/// to 1e-9 of the largest pressure. The tangential force is opposite.
#[test]
fn a_lower_body_floats_as_well() {
    let rest = |side: Side, pull: f64| {
        let mut mesh = upper_mesh(wavy, 1.0);
        if side == Side::Lower {
            // Half a rotation about x preserves the orientation of the elements.
            mesh.points.iter_mut().for_each(|x| *x = [x[0], -x[1], -x[2]]);
        }
        let mut block = spec(mesh, &material(70e3, 0.33));
        block.pressures = vec![("base".into(), 5.0)];
        block.body_force = [pull, 0.0, 0.0];
        let frame = ContactFrame::grid([1.6, 1.2], [4, 3], [0.0; 2], 0.0).unwrap();
        let mut body = FeBody::new(block, "contact", side, &frame).unwrap();
        let bodies: [&mut dyn ElasticBody; 2] =
            if side == Side::Upper { [&mut RigidBody, &mut body] } else { [&mut body, &mut RigidBody] };
        let model = model(bodies, &frame, GapShape::Flat, FrictionLaw::Coulomb { mu: 0.3 });
        run(&model, &[step("rest")], &TIGHT, None, &mut Silent).unwrap()
    };
    let [upper, lower] = [Side::Upper, Side::Lower].map(|side| rest(side, 1.0));
    assert_eq!([&upper.outcome, &lower.outcome], [&Outcome::Converged; 2]);
    let (a, b) = (&upper.records[0], &lower.records[0]);
    assert!((b.normal_force / 60.0 - 1.0).abs() < 1e-9, "{}", b.normal_force);
    assert!((a.approach / b.approach - 1.0).abs() < 1e-9, "{} {}", a.approach, b.approach);
    assert!(
        (a.tangential_force[0] / 12.0 - 1.0).abs() < 1e-9
            && (b.tangential_force[0] / 12.0 + 1.0).abs() < 1e-9
    );
    // Half a rotation about x maps cell (ix, iy) to cell (ix, 2 - iy).
    let n = 12;
    for cell in 0..n {
        let mirrored = cell - cell % 3 + 2 - cell % 3;
        let (p, q) = (upper.state.tractions[2 * n + cell], lower.state.tractions[2 * n + mirrored]);
        assert!((p - q).abs() < 1e-9 * a.peak_pressure, "{p} {q}");
    }
    for (side, words) in [(Side::Upper, "body 2 slides along"), (Side::Lower, "body 1 slides along")] {
        let slid = rest(side, 2.0);
        assert_eq!(slid.outcome, Outcome::NotConverged(Divergence::GrossSliding));
        assert!(slid.warnings.iter().any(|w| w.contains(words)), "{:?}", slid.warnings);
    }
}

/// Truth: statics. A tensile force lifts the body off the plane. A load along a motion without any resistance has no equilibrium.
#[test]
fn loads_that_nothing_balances() {
    let mut lifted = spec(upper_mesh(straight, 1.0), &material(70e3, 0.33));
    lifted.body_force = [0.0, 0.0, 1.0];
    let (_, result) = on_rigid(lifted, FrictionLaw::Coulomb { mu: 0.3 }, &[step("rest")]);
    assert_eq!(result.outcome, Outcome::NotConverged(Divergence::ContactLost));
    assert!(result.warnings.iter().any(|w| w.contains("body 2 moves away along n")), "{:?}", result.warnings);

    let mut pushed = spec(upper_mesh(straight, 1.0), &material(70e3, 0.33));
    pushed.body_force = [0.0, 1.0, -1.0];
    let frame = ContactFrame::from_faces(&pushed.mesh, "contact", Side::Upper, [0.0; 2], 0.0).unwrap();
    let mut body = FeBody::new(pushed, "contact", Side::Upper, &frame).unwrap();
    let model = model([&mut RigidBody, &mut body], &frame, GapShape::Flat, FrictionLaw::None);
    let error = run(&model, &[step("rest")], &TIGHT, None, &mut Silent).expect_err("a refusal").to_string();
    assert!(error.contains("translation along y of body 2") && error.contains("[friction]"), "{error}");
}

/// Truth: a run with prescribed displacements. A second run prescribes the forces of the first run. It has the same motion to
/// 1e-7 and the same tractions to 1e-6, at a solver tolerance of 1e-11. The cells are the curved faces of a spherical cap.
#[test]
fn forces_on_a_curved_frame() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("meshes/steel-cap.msh");
    let mesh = gmsh::read(&path).expect("the committed mesh");
    let mut cap = spec(mesh, &material(210e3, 0.3));
    cap.supports = vec![support("top", [true; 3], [0.0; 3])];
    let frame = ContactFrame::from_faces(&cap.mesh, "contact", Side::Upper, [0.0; 2], 0.0).unwrap();
    let mut body = FeBody::new(cap, "contact", Side::Upper, &frame).unwrap();
    let friction = FrictionLaw::Coulomb { mu: 0.3 };
    let model = model([&mut RigidBody, &mut body], &frame, GapShape::Mesh, friction);
    let moved = [
        Step { normal: Some(Normal::Approach(0.01)), ..step("indent") },
        Step { tangential: Some(Tangential::Shift([0.001, 0.0005])), ..step("shift") },
    ];
    let driven = run(&model, &moved, &TIGHT, None, &mut Silent).unwrap();
    let forces = driven.records.iter().map(|record| Step {
        normal: Some(Normal::Force(record.normal_force)),
        tangential: Some(Tangential::Force(record.tangential_force)),
        ..step(&record.name)
    });
    let forced = run(&model, &forces.collect::<Vec<_>>(), &TIGHT, None, &mut Silent).unwrap();
    assert_eq!(driven.outcome, Outcome::Converged);
    assert_eq!(forced.outcome, Outcome::Converged, "{:?}", forced.warnings);
    for (a, b) in driven.records.iter().zip(&forced.records) {
        assert!((a.approach / b.approach - 1.0).abs() < 1e-7, "{} {}", a.approach, b.approach);
        assert!((a.shift[0] - b.shift[0]).abs() < 1e-7 * a.approach, "{:?} {:?}", a.shift, b.shift);
    }
    let largest = driven.records[1].peak_pressure;
    for (a, b) in driven.state.tractions.iter().zip(&forced.state.tractions) {
        assert!((a - b).abs() < 1e-6 * largest);
    }
    let record = &forced.records[0];
    let pull = Step { tangential: Some(Tangential::Force([0.7 * record.normal_force, 0.0])), ..step("pull") };
    let press = Step { normal: Some(Normal::Force(record.normal_force)), ..step("press") };
    let slid = run(&model, &[press, pull], &TIGHT, None, &mut Silent).unwrap();
    assert_eq!(slid.outcome, Outcome::NotConverged(Divergence::GrossSliding));
}
