//! Changes of temperature: free expansion, layered strips, shrink fits, and half-spaces.

use nalgebra::Matrix3;
use orthowear::bem::finite::Interpolation::Linear;
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, ErrorEstimation, FeBody, HalfSpaceBody, LoadCase, Loading};
use orthowear::coupling::{Coupling, clearance_and_interference, couple, surface_distance};
use orthowear::element::ElementKind::{self, Hex8, Hex20, Hex27};
use orthowear::evolution::Model;
use orthowear::evolution::step::{Step, Tangential};
use orthowear::fem::{
    CondensationResources, FeModel, FeSpec, HexFormulation, StressRecovery, Support, ThermoelasticState,
};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Side};
use orthowear::geometry::{Point, fibre_axes};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::{Orientation, PlacedMaterial, Ply, RegionMaterial, Stiffness};
use orthowear::mesh::Mesh;

use crate::bem::bodies::{body as boundary_body, held, spec as boundary_spec};
use crate::common::{im7, indent, press, relative, solve, sphere, steel, step};
use crate::crystals::cfrp_of_tables;
use crate::fem_bodies::{ELEMENTS, clamp, spec};
use crate::fem_meshes::{block, rough};

/// Young's modulus (MPa), Poisson's ratio and coefficient of thermal expansion (1/K) of steel.
const STEEL: [f64; 3] = [210e3, 0.3, 12e-6];
const ALUMINIUM: [f64; 3] = [70e3, 0.33, 23e-6];

fn placed(stiffness: Stiffness, expansion: [f64; 3], axes: Matrix3<f64>) -> PlacedMaterial {
    let orientation = Orientation::Uniform(axes);
    PlacedMaterial { name: "heated".into(), stiffness, expansion: Some(expansion), orientation }
}

fn isotropic([modulus, nu, alpha]: [f64; 3]) -> PlacedMaterial {
    let stiffness = Stiffness::isotropic(modulus, nu).expect("a material");
    placed(stiffness, [alpha; 3], Matrix3::identity())
}

fn heated(mesh: Mesh, material: PlacedMaterial, change: f64, supports: Vec<Support>) -> FeSpec {
    let plain = spec(mesh, material.stiffness.clone(), HexFormulation::Enhanced, supports);
    let regions = vec![(None, RegionMaterial::Single(Box::new(material)))];
    FeSpec { regions, temperature_change: change, ..plain }
}

/// Truth: an unconstrained body of one material expands by its thermal strain ε_T, without stress. The displacements u of two
/// points x and y obey (x - y)·(u(x) - u(y)) = (x - y)·ε_T (x - y). Rigid motions do not affect this equation. Tolerance:
/// rounding.
#[test]
fn free_expansion_has_no_stress() {
    let (expansion, change) = ([-0.5e-6, 30e-6, 27e-6], 80.0);
    let axes = fibre_axes(0.6, 0.4);
    let strain = axes * Matrix3::from_diagonal(&expansion.into()) * axes.transpose() * change;
    for (kind, formulation) in ELEMENTS {
        let mesh = block(kind, [2, 2, 2], [1.0; 3], rough);
        let material = placed(cfrp_of_tables(), expansion, axes);
        let spec = FeSpec { formulation, ..heated(mesh, material, change, vec![]) };
        let body = FeModel::new(spec).expect("a model").condense(&[]).expect("a body");
        let (model, u) = (body.model(), body.contact_free_displacement());
        let points = &model.mesh().points;
        for (x, at_x) in points.iter().zip(u) {
            let between = Point::from(*x) - Point::from(points[0]);
            let moved = Point::from(*at_x) - Point::from(u[0]);
            let error = between.dot(&(moved - strain * between));
            assert!(error.abs() < 1e-12 * change * expansion[1], "{} {error}", kind.name());
        }
        let recovery = StressRecovery::new(model).expect("a recovery");
        let state = ThermoelasticState { displacement: u, temperature_change: change };
        let stress = recovery.stress(model, state).expect("a stress");
        let largest = stress.iter().flatten().fold(0.0, |most: f64, stress| most.max(stress.abs()));
        // If supports prevented the expansion, the stress would be some 40 MPa.
        assert!(largest < 1e-9, "{} {formulation:?} {largest:e}", kind.name());
    }
}

/// Truth: smooth walls prevent expansion along x and y, and the upper surface is free. Finite and boundary elements have σ_x =
/// σ_y = -E α ΔT / (1 - ν). They also have ε_z = α ΔT (1 + ν) / (1 - ν). The stress of the contact surface follows from its
/// strain. At half of the amplitude, all results are halved.
#[test]
fn block_between_smooth_walls() {
    let ([modulus, nu, alpha], change) = (STEEL, 80.0);
    let (stress, rise) = (-modulus * alpha * change / (1.0 - nu), alpha * change * (1.0 + nu) / (1.0 - nu));
    let walls = vec![held("x0", 0), held("x1", 0), held("y0", 1), held("y1", 1), held("z0", 2)];
    let mesh = block(Hex8, [3, 3, 3], [1.0; 3], |[x, y, z]| [x, y, z - 1.0]);
    let frame = ContactFrame::grid([0.3; 2], [4; 2], [0.5; 2], 0.0).expect("a frame");
    let mut boundary = boundary_spec(&mesh, &steel(), Linear, walls.clone());
    boundary.thermal_strain = Matrix3::identity() * (alpha * change);
    let finite = heated(mesh, isotropic(STEEL), change, walls);
    let bodies: [(Box<dyn ElasticBody>, f64); 2] = [
        (Box::new(FeBody::new(finite, "z1", Side::Lower, &frame).expect("a body")), 1e-10),
        (Box::new(boundary_body(&boundary, "z1", Side::Lower, &frame)), 1e-4),
    ];
    let n = frame.n_cells();
    let nothing = vec![0.0; 3 * n];
    for (body, tolerance) in bodies {
        assert!(body.loads()[0].gap[2 * n..].iter().all(|gap| relative(*gap, -rise) < tolerance));
        let loading = Loading { tractions: &nothing, amplitudes: &[0.5] };
        let displacement = body.recover(loading).expect("a field").displacement;
        let top = displacement.iter().map(|u| u[2]).fold(0.0, f64::max);
        assert!(relative(top, 0.5 * rise) < tolerance, "{top} {rise}");
        let field = body.recover_stress(loading, &displacement, ErrorEstimation::Estimate);
        let field = field.expect("a stress").expect("a stress");
        let contact = field.contact.iter().map(|point| point.stress(&[0.0; 3]));
        for found in field.stress.iter().copied().chain(contact) {
            let wanted = [0.5 * stress, 0.5 * stress, 0.0, 0.0, 0.0, 0.0];
            let error = (0..6).map(|c| (found[c] - wanted[c]).abs()).fold(0.0, f64::max);
            assert!(error < tolerance * stress.abs(), "{found:?} {stress} {}", body.describe());
        }
        assert!(field.error.is_none_or(|error| error.relative_error() < 1e-6));
    }
}

/// Truth: superposition. A change of temperature at the amplitude 0.5 and a pressure at the amplitude 1 together cause the sum of
/// their single stresses.
#[test]
fn temperature_and_pressure_add_up() {
    let walls = vec![held("x0", 0), held("x1", 0), held("y0", 1), held("z0", 2)];
    let mesh = block(Hex8, [3, 3, 3], [1.0; 3], |[x, y, z]| [x, y, z - 1.0]);
    let frame = ContactFrame::grid([0.3; 2], [4; 2], [0.5; 2], 0.0).expect("a frame");
    let warm = heated(mesh, isotropic(STEEL), 80.0, walls);
    let pressed = FeSpec { temperature_change: 0.0, pressures: vec![("y1".into(), 30.0)], ..warm.clone() };
    let both = FeSpec { temperature_change: 80.0, ..pressed.clone() };
    let case = |name: &str| LoadCase { name: Some(name.to_owned()), preload: false };
    let cases = [(case("pressed"), pressed.clone()), (case("warm"), warm.clone())];
    let resources = CondensationResources::default();
    let stress = |spec: &FeSpec, cases: &[(LoadCase, FeSpec)], amplitudes: &[f64]| {
        let body = FeBody::with_worn_mesh(spec.clone(), cases, "z1", Side::Lower, &frame, &resources, None);
        let body = body.expect("a body");
        let nothing = vec![0.0; 3 * frame.n_cells()];
        let loading = Loading { tractions: &nothing, amplitudes };
        let displacement = body.recover(loading).expect("a field").displacement;
        let field = body.recover_stress(loading, &displacement, ErrorEstimation::Skip);
        let field = field.expect("a stress").expect("a stress");
        let contact = field.contact.iter().map(|point| point.stress(&[0.0; 3]));
        field.stress.iter().copied().chain(contact).flatten().collect::<Vec<f64>>()
    };
    let sum = stress(&both, &cases, &[1.0, 0.5]);
    let parts = [stress(&pressed, &[], &[1.0]), stress(&warm, &[], &[0.5])];
    for (k, sum) in sum.iter().enumerate() {
        assert!((sum - parts[0][k] - parts[1][k]).abs() < 1e-9, "{sum}");
    }
    assert!(parts.iter().all(|part| part.iter().any(|stress| stress.abs() > 10.0)));
}

/// Curvature of two bonded layers, each 1 mm thick, 1/mm. `moduli` are Young's moduli of the lower and the upper layer. `strains`
/// are the free strains of the two layers along the strip.
///
/// # Source
/// Timoshenko (1925), J. Opt. Soc. Am. 11, 233-255, eq. 4.
fn bonded_layers(moduli: [f64; 2], strains: [f64; 2]) -> f64 {
    let n = moduli[0] / moduli[1];
    24.0 * (strains[0] - strains[1]) / (2.0 * (12.0 + (1.0 + n) * (1.0 + 1.0 / n)))
}

/// Curvature u_z,xx in the middle of a strip of two layers, 1/mm. The strip is 40 mm long and 2 mm high.
fn curvature(plies: [PlacedMaterial; 2], change: f64, plane_strain: bool) -> f64 {
    let mesh = block(Hex20, [40, 1, 8], [1.0; 3], |[x, y, z]| [20.0 * x, 0.25 * y, 2.0 * z]);
    let mut supports = vec![held("x0", 0), held("y0", 1)];
    supports.extend(plane_strain.then(|| held("y1", 1)));
    let at = |x: f64| {
        let wanted = [x, 0.0, 1.0];
        let distance = |point: &[f64; 3]| (0..3).map(|c| (point[c] - wanted[c]).powi(2)).sum::<f64>();
        mesh.points.iter().position(|point| distance(point) < 1e-12).expect("a node")
    };
    let places = [0.0, 4.0, 8.0].map(at);
    let z_range = [[0.0, 1.0], [1.0, 2.0]];
    let plies = plies.into_iter().zip(z_range).map(|(material, z_range)| Ply { z_range, material });
    let layup = RegionMaterial::Layup(plies.collect());
    let plain = spec(mesh, steel(), HexFormulation::Enhanced, supports);
    let strip = FeSpec { regions: vec![(None, layup)], temperature_change: change, ..plain };
    let body = FeModel::new(strip).expect("a model").condense(&[]).expect("a body");
    let [a, b, c] = places.map(|node| body.contact_free_displacement()[node][2]);
    (a - 2.0 * b + c) / 16.0
}

/// Truth: Timoshenko's bimetallic strip. Plane strain replaces E by E / (1 - ν²) and α by α (1 + ν). The second strip is a
/// laminate of a 0° and a 90° ply, with σ_z = 0 and ε_y = 0. An independent program gives the curvatures -1.04109e-3 and
/// 1.13613e-3 per mm. The strip bends uniformly far from its ends.
#[test]
fn strips_of_two_materials() {
    let plane = |[modulus, nu, alpha]: [f64; 3]| [modulus / (1.0 - nu * nu), alpha * (1.0 + nu)];
    let [lower, upper] = [STEEL, ALUMINIUM].map(plane);
    let exact = bonded_layers([lower[0], upper[0]], [lower[1], upper[1]].map(|alpha| 100.0 * alpha));
    assert!((exact + 1.04109e-3).abs() < 1e-8, "{exact}");
    let found = curvature([STEEL, ALUMINIUM].map(isotropic), 100.0, true);
    assert!(relative(found, exact) < 1e-4, "{found} {exact}");
    // In plane strain, a ply with fibres along x has σ_x = E1 / (1 - ν12 ν21) (ε_x - (α_x + ν_yx α_y) ΔT). With fibres along y,
    // E2 replaces E1.
    let (e1, e2, nu12, alpha) = (167230.0, 9544.0, 0.272, [-0.5e-6, 30e-6, 30e-6]);
    let nu21 = nu12 * e2 / e1;
    let moduli = [e1, e2].map(|modulus| modulus / (1.0 - nu12 * nu21));
    let strains = [alpha[0] + nu21 * alpha[1], alpha[1] + nu12 * alpha[0]].map(|strain| -100.0 * strain);
    let exact = bonded_layers(moduli, strains);
    assert!((exact - 1.13613e-3).abs() < 1e-8, "{exact}");
    let ply = |angle: f64| placed(im7(0.0), alpha, fibre_axes(0.0, angle.to_radians()));
    let found = curvature([ply(0.0), ply(90.0)], -100.0, true);
    assert!(relative(found, exact) < 1e-3, "{found} {exact}");
}

/// Nominal outer radii of shaft and hub, mm.
const RADII: [f64; 2] = [25.0, 40.0];

/// Radius of the bore of the shaft, mm.
const BORE: f64 = 15.0;

/// A quarter of a ring about the y axis, 1 mm long along y, in z <= 0. It has `around` elements along the arc.
fn ring(
    kind: ElementKind,
    [inner, outer]: [f64; 2],
    around: usize,
    material: [f64; 3],
    change: f64,
    plane_strain: bool,
) -> FeSpec {
    let mesh = block(kind, [around, 1, 4], [1.0; 3], |[t, y, r]| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * t).sin_cos();
        let radius = inner + (outer - inner) * r;
        [radius * cos, y, -radius * sin]
    });
    let mut supports = vec![held("x0", 2), held("x1", 0), held("y0", 1)];
    supports.extend(plane_strain.then(|| held("y1", 1)));
    heated(mesh, isotropic(material), change, supports)
}

/// Materials (E, ν, α) and changes of temperature (K) of a shaft and a hub.
#[derive(Clone, Copy)]
struct Fit {
    shaft: ([f64; 3], f64),
    hub: ([f64; 3], f64),
    /// Meshed outer radius of the shaft minus meshed inner radius of the hub, mm.
    interference: f64,
    plane_strain: bool,
}

impl Fit {
    /// Pressures in all cells, MPa. The quarter circle has `around` elements.
    fn pressures(&self, kind: ElementKind, around: usize) -> Vec<f64> {
        let bodies = [
            (RADII, self.hub),
            // The interference multiplies all radii of the shaft by one factor, as a change of temperature does.
            ([BORE, RADII[0]].map(|r| r * (1.0 + self.interference / RADII[0])), self.shaft),
        ];
        let [hub, shaft] = bodies.map(|(radii, (material, change))| {
            ring(kind, radii, around, material, change, self.plane_strain)
        });
        let frame = ContactFrame::from_faces(&hub.mesh, "z0", Side::Lower, [0.0; 2], 0.0).expect("a frame");
        let mut hub = FeBody::new(hub, "z0", Side::Lower, &frame).expect("a hub");
        let mut shaft = FeBody::new(shaft, "z1", Side::Upper, &frame).expect("a shaft");
        let as_meshed = InitialGap { as_meshed: true, ..GapShape::Mesh.into() };
        let distance = surface_distance(&as_meshed, &frame, &hub, &shaft).expect("a gap");
        let coupled =
            couple(&mut hub, &mut shaft, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
        let (clearance, interference) = clearance_and_interference(&distance);
        let model = Model {
            initial_gap: coupled.initial_gap(&clearance),
            frame,
            flexibility: coupled.flexibility,
            loads: coupled.loads.into_iter().chain([interference]).collect(),
            floating: coupled.floating,
            friction: FrictionLaw::None,
            wear: WearLaw::None,
            wear_share: 1.0,
        };
        let n = model.frame.n_cells();
        solve(&model, &[indent(0.0)]).state.tractions[2 * n..].to_vec()
    }

    /// Pressure by Lamé, MPa; 0 if the shaft loses contact. Plane strain replaces E by E/(1-ν²), ν by ν/(1-ν) and α by α(1+ν).
    fn by_lame(&self) -> f64 {
        let plane = |([modulus, nu, alpha], change): ([f64; 3], f64)| {
            if self.plane_strain {
                [modulus / (1.0 - nu * nu), nu / (1.0 - nu), alpha * (1.0 + nu) * change]
            } else {
                [modulus, nu, alpha * change]
            }
        };
        let [shaft, hub] = [self.shaft, self.hub].map(plane);
        let ([r, outer], bore) = (RADII.map(|radius| radius * radius), BORE * BORE);
        let flexibility =
            ((r + bore) / (r - bore) - shaft[1]) / shaft[0] + ((outer + r) / (outer - r) + hub[1]) / hub[0];
        ((self.interference / RADII[0] + shaft[2] - hub[2]) / flexibility).max(0.0)
    }
}

const STEEL_OF_RINGS: [f64; 3] = [200e3, 0.3, 12e-6];

/// Truth: Lamé's rings with thermal strains. In plane strain, a steel shaft that is 80 K warmer than its steel hub causes 62.2379
/// MPa. The second fit is a steel shaft with an interference of 0.02 mm in an aluminium hub, both 60 K warmer. In plane stress it
/// causes 3.01464 MPa, in plane strain the shaft loses contact. Errors decrease with the square of the element size. The meshed
/// radii differ by the interference, which changes the pressure due to the interference by 8e-4.
#[test]
fn shrink_fits_by_lame() {
    let (steel, aluminium) = (STEEL_OF_RINGS, ALUMINIUM);
    let warm = Fit { shaft: (steel, 80.0), hub: (steel, 0.0), interference: 0.0, plane_strain: true };
    let fitted =
        Fit { shaft: (steel, 60.0), hub: (aluminium, 60.0), interference: 0.02, plane_strain: false };
    for (fit, pressure, tolerance) in [(warm, 62.2379, 2e-3), (fitted, 3.01464, 1e-2)] {
        let exact = fit.by_lame();
        assert!(relative(exact, pressure) < 2e-6, "{exact}");
        let [coarse, fine] = [6, 12].map(|around| {
            let found = fit.pressures(Hex27, around);
            found.iter().sum::<f64>() / found.len() as f64 / exact - 1.0
        });
        println!("{exact} {coarse:e} {fine:e}");
        assert!((fine - (coarse - fine) / 3.0).abs() < tolerance, "{coarse} {fine}");
    }
    let loose = Fit { plane_strain: true, ..fitted };
    assert_eq!(loose.by_lame(), 0.0);
    assert!(loose.pressures(Hex27, 6).iter().all(|p| *p == 0.0));
}

/// Truth: in plane strain, a shaft that is ΔT warmer acts as a shaft meshed larger by the factor 1 + α (1 + ν) ΔT. This holds
/// because the stiffness of a shaft does not depend on its size in the plane. With equal straight faces of shaft and hub, both
/// shafts have the same gap in each cell.
#[test]
fn a_warm_shaft_is_a_larger_shaft() {
    let [_, nu, alpha] = STEEL_OF_RINGS;
    let steel = |change| (STEEL_OF_RINGS, change);
    let warm = Fit { shaft: steel(50.0), hub: steel(0.0), interference: 0.0, plane_strain: true };
    let larger = alpha * (1.0 + nu) * 50.0 * RADII[0];
    let meshed = Fit { shaft: steel(0.0), interference: larger, ..warm };
    let [warm, meshed] = [warm, meshed].map(|fit| fit.pressures(Hex8, 6));
    assert!(warm.iter().zip(&meshed).all(|(a, b)| relative(*a, *b) < 1e-9));
}

/// Half-space with the thermal strain `strain` in global axes.
fn half_space(
    stiffness: &Stiffness,
    side: Side,
    frame: &ContactFrame,
    strain: &Matrix3<f64>,
) -> HalfSpaceBody {
    let body = HalfSpaceBody::new(stiffness, side, frame).expect("a half-space");
    body.with_thermal_strain(strain, LoadCase::default(), frame).expect("an admissible strain")
}

fn thermal_strain(expansion: [f64; 3], axes: &Matrix3<f64>, change: f64) -> Matrix3<f64> {
    axes * Matrix3::from_diagonal(&expansion.into()) * axes.transpose() * change
}

/// Truth: both half-spaces become ΔT = 80 K warmer. The fibres of the lower one have the tilt φ, so its surface strain is ΔT
/// α_xx = ΔT (α1 cos²φ + α2 sin²φ) along the projected fibre. Across the fibre the strain is ΔT α2. The upper half-space, of
/// steel, has the strain 12e-6 ΔT. For tilts of 0, 30 and 90 degrees, the relative strains along x are 1.0e-3, 3.9e-4 and
/// -1.44e-3.
#[test]
fn half_spaces_expand_along_their_surface() {
    let frame = ContactFrame::grid([1.0, 0.5], [8, 4], [0.3, 0.0], 0.0).expect("a frame");
    for (tilt, along, across) in
        [(0.0_f64, 1.0e-3, -1.44e-3), (30.0, 3.9e-4, -1.44e-3), (90.0, -1.44e-3, -1.44e-3)]
    {
        let axes = fibre_axes(tilt.to_radians(), 0.0);
        let lower = thermal_strain([-0.5e-6, 30e-6, 30e-6], &axes, 80.0);
        let upper = Matrix3::identity() * (12e-6 * 80.0);
        let lower = half_space(&im7(tilt), Side::Lower, &frame, &lower);
        let upper = half_space(&steel(), Side::Upper, &frame, &upper);
        let n = frame.n_cells();
        for (cell, center) in frame.centers.iter().enumerate() {
            let gap = |k: usize| lower.loads()[0].gap[k] + upper.loads()[0].gap[k];
            let wanted = [along * (center.x - 0.3), across * center.y, 0.0];
            let error = (0..3).map(|c| (gap(c * n + cell) - wanted[c]).abs()).fold(0.0, f64::max);
            assert!(error < 1e-15, "{tilt} {error:e}");
        }
    }
}

/// Truth: only the strain of the surface affects the friction. The bulk stress σ_x = σ_y = E α ΔT / (1 - ν) strains the surface
/// as the temperature does. It therefore causes the same tractions. At a point x inside the body, the temperature causes no
/// stress, but the displacement α ΔT x.
#[test]
fn temperature_acts_as_bulk_stress() {
    let ([modulus, nu, alpha], change) = (STEEL, 40.0);
    let stress = modulus * alpha * change / (1.0 - nu);
    let frame = ContactFrame::grid([1.25; 2], [24; 2], [0.0; 2], 0.0).expect("a frame");
    let tractions = |heated: bool| {
        let mut lower = HalfSpaceBody::new(&steel(), Side::Lower, &frame).expect("a half-space");
        lower = if heated {
            half_space(&steel(), Side::Lower, &frame, &(Matrix3::identity() * (alpha * change)))
        } else {
            lower.with_bulk_stress([stress, stress, 0.0], LoadCase::default(), &frame).expect("a stress")
        };
        let mut upper = HalfSpaceBody::new(&steel(), Side::Upper, &frame).expect("a half-space");
        let coupled =
            couple(&mut lower, &mut upper, &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
        let shape = sphere(50.0);
        let gap: Vec<f64> = frame.centers.iter().map(|center| shape(center.x, center.y)).collect();
        let initial_gap = coupled.initial_gap(&gap);
        let model = Model {
            frame: frame.clone(),
            flexibility: coupled.flexibility,
            initial_gap,
            loads: coupled.loads,
            floating: coupled.floating,
            friction: FrictionLaw::Coulomb { mu: 0.5 },
            wear: WearLaw::None,
            wear_share: 1.0,
        };
        let pull = Step { tangential: Some(Tangential::Force([30.0, 0.0])), ..step("pull") };
        let state = solve(&model, &[press(200.0), pull]).state;
        let point = Point::new(0.2, -0.1, -0.7);
        let inside = |amplitude: f64| {
            let loading = Loading { tractions: &state.tractions, amplitudes: &[amplitude] };
            lower.recover_at_points(&frame, loading, &[point]).expect("a field").expect("a field")[0]
        };
        let (with, without) = (inside(1.0), inside(0.0));
        if heated {
            assert!((with.stress - without.stress).amax() < 1e-12);
            assert!((with.displacement - without.displacement - point * (alpha * change)).amax() < 1e-15);
        }
        state.tractions
    };
    let [by_temperature, by_stress] = [true, false].map(tractions);
    let peak = by_stress.iter().fold(0.0, |most: f64, p| most.max(p.abs()));
    let shear = by_stress[..frame.n_cells()].iter().fold(0.0, |most: f64, q| most.max(q.abs()));
    assert!(shear > 0.05 * peak);
    assert!(by_temperature.iter().zip(&by_stress).all(|(a, b)| (a - b).abs() < 1e-10 * peak));
}

/// Truth: a surface that is periodic along y cannot expand along y. At a plane of symmetry y = 0, the surface must not move along
/// y. The thermal strain has no shear at this plane if the fibre is parallel or perpendicular to the plane. A fibre at another
/// angle has shear and is refused. Elements without coefficients of expansion cannot change their temperature.
#[test]
fn what_cannot_expand_is_refused() {
    let mut frame = ContactFrame::grid([1.0; 2], [4; 2], [0.0; 2], 0.0).expect("a frame");
    frame.grid.as_mut().expect("a grid").periodic = [false, true];
    let body = HalfSpaceBody::new(&steel(), Side::Lower, &frame).expect("a half-space");
    let strain = Matrix3::identity() * 1e-3;
    let error = body.with_thermal_strain(&strain, LoadCase::default(), &frame).err().expect("a refusal");
    assert!(error.message().contains("periodic direction y"), "{error}");
    let mut frame = ContactFrame::grid([1.0, 0.1], [4, 1], [0.0; 2], 0.0).expect("a frame");
    frame.symmetry_planes = Some(vec![[false, true, false]; 4]);
    let with_fibre = |azimuth: f64| {
        let axes = fibre_axes(30.0_f64.to_radians(), azimuth.to_radians());
        let body = HalfSpaceBody::new(&steel(), Side::Lower, &frame).expect("a half-space");
        let strain = thermal_strain([-0.5e-6, 30e-6, 30e-6], &axes, 80.0);
        body.with_thermal_strain(&strain, LoadCase::default(), &frame).map(|_| ())
    };
    assert!(with_fibre(0.0).is_ok() && with_fibre(90.0).is_ok());
    let error = with_fibre(40.0).expect_err("a refusal");
    assert!(error.message().contains("plane of symmetry"), "{error}");
    let mesh = block(Hex8, [1, 1, 1], [1.0; 3], |x| x);
    let unknown = FeSpec {
        temperature_change: 80.0,
        ..spec(mesh, steel(), HexFormulation::Enhanced, vec![clamp("z0")])
    };
    let error = FeModel::new(unknown).err().expect("a refusal");
    assert!(error.message().contains("thermal expansion"), "{error}");
}
