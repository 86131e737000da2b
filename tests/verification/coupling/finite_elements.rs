//! Finite-element bodies on a frame: contact patch test, flexibility, loads, surfaces.

use super::bricks::{Brick, rollers, spec, straight, support, wavy};
use super::half_spaces::{cfrp, difference, gaps, largest};
use super::random;
use crate::common::steel;
use nalgebra::{Vector3, Vector6};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, ErrorEstimation, FeBody, HalfSpaceBody, Loading, RigidBody};
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::material::Stiffness;

const HEIGHTS: [f64; 2] = [1.1, 0.7];

/// Two blocks with the same outline, whose contact faces do not match.
fn pair(tetrahedra: bool) -> [Brick; 2] {
    let width = [2.0, 1.5];
    [
        Brick {
            width,
            z: [-HEIGHTS[0], 0.0],
            cells: [5, 4, 2],
            contact_on_top: true,
            distortion: wavy,
            tetrahedra: false,
        },
        Brick {
            width,
            z: [0.0, HEIGHTS[1]],
            cells: [7, 3, 2],
            contact_on_top: false,
            distortion: |x| wavy([-x[1], x[0]]),
            tetrahedra,
        },
    ]
}

fn bodies(bricks: &[Brick; 2], frame: &ContactFrame, materials: [&Stiffness; 2]) -> [FeBody; 2] {
    let build = |i: usize, side: Side| {
        let mut spec = spec(bricks[i].mesh(), materials[i]);
        spec.supports = rollers();
        FeBody::new(spec, "contact", side, frame).expect("a finite-element body")
    };
    [build(0, Side::Lower), build(1, Side::Upper)]
}

/// Truth: the contact patch test. A constant pressure p on the frame causes the constant stress -p e_z e_z in both bodies. The
/// gap is p (h1 s33_1 + h2 s33_2) in every cell, with the heights h and the compliances s33 along z. The relative tolerance 1e-10
/// covers rounding times the condition number of the stiffness.
#[test]
fn constant_pressure_passes_from_body_to_body() {
    let pressure = 3.0;
    let materials = [&cfrp(30.0, 0.0), &steel()];
    let closing: f64 =
        (0..2).map(|i| HEIGHTS[i] * materials[i].voigt().try_inverse().unwrap()[(2, 2)] * pressure).sum();
    let grid = |cells| ContactFrame::grid([2.0, 1.5], cells, [0.0, 0.0], 0.0).unwrap();
    let faces = |tetrahedra, side: Side| {
        let mesh = pair(tetrahedra)[usize::from(side == Side::Upper)].mesh();
        ContactFrame::from_faces(&mesh, "contact", side, [0.0, 0.0], 0.3).unwrap()
    };
    let frames = [
        (false, grid([6, 9])),
        (true, grid([11, 2])),
        (false, faces(false, Side::Lower)),
        (true, faces(true, Side::Upper)),
    ];
    for (tetrahedra, frame) in frames {
        let [mut lower, mut upper] = bodies(&pair(tetrahedra), &frame, materials);
        let n = frame.n_cells();
        let mut tractions = vec![0.0; 3 * n];
        tractions[2 * n..].fill(pressure);
        for body in [&lower, &upper] {
            let displacement = body.recover(Loading::of_contact(&tractions)).unwrap().displacement;
            let field = body
                .recover_stress(Loading::of_contact(&tractions), &displacement, ErrorEstimation::Estimate)
                .unwrap()
                .unwrap();
            assert!(field.error.unwrap().relative_error() < 1e-10);
            for stress in field.stress {
                let error = Vector6::from(stress) - Vector6::new(0.0, 0.0, -pressure, 0.0, 0.0, 0.0);
                assert!(error.amax() < 1e-10 * pressure, "{stress:?}");
            }
        }
        let coupled = couple(&mut lower, &mut upper, &frame, Coupling::Schur, SkipVanishing).unwrap();
        for gap in &gaps(&coupled, &tractions)[2 * n..] {
            assert!((gap - closing).abs() < 1e-10 * closing, "{gap} {closing}");
        }
        let mut normal = vec![0.0; n];
        coupled.flexibility.apply_normal(&tractions[2 * n..], &mut normal);
        assert!(normal.iter().all(|gap| (gap - closing).abs() < 1e-10 * closing));
    }
}

/// Truth: the forces on the two bodies balance, and their moments also balance. The tolerance 1e-12 covers rounding.
#[test]
fn forces_on_both_bodies_balance() {
    let frame = ContactFrame::grid([1.1, 0.9], [6, 9], [0.1, -0.2], 0.3).unwrap();
    let bodies = bodies(&pair(true), &frame, [&cfrp(30.0, 0.0), &steel()]);
    let tractions = random(3 * frame.n_cells());
    let (mut force, mut moment, mut size) = (Vector3::zeros(), Vector3::zeros(), 0.0);
    for body in &bodies {
        for (f, &node) in body.contact_forces(&tractions).chunks_exact(3).zip(body.map().nodes()) {
            let f = Vector3::from_row_slice(f);
            let arm = Vector3::from(body.condensed().model().mesh().points[node]);
            force += f;
            moment += arm.cross(&f);
            size += f.norm();
        }
    }
    assert!(force.amax() < 1e-12 * size && moment.amax() < 1e-12 * size, "{force} {moment}");
}

/// Truth: A S = (A S)^T for the flexibility S and the cell areas A, because the same map transfers forces and displacements. P^T
/// A S P > 0 for tractions P. The cell means of the recovered displacements are S P. The tolerance 1e-12 covers rounding.
#[test]
fn condensed_flexibility_is_symmetric_and_consistent() {
    let frame = ContactFrame::grid([1.1, 0.9], [4, 5], [0.1, -0.2], 0.3).unwrap();
    let [mut lower, _] = bodies(&pair(false), &frame, [&cfrp(30.0, 40.0), &steel()]);
    let recovered = lower.recover(Loading::of_contact(&random(60))).unwrap().displacement;
    let map = lower.map().clone();
    let coupled = couple(&mut lower, &mut RigidBody, &frame, Coupling::Schur, SkipVanishing).unwrap();
    let n = frame.n_cells();
    let column = |j: usize| {
        let unit: Vec<f64> = (0..3 * n).map(|i| f64::from(i == j)).collect();
        gaps(&coupled, &unit)
    };
    let columns: Vec<Vec<f64>> = (0..3 * n).map(column).collect();
    let size = columns.iter().map(|c| largest(c)).fold(0.0, f64::max);
    let blocks = coupled.flexibility.diagonal_blocks();
    for i in 0..3 * n {
        for j in 0..3 * n {
            let (a, b) = (frame.areas[i % n] * columns[j][i], frame.areas[j % n] * columns[i][j]);
            assert!((a - b).abs() < 1e-12 * size * frame.areas[0], "{i} {j}");
            if i % n == j % n {
                assert!((blocks[i % n][(i / n, j / n)] - columns[j][i]).abs() < 1e-12 * size);
            }
        }
    }
    let tractions = random(3 * n);
    let gap = gaps(&coupled, &tractions);
    assert!(gap.iter().zip(&tractions).map(|(g, p)| g * p).sum::<f64>() > 0.0);
    let mut normal = vec![0.0; n];
    coupled.flexibility.apply_normal(&tractions[2 * n..], &mut normal);
    let only: Vec<f64> = (0..3 * n).map(|i| if i < 2 * n { 0.0 } else { tractions[i] }).collect();
    assert!(difference(&normal, &gaps(&coupled, &only)[2 * n..]) < 1e-12);
    let nodal: Vec<f64> = map.nodes().iter().flat_map(|&node| recovered[node].map(|u| -u)).collect();
    let mut mean = vec![0.0; 3 * n];
    map.apply(&nodal, &mut mean);
    assert!(difference(&mean, &gap) < 1e-12);
}

/// Truth: a rigid translation of a body changes the gap by this translation, in the axes of the frame. The tolerance 1e-11 covers
/// rounding times the condition number.
#[test]
fn moved_supports_open_the_gap() {
    let frame = ContactFrame::grid([1.1, 0.9], [4, 5], [0.1, -0.2], 0.3).unwrap();
    let [lower, upper] = pair(false);
    let motion = [0.01, -0.02, 0.03];
    let body = |brick: &Brick, side: Side, value: [f64; 3]| {
        let mut spec = spec(brick.mesh(), &steel());
        spec.supports = vec![support("base", [true; 3], value)];
        FeBody::new(spec, "contact", side, &frame).unwrap()
    };
    let (mut lower, mut upper) = (body(&lower, Side::Lower, [0.0; 3]), body(&upper, Side::Upper, motion));
    assert!(lower.loads().is_empty());
    let coupled = couple(&mut lower, &mut upper, &frame, Coupling::Schur, SkipVanishing).unwrap();
    let local = frame.triads[0].to_local(&Vector3::from(motion));
    for (i, gap) in coupled.loads[0].gap.iter().enumerate() {
        assert!((gap - local[i / 20]).abs() < 1e-11 * 0.03, "{gap} {local}");
    }
}

/// Truth: any number of threads gives the same bits.
#[test]
fn threads_do_not_change_bits() {
    let answer = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let frame = ContactFrame::grid([1.1, 0.9], [8, 7], [0.1, -0.2], 0.3).unwrap();
            let [mut lower, _] = bodies(&pair(false), &frame, [&cfrp(30.0, 40.0), &steel()]);
            let mut upper = HalfSpaceBody::new(&steel(), Side::Upper, &frame).unwrap();
            let coupled = couple(&mut lower, &mut upper, &frame, Coupling::Schur, SkipVanishing).unwrap();
            gaps(&coupled, &random(3 * 56))
        })
    };
    let one = answer(1);
    assert!(answer(2) == one && answer(5) == one);
}

/// Truth: the mean distance of an inclined plane over a rectangular cell is the distance at its centre. The plane first touches
/// at the edge of the frame where it is lowest.
#[test]
fn the_gap_between_meshes() {
    let frame = ContactFrame::grid([1.3, 1.1], [4, 5], [0.0, 0.0], 0.0).unwrap();
    let [lower, upper] = pair(false);
    let mut raised = Brick { distortion: straight, ..upper }.mesh();
    raised.points.iter_mut().for_each(|x| x[2] += 0.5 + 0.1 * x[0]);
    let build = |mesh, side| {
        let mut spec = spec(mesh, &steel());
        spec.supports = vec![support("base", [true; 3], [0.0; 3])];
        FeBody::new(spec, "contact", side, &frame).unwrap()
    };
    let (lower, upper) = (build(lower.mesh(), Side::Lower), build(raised, Side::Upper));
    let mesh_gap = InitialGap::from(GapShape::Mesh);
    for bodies in [[&lower as &dyn ElasticBody, &upper], [&RigidBody, &upper]] {
        let distance = surface_distance(&mesh_gap, &frame, bodies[0], bodies[1]).unwrap();
        let first = -1.3;
        for (d, center) in distance.iter().zip(&frame.centers) {
            assert!((d - 0.1 * (center.x - first)).abs() < 1e-13);
        }
    }
    assert!(surface_distance(&mesh_gap, &frame, &RigidBody, &RigidBody).is_err());
}
