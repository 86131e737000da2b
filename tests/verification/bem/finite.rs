//! Finite boundary-element bodies: uniform stress, spheres and cavities under pressure, rigid motions, Somigliana's identity.

use faer::Par;
use nalgebra::{Matrix3, Vector3};
use orthowear::bem::finite::{
    BoundaryElements, BoundarySolution, BoundaryValueProblem, BoundaryValues, Domain, Interpolation, Panel,
    SurfaceState,
};
use orthowear::bem::full_space::FullSpaceField;
use orthowear::element::ElementKind::{Quad9, Tri6};
use orthowear::geometry::Point;
use orthowear::material::Stiffness;

use crate::common::{assert_order, steel, tabulated_cfrp as cfrp};

/// Surface of the cube [-1, 1]³ with `n` x `n` squares on each side. A square is one quadrilateral with nine nodes or two
/// triangles with six nodes each. Normals point outward. `map` moves the nodes.
pub(super) fn cube(n: usize, triangles: bool, map: impl Fn(Point) -> Point) -> Vec<Panel> {
    let mut panels = Vec::new();
    for (axis, sign) in [0, 1, 2].into_iter().flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let (u_axis, v_axis) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |[u, v]: [f64; 2]| {
            let mut x = Point::zeros();
            x[axis] = sign;
            x[u_axis] = u;
            x[v_axis] = sign * v;
            map(x)
        };
        let h = 2.0 / n as f64;
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let node = |s: f64, t: f64| at([-1.0 + h * (i as f64 + s), -1.0 + h * (j as f64 + t)]);
            let of = |places: &[[f64; 2]]| places.iter().map(|[s, t]| node(*s, *t)).collect();
            if triangles {
                let halves = [[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], [[1.0, 1.0], [0.0, 1.0], [1.0, 0.0]]];
                for [a, b, c] in halves {
                    let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| 0.5 * (p[k] + q[k]));
                    let nodes = of(&[a, b, c, middle(a, b), middle(b, c), middle(c, a)]);
                    panels.push(Panel { kind: Tri6, nodes });
                }
            } else {
                let places = Quad9.face_reference_nodes().iter().map(|[s, t]| [0.5 + 0.5 * s, 0.5 + 0.5 * t]);
                panels.push(Panel { kind: Quad9, nodes: of(&places.collect::<Vec<_>>()) });
            }
        }
    }
    panels
}

pub(super) fn sphere(n: usize, radius: f64, triangles: bool) -> Vec<Panel> {
    // The tangent spaces the nodes by equal angles instead of equal lengths.
    let even = |x: Point| x.map(|c| (c * std::f64::consts::FRAC_PI_4).tan());
    cube(n, triangles, |x| even(x).normalize() * radius)
}

pub(super) fn elements(
    panels: Vec<Panel>,
    interpolation: Interpolation,
    stiffness: &Stiffness,
    accuracy: f64,
) -> BoundaryElements {
    let field = FullSpaceField::new(stiffness).unwrap();
    BoundaryElements::new(panels, interpolation, stiffness, field, accuracy)
}

pub(super) fn flat(values: impl Iterator<Item = Point>) -> Vec<f64> {
    values.flat_map(|x| [x.x, x.y, x.z]).collect()
}

/// Solves a boundary-value problem. `displacement` is prescribed where `held` is true, `traction` elsewhere.
pub(super) fn solved(
    elements: &BoundaryElements,
    domain: Domain,
    held: impl Fn(&Point) -> bool,
    (displacement, traction): (impl Fn(&Point) -> Point, impl Fn(&Point, &Point) -> Point),
) -> BoundarySolution {
    let (positions, normals) = (elements.positions(), elements.normals());
    let is_held: Vec<bool> = positions.iter().flat_map(|x| [held(x); 3]).collect();
    let of_node = |(x, n): (&Point, &Point)| if held(x) { displacement(x) } else { traction(x, n) };
    let known = flat(positions.iter().zip(&normals).map(of_node));
    let free = elements.free_motions(&is_held).unwrap().filter(|_| domain == Domain::Interior);
    let problem = BoundaryValueProblem {
        elements,
        domain,
        displacement_known: &is_held,
        loads: &[BoundaryValues::new(known)],
        loaded: &[],
        free_motions: free.as_ref(),
    };
    let solution = problem.solve(Par::Seq).unwrap();
    assert!(solution.residual() < 1e-12, "{}", solution.residual());
    solution
}

pub(super) fn off(elements: &BoundaryElements, state: &SurfaceState, exact: impl Fn(&Point) -> Point) -> f64 {
    let positions = elements.positions();
    let apart = positions.iter().zip(&state.displacement).map(|(x, u)| (Point::from(*u) - exact(x)).norm());
    let size = positions.iter().map(|x| exact(x).norm()).fold(0.0, f64::max);
    apart.fold(0.0, f64::max) / size
}

/// Relative error of the displacement, root mean square over the surface.
fn off_in_the_mean(
    elements: &BoundaryElements,
    state: &SurfaceState,
    exact: impl Fn(&Point) -> Point,
) -> f64 {
    let nodes = || elements.positions().into_iter().zip(elements.areas());
    let apart = nodes().zip(&state.displacement);
    let apart: f64 = apart.map(|((x, area), u)| (Point::from(*u) - exact(&x)).norm_squared() * area).sum();
    (apart / nodes().map(|(x, area)| exact(&x).norm_squared() * area).sum::<f64>()).sqrt()
}

pub(super) struct Linear {
    pub gradient: Matrix3<f64>,
    pub stress: Matrix3<f64>,
}

impl Linear {
    pub fn new(stiffness: &Stiffness, gradient: Matrix3<f64>) -> Self {
        let stress = Matrix3::from_fn(|i, j| {
            let pairs = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            pairs.map(|(k, l)| stiffness.component(i, j, k, l) * gradient[(k, l)]).sum()
        });
        Self { gradient, stress }
    }
}

/// Displacement at a point off the surface, mm; zero on the other side of the surface.
///
/// # Source
/// Somigliana's identity, u(y) = ∫ U t dS - ∫ T u dS, with displacements U and tractions T of a unit force at y.
fn displacement_at(elements: &BoundaryElements, state: &SurfaceState, y: &Point) -> Point {
    let mut sum = Point::zeros();
    for i in 0..elements.n_elements() {
        let influence = elements.influence_off_element(i, y);
        for (a, node) in elements.nodes_of(i).enumerate() {
            sum += influence.single_layer[a] * Point::from(state.traction[node])
                - influence.double_layer[a] * Point::from(state.displacement[node]);
        }
    }
    sum
}

/// Truth: a linear field, which linear elements represent exactly. Under a tension p, u_x = p x / E and u_y = -ν p y / E (case
/// `be-cube-tension`, docs/verification.md). The integrals are accurate to 1e-8. The tolerance is 1e-6 for displacements and 1e-5
/// for tractions and stresses. Somigliana's identity gives the field inside, up to a distance of 0.001 from the surface, and zero
/// outside.
#[test]
fn uniform_strain_in_a_cube() {
    let any = Matrix3::new(1e-3, 2e-4, -3e-4, -5e-4, 7e-4, 1e-4, 4e-4, -2e-4, -9e-4);
    let tension = Matrix3::from_diagonal(&Vector3::new(100.0, -30.0, -30.0)) / 210e3;
    let cases = [(steel(), false, tension), (steel(), true, any), (cfrp(), false, any)];
    for (stiffness, triangles, gradient) in cases {
        let elements = elements(cube(2, triangles, |x| x), Interpolation::Linear, &stiffness, 1e-8);
        let linear = Linear::new(&stiffness, gradient);
        let data = (|x: &Point| linear.gradient * x, |_: &Point, n: &Point| linear.stress * n);
        let solution = solved(&elements, Domain::Interior, |x| x.z < -1.0 + 1e-9, data);
        let state = solution.state(&[1.0], &[]);
        let wrong = off(&elements, &state, |x| linear.gradient * x);
        assert!(wrong < 1e-6, "{triangles} {wrong:e}");
        for (traction, normal) in state.traction.iter().zip(elements.normals()) {
            let wrong = (Point::from(*traction) - linear.stress * normal).norm() / linear.stress.norm();
            assert!(wrong < 1e-5, "{triangles} {wrong:e}");
        }
        let places =
            [([0.0; 3], 1.0), ([0.4, -0.3, 0.9], 1.0), ([0.3, 0.2, 0.999], 1.0), ([0.2, 1.5, 0.0], 0.0)];
        for (y, inside) in places {
            let y = Point::from(y);
            let wrong = displacement_at(&elements, &state, &y) - linear.gradient * y * inside;
            assert!(wrong.norm() < 1e-6 * gradient.norm(), "{y} {wrong:e}");
        }
        let field = elements.interior_solution(&state, Domain::Interior);
        for (y, bound) in [
            ([0.1, -0.2, 0.0], 1e-5),
            ([0.4, -0.3, 0.98], 1e-5),
            ([0.4, -0.3, 0.9999], 1e-5),
            ([0.4, -0.3, 1.0], 1e-5),
        ] {
            let stress = field.at(&Point::from(y)).stress;
            let wrong = (stress - linear.stress).norm() / linear.stress.norm();
            assert!(wrong < bound, "{y:?} {wrong:e}");
        }
    }
}

/// Truth: uniaxial tension u = (x, -ν y, -ν z) σ / E. The field is linear, so linear elements represent it exactly. The bodies
/// are cubes, plates and needles, up to ν = 0.4999. The tolerance is 1e-6 / (1 - 2ν) for displacements and ten times as large for
/// tractions, because errors of the displacement enter the pressure with the factor 1 / (1 - 2ν).
#[test]
fn nearly_incompressible_and_slender_bodies_in_tension() {
    let stretches = [[1.0, 1.0, 1.0], [1.0, 1.0, 0.02], [1.0, 0.05, 0.05]];
    for (nu, stretch) in
        [0.3, 0.45, 0.49, 0.499, 0.4999].into_iter().flat_map(|nu| stretches.map(|s| (nu, s)))
    {
        let stiffness = Stiffness::isotropic(210e3, nu).unwrap();
        let stretched = |x: Point| Point::new(stretch[0] * x.x, stretch[1] * x.y, stretch[2] * x.z);
        let elements = elements(cube(2, false, stretched), Interpolation::Linear, &stiffness, 1e-8);
        let gradient = Matrix3::from_diagonal(&Vector3::new(1.0, -nu, -nu)) * (100.0 / 210e3);
        let linear = Linear { gradient, stress: Matrix3::from_diagonal(&Vector3::new(100.0, 0.0, 0.0)) };
        let data = (|x: &Point| linear.gradient * x, |_: &Point, n: &Point| linear.stress * n);
        let state = solved(&elements, Domain::Interior, |x| x.x < -1.0 + 1e-9, data).state(&[1.0], &[]);
        let wrong = off(&elements, &state, |x| linear.gradient * x);
        let accuracy = 1e-6 / (1.0 - 2.0 * nu);
        assert!(wrong < accuracy.max(1e-6), "{nu} {stretch:?}: {wrong:e}");
        for (traction, normal) in state.traction.iter().zip(elements.normals()) {
            let wrong = (Point::from(*traction) - linear.stress * normal).norm() / 100.0;
            assert!(wrong < 10.0 * accuracy, "{nu} {stretch:?}: {wrong:e}");
        }
    }
}

/// Relative error of the displacement of a sphere or spherical cavity under pressure, root mean square over the surface.
fn pressed(n: usize, interpolation: Interpolation, triangles: bool, domain: Domain) -> f64 {
    let (radius, e, nu, pressure) = (10.0, 210e3, 0.3, 100.0);
    let mut panels = sphere(n, radius, triangles);
    if domain == Domain::Exterior {
        // Mirroring the nodes at the plane x = 0 makes the normals point into the cavity.
        panels.iter_mut().for_each(|panel| panel.nodes.iter_mut().for_each(|x| x.x = -x.x));
    }
    let elements = elements(panels, interpolation, &steel(), 1e-7);
    let exact = |x: &Point| match domain {
        Domain::Interior => -x * (pressure * (1.0 - 2.0 * nu) / e),
        Domain::Exterior => x * (pressure / (4.0 * e / (2.0 * (1.0 + nu)))),
    };
    let data = (|_: &Point| Point::zeros(), |_: &Point, n: &Point| -n * pressure);
    let state = solved(&elements, domain, |_| false, data).state(&[1.0], &[]);
    off_in_the_mean(&elements, &state, exact)
}

/// Truth: Lamé's solutions. Under a pressure p the radius R of a solid sphere shrinks by p R (1 - 2ν) / E. The wall of a cavity
/// moves by p R / (4 G). Errors decrease with order 1 for constant elements, and with order 2 for linear and quadratic elements.
/// Quadratic elements have only order 2, because their geometry is of second order at the corners of the mapped cube. With 384
/// linear elements the errors are below 1e-3.
#[test]
fn spheres_under_pressure() {
    for domain in [Domain::Interior, Domain::Exterior] {
        for (interpolation, triangles, cells, order) in [
            (Interpolation::Constant, false, [2, 4, 8], 0.8),
            (Interpolation::Linear, false, [2, 4, 8], 1.8),
            (Interpolation::Linear, true, [2, 3, 6], 1.7),
            (Interpolation::Quadratic, false, [2, 3, 4], 1.9),
        ] {
            if triangles && domain == Domain::Exterior {
                continue;
            }
            let errors = cells.map(|n| pressed(n, interpolation, triangles, domain));
            assert_order(
                &errors,
                &cells,
                order,
                &format!("{domain:?} {interpolation:?}, triangles: {triangles}"),
            );
            let fine = errors[2];
            if interpolation == Interpolation::Linear && !triangles {
                assert!(fine < 1e-3, "{domain:?} {fine:e}");
            }
        }
    }
}

/// Truth: uniform stress σ_xx in a sphere of CFRP. The strain is σ_xx times the first column of the compliance. The solver sets
/// the mean rigid motion of the free sphere to zero. In the exact solution this motion is zero by symmetry. The errors have order
/// 2 with linear elements and are below 1e-3 with 96 quadratic elements.
#[test]
fn anisotropic_sphere_under_uniform_stress() {
    let stiffness = cfrp();
    let strain = Vector3::new(100.0, -30.0, -28.0) / 140e3;
    let linear = Linear::new(&stiffness, Matrix3::from_diagonal(&strain));
    assert!((linear.stress - Matrix3::from_diagonal(&Vector3::new(100.0, 0.0, 0.0))).amax() < 1e-9);
    let error = |n: usize, interpolation: Interpolation| {
        let elements = elements(sphere(n, 10.0, false), interpolation, &stiffness, 1e-7);
        let data = (|_: &Point| Point::zeros(), |_: &Point, n: &Point| linear.stress * n);
        let state = solved(&elements, Domain::Interior, |_| false, data).state(&[1.0], &[]);
        off_in_the_mean(&elements, &state, |x| linear.gradient * x)
    };
    let cells = [2, 3, 6];
    let errors = cells.map(|n| error(n, Interpolation::Linear));
    assert_order(&errors, &cells, 1.9, "linear elements");
    let error = error(4, Interpolation::Quadratic);
    assert!(error < 1e-3, "{error:e}");
}

/// Truth: rigid motions cause no tractions. The computed tractions vanish by construction for translations, and within the
/// accuracy of the integrals for rotations.
#[test]
fn rigid_motions() {
    let stiffness = cfrp();
    let elements = elements(cube(2, false, |x| x), Interpolation::Linear, &stiffness, 1e-8);
    let turn = Vector3::new(1.0, -2.0, 0.5);
    for (turn, bound) in [(Point::zeros(), 1e-12), (turn, 1e-6)] {
        let motion = |x: &Point| Point::new(0.3, -0.1, 0.2) + turn.cross(x);
        let data = (motion, |_: &Point, _: &Point| Point::zeros());
        let state = solved(&elements, Domain::Interior, |x| x.x > 1.0 - 1e-9, data).state(&[1.0], &[]);
        let most = state.traction.iter().map(|t| Point::from(*t).norm()).fold(0.0, f64::max) / 140e3;
        let wrong = off(&elements, &state, motion);
        assert!(wrong < bound && most < 10.0 * bound, "{wrong:e} {most:e}");
    }
}

/// Truth: the same bits for any number of threads.
#[test]
fn threads_change_nothing() {
    let stiffness = steel();
    let elements = elements(cube(3, false, |x| x), Interpolation::Linear, &stiffness, 1e-4);
    let positions = elements.positions();
    let held: Vec<bool> = positions.iter().flat_map(|x| [x.z < -1.0 + 1e-9; 3]).collect();
    let known: Vec<f64> =
        (0..held.len()).map(|dof| if held[dof] { 0.0 } else { (dof as f64).sin() }).collect();
    let loaded: Vec<usize> = (0..positions.len()).filter(|&node| positions[node].z > 1.0 - 1e-9).collect();
    let problem = BoundaryValueProblem {
        elements: &elements,
        domain: Domain::Interior,
        displacement_known: &held,
        loads: &[BoundaryValues::new(known)],
        loaded: &loaded,
        free_motions: None,
    };
    let tractions: Vec<f64> = (0..3 * loaded.len()).map(|k| (k as f64).cos()).collect();
    let [one, two, four] = [Par::Seq, Par::rayon(2), Par::rayon(4)]
        .map(|par| problem.solve(par).unwrap().state(&[1.0], &tractions));
    assert!(one == two && one == four);
}
