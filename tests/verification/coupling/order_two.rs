//! Contact of bodies with elements of order 2.

use std::f64::consts::PI;

use super::bricks::{Brick, rollers, spec, straight, wavy};
use super::grids::{boxes, full, growing, raise, serendipity, steps, wedges};
use super::pairs::{Part, model, solved};
use crate::common::{indent, press, relative, solve_with, steel};
use orthowear::bem::half_space::CrossBlocks::SkipVanishing;
use orthowear::body::FeBody;
use orthowear::contact::SolverOptions;
use orthowear::coupling::{Coupling, couple};
use orthowear::evolution::Model;
use orthowear::frame::{ContactFrame, Side};
use orthowear::laws::friction::FrictionLaw;
use orthowear::laws::wear::WearLaw;
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;

/// Distortion that rotates the middle of the face by 17 degrees and keeps its outline.
fn turned([x, y]: [f64; 2]) -> [f64; 2] {
    let angle = 17f64.to_radians() * (1.0 - x * x) * (1.0 - y * y);
    let (s, c) = angle.sin_cos();
    [c * x - s * y - x, s * x + c * y - y]
}

/// Presses blocks of steel (5 mm) and aluminium (8 mm) together with 10 MPa. Returns the largest relative error of the cell
/// pressures, and the relative error of the approach.
fn worst_cell([lower, upper]: [&Mesh; 2], frame: &ContactFrame) -> (f64, f64) {
    let materials = [Stiffness::isotropic(210e3, 0.3).unwrap(), Stiffness::isotropic(70e3, 0.33).unwrap()];
    let body = |mesh: &Mesh, material: &Stiffness, side: Side| {
        let mut spec = spec(mesh.clone(), material);
        spec.supports = rollers();
        FeBody::new(spec, "contact", side, frame).expect("a finite-element body")
    };
    let (mut below, mut above) =
        (body(lower, &materials[0], Side::Lower), body(upper, &materials[1], Side::Upper));
    let coupled = couple(&mut below, &mut above, frame, Coupling::Schur, SkipVanishing).unwrap();
    let n = frame.n_cells();
    let model = Model {
        frame: frame.clone(),
        initial_gap: coupled.initial_gap(&vec![0.0; n]),
        flexibility: coupled.flexibility,
        friction: FrictionLaw::None,
        wear: WearLaw::None,
        wear_share: 1.0,
        loads: coupled.loads,
        floating: coupled.floating,
    };
    let options = SolverOptions { tolerance: 1e-12, ..Default::default() };
    let result = solve_with(&model, &[press(160.0)], &options);
    assert!(result.records[0].converged);
    let worst = result.state.tractions[2 * n..].iter().map(|p| relative(p.abs(), 10.0)).fold(0.0, f64::max);
    (worst, relative(result.records[0].approach, 0.001380952381))
}

/// Truth: case `contact-patch-nonmatching` of docs/verification.md, with faces of order 2. Every cell carries p = 10 MPa. The
/// blocks of heights L1 and L2 approach by p (L1/E1 + L2/E2). The consistent loads of some nodes are zero or negative. This has
/// no effect, because contact conditions apply to cells and not to nodes. The tolerance 1e-9 is the tolerance of the case.
#[test]
fn patches_of_order_two() {
    let brick = |z: [f64; 2], n: usize, distortion: fn([f64; 2]) -> [f64; 2], tetrahedra: bool| {
        let (width, contact_on_top) = ([2.0, 2.0], z[0] < 0.0);
        Brick { width, z, cells: [n, n, 1], contact_on_top, distortion, tetrahedra }.mesh()
    };
    let (below, above) = ([-5.0, 0.0], [0.0, 8.0]);
    let pairs: [[Mesh; 2]; 4] = [
        [raise(&brick(below, 4, turned, false), serendipity), brick(above, 5, straight, false)],
        [
            raise(&brick(below, 3, straight, true), serendipity),
            raise(&brick(above, 4, turned, false), serendipity),
        ],
        [
            raise(&brick(below, 4, wavy, false), full),
            raise(&wedges(&brick(above, 3, turned, false)), serendipity),
        ],
        [
            raise(&brick(below, 2, straight, true), serendipity),
            raise(&brick(above, 3, wavy, true), serendipity),
        ],
    ];
    for [lower, upper] in &pairs {
        let faces =
            |mesh: &Mesh, side: Side| ContactFrame::from_faces(mesh, "contact", side, [0.0; 2], 0.3).unwrap();
        let grid = ContactFrame::grid([2.0; 2], [3; 2], [0.0; 2], 0.0).unwrap();
        for frame in [grid, faces(lower, Side::Lower), faces(upper, Side::Upper)] {
            let (pressure, shortening) = worst_cell([lower, upper], &frame);
            println!("{} cells: {pressure:e} {shortening:e}", frame.n_cells());
            assert!(pressure < 1e-9 && shortening < 1e-9, "{pressure:e} {shortening:e}");
        }
    }
}

/// Half a ring about the y axis, one element thick. Its hexahedra have 20 nodes on circles.
fn ring(radii: Vec<f64>, n: usize) -> Mesh {
    let polar = |[angle, r, y]: [f64; 3]| [r * angle.sin(), y, -r * angle.cos()];
    let mut mesh = raise(&boxes(&[steps(0.0, PI, n), radii, vec![0.0, 1.0]], false, |x| x), serendipity);
    mesh.points.iter_mut().for_each(|x| *x = polar(*x));
    mesh
}

/// Truth: Persson's closed form (formulas at the test pin_in_hole in curved_pairs.rs), here for a clearance of 0.005 R. The peak
/// pressure agrees to 3 %. Faces of order 2 over 7.5 degrees lie within 2e-4 mm of the circle. The core of 0.1 R and the outer
/// radius 10 R of the plate cause errors of 1 % each. The mean over a cell differs from the peak by 0.4 %.
#[test]
fn pin_of_few_elements() {
    let clearance = 0.05;
    let plate = ring(growing(10.0, 100.0, 0.8, 10), 24);
    let mut radii = growing(10.0 - clearance, 1.0, 0.8, 7);
    radii.reverse();
    let pin = ring(radii, 30);
    let held = |group| {
        [("low2", 1), ("high2", 1), ("low0", 0), ("high0", 0), (group, 3)]
            .map(|(group, axis)| (group, [0, 1, 2].map(|c| axis == 3 || axis == c)))
    };
    let (outer, core) = (held("high1"), held("low1"));
    let material = steel();
    let lower = Part { mesh: &plate, contact: "low1", material: &material, supports: &outer };
    let upper = Part { mesh: &pin, contact: "high1", material: &material, supports: &core };
    for (mesh, group, side) in [(&plate, "low1", Side::Lower), (&pin, "high1", Side::Upper)] {
        let frame = ContactFrame::from_faces(mesh, group, side, [0.0; 2], 0.0).unwrap();
        let result = solved(&model([&lower, &upper], &frame, FrictionLaw::None), &[indent(0.06)]);
        let load = 2.0 * result.records[0].normal_force;
        let b = persson(210e3 / (1.0 - 0.09) * clearance / load);
        let root = (1.0 + b * b).sqrt();
        let logarithm = ((root + b) / (root - b)).ln();
        let peak = load / 10.0 * (2.0 / PI * b / root + logarithm / (2.0 * PI * b * b * (1.0 + b * b)));
        println!("load {load}: {} {peak}", result.records[0].peak_pressure);
        assert!(
            relative(result.records[0].peak_pressure, peak) < 0.03,
            "{}",
            result.records[0].peak_pressure
        );
    }
}

/// Persson's b = tan(half-angle / 2) for `stiffness` = E* clearance / load.
fn persson(stiffness: f64) -> f64 {
    let (mut low, mut high) = (1e-3f64, 0.9);
    for _ in 0..100 {
        let b: f64 = 0.5 * (low + high);
        let value = (2.0 - (b * b + 1.0).ln() - 2.0 * b.powi(4)) / (PI * (b.powi(4) + b * b));
        if value > stiffness { low = b } else { high = b }
    }
    low
}
