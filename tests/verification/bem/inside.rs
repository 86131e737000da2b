//! Stress on the surface of finite boundary-element bodies; displacement and stress inside them and inside half-spaces.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Matrix6};
use orthowear::bem::finite::{BoundaryElements, Domain, Interpolation, SurfaceState};
use orthowear::body::{ElasticBody, ErrorEstimation, FeBody, HalfSpaceBody, Loading};
use orthowear::element::ElementKind::{Hex8, Hex20};
use orthowear::fem::{HexFormulation, Support};
use orthowear::frame::{ContactFrame, Side};
use orthowear::geometry::Point;
use orthowear::material::Stiffness;

use super::bodies::{body, graded, spec};
use super::finite::{elements, solved, sphere};
use crate::common::{assert_order, im7, steel};
use crate::fem_bodies::{self, clamp};
use crate::fem_meshes::block;

/// Stress at the corners of the elements, averaged over the adjacent elements.
fn at_corners(elements: &BoundaryElements, state: &SurfaceState) -> Vec<(Point, Matrix3<f64>)> {
    let field = elements.surface_solution(state);
    let mut all: Vec<(Point, Matrix3<f64>, f64)> = Vec::new();
    for i in 0..elements.n_elements() {
        let kind = elements.panel(i).kind;
        for xi in &kind.face_reference_nodes()[..kind.n_corners()] {
            let x = elements.panel(i).position(*xi);
            let stress = field.stress(i, *xi);
            match all.iter_mut().find(|(y, ..)| (*y - x).norm() < 1e-9) {
                Some((_, sum, count)) => {
                    *sum += stress;
                    *count += 1.0;
                }
                None => all.push((x, stress, 1.0)),
            }
        }
    }
    all.into_iter().map(|(x, sum, count)| (x, sum / count)).collect()
}

/// Errors of the stress in a sphere or around a cavity of radius 1, relative to the pressure.
struct Errors {
    /// Root mean square error at the corners of the elements.
    corners: f64,
    /// Error of the mean tangential stress over the surface.
    mean: f64,
    /// Errors at `DISTANCES` from the surface.
    inside: [f64; 4],
}

const DISTANCES: [f64; 4] = [0.5, 0.2, 0.05, 0.005];

fn errors(n: usize, interpolation: Interpolation, domain: Domain) -> Errors {
    let pressure = 100.0;
    let mut panels = sphere(n, 1.0, false);
    if domain == Domain::Exterior {
        // Mirroring the nodes at the plane x = 0 makes the normals point into the cavity.
        panels.iter_mut().for_each(|panel| panel.nodes.iter_mut().for_each(|x| x.x = -x.x));
    }
    let elements = elements(panels, interpolation, &steel(), 1e-7);
    let data = (|_: &Point| Point::zeros(), |_: &Point, n: &Point| -n * pressure);
    let state = solved(&elements, domain, |_| false, data).state(&[1.0], &[]);
    let exact = |x: &Point| {
        let (r, n) = (x.norm(), x.normalize());
        match domain {
            Domain::Interior => -pressure * Matrix3::identity(),
            Domain::Exterior => {
                (Matrix3::identity() * 0.5 - n * n.transpose() * 1.5) * (pressure / r.powi(3))
            }
        }
    };
    let corners = at_corners(&elements, &state);
    let square: f64 = corners.iter().map(|(x, stress)| (stress - exact(x)).norm_squared()).sum();
    let field = elements.surface_solution(&state);
    let (mut sum, mut area) = (0.0, 0.0);
    let all = (0..elements.n_elements())
        .flat_map(|i| elements.reference_nodes_of(i).reference_points().iter().map(move |xi| (i, *xi)));
    for ((i, xi), weight) in all.zip(elements.areas()) {
        let n = elements.panel(i).position(xi).normalize();
        let stress = field.stress(i, xi);
        sum += 0.5 * (stress.trace() - n.dot(&(stress * n))) * weight;
        area += weight;
    }
    let inside = elements.interior_solution(&state, domain);
    let direction = Point::new(0.3, 0.5, 0.8).normalize();
    let tangential = if domain == Domain::Interior { -pressure } else { 0.5 * pressure };
    let outward = if domain == Domain::Interior { -1.0 } else { 1.0 };
    Errors {
        corners: (square / corners.len() as f64).sqrt() / pressure,
        mean: (sum / area - tangential).abs() / pressure,
        inside: DISTANCES.map(|distance| {
            let x = direction * (1.0 + outward * distance);
            (inside.at(&x).stress - exact(&x)).norm() / pressure
        }),
    }
}

/// Truth: Lamé's solutions (cases `be-cavity-pressure` and `be-sphere-uniform-pressure` of docs/verification.md). Around a cavity
/// of radius a under a pressure p, the radial stress is σ_r = -p a³/r³ and the tangential stress is σ_t = p a³/(2 r³). In a
/// sphere all normal stresses are -p. Errors at the corners of linear elements decrease with order 1.5, because the geometry is
/// not regular at the corners of the mapped cube. With 216 elements the mean of σ_t over the surface has an error below 1.2 % of
/// p.
#[test]
fn spheres_and_cavities() {
    for domain in [Domain::Interior, Domain::Exterior] {
        let cells = [2, 3, 6];
        let [coarsest, coarse, fine] = cells.map(|n| errors(n, Interpolation::Linear, domain));
        let corners = [coarsest.corners, coarse.corners, fine.corners];
        assert_order(&corners, &cells, 1.3, &format!("{domain:?}"));
        assert!(fine.corners < 0.035, "{domain:?} {}", fine.corners);
        assert!(fine.mean < 0.012, "{domain:?} {} {}", coarse.mean, fine.mean);
        for (error, bound) in fine.inside.into_iter().zip([1e-3, 0.01, 0.06, 0.06]) {
            assert!(error < bound, "{domain:?} {:?}", fine.inside);
        }
        assert!(fine.inside[0] < 0.3 * coarse.inside[0]);
    }
}

/// Truth: Lamé's solution (case `be-cavity-pressure` of docs/verification.md). The tangential stress on the wall is σ_t = p/2.
/// Quadratic elements give the mean of σ_t over the wall to 1e-3. The stress errors at the corners of the elements decrease at
/// least with order 1.5.
#[test]
fn the_wall_of_a_cavity() {
    let [coarse, fine] = [2, 3].map(|n| errors(n, Interpolation::Quadratic, Domain::Exterior));
    assert!(fine.mean < 1e-3 * 0.5, "{}", fine.mean);
    assert!(coarse.corners / fine.corners > 1.5_f64.powf(1.5), "{} {}", coarse.corners, fine.corners);
}

/// Truth: Hertz's solution (Johnson 3.45, 4.2) for the pressure p0 √(1 - r²/a²). With ζ = z / a, the stresses on the axis are
/// σ_z = -p0 / (1 + ζ²) and σ_r = -p0 ((1 + ν)(1 - ζ atan(1/ζ)) - 1/(2 (1 + ζ²))). The largest shear stress is 0.310 p0 at the
/// depth 0.48 a for ν = 0.3.
#[test]
fn below_a_circular_contact() {
    let frame = ContactFrame::grid([1.05; 2], [64; 2], [0.3, -0.2], 0.4).unwrap();
    let n = frame.n_cells();
    let mut tractions = vec![0.0; 3 * n];
    for (cell, x) in frame.centers.iter().enumerate() {
        tractions[2 * n + cell] = (1.0 - (x - frame.origin).norm_squared()).max(0.0).sqrt();
    }
    let depths = [0.03, 0.1, 0.3, 0.48, 0.7, 1.0, 2.0];
    for side in [Side::Lower, Side::Upper] {
        let body = HalfSpaceBody::new(&steel(), side, &frame).unwrap();
        let points = depths.map(|depth| frame.origin + Point::new(0.0, 0.0, depth * -side.outward()));
        let found =
            body.recover_at_points(&frame, Loading::of_contact(&tractions), &points).unwrap().unwrap();
        for (zeta, found) in depths.into_iter().zip(&found) {
            let inverse = 1.0 / (1.0 + zeta * zeta);
            let radial = -1.3 * (1.0 - zeta * (1.0 / zeta).atan()) + 0.5 * inverse;
            let stress = found.stress;
            assert!((stress[(2, 2)] + inverse).abs() < 5e-4, "{zeta} {stress}");
            assert!((stress[(0, 0)] - radial).abs() < 5e-4, "{zeta} {stress}");
            assert!((stress[(1, 1)] - radial).abs() < 5e-4, "{zeta} {stress}");
        }
        let shear = |k: usize| 0.5 * (found[k].stress[(0, 0)] - found[k].stress[(2, 2)]);
        assert!((shear(3) - 0.310).abs() < 1e-3, "{}", shear(3));
        assert!(shear(3) > shear(2) && shear(3) > shear(4));
        // The displacement points away from the other body. In the middle of the surface its magnitude is a π p0 / (2 E*).
        let modulus = 210e3 / (1.0 - 0.09);
        let middle = body
            .recover_at_points(&frame, Loading::of_contact(&tractions), &[frame.origin])
            .unwrap()
            .unwrap()[0]
            .displacement;
        assert!((middle.z * -side.outward() / (FRAC_PI_2 / modulus) - 1.0).abs() < 0.02, "{middle}");
    }
}

/// Truth: equilibrium of the surface. Just below the middle of a wide cell, the stress vector σ n equals the uniform traction on
/// the body. Here σ is the stress and n the outward normal. The tractions on bodies 1 and 2 have opposite signs.
#[test]
fn tractions_below_the_surface() {
    let frame = ContactFrame::grid([1.0; 2], [1; 2], [0.0; 2], 0.3).unwrap();
    let tractions = [0.3, -0.2, 1.0];
    for (side, stiffness) in
        [(Side::Lower, steel()), (Side::Upper, steel()), (Side::Lower, im7(30.0)), (Side::Upper, im7(30.0))]
    {
        let body = HalfSpaceBody::new(&stiffness, side, &frame).unwrap();
        let x = Point::new(0.0, 0.0, -0.02 * side.outward());
        let found =
            body.recover_at_points(&frame, Loading::of_contact(&tractions), &[x]).unwrap().unwrap()[0].stress;
        let global = frame.axes.to_global(&Point::from(tractions)) * side.gap_sign();
        let wrong = found * frame.axes.normal() * side.outward() - global;
        assert!(wrong.norm() < 0.05, "{side:?} {found} {wrong}");
    }
}

/// Truth: a block tends to a half-space if it is much larger than the loaded square. The block is 16 times as wide as the square.
/// At depths of at least half an element, the stresses differ from the half-space by less than 5 % of the pressure.
#[test]
fn a_large_block_beside_the_half_space() {
    let frame = ContactFrame::grid([1.0; 2], [4; 2], [0.0; 2], 0.0).unwrap();
    let n = frame.n_cells();
    let tractions: Vec<f64> = (0..3 * n).map(|k| [0.3, 0.0, 1.0][k / n]).collect();
    for (side, up, held) in [(Side::Lower, -1.0, "z0"), (Side::Upper, 1.0, "z1")] {
        let support: Vec<Support> = vec![clamp(held)];
        let spec = spec(&graded(16.0, up), &steel(), Interpolation::Constant, support);
        let block = body(&spec, if up < 0.0 { "z1" } else { "z0" }, side, &frame);
        let half_space = HalfSpaceBody::new(&steel(), side, &frame).unwrap();
        let points =
            [[0.1, 0.2, 0.3], [0.6, -0.3, 0.5], [-0.2, 0.1, 1.5]].map(|[x, y, z]| Point::new(x, y, up * z));
        let found =
            block.recover_at_points(&frame, Loading::of_contact(&tractions), &points).unwrap().unwrap();
        let wanted =
            half_space.recover_at_points(&frame, Loading::of_contact(&tractions), &points).unwrap().unwrap();
        for (found, wanted) in found.iter().zip(&wanted) {
            assert!(
                (found.stress - wanted.stress).amax() < 0.05,
                "{side:?} {} {}",
                found.stress,
                wanted.stress
            );
        }
    }
}

/// Truth: the stress in a finite-element block of the same shape, with hexahedra of 20 nodes. It agrees to 2 % of the largest
/// pressure. The test compares nodes inside, and nodes on the sides that are at least two elements away from the edges.
#[test]
fn a_block_of_finite_elements() {
    let n = 6;
    let place = |[x, y, z]: [f64; 3]| [2.0 * x - 1.0, 2.0 * y - 1.0, 2.0 * z - 2.0];
    let frame = ContactFrame::grid([2.0 / 3.0; 2], [4; 2], [0.0; 2], 0.0).unwrap();
    let cells = frame.n_cells();
    let mut tractions = vec![0.0; 3 * cells];
    for (cell, x) in frame.centers.iter().enumerate() {
        (tractions[cell], tractions[2 * cells + cell]) = (0.3, 1.0 - x.x * x.x);
    }
    let mesh = block(Hex20, [n; 3], [1.0; 3], place);
    let finite = fem_bodies::spec(mesh.clone(), steel(), HexFormulation::Standard, vec![clamp("z0")]);
    let finite = FeBody::new(finite, "z1", Side::Lower, &frame).unwrap();
    let moved = finite.recover(Loading::of_contact(&tractions)).unwrap().displacement;
    let wanted = finite
        .recover_stress(Loading::of_contact(&tractions), &moved, ErrorEstimation::Skip)
        .unwrap()
        .unwrap();
    let wanted = |x: Point| {
        let node = mesh.points.iter().position(|y| (Point::from(*y) - x).norm() < 1e-9).unwrap();
        wanted.stress[wanted.points.mesh_nodes.iter().position(|other| *other == node).unwrap()]
    };
    let coarse = block(Hex8, [n; 3], [1.0; 3], place);
    let by_surface = spec(&coarse, &steel(), Interpolation::Linear, vec![clamp("z0")]);
    let boundary = body(&by_surface, "z1", Side::Lower, &frame);
    let near = |found: [f64; 6], wanted: [f64; 6], x: &Point| {
        let wrong = (0..6).map(|c| (found[c] - wanted[c]).abs()).fold(0.0, f64::max);
        assert!(wrong < 0.02, "{x} {found:?} {wanted:?}");
    };
    let points = [[0.0, 0.0, -2.0], [1.0, -2.0, -1.0], [2.0, 1.0, -3.0], [-1.0, 1.0, -2.0]]
        .map(|x| Point::from(x) / 3.0);
    let inside =
        boundary.recover_at_points(&frame, Loading::of_contact(&tractions), &points).unwrap().unwrap();
    points.iter().zip(&inside).for_each(|(x, found)| near(found.voigt(), wanted(*x), x));
    let stress = boundary
        .recover_stress(Loading::of_contact(&tractions), &[], ErrorEstimation::Skip)
        .unwrap()
        .unwrap();
    for x in [[3.0, 0.0, -3.0], [0.0, -3.0, -2.0], [-3.0, 1.0, -3.0]].map(|x| Point::from(x) / 3.0) {
        let at = |node: &usize| (Point::from(by_surface.mesh.points[*node]) - x).norm() < 1e-9;
        let point = stress.points.mesh_nodes.iter().position(at).unwrap();
        near(stress.stress[point], wanted(x), &x);
    }
}

/// Truth: superposition. A uniform pressure on a square of CuAlNi (cubic, Zener's ratio 12) causes the same stress as pressures
/// on its 64 parts together. An independent program (Stroh's formalism, integrals over angles and the square) gives two more
/// values in % of the pressure. They are σ_x = -73.285 at the depth 0.25 and σ_z = -98.621 at the depth 0.15.
#[test]
fn below_a_cubic_crystal() {
    let [c11, c12, c44] = [142e3, 126e3, 96e3];
    let voigt = Matrix6::from_fn(|i, j| match (i < 3, j < 3, i == j) {
        (true, true, true) => c11,
        (true, true, false) => c12,
        (false, false, true) => c44,
        _ => 0.0,
    });
    let crystal = Stiffness::from_voigt(voigt).unwrap();
    let depths: Vec<Point> = [0.05, 0.15, 0.25, 0.5].map(|z| Point::new(0.0, 0.0, -z)).to_vec();
    let stress = |cells: usize| {
        let frame = ContactFrame::grid([0.5; 2], [cells; 2], [0.0; 2], 0.0).unwrap();
        let body = HalfSpaceBody::new(&crystal, Side::Lower, &frame).unwrap();
        let n = cells * cells;
        let tractions: Vec<f64> = (0..3 * n).map(|k| if k < 2 * n { 0.0 } else { 100.0 }).collect();
        let states =
            body.recover_at_points(&frame, Loading::of_contact(&tractions), &depths).unwrap().unwrap();
        states.into_iter().map(|state| state.voigt()).collect::<Vec<_>>()
    };
    let (whole, parts) = (stress(1), stress(8));
    for (a, b) in whole.iter().zip(&parts) {
        assert!(a.iter().zip(b.iter()).all(|(a, b)| (a - b).abs() < 1e-3), "{a:?} {b:?}");
    }
    assert!((whole[2][0] + 73.285).abs() < 1e-3 && (whole[1][2] + 98.621).abs() < 1e-3, "{whole:?}");
}
