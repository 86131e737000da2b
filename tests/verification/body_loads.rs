//! Loads of meshed bodies that change while the bodies are in contact.

use orthowear::bem::finite::Interpolation::Linear;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::hybrid::HalfSpaceFit;
use orthowear::body::{
    BodyEquations, ElasticBody, ErrorEstimation, FeBody, HybridBody, LoadCase, Loading, RigidBody,
};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::element::ElementKind;
use orthowear::error::Result;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::evolution::{Model, RunResult};
use orthowear::fem::{CondensationResources, FeSpec, HexFormulation, Support};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::bem::bodies::{body as boundary_body, held, spec as boundary_spec};
use crate::common::{relative, solve_with, steel, step};
use crate::fem_bodies::spec;
use crate::fem_meshes::block;
use crate::hybrid::blocks;

/// Half of a plate of 80 mm x 40 mm x 1 mm on a rigid plane, in plane strain. The symmetry plane is x = 40 mm. The mesh has 16
/// elements along each side. The pressures are 50 MPa on top and 150 MPa on the side at x = 0.
fn plate() -> FeSpec {
    let mesh = block(ElementKind::Hex20, [16, 1, 16], [1.0; 3], |[x, y, z]| [40.0 * x, y, 40.0 * z]);
    let supports = vec![held("x1", 0), held("y0", 1), held("y1", 1)];
    let material = Stiffness::isotropic(130e3, 0.2).expect("a material");
    let mut plate = spec(mesh, material, HexFormulation::Enhanced, supports);
    plate.pressures = vec![("z1".into(), 50.0), ("x0".into(), 150.0)];
    plate
}

/// Load cases of the plate: `top` is the pressure on top, `side` is the pressure on the side at x = 0.
fn cases(plate: &FeSpec) -> Vec<(LoadCase, FeSpec)> {
    let case = |(name, pressure): (&str, &(String, f64))| {
        let case = LoadCase { name: Some(name.to_owned()), preload: false };
        (case, FeSpec { pressures: vec![pressure.clone()], ..plate.clone() })
    };
    ["top", "side"].into_iter().zip(&plate.pressures).map(case).collect()
}

fn upper_body(spec: FeSpec, cases: &[(LoadCase, FeSpec)]) -> Result<(FeBody, ContactFrame)> {
    let frame = ContactFrame::from_faces(&spec.mesh, "z0", Side::Upper, [0.0; 2], 0.0)?;
    let resources = CondensationResources::default();
    let body = FeBody::with_worn_mesh(spec, cases, "z0", Side::Upper, &frame, &resources, None)?;
    Ok((body, frame))
}

fn on_rigid_plane(spec: FeSpec, cases: &[(LoadCase, FeSpec)], friction: FrictionLaw) -> (FeBody, Model) {
    let (mut body, frame) = upper_body(spec, cases).expect("a body");
    let gap = InitialGap::from(GapShape::Flat);
    let distance = surface_distance(&gap, &frame, &RigidBody, &body).expect("a gap");
    let coupled =
        couple(&mut RigidBody, &mut body, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let model = Model {
        initial_gap: coupled.initial_gap(&distance),
        frame,
        flexibility: coupled.flexibility,
        loads: coupled.loads,
        floating: coupled.floating,
        friction,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    (body, model)
}

fn loaded(model: &Model, increments: usize) -> RunResult {
    in_steps(model, &[Step { increments, ..step("load") }])
}

fn in_steps(model: &Model, steps: &[Step]) -> RunResult {
    let options = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
    let result = solve_with(model, steps, &options);
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    result
}

/// Truth: an independent program in plane strain, with bilinear elements, contact at nodes and 256 elements along each side. The
/// friction force is -1405.36(1) N on the plate, the normal force 2000 N. The lower left corner moves by (0.028603(1),
/// 0.000590(1)) mm, and the dissipation is 4.4011(1) N mm.
///
/// All loads are proportional to one amplitude. A state that is proportional to the amplitude solves every increment. Forces and
/// dissipation therefore do not depend on the number of increments.
#[test]
fn plate_squeezed_on_a_rigid_plane() {
    let (body, model) = on_rigid_plane(plate(), &[], FrictionLaw::Coulomb { mu: 1.0 });
    let single = loaded(&model, 1);
    let last = &single.records[0];
    assert!(relative(last.tangential_force[0], 1405.36) < 2e-3, "{:?}", last.tangential_force);
    assert!(relative(last.normal_force, 2000.0) < 1e-9, "{}", last.normal_force);
    let loading = Loading { tractions: &single.state.tractions, amplitudes: &single.state.load_amplitudes };
    let corner = body.recover(loading).expect("a field").displacement[0];
    let lift = corner[2] - last.approach;
    assert!(relative(corner[0], 0.028603) < 2e-3, "{corner:?}");
    assert!(relative(lift, 0.000590) < 0.1, "{corner:?} {}", last.approach);
    for increments in [1, 2, 5] {
        let result = loaded(&model, increments);
        let end = result.records.last().expect("a record");
        assert!(relative(end.tangential_force[0], last.tangential_force[0]) < 1e-9, "{end:?}");
        assert!(relative(end.dissipation, 4.4011) < 3e-3, "{end:?}");
    }
}

/// Truth: the program of [`plate_squeezed_on_a_rigid_plane`]. The pressure on top acts first, and the pressure on the side
/// follows in a second step. The forces are the same as with both pressures at once. The dissipation of the program tends to
/// 9.841 N mm with the number of increments.
#[test]
fn plate_pressed_first_and_squeezed_then() {
    let (_, model) = {
        let spec = plate();
        let cases = cases(&spec);
        on_rigid_plane(spec, &cases, FrictionLaw::Coulomb { mu: 1.0 })
    };
    let amplitudes = |side: f64| vec![("top".to_owned(), 1.0), ("side".to_owned(), side)];
    for (increments, allowed) in [(10, 1.5e-2), (40, 3e-3)] {
        let first = Step { loads: amplitudes(0.0), ..step("press") };
        let then = Step { loads: amplitudes(1.0), increments, ..step("squeeze") };
        let result = in_steps(&model, &[first, then]);
        let end = result.records.last().expect("a record");
        assert!(relative(end.tangential_force[0], 1405.36) < 2e-3, "{:?}", end.tangential_force);
        assert!(relative(end.dissipation, 9.841) < allowed, "{}", end.dissipation);
        assert_eq!(end.loads.get("side"), Some(&1.0));
    }
}

/// Truth: an independent program in plane strain with 256 bilinear elements along each side. The side of the plate at x = 0 is
/// displaced by 0.04 mm. The friction force on the plate is -1641.55(1) N. The dissipation is 9.7056(10) N mm in any number of
/// increments.
#[test]
fn plate_with_a_moved_side() {
    let mut spec = plate();
    spec.pressures.truncate(1);
    spec.supports.push(Support { value: [0.04, 0.0, 0.0], ..held("x0", 0) });
    let (_, model) = on_rigid_plane(spec, &[], FrictionLaw::Coulomb { mu: 1.0 });
    for increments in [1, 3] {
        let end = loaded(&model, increments).records.pop().expect("a record");
        assert!(relative(end.tangential_force[0], 1641.55) < 1e-2, "{:?}", end.tangential_force);
        assert!(relative(end.dissipation, 9.7056) < 1e-2, "{}", end.dissipation);
    }
}

/// Truth: statics of a block whose top is displaced by 0.1 mm along x, without friction. The block is free to rotate and to move
/// along z. All its points move by 0.1 mm along x. The block does not rotate, and its pressure stays uniform.
#[test]
fn a_moved_face_of_a_free_block() {
    let top = Support { components: [true, true, false], value: [0.1, 0.0, 0.0], ..held("z1", 0) };
    let mesh = block(ElementKind::Hex8, [4, 4, 4], [10.0; 3], |x| x);
    let material = Stiffness::isotropic(100e3, 0.0).expect("a material");
    let mut spec = spec(mesh, material, HexFormulation::Enhanced, vec![top]);
    spec.pressures = vec![("z1".into(), 50.0)];
    let (body, model) = on_rigid_plane(spec, &[], FrictionLaw::None);
    let result = loaded(&model, 1);
    let end = &result.records[0];
    assert!(end.rotation.iter().all(|angle| angle.abs() < 1e-9), "{:?}", end.rotation);
    assert!(relative(end.peak_pressure, 50.0) < 1e-9, "{}", end.peak_pressure);
    let loading = Loading { tractions: &result.state.tractions, amplitudes: &result.state.load_amplitudes };
    let moved = body.recover(loading).expect("a field").displacement;
    assert!(moved.iter().all(|u| (u[0] - 0.1).abs() < 1e-9), "{moved:?}");
}

/// Truth: superposition. All load cases at amplitude 1 cause together the gap and the stress of the body with all loads. This
/// holds for finite elements alone and with the near field of a half-space. The block system has the same gaps due to loads.
#[test]
fn cases_add_up_to_all_loads() {
    let frame = blocks::frame(6);
    let mut spec = blocks::body(ElementKind::Hex8, (3.0, 6, 1.0), &steel());
    spec.supports[0].value = [1e-4, 0.0, 2e-4];
    spec.pressures = vec![("x1".into(), 20.0)];
    spec.tractions = vec![("y0".into(), [1.0, 0.0, -3.0])];
    spec.body_force = [0.0, 0.0, -2.0];
    let unloaded = FeSpec { pressures: vec![], tractions: vec![], body_force: [0.0; 3], ..spec.clone() };
    let fixed: Vec<Support> =
        spec.supports.iter().map(|support| Support { value: [0.0; 3], ..support.clone() }).collect();
    let named = |name: &str| LoadCase { name: Some(name.to_owned()), preload: false };
    let cases = [
        (named("moved"), FeSpec { body_force: spec.body_force, ..unloaded.clone() }),
        (named("loaded"), FeSpec { supports: fixed, body_force: [0.0; 3], ..spec.clone() }),
    ];
    let resources = CondensationResources::default();
    let site = HalfSpaceFit::find(&spec, "z1", Side::Lower, &frame).expect("a fit").expect("a half-space");
    let meshed = |cases: &[(LoadCase, FeSpec)]| -> Box<dyn ElasticBody> {
        let (spec, worn) = (spec.clone(), None);
        let body = FeBody::with_worn_mesh(spec, cases, "z1", Side::Lower, &frame, &resources, worn);
        Box::new(body.expect("a body"))
    };
    let hybrid = |cases: &[(LoadCase, FeSpec)]| -> Box<dyn ElasticBody> {
        let spec = spec.clone();
        let body = HybridBody::new(spec, cases, "z1", Side::Lower, &frame, &site, &resources);
        Box::new(body.expect("a body"))
    };
    for bodies in [[meshed(&[]), meshed(&cases)], [hybrid(&[]), hybrid(&cases)]] {
        let [whole, mut parts] = bodies;
        let all = &whole.loads()[0].gap;
        let size = all.iter().fold(0.0, |most: f64, gap| most.max(gap.abs()));
        let loads = parts.loads().to_vec();
        assert_eq!(
            loads.iter().map(|load| load.case.clone()).collect::<Vec<_>>(),
            [named("moved"), named("loaded")]
        );
        let sum = |k: usize| loads[0].gap[k] + loads[1].gap[k];
        assert!((0..all.len()).all(|k| (sum(k) - all[k]).abs() < 1e-9 * size), "{}", whole.describe());
        assert!(loads.iter().all(|load| load.gap.iter().any(|gap| gap.abs() > 0.01 * size)));
        let nothing = vec![0.0; all.len()];
        let [one, two] = [(&whole, &[1.0][..]), (&parts, &[1.0, 1.0])].map(|(body, amplitudes)| {
            let loading = Loading { tractions: &nothing, amplitudes };
            let displacement = body.recover(loading).expect("a field").displacement;
            let field = body.recover_stress(loading, &displacement, ErrorEstimation::Skip).expect("a stress");
            let field = field.expect("a stress");
            let contact = field.contact.iter().map(|point| point.stress(&[0.0; 3]));
            field.stress.iter().copied().chain(contact).flatten().collect::<Vec<f64>>()
        });
        let largest = one.iter().fold(0.0, |most: f64, stress| most.max(stress.abs()));
        assert!(one.iter().zip(&two).all(|(a, b)| (a - b).abs() < 1e-9 * largest));
        if matches!(parts.equations(), BodyEquations::FiniteElements(_)) {
            let block = couple(parts.as_mut(), &mut RigidBody, &frame, Coupling::Block, SkipVanishing);
            for (block, load) in block.expect("a block system").loads.iter().zip(&loads) {
                assert!(block.gap.iter().zip(&load.gap).all(|(a, b)| (a - b).abs() < 1e-9 * size));
            }
        }
    }
}

/// Truth: equilibrium before contact. The plate is free along z, so nothing balances a preload by the pressure on top. The
/// support at x = 40 mm balances the pressure on the side.
#[test]
fn preloads_along_free_motions_are_refused() {
    let spec = plate();
    let with_preload = |preloaded: usize| {
        let mut cases = cases(&spec);
        cases[preloaded].0.preload = true;
        upper_body(spec.clone(), &cases)
    };
    let error = with_preload(0).err().expect("a refusal");
    assert!(error.message().contains("preload") && error.message().contains("translation z"), "{error}");
    let (body, _) = with_preload(1).expect("a body");
    assert!(body.loads()[1].case.preload);
}

/// Truth: without friction, the state does not depend on the load path. The pressures at the end do not depend on the number of
/// increments.
#[test]
fn frictionless_contact_has_no_memory_of_loads() {
    let (_, model) = on_rigid_plane(plate(), &[], FrictionLaw::None);
    let [once, often] = [1, 4].map(|increments| loaded(&model, increments).state.tractions);
    let peak = once.iter().fold(0.0, |most: f64, p| most.max(p.abs()));
    assert!(once.iter().zip(&often).all(|(a, b)| (a - b).abs() < 1e-9 * peak));
}

/// Truth: the bodies are linear. Displacement and stress are the sum of the fields due to the tractions and the fields due to the
/// loads. The latter are proportional to the amplitude.
#[test]
fn fields_are_linear_in_amplitudes() {
    let frame = blocks::frame(6);
    let tractions: Vec<f64> = (0..3 * frame.n_cells()).map(|k| ((7 * k) % 11) as f64 - 5.0).collect();
    let meshed = || {
        let mut spec = blocks::body(ElementKind::Hex8, (3.0, 6, 1.0), &steel());
        spec.supports[0].value = [1e-4, 0.0, 2e-4];
        spec.pressures = vec![("x1".into(), 20.0)];
        spec.body_force = [0.0, 0.0, -2.0];
        spec
    };
    let boundary = {
        let FeSpec { mesh, supports, pressures, body_force, .. } = meshed();
        let spec = boundary_spec(&mesh, &steel(), Linear, supports);
        boundary_body(&orthowear::body::BeSpec { pressures, body_force, ..spec }, "z1", Side::Lower, &frame)
    };
    let bodies: [Box<dyn ElasticBody>; 3] = [
        Box::new(FeBody::new(meshed(), "z1", Side::Lower, &frame).expect("a body")),
        Box::new(blocks::hybrid(meshed(), "z1", Side::Lower, &frame)),
        Box::new(boundary),
    ];
    for body in bodies {
        let field = |tractions: &[f64], amplitude: f64| {
            let loading = Loading { tractions, amplitudes: &[amplitude] };
            let displacement = body.recover(loading).expect("a field").displacement;
            let stress =
                body.recover_stress(loading, &displacement, ErrorEstimation::Skip).expect("a stress");
            let stress = stress.expect("a stress").stress;
            [displacement.into_flattened(), stress.into_flattened()]
        };
        let nothing = vec![0.0; tractions.len()];
        let (alone, loads, both) = (field(&tractions, 0.0), field(&nothing, 1.0), field(&tractions, -2.5));
        for kind in 0..2 {
            let size = loads[kind].iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            assert!(size > 0.0);
            for ((alone, load), both) in alone[kind].iter().zip(&loads[kind]).zip(&both[kind]) {
                assert!((alone - 2.5 * load - both).abs() < 1e-9 * size, "{}: {both}", body.describe());
            }
        }
    }
}
