//! Press fits without friction: pressure between bodies that overlap as meshed.

use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{FeBody, INTERFERENCE};
use orthowear::coupling::{Coupling, clearance_and_interference, couple, meshed_gap, surface_distance};
use orthowear::element::ElementKind;
use orthowear::error::Result;
use orthowear::evolution::Model;
use orthowear::evolution::records::Outcome;
use orthowear::evolution::step::Step;
use orthowear::fem::{FeSpec, HexFormulation};
use orthowear::frame::{ContactFrame, GapShape, InitialGap, MeshedSurface, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::bem::bodies::held;
use crate::common::{indent, relative, solve, step};
use crate::fem_bodies::spec;
use crate::fem_meshes::block;

/// Nominal outer radii of shaft and hub, mm. The inner radius of the hub is the first radius.
const RADII: [f64; 2] = [25.0, 40.0];
/// Radial interference of shaft and hub, mm.
const INTERFERENCE_MM: f64 = 0.02;

/// A quarter of a ring about the y axis in z <= 0, 1 mm long along y, with roller supports. It has `around` elements along the
/// arc and four along the radius. The face group "z0" is the inner cylinder, "z1" the outer one.
fn ring(kind: ElementKind, [inner, outer]: [f64; 2], around: usize, plane_strain: bool) -> FeSpec {
    let mesh = block(kind, [around, 1, 4], [1.0; 3], |[t, y, r]| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * t).sin_cos();
        let radius = inner + (outer - inner) * r;
        [radius * cos, y, -radius * sin]
    });
    let mut supports = vec![held("x0", 2), held("x1", 0), held("y0", 1)];
    supports.extend(plane_strain.then(|| held("y1", 1)));
    let steel = Stiffness::isotropic(200e3, 0.3).expect("a material");
    spec(mesh, steel, HexFormulation::Enhanced, supports)
}

fn as_meshed() -> InitialGap {
    InitialGap { as_meshed: true, ..GapShape::Mesh.into() }
}

/// Contact model of hub and shaft with the interference [`INTERFERENCE_MM`]. `bore` is the inner radius of the shaft, mm.
/// `elements` are the numbers of elements along the arc of the hub and of the shaft.
fn fit(kind: ElementKind, bore: f64, elements: [usize; 2], plane_strain: bool) -> Result<Model> {
    fit_with(INTERFERENCE_MM, kind, bore, elements, plane_strain)
}

fn fit_with(
    interference: f64,
    kind: ElementKind,
    bore: f64,
    [around, shaft]: [usize; 2],
    plane_strain: bool,
) -> Result<Model> {
    let hub = ring(kind, RADII, around, plane_strain);
    let shaft = ring(kind, [bore, RADII[0] + interference], shaft, plane_strain);
    let frame = ContactFrame::from_faces(&hub.mesh, "z0", Side::Lower, [0.0; 2], 0.0)?;
    let mut hub = FeBody::new(hub, "z0", Side::Lower, &frame)?;
    let mut shaft = FeBody::new(shaft, "z1", Side::Upper, &frame)?;
    let distance = surface_distance(&as_meshed(), &frame, &hub, &shaft)?;
    let coupled = couple(&mut hub, &mut shaft, &frame, Coupling::Schur, SkipVanishing)?;
    let (clearance, interference) = clearance_and_interference(&distance);
    Ok(Model {
        initial_gap: coupled.initial_gap(&clearance),
        frame,
        flexibility: coupled.flexibility,
        loads: coupled.loads.into_iter().chain([interference]).collect(),
        floating: coupled.floating,
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    })
}

/// Contact pressure by Lamé between a hub and a hollow shaft of one material, MPa. `bore` is the inner radius of the shaft, mm.
/// Plane strain replaces E by E/(1-ν²) and ν by ν/(1-ν).
fn lame(bore: f64, plane_strain: bool) -> f64 {
    let (modulus, nu) = if plane_strain { (200e3 / 0.91, 0.3 / 0.7) } else { (200e3, 0.3) };
    let [r, outer] = RADII.map(|radius| radius * radius);
    let bore = bore * bore;
    let shaft = (r + bore) / (r - bore) - nu;
    let hub = (outer + r) / (outer - r) + nu;
    INTERFERENCE_MM * modulus / (RADII[0] * (shaft + hub))
}

fn pressures(model: &Model, steps: &[Step]) -> Vec<f64> {
    let result = solve(model, steps);
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    let n = model.frame.n_cells();
    result.state.tractions[2 * n..].to_vec()
}

/// Truth: the pressure is uniform and has Lamé's value (1852). Its error decreases with the square of the element size. The
/// meshed outer radius of the shaft is R + δ (nominal radius R, interference δ), but Lamé's formula uses R for both bodies. This
/// changes the pressure by the fraction δ/R = 8e-4.
#[test]
fn rings_by_lame() {
    for (bore, plane_strain) in [(2.0, false), (15.0, false), (15.0, true)] {
        let exact = lame(bore, plane_strain);
        let errors = [6, 12].map(|around| {
            let model = fit(ElementKind::Hex27, bore, [around; 2], plane_strain).expect("a model");
            let found = pressures(&model, &[indent(0.0)]);
            let [least, most] = [f64::min, f64::max].map(|of| found.iter().copied().reduce(of).unwrap());
            assert!(most - least < 1e-6 * exact, "{least} {most}");
            println!("{bore} {plane_strain} {around} {} {exact}", found[0]);
            found[0] / exact - 1.0
        });
        assert!(errors[1].abs() < 1e-2, "{errors:?}");
        assert!(errors[0] - errors[1] > 0.0, "{errors:?}");
        // Richardson extrapolation with order 2.
        let limit = errors[1] - (errors[0] - errors[1]) / 3.0;
        assert!(limit.abs() < 2e-3, "{errors:?} {limit}");
    }
}

/// Truth: contact without friction does not depend on the load path, and the rings respond linearly while they touch everywhere.
/// Half of the interference therefore gives half of the pressure, in any number of increments.
#[test]
fn half_of_the_interference() {
    let model = fit(ElementKind::Hex27, 15.0, [6; 2], false).expect("a model");
    let amplitude = |amplitude: f64| vec![(INTERFERENCE.to_owned(), amplitude)];
    let whole = pressures(&model, &[indent(0.0)]);
    let half = Step { loads: amplitude(0.5), increments: 3, ..indent(0.0) };
    let again = Step { loads: amplitude(1.0), ..step("rest") };
    for (steps, factor) in [(vec![half.clone()], 0.5), (vec![half, again], 1.0)] {
        let found = pressures(&model, &steps);
        assert!(whole.iter().zip(&found).all(|(whole, p)| relative(*p, factor * whole) < 1e-9));
    }
}

/// Truth: chords of length h lie up to h²/8R inside a circle of radius R. With 6 and 8 straight faces per quarter, these depths
/// differ by far more than the interference, and the gap is refused. With equal numbers of faces, the depths are equal. Rings
/// that do not overlap have a positive distance, which equals their clearance.
#[test]
fn straight_faces_against_interference() {
    let refused = fit(ElementKind::Hex8, 15.0, [6, 8], false).err().expect("a refusal");
    assert!(refused.message().contains("second order"), "{refused}");
    assert!(fit(ElementKind::Hex27, 15.0, [6, 8], false).is_ok());
    // The straight faces also overlap if the curved surfaces have a clearance.
    let loose = fit_with(-INTERFERENCE_MM, ElementKind::Hex8, 15.0, [6, 8], false);
    assert!(loose.err().is_some_and(|error| error.message().contains("second order")));
    let model = fit(ElementKind::Hex8, 15.0, [12; 2], false).expect("a model");
    let found = pressures(&model, &[indent(0.0)]);
    assert!(found.iter().all(|p| relative(*p, lame(15.0, false)) < 0.03), "{found:?}");
    let hub = ring(ElementKind::Hex27, RADII, 6, false);
    let shaft = ring(ElementKind::Hex27, [15.0, RADII[0] - INTERFERENCE_MM], 6, false);
    let frame = ContactFrame::from_faces(&hub.mesh, "z0", Side::Lower, [0.0; 2], 0.0).unwrap();
    let surface = |spec: FeSpec, contact: &str, side: Side| -> MeshedSurface {
        use orthowear::body::ElasticBody;
        FeBody::new(spec, contact, side, &frame).unwrap().surface().unwrap().clone()
    };
    let [hub, shaft] = [surface(hub, "z0", Side::Lower), surface(shaft, "z1", Side::Upper)];
    let gap = meshed_gap(&as_meshed(), &frame, [Some(&hub), Some(&shaft)]).unwrap();
    assert_eq!(gap.closing_motion, 0.0);
    assert!(gap.distance.iter().all(|distance| relative(*distance, INTERFERENCE_MM) < 0.02), "{gap:?}");
}
