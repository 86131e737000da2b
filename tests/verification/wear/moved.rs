//! Finite-element meshes whose contact surface moves by the wear depth.

use std::cell::Cell;
use std::sync::Arc;

use orthowear::bem::half_space::CrossBlocks;
use orthowear::body::worn_mesh::worn_mesh;
use orthowear::body::{ElasticBody, FeBody, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple};
use orthowear::element::ElementKind;
use orthowear::error::Result;
use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord, Outcome};
use orthowear::evolution::step::Step;
use orthowear::evolution::{Model, PreviousModel, run};
use orthowear::fem::{CondensationResources, FeSpec, HexFormulation, Support};
use orthowear::frame::ContactFrame;
use orthowear::geometry::Side;
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::linalg::memory::MemoryLimit;
use orthowear::material::Stiffness;
use orthowear::mesh::quality::check;
use orthowear::mesh::{Mesh, PhysicalGroup};
use serde_json::Value;

use crate::common::{Silent, press, shift, step};
use crate::coupling::grids::{boxes, full, raise, serendipity, steps, wedges};
use crate::fem_bodies::{clamp, isotropic, rotated_orthotropic, spec};
use crate::structured::{BlockElements, GradedBlock};

const DEPTH: f64 = 1.2;

/// Meshes of one block of the given thickness, with all kinds of contact faces. The lower block has its base at z = -DEPTH, the
/// upper block at z = DEPTH.
fn blocks(side: Side, thickness: f64) -> Vec<(&'static str, Mesh)> {
    let z = match side {
        Side::Lower => steps(-DEPTH, thickness - DEPTH, 3),
        Side::Upper => steps(DEPTH - thickness, DEPTH, 3),
    };
    let mesh = boxes(&[steps(-1.0, 1.0, 5), steps(-1.0, 1.0, 4), z], false, |x| x);
    let split = wedges(&mesh);
    vec![
        ("hex20", raise(&mesh, serendipity)),
        ("hex27", raise(&mesh, full)),
        ("wedge15", raise(&split, serendipity)),
        ("wedge6", split),
        ("hex8", mesh),
    ]
}

fn contact(side: Side) -> &'static str {
    if side == Side::Lower { "high2" } else { "low2" }
}

fn held(mesh: Mesh, side: Side) -> FeSpec {
    let base = if side == Side::Lower { "low2" } else { "high2" };
    spec(mesh, rotated_orthotropic(), HexFormulation::Enhanced, vec![clamp(base)])
}

fn frame(half_width: f64, cells: [usize; 2]) -> ContactFrame {
    ContactFrame::grid([half_width; 2], cells, [0.0; 2], 0.0).expect("a frame")
}

fn worn(spec: &FeSpec, side: Side, frame: &ContactFrame, depth: &[f64]) -> Result<Mesh> {
    worn_mesh(spec, contact(side), side, frame, depth, &MemoryLimit::of_machine())
}

/// Wear depth with its maximum at x = 0.3, y = 0. On one side the wear reaches the edge of the frame.
fn bump(frame: &ContactFrame) -> Vec<f64> {
    let at = |cell: usize| {
        let [x, y] = frame.plane_coordinates(cell);
        0.1 * (-4.0 * ((x - 0.3) * (x - 0.3) + y * y)).exp()
    };
    (0..frame.n_cells()).map(at).collect()
}

/// Truth: the mesh loses the volume Σ A w (cell areas A, wear depths w), even if cells and faces do not match. Nodes keep their x
/// and y, and do not move outward.
#[test]
fn volumes_are_conserved() {
    let frame = frame(0.9, [7, 6]);
    let depth = bump(&frame);
    let lost: f64 = frame.areas.iter().zip(&depth).map(|(area, depth)| area * depth).sum();
    for side in [Side::Lower, Side::Upper] {
        let graded = GradedBlock {
            solids: BlockElements::Tet4,
            side,
            ..GradedBlock::uniform([1.0; 2], 1.2, [5, 4, 3])
        };
        let tets = graded.mesh().expect("a block");
        let mut meshes = blocks(side, DEPTH);
        meshes.extend([("tet10", raise(&tets, serendipity)), ("tet4", tets)]);
        for (name, mesh) in meshes {
            let (group, base) = if name.starts_with("tet") {
                ("contact", "base")
            } else {
                (contact(side), if side == Side::Lower { "low2" } else { "high2" })
            };
            let spec = spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp(base)]);
            let after = worn_mesh(&spec, group, side, &frame, &depth, &MemoryLimit::of_machine());
            let after = after.expect("a mesh");
            let [a, b] = [&*spec.mesh, &after].map(|mesh| check(mesh).expect("a sound mesh").volume);
            assert!((a - b - lost).abs() < 1e-12 * a, "{name} {side:?}: {} {lost}", a - b);
            let bottom = spec.mesh.group_nodes(base).expect("a group");
            for (node, (a, b)) in spec.mesh.points.iter().zip(&after.points).enumerate() {
                assert_eq!(a[..2], b[..2], "{name} {side:?}: node {node}");
                assert!(!bottom.contains(&node) || a == b, "{name} {side:?}: node {node} of the base");
                assert!(side.gap_sign() * (b[2] - a[2]) >= -1e-15, "{name} {side:?}: node {node} moves out");
            }
        }
    }
}

fn rollers(side: Side) -> Vec<Support> {
    let base = if side == Side::Lower { "low2" } else { "high2" };
    let along = |group: &str, component: usize| Support {
        components: [0, 1, 2].map(|c| c == component),
        ..clamp(group)
    };
    vec![clamp(base), along("low0", 0), along("high0", 0), along("low1", 1), along("high1", 1)]
}

fn difference(bodies: [FeBody; 2], n: usize) -> f64 {
    let tractions: Vec<f64> = (0..3 * n).map(|k| ((k * k + 3 * k) as f64).sin()).collect();
    let [a, b] = bodies.map(|mut body| {
        let operator = body.take_flexibility(CrossBlocks::Keep).expect("an operator").expect("not rigid");
        let mut gap = vec![0.0; 3 * n];
        operator.apply(&tractions, &mut gap);
        gap
    });
    let largest = b.iter().fold(0.0_f64, |largest, b| largest.max(b.abs()));
    a.iter().zip(&b).fold(0.0_f64, |apart, (a, b)| apart.max((a - b).abs())) / largest
}

/// Truth: a layer with uniform wear has the flexibility of a layer that is meshed with the smaller thickness.
#[test]
fn even_wear_gives_the_thinner_layer() {
    let (frame, lost) = (frame(1.0, [4, 3]), 0.5);
    let depth = vec![lost; frame.n_cells()];
    for side in [Side::Lower, Side::Upper] {
        for ((name, mesh), (_, thin)) in blocks(side, DEPTH).into_iter().zip(blocks(side, DEPTH - lost)) {
            let of = |mesh: Mesh| spec(mesh, rotated_orthotropic(), HexFormulation::Enhanced, rollers(side));
            let (spec, thin) = (of(mesh), of(thin));
            let after = worn(&spec, side, &frame, &depth).expect("a mesh");
            for (a, b) in after.points.iter().zip(&thin.mesh.points) {
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-13), "{name} {side:?}: {a:?} {b:?}");
            }
            let resources = CondensationResources::default();
            let moved = FeBody::with_worn_mesh(
                spec,
                &[],
                contact(side),
                side,
                &frame,
                &resources,
                Some(Arc::new(after)),
            );
            let made = FeBody::with_worn_mesh(thin, &[], contact(side), side, &frame, &resources, None);
            let apart = difference([moved, made].map(|body| body.expect("a body")), frame.n_cells());
            assert!(apart < 1e-10, "{name} {side:?}: {apart:e}");
        }
    }
}

/// Truth: by symmetry, uniform wear moves the nodes on the hole of a ring along their radii, by the wear depth.
#[test]
fn holes_get_wider() {
    let (inner, outer, lost) = (2.0, 3.0, 0.07);
    let axes = [steps(0.0, std::f64::consts::TAU, 24), steps(inner, outer, 3), steps(0.0, 0.5, 2)];
    let mesh = boxes(&axes, true, |[t, r, z]| [r * t.cos(), r * t.sin(), -z]);
    let frame = ContactFrame::from_faces(&mesh, "low1", Side::Lower, [0.0; 2], 0.0).expect("a frame");
    let spec = spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("high1")]);
    let depth = vec![lost; frame.n_cells()];
    let after = worn_mesh(&spec, "low1", Side::Lower, &frame, &depth, &MemoryLimit::of_machine());
    let radius = |x: &[f64; 3]| x[0].hypot(x[1]);
    let hole = spec.mesh.group_nodes("low1").expect("a group");
    for (node, (a, b)) in spec.mesh.points.iter().zip(&after.expect("a mesh").points).enumerate() {
        let [was, is] = [a, b].map(radius);
        assert_eq!(a[2], b[2]);
        if hole.contains(&node) {
            assert!((is - was - lost).abs() < 1e-12, "{was} {is}");
        } else {
            assert!(is >= was && is - was < lost && (was < outer - 1e-9 || is == was), "{was} {is}");
        }
        assert!((a[0] * b[1] - a[1] * b[0]).abs() < 1e-3 * lost, "{a:?} {b:?}");
    }
}

/// Truth: the whole ring of [`holes_get_wider`]. A quarter of this ring between planes of symmetry moves in the same way.
#[test]
fn quarters_move_as_the_whole() {
    let lost = 0.07;
    let axes = [steps(0.0, std::f64::consts::FRAC_PI_2, 6), steps(2.0, 3.0, 3), steps(0.0, 0.5, 2)];
    let mesh = boxes(&axes, false, |[t, r, z]| [r * t.cos(), r * t.sin(), -z]);
    let frame = ContactFrame::from_faces(&mesh, "low1", Side::Lower, [0.0; 2], 0.0).expect("a frame");
    let spec = spec(mesh, isotropic(), HexFormulation::Enhanced, vec![clamp("high1")]);
    let depth = vec![lost; frame.n_cells()];
    let after = worn_mesh(&spec, "low1", Side::Lower, &frame, &depth, &MemoryLimit::of_machine());
    let after = after.expect("a mesh");
    let radius = |x: &[f64; 3]| x[0].hypot(x[1]);
    for node in spec.mesh.group_nodes("low1").expect("a group") {
        let [was, is] = [&spec.mesh.points[node], &after.points[node]].map(radius);
        assert!((is - was - lost).abs() < 1e-12, "{was} {is}");
    }
    for (a, b) in spec.mesh.points.iter().zip(&after.points) {
        for k in 0..2 {
            assert!(a[k].abs() > 1e-12 || b[k] == a[k], "{a:?} {b:?} leaves its plane");
        }
    }
}

/// Truth: nodes on a material interface do not move, so that only the ply at the surface becomes thinner.
#[test]
fn plies_below_keep_their_thickness() {
    let mut mesh = boxes(&[steps(-1.0, 1.0, 4), steps(-1.0, 1.0, 4), steps(-DEPTH, 0.0, 6)], false, |x| x);
    let solids: Vec<_> = mesh.volume_cells().collect();
    let is_top = |cell| mesh.cell_nodes(cell).iter().all(|&node| mesh.points[node][2] > -0.5);
    let (top, core): (Vec<_>, Vec<_>) = solids.into_iter().partition(|&cell| is_top(cell));
    for (tag, (name, cells)) in [("top", top), ("core", core)].into_iter().enumerate() {
        mesh.groups.push(PhysicalGroup { name: name.into(), dim: 3, tag: 90 + tag as i64, cells });
    }
    let regions = vec![
        (Some("top".to_owned()), isotropic().into()),
        (Some("core".to_owned()), rotated_orthotropic().into()),
    ];
    let spec = FeSpec { regions, ..held(mesh, Side::Lower) };
    let frame = frame(1.0, [4, 4]);
    let after = worn(&spec, Side::Lower, &frame, &[0.1; 16]).expect("a mesh");
    for (a, b) in spec.mesh.points.iter().zip(&after.points) {
        let wanted = if a[2] > -0.4 { -0.4 + (a[2] + 0.4) * 0.75 } else { a[2] };
        assert!((b[2] - wanted).abs() < 1e-13, "{a:?} {b:?}");
    }
}

/// Truth: the elements of a layer that is worn through are inverted. A layer that has lost more than nine tenths of its thickness
/// is too flat. Both meshes are refused.
#[test]
fn meshes_that_are_refused() {
    let frame = frame(1.0, [4, 4]);
    let (_, mesh) = blocks(Side::Lower, DEPTH).pop().expect("a block");
    let spec = held(mesh, Side::Lower);
    let lost = |depth: f64| worn(&spec, Side::Lower, &frame, &[depth; 16]).map_err(|e| e.to_string());
    assert!(lost(0.89 * DEPTH).is_ok());
    assert!(lost(0.91 * DEPTH).is_err_and(|text| text.contains("nine tenths")));
    assert!(lost(1.2 * DEPTH).is_err_and(|text| text.contains("positive Jacobian")));
}

/// Observer that requests a rebuild of the bodies before the third step.
struct Stops(Cell<usize>);

impl Observer for Stops {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> Result<()> {
        Ok(())
    }

    fn wants_rebuild(&self, _: &[f64]) -> bool {
        self.0.set(self.0.get() + 1);
        self.0.get() == 3
    }
}

fn model(mesh: Option<Mesh>, frame: &ContactFrame) -> Model {
    let (_, unworn) = blocks(Side::Lower, DEPTH).pop().expect("a block");
    let steel = Stiffness::isotropic(210e3, 0.3).expect("admissible");
    let spec = spec(unworn, steel, HexFormulation::Enhanced, vec![clamp("low2")]);
    let mesh = mesh.map(Arc::new);
    let resources = CondensationResources::default();
    let body = FeBody::with_worn_mesh(spec, &[], contact(Side::Lower), Side::Lower, frame, &resources, mesh);
    let coupled = couple(
        &mut body.expect("a body"),
        &mut RigidBody,
        frame,
        Coupling::Schur,
        CrossBlocks::SkipVanishing,
    )
    .expect("coupled bodies");
    let n = frame.n_cells();
    let distance = (0..n).map(|cell| {
        let [x, y] = frame.plane_coordinates(cell);
        (x * x + y * y) / 40.0
    });
    let distance: Vec<f64> = distance.collect();
    Model {
        frame: frame.clone(),
        initial_gap: coupled.initial_gap(&distance),
        flexibility: coupled.flexibility,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::Coulomb { mu: 50.0 },
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

fn field(state: &Value, name: &str) -> Vec<f64> {
    let values = state.pointer(name).and_then(Value::as_array).expect("a field");
    values.iter().map(|value| value.as_f64().expect("a number")).collect()
}

/// Truth: while body 2 is at rest, rebuilding body 1 with its worn mesh causes no slip. The slip reference is the tangential gap
/// from which slip is measured. In sticking contact it changes by the difference of the elastic gaps under the same tractions.
/// Tractions stay the same, bit by bit.
#[test]
fn no_cell_slips_by_a_move() {
    let frame = frame(0.8, [4, 3]);
    let n = frame.n_cells();
    let (_, mesh) = blocks(Side::Lower, DEPTH).pop().expect("a block");
    let after = worn(&held(mesh, Side::Lower), Side::Lower, &frame, &bump(&frame)).expect("a mesh");
    let [before, after] = [None, Some(after)].map(|mesh| model(mesh, &frame));
    let steps: [Step; 3] = [press(2000.0), shift(1e-3, 20.0), step("hold")];
    let (options, mut stops) = (SolverOptions::default(), Stops(Cell::new(0)));
    let stopped = run(&before, &steps, &options, None, &mut stops).expect("a run");
    let snapshot = stopped.suspended.expect("a state").into_checkpoint();
    assert_eq!((stopped.outcome, snapshot.records().len()), (Outcome::Converged, 2));
    let places: Vec<usize> = (0..n).collect();
    let carried = snapshot
        .clone()
        .transfer_to(&places, &after, &steps, Some(&PreviousModel::of(&before)))
        .expect("a state");
    let [was, is] = [&snapshot, &carried].map(|state| serde_json::to_value(state).expect("JSON"));
    let tractions = field(&was, "/state/tractions");
    assert_eq!(tractions, field(&is, "/state/tractions"));
    let [old, new] = [&before, &after].map(|model| {
        let mut gap = vec![0.0; 3 * n];
        model.flexibility.apply(&tractions, &mut gap);
        gap
    });
    let [reference, moved] = [&was, &is].map(|state| field(state, "/state/slip_reference"));
    let largest = (0..2 * n).map(|k| (new[k] - old[k]).abs()).fold(0.0, f64::max);
    assert!(largest > 1e-5, "{largest}");
    for k in 0..2 * n {
        let apart = moved[k] - reference[k] - (new[k] - old[k]);
        assert!(apart.abs() < 1e-9 * largest, "plane {} of cell {}: {apart}", k / n, k % n);
    }
    let held = run(&after, &steps, &options, Some(carried), &mut Silent).expect("a run");
    assert_eq!((held.outcome, held.records.len()), (Outcome::Converged, 3));
    let touching = (0..n).filter(|cell| held.state.tractions[2 * n + cell] > 0.0);
    let slip = touching.map(|i| held.state.slip[i].hypot(held.state.slip[n + i])).fold(0.0, f64::max);
    assert!(slip < 1e-4 * largest, "{slip} {largest}");
    let place = places.iter().map(|&cell| cell + 1).collect::<Vec<usize>>();
    assert!(
        snapshot.transfer_to(&place, &after, &steps, Some(&PreviousModel::of(&before))).is_err(),
        "places beyond the frame"
    );
}

/// Truth: the blocks of the other tests have contact faces of all five kinds.
#[test]
fn all_kinds_of_faces_are_moved() {
    let kinds: Vec<ElementKind> =
        blocks(Side::Lower, DEPTH).iter().flat_map(|(_, mesh)| mesh.blocks.iter().map(|b| b.kind)).collect();
    for kind in
        [ElementKind::Quad4, ElementKind::Quad8, ElementKind::Quad9, ElementKind::Tri3, ElementKind::Tri6]
    {
        assert!(kinds.contains(&kind), "{kind:?}");
    }
}
