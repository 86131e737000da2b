//! Flat punches of any outline: pressed, tilted, twisted, displaced tangentially, bonded. docs/verification.md lists the named
//! cases.

use std::f64::consts::PI;
use std::sync::Arc;

use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::{ElasticBody, HalfSpaceBody, Loading, RigidBody};
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple, surface_distance};
use orthowear::evolution::Model;
use orthowear::evolution::records::{Divergence, IncrementRecord, Outcome};
use orthowear::evolution::step::{Spin, Step, Tilt};
use orthowear::flexibility::Flexibility;
use orthowear::frame::{ContactFrame, GapShape, InitialGap, Outline, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;

use crate::common::{indent, press, relative, shift, solve, solve_with, steel, step};
use crate::observed::pull;

/// Friction coefficient so large that only cells at the edge of a punch slip.
const BONDED: FrictionLaw = FrictionLaw::Coulomb { mu: 100.0 };

/// Frame with the grid cells inside `outline`. The grid has `cells` cells across the width `2 extent`, plus a margin of one cell.
pub fn frame(outline: &Outline, extent: f64, cells: usize) -> ContactFrame {
    let spacing = 2.0 * extent / cells as f64;
    let n = cells + 2;
    ContactFrame::grid([0.5 * n as f64 * spacing; 2], [n, n], [0.0; 2], 0.0)
        .and_then(|grid| grid.clipped_to(outline))
        .expect("an admissible frame")
}

fn disc(radius: f64) -> Outline {
    Outline::Circle { radius, center: [0.0; 2] }
}

/// Frictionless contact of a half-space below with a half-space above. The upper body is rigid if `upper` is `None`.
pub fn model(lower: &Stiffness, upper: Option<&Stiffness>, frame: ContactFrame, gap: GapShape) -> Model {
    let mut body1 = HalfSpaceBody::new(lower, Side::Lower, &frame).expect("a half-space");
    let mut body2: Box<dyn ElasticBody> = match upper {
        Some(upper) => Box::new(HalfSpaceBody::new(upper, Side::Upper, &frame).expect("a half-space")),
        None => Box::new(RigidBody),
    };
    let distance = surface_distance(&InitialGap::from(gap), &frame, &body1, body2.as_ref()).expect("a gap");
    let coupled =
        couple(&mut body1, body2.as_mut(), &frame, Coupling::Schur, SkipVanishing).expect("coupled bodies");
    let initial_gap = coupled.initial_gap(&distance);
    Model {
        frame,
        flexibility: coupled.flexibility,
        initial_gap,
        loads: coupled.loads,
        floating: coupled.floating,
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
    }
}

fn last(model: &Model, steps: &[Step]) -> IncrementRecord {
    let result = solve(model, steps);
    assert_eq!(result.outcome, Outcome::Converged, "{:?}", result.warnings);
    result.records.last().expect("records").clone()
}

fn moduli(g: f64, nu: f64) -> Stiffness {
    Stiffness::isotropic(2.0 * g * (1.0 + nu), nu).expect("an admissible material")
}

fn at(frame: &ContactFrame, values: &[f64], x: f64, y: f64) -> f64 {
    let distance = |cell: usize| (frame.centers[cell].x - x).hypot(frame.centers[cell].y - y);
    let cell = (0..frame.n_cells()).min_by(|a, b| distance(*a).total_cmp(&distance(*b))).expect("cells");
    values[cell]
}

/// Truth: case `punch-flat-circular` (Boussinesq). At the approach delta, a rigid punch of radius a carries F = 2 E* a delta. The
/// force agrees to 1e-2 at 20 cells along the radius, the pressure at the centre to 5e-3. Pressures are positive and increase
/// along a radius, without a checkerboard pattern. At the distance r > a from the axis, the surface sinks by (2 delta / pi)
/// asin(a / r), to 1e-2.
#[test]
fn a_circular_punch() {
    let (a, delta) = (2.0, 0.01);
    let frame = frame(&disc(a), a, 40);
    let model = model(&steel(), None, frame.clone(), GapShape::Flat);
    let result = solve(&model, &[indent(delta)]);
    let found = &result.records[0];
    assert!(relative(found.normal_force, 9_230.769_231) < 1e-2, "{}", found.normal_force);
    assert!(!found.contact_touches_edge && result.warnings.is_empty(), "{:?}", result.warnings);
    // The clipped frame keeps the grid positions of its cells, so the convolution on the grid remains exact.
    assert!(found.certificate.operator_defect.expect("a grid") < 1e-12, "{:?}", found.certificate);
    let n = frame.n_cells();
    let pressure = &result.state.tractions[2 * n..];
    assert!(pressure.iter().all(|p| *p > 0.0));
    let middle = at(&frame, pressure, 0.05, 0.05);
    assert!(relative(middle, 367.280_637_9) < 5e-3, "{middle}");
    let along: Vec<f64> = (0..20).map(|i| at(&frame, pressure, 0.05 + 0.1 * f64::from(i), 0.05)).collect();
    assert!(along.windows(2).all(|pair| pair[1] > pair[0]), "{along:?}");

    let wide = ContactFrame::grid([4.5; 2], [90, 90], [0.0; 2], 0.0).expect("a grid");
    let body = HalfSpaceBody::new(&steel(), Side::Lower, &wide).expect("a half-space");
    let mut tractions = vec![0.0; 3 * wide.n_cells()];
    for (cell, center) in wide.centers.iter().enumerate() {
        if center.x.hypot(center.y) <= a {
            tractions[2 * wide.n_cells() + cell] = at(&frame, pressure, center.x, center.y);
        }
    }
    let sunk: Vec<f64> = body
        .recover(Loading::of_contact(&tractions))
        .expect("a field")
        .displacement
        .iter()
        .map(|u| -u[2])
        .collect();
    for (r, wanted) in [(2.0 * a, 0.003_333_333_333), (1.1 * a, 0.007_264_446_963)] {
        let (low, high) = (at(&wide, &sunk, r - 0.05, 0.05), at(&wide, &sunk, r + 0.05, 0.05));
        assert!(relative(0.5 * (low + high), wanted) < 1e-2, "{r}: {low} {high} {wanted}");
    }
}

/// Truth: case `punch-flat-square`. At the approach delta, a rigid square of side L carries F = 1.152303513 E* L delta. The
/// factor follows from the capacitance of a square plate (Hwang, Mascagni, Won 2010). Tolerances: 6e-3 at 64 cells along the
/// side, 3e-3 at 128, 1e-3 after Richardson extrapolation of order 1. A polygonal outline on a wider grid selects the same cells
/// and gives the same force.
#[test]
fn a_square_punch() {
    let material = Stiffness::isotropic(1.0, 0.0).expect("E* = 1");
    let wanted = 1.152_303_513;
    let force = |frame: ContactFrame| {
        last(&model(&material, None, frame, GapShape::Flat), &[indent(1.0)]).normal_force
    };
    let whole = |n: usize| ContactFrame::grid([0.5; 2], [n, n], [0.0; 2], 0.0).expect("a grid");
    let (coarse, fine) = (force(whole(64)), force(whole(128)));
    assert!(relative(coarse, wanted) < 6e-3 && relative(fine, wanted) < 3e-3, "{coarse} {fine}");
    assert!(relative(2.0 * fine - coarse, wanted) < 1e-3, "{}", 2.0 * fine - coarse);
    let square = Outline::Polygon { vertices: vec![[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]] };
    let within = frame(&square, 0.5, 64);
    assert_eq!(within.n_cells(), 64 * 64);
    assert!(relative(force(within), coarse) < 1e-6);
}

/// Truth: the moment P e tilts a frictionless circular punch of radius a by theta = 3 P e / (4 E* a^3) (Johnson 1985, 3.3). The
/// formula holds for eccentricities e < a/3 of the load P. The tilt adds the pressure C x / sqrt(a^2 - r^2) with C = 2 E* theta /
/// pi. The moment of this pressure is (4/3) E* a^3 theta. The error is below 1.5e-2 at 30 cells along the radius and below 1e-2
/// at 60. Convergence is only of first order, because the pressure is singular at the edge. The stepped outline of the cells
/// changes the radius by about 3e-3 of a. Without friction, unloading and reloading give the same state.
#[test]
fn a_tilting_punch() {
    let (a, force, modulus) = (1.0, 1000.0, 210e3 / 0.91);
    let flat = model(&steel(), None, frame(&disc(a), a, 60), GapShape::Flat);
    let stiffness = 4.0 / 3.0 * modulus * a * a * a;
    for moment in [[0.0, 200.0], [120.0, -160.0]] {
        let lean = |moment| Step { tilt: Some(Tilt::Moment(moment)), ..press(force) };
        let found = last(&flat, &[lean(moment)]);
        for (k, m) in moment.into_iter().enumerate() {
            let wanted = m / stiffness;
            let angle = found.rotation[k].to_radians();
            assert!((angle - wanted).abs() < 1.5e-2 * 200.0 / stiffness, "{angle} {wanted}");
            assert!((found.moment[k] - m).abs() < 1e-5 * 200.0);
        }
        assert!(relative(found.approach, force / (2.0 * modulus * a)) < 1e-2, "{}", found.approach);
        let upright = Step { increments: 2, ..lean([0.0; 2]) };
        let again = last(&flat, &[lean(moment), upright, lean(moment)]);
        (0..2).for_each(|k| {
            assert!((again.rotation[k] - found.rotation[k]).abs() < 1e-5 * found.rotation[1].abs())
        });
        let turned = Step { tilt: Some(Tilt::Rotation(found.rotation.map(f64::to_radians))), ..press(force) };
        let held = last(&flat, &[turned]);
        (0..2).for_each(|k| assert!((held.moment[k] - moment[k]).abs() < 1e-5 * 200.0));
    }
    let lean = Step { tilt: Some(Tilt::Moment([0.0, 200.0])), ..press(force) };
    let fine = model(&steel(), None, frame(&disc(a), a, 120), GapShape::Flat);
    let [coarse, fine] = [&flat, &fine].map(|model| {
        relative(last(model, std::slice::from_ref(&lean)).rotation[1].to_radians(), 200.0 / stiffness)
    });
    assert!(fine < 1e-2 && fine < 0.8 * coarse, "{coarse} {fine}");
    // For eccentricities beyond a / 3 the punch lifts off on one side. For eccentricities beyond a it tips over.
    let lifted = last(&flat, &[Step { tilt: Some(Tilt::Moment([0.0, 700.0])), ..press(force) }]);
    assert!(lifted.contact_area < 0.9 * PI * a * a, "{}", lifted.contact_area);
    let off = solve(&flat, &[Step { tilt: Some(Tilt::Moment([0.0, 1050.0])), ..press(force) }]);
    assert_eq!(off.outcome, Outcome::NotConverged(Divergence::ContactLost));
}

/// Truth: case `torsion-reissner-sagoci`. A bonded disc of radius a, twisted by theta, needs the torque T = (16/3) G a^3 theta.
/// The shear traction at the radius r is tau = 4 G theta r / (pi sqrt(a^2 - r^2)). Torque and traction agree with these formulas
/// to 1e-2.
#[test]
fn torsion_of_a_bonded_disc() {
    let frame = frame(&disc(1.0), 1.0, 60);
    let mut bonded = model(&moduli(1.0, 0.3), None, frame.clone(), GapShape::Flat);
    bonded.friction = BONDED;
    let theta = 1e-3;
    let pressed = Step { friction: false, ..indent(1e-3) };
    let turned = Step { spin: Some(Spin::Twist(theta)), ..step("twist") };
    let result = solve(&bonded, &[pressed, turned]);
    assert_eq!(result.outcome, Outcome::Converged);
    let torque = result.records[1].moment[2] / theta;
    assert!(relative(torque, 16.0 / 3.0) < 1e-2, "{torque}");
    let n = frame.n_cells();
    // At x > 0 body 2 moves along +y, so the friction on body 2 acts along -y.
    let shear = -at(&frame, &result.state.tractions[n..2 * n], 0.5 - 1.0 / 60.0, 1.0 / 60.0) / theta;
    let (x, y) = (0.5 - 1.0 / 60.0, 1.0 / 60.0_f64);
    let wanted = 4.0 / PI * x / (1.0 - x * x - y * y).sqrt();
    assert!(relative(shear, wanted) < 1e-2, "{shear} {wanted}");
}

/// Truth: case `stick-tangential-punch`. A rigid disc of radius a sticks to a half-space. A tangential displacement u of the disc
/// needs the force Q = 8 G a u / (2 - nu), to 1e-2. Two equal half-spaces have twice the compliance and need Q / 2. nu = 0.4999
/// replaces 0.5, which the material does not admit.
#[test]
fn shift_of_a_sticking_disc() {
    for (nu, wanted) in [(0.0, 4.0), (0.3, 4.705_882_353), (0.4999, 5.333_333_333)] {
        let material = moduli(1.0, nu);
        let mut stuck = model(&material, Some(&material), frame(&disc(1.0), 1.0, 60), GapShape::Flat);
        stuck.friction = BONDED;
        let u = 1e-4;
        let found = last(&stuck, &[Step { friction: false, ..indent(1e-3) }, shift(u, 30.0)]);
        let force = found.tangential_force[0].hypot(found.tangential_force[1]) / u;
        assert!(relative(force, 0.5 * wanted) < 1e-2, "nu {nu}: {force}");
        assert!(
            relative(found.tangential_force[1] / found.tangential_force[0], 30f64.to_radians().tan()) < 1e-4
        );
    }
}

/// Truth: case `punch-bonded-normal` (Mossakovskii 1954). Under full stick, a pressed disc carries ((1 - nu) / (1 - 2 nu)) ln(3 -
/// 4 nu) times the frictionless load, to 1e-2.
#[test]
fn a_bonded_punch_is_stiffer() {
    for (nu, wanted) in [(0.0, 1.098_612_289), (0.3, 1.028_626_664), (0.49, 1.000_128_185)] {
        let mut punch = model(&moduli(1.0, nu), None, frame(&disc(1.0), 1.0, 32), GapShape::Flat);
        punch.friction = FrictionLaw::Coulomb { mu: 10.0 };
        let free = last(&punch, &[Step { friction: false, ..indent(1e-3) }]).normal_force;
        let stuck = last(&punch, &[indent(1e-3)]).normal_force;
        assert!(relative(stuck / free, wanted) < 1e-2, "nu {nu}: {}", stuck / free);
    }
}

/// Flexibility of an independent spring of unit stiffness under each cell. The pressure under a flat punch is therefore uniform.
struct Springs(usize);

impl Flexibility for Springs {
    fn n_cells(&self) -> usize {
        self.0
    }

    fn apply(&self, tractions: &[f64], gap: &mut [f64]) {
        gap.iter_mut().zip(tractions).for_each(|(g, t)| *g = *t);
    }

    fn apply_normal(&self, pressure: &[f64], normal_gap: &mut [f64]) {
        normal_gap.copy_from_slice(pressure);
    }

    fn diagonal_blocks(&self) -> orthowear::flexibility::per_cell::PerCell<nalgebra::Matrix3<f64>> {
        orthowear::flexibility::per_cell::PerCell::Same(nalgebra::Matrix3::identity(), self.0)
    }
}

/// Result for a disc of radius 1 that slides on springs of unit stiffness under unit pressure. The disc moves by `distance` along
/// x and rotates by `angle` (radians). This motion is many times the deflection of the springs.
fn slid(friction: FrictionLaw, distance: f64, angle: f64) -> IncrementRecord {
    let frame = frame(&disc(1.0), 1.0, 100);
    let n = frame.n_cells();
    let disc = Model {
        frame,
        flexibility: Arc::new(Springs(n)),
        initial_gap: vec![0.0; 3 * n],
        loads: Vec::new(),
        floating: Vec::new(),
        friction,
        wear: WearLaw::None,
        wear_share: 1.0,
    };
    let pressed = Step { friction: false, ..indent(1.0) };
    last(&disc, &[pressed, Step { spin: Some(Spin::Twist(angle)), ..shift(distance, 0.0) }])
}

/// Truth: case `spin-slide-isotropic` (Contensou 1963). A disc of radius a under uniform pressure slides with lambda times the
/// velocity that the spin gives to its edge. Force and moment agree to 1e-3 (in units of P and P a). Results refer to the lower
/// body, and are opposite to the force and the moment on the disc. Pure sliding gives the force mu P, pure spin the moment (2/3)
/// mu P a.
#[test]
fn spinning_and_sliding() {
    let far = 1e6;
    for (lambda, force, moment) in
        [(0.5, 0.483_843_755_6, 0.547_748_354_8), (1.0, 0.848_826_363_2, 0.282_942_121_1)]
    {
        let found = slid(FrictionLaw::Coulomb { mu: 1.0 }, lambda * far, far);
        let [f, t] = [found.tangential_force[0], found.moment[2]].map(|x| x / found.normal_force);
        assert!((f - force).abs() < 1e-3 && (t - moment).abs() < 1e-3, "{lambda}: {f} {t}");
        assert!(found.tangential_force[1].abs() < 1e-6);
    }
    let sliding = slid(FrictionLaw::Coulomb { mu: 1.0 }, far, 0.0);
    assert!(relative(sliding.tangential_force[0], sliding.normal_force) < 1e-6);
    let spinning = slid(FrictionLaw::Coulomb { mu: 1.0 }, 0.0, far);
    assert!(relative(spinning.moment[2], 2.0 / 3.0 * spinning.normal_force) < 1e-3, "{}", spinning.moment[2]);
}

/// Truth: case `spin-orthotropic-closed-form`. Pure spin has the torque T = (2/3) P a (2 / pi) mu2 E(1 - mu1^2 / mu2^2) =
/// 0.1027976283 P a, to 1e-3. E(m) is the complete elliptic integral of the second kind. The torque does not depend on the angle
/// of the friction ellipse.
#[test]
fn spinning_with_elliptic_friction() {
    for angle in [0.0, 0.7] {
        let found = slid(FrictionLaw::Elliptic { mu: [0.1, 0.2], angle }, 0.0, 1e6);
        let torque = found.moment[2] / found.normal_force;
        assert!(relative(torque, 0.102_797_628_3) < 1e-3, "{torque}");
    }
}

/// Truth: case `str-conforming-flat`. Every cell of a flat contact stays in contact, although the pressure is singular at the
/// edge. Noise in the gaps of the size of rounding errors changes the results by less than 1e-9.
#[test]
fn noise_in_a_conforming_gap() {
    let options = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
    let clean = model(&steel(), None, frame(&disc(1.0), 1.0, 40), GapShape::Flat);
    let n = clean.frame.n_cells();
    let mut noisy = model(&steel(), None, frame(&disc(1.0), 1.0, 40), GapShape::Flat);
    for (cell, gap) in noisy.initial_gap[2 * n..].iter_mut().enumerate() {
        *gap = f64::EPSILON * 1e-3 * ((cell * 7919) % 13) as f64;
    }
    let [a, b] = [clean, noisy].map(|model| solve_with(&model, &[press(1000.0)], &options));
    for result in [&a, &b] {
        assert_eq!(result.outcome, Outcome::Converged);
        assert!(result.state.tractions[2 * n..].iter().all(|p| *p > 0.0));
    }
    let peak = a.records[0].peak_pressure;
    let difference = a.state.tractions.iter().zip(&b.state.tractions).map(|(x, y)| (x - y).abs());
    assert!(difference.fold(0.0, f64::max) < 1e-9 * peak);
    assert!(relative(a.records[0].approach, b.records[0].approach) < 1e-9);
}

/// Truth: case `str-conforming-flat`. The press and the following pull with mu P / 3 each take fewer than ten iterations to a
/// residual of 1e-6. Noise in the gaps of the size of rounding errors does not change the number of iterations, because the
/// active set does not oscillate.
#[test]
fn conforming_contacts_take_few_iterations() {
    let square = ContactFrame::grid([1.0; 2], [40; 2], [0.0; 2], 0.0).expect("a grid");
    let mut flat = model(&steel(), None, square, GapShape::Flat);
    flat.friction = FrictionLaw::Coulomb { mu: 0.3 };
    let pressed = Step { friction: false, ..press(1000.0) };
    let options = SolverOptions { tolerance: 1e-6, ..SolverOptions::default() };
    let [clean, noisy] = [0.0, f64::EPSILON * 1e-3].map(|ulp| {
        let n = flat.frame.n_cells();
        for (cell, gap) in flat.initial_gap[2 * n..].iter_mut().enumerate() {
            *gap = ulp * ((cell * 7919) % 13) as f64;
        }
        let result = solve_with(&flat, &[pressed.clone(), pull([100.0, 0.0])], &options);
        assert_eq!(result.outcome, Outcome::Converged);
        assert!(result.records.iter().all(|record| relative(record.contact_area, 4.0) < 1e-12));
        result.records.iter().map(|record| record.iterations).collect::<Vec<_>>()
    });
    assert_eq!(noisy, clean);
    assert!(noisy.iter().all(|iterations| *iterations < 10), "{noisy:?}");
}
