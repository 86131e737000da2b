//! Finite boundary-element bodies whose equations are solved with compressed matrices.

use faer::Par;
use nalgebra::{Matrix3, Vector3};
use orthowear::bem::finite::Interpolation::{Constant, Linear as LinearElements};
use orthowear::bem::finite::{
    BoundaryElements, BoundarySolution, BoundaryValueProblem, BoundaryValues, Domain, Interpolation,
    SolutionMethod, SurfaceState,
};
use orthowear::error::ErrorKind;
use orthowear::geometry::Point;
use orthowear::material::Stiffness;

use super::finite::{Linear, cube, elements, flat, off};
use crate::common::{steel, tabulated_cfrp as cfrp, usual_or_finest};

fn body(n: usize, interpolation: Interpolation, stiffness: &Stiffness) -> BoundaryElements {
    elements(cube(n, false, |x| x), interpolation, stiffness, 1e-7)
}

/// Solves a boundary-value problem. `displacement` is prescribed where `held` is true, `traction` elsewhere.
fn solved(
    elements: &BoundaryElements,
    held: impl Fn(&Point) -> [bool; 3],
    (displacement, traction): (impl Fn(&Point) -> Point, impl Fn(&Point) -> Point),
    (loaded, equations): (&[usize], SolutionMethod),
) -> BoundarySolution {
    let (positions, normals) = (elements.positions(), elements.normals());
    let is_held: Vec<bool> = positions.iter().flat_map(&held).collect();
    let of_node = |(x, n): (&Point, &Point)| {
        let (u, t, is_held) = (displacement(x), traction(n), held(x));
        Point::from_fn(|c, _| if is_held[c] { u[c] } else { t[c] })
    };
    let known = flat(positions.iter().zip(&normals).map(of_node));
    let free = elements.free_motions(&is_held).unwrap();
    let problem = BoundaryValueProblem {
        elements,
        domain: Domain::Interior,
        displacement_known: &is_held,
        loads: &[BoundaryValues::new(known)],
        loaded,
        free_motions: free.as_ref(),
    };
    problem.solve_by(equations, Par::Seq).unwrap()
}

/// Truth: the solution of the dense equations. The compressed equations change displacements, tractions and responses to unit
/// tractions by less than 10 times the tolerance, each relative to its largest value.
#[test]
fn the_dense_equations() {
    let elements = body(usual_or_finest(8, 10), Constant, &cfrp());
    let held = |x: &Point| [x.z < -0.999 || x.x < -0.999, x.z < -0.999, x.z < -0.999];
    let known = (|x: &Point| x * 1e-3, |n: &Point| Point::new(3.0, -1.0, 2.0) + n * 5.0);
    let positions = elements.positions();
    let top = |&node: &usize| positions[node].z > 0.999 && positions[node].xy().norm() < 0.4;
    let loaded: Vec<usize> = (0..positions.len()).filter(top).collect();
    let dense = solved(&elements, held, known, (&loaded, SolutionMethod::Dense));
    assert!(dense.compression().is_none() && loaded.len() > 6);
    let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let values = |solution: &BoundarySolution| {
        let state = solution.state(&[1.0], &vec![0.0; 3 * loaded.len()]);
        let columns = 0..3 * loaded.len();
        let responses: Vec<f64> = columns
            .flat_map(|j| loaded.iter().map(move |node| (3 * node + j % 3, j)))
            .map(|(dof, j)| solution.response(dof, j))
            .collect();
        [state.displacement.concat(), state.traction.concat(), responses]
    };
    let wanted = values(&dense);
    let found = [1e-3, 1e-5].map(|tolerance| {
        let solution = solved(&elements, held, known, (&loaded, SolutionMethod::Compressed(tolerance)));
        let report = solution.compression().unwrap();
        assert!(
            report.tolerance == tolerance && report.iterations < 40 && solution.residual() < 3.0 * tolerance
        );
        [0, 1, 2].map(|k| {
            let apart: Vec<f64> = values(&solution)[k].iter().zip(&wanted[k]).map(|(a, b)| a - b).collect();
            largest(&apart) / largest(&wanted[k]) / tolerance
        })
    });
    for (k, apart) in found.iter().flatten().enumerate() {
        assert!(*apart < 10.0 && *apart > 0.0, "{k}: {found:?}");
    }
}

/// Truth: superposition. The state under two loads with amplitudes is the sum of the states under each load alone. The tolerance
/// is 1e-12 for dense equations and 10 times the compression tolerance for compressed equations. One load is a thousand times as
/// large as the other load.
#[test]
fn loads_of_several_amplitudes() {
    let elements = body(6, Constant, &cfrp());
    let (positions, normals) = (elements.positions(), elements.normals());
    let is_held: Vec<bool> = positions.iter().flat_map(|x| [x.z < -0.999, false, false]).collect();
    let free = elements.free_motions(&is_held).unwrap();
    let values = |size: f64, mean: Vec<f64>| {
        let of_node = |(x, n): (&Point, &Point)| {
            if x.z < -0.999 { Point::new(size * x.y, 0.0, 0.0) } else { n * (1e3 * size * x.z) }
        };
        BoundaryValues { at_dofs: flat(positions.iter().zip(&normals).map(of_node)), mean_displacement: mean }
    };
    let n_free = free.as_ref().unwrap().n_modes();
    let loads = [values(1e-3, vec![0.0; n_free]), values(1.0, vec![0.3; n_free])];
    let solve = |loads: &[BoundaryValues], method: SolutionMethod| {
        let problem = BoundaryValueProblem {
            elements: &elements,
            domain: Domain::Interior,
            displacement_known: &is_held,
            loads,
            loaded: &[],
            free_motions: free.as_ref(),
        };
        problem.solve_by(method, Par::Seq).unwrap()
    };
    let amplitudes = [700.0, -0.4];
    for (method, allowed) in [(SolutionMethod::Dense, 1e-12), (SolutionMethod::Compressed(1e-5), 1e-4)] {
        let together = solve(&loads, method);
        let found = together.state(&amplitudes, &[]);
        let parts = [0, 1].map(|k| solve(&loads[k..=k], method).state(&amplitudes[k..=k], &[]));
        let apart = |of: fn(&SurfaceState) -> Vec<f64>| {
            let wanted = of(&parts[0]).into_iter().zip(of(&parts[1])).map(|(a, b)| a + b);
            let (error, size) = of(&found)
                .into_iter()
                .zip(wanted)
                .fold((0.0_f64, 0.0_f64), |(e, s), (a, b)| (e.max((a - b).abs()), s.max(b.abs())));
            error / size
        };
        let errors = [apart(|state| state.displacement.concat()), apart(|state| state.traction.concat())];
        assert!(errors.iter().all(|error| *error < allowed), "{method:?} {errors:?}");
        assert_ne!(together.state(&[700.0, 0.0], &[]), together.state(&[700.0, -0.4], &[]));
    }
}

/// Truth: a body whose base is displaced and rotated moves as a rigid body. Translations have an error below 2e-6, because the
/// diagonal blocks are computed from translations. This bound is some thirty times the rounding of single precision, 6e-8.
/// Rotations have an error below 6 times the compression tolerance.
#[test]
fn rigid_motions() {
    let elements = body(6, LinearElements, &steel());
    let held = |x: &Point| [x.z < -0.999; 3];
    for (turn, allowed) in [(0.0, 2e-6), (1.0, 6e-5)] {
        let motion = |x: &Point| Point::new(1.0, 2.0, -1.0) + Vector3::new(0.3, -0.5, 0.7).cross(x) * turn;
        let known = (motion, |_: &Point| Point::zeros());
        let solution = solved(&elements, held, known, (&[], SolutionMethod::Compressed(1e-5)));
        let error = off(&elements, &solution.state(&[1.0], &[]), motion);
        assert!(error < allowed, "{turn}: {error:e}");
    }
}

/// Truth: a linear field, which linear elements represent exactly. The error is below 6 times the compression tolerance for
/// displacements and below 50 times for tractions.
#[test]
fn uniform_strain() {
    let elements = body(usual_or_finest(5, 6), LinearElements, &cfrp());
    let any = Matrix3::new(1e-3, 2e-4, -3e-4, 2e-4, 7e-4, 1e-4, -3e-4, 1e-4, -9e-4);
    let field = Linear::new(&cfrp(), any);
    for base in [true, false] {
        let held = |x: &Point| [base && x.z < -0.999; 3];
        let known = (|x: &Point| field.gradient * x, |n: &Point| field.stress * n);
        let solution = solved(&elements, held, known, (&[], SolutionMethod::Compressed(1e-5)));
        let state = solution.state(&[1.0], &[]);
        let error = off(&elements, &state, |x| field.gradient * x);
        assert!(error < 6e-5, "{base}: {error:e}");
        let size = field.stress.amax();
        let normals = elements.normals();
        let apart =
            normals.iter().zip(&state.traction).map(|(n, t)| (Point::from(*t) - field.stress * n).amax());
        let error = apart.fold(0.0, f64::max) / size;
        assert!(error < 5e-4, "{base}: {error:e}");
    }
}

/// Truth: any number of threads gives the same bits.
#[test]
fn threads_do_not_change_bits() {
    let elements = body(6, Constant, &steel());
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let held = |x: &Point| [x.z < -0.999; 3];
        let known = (|x: &Point| x * 1e-3, |n: &Point| n * 5.0);
        let loaded: Vec<usize> = (0..20).collect();
        let loaded: Vec<usize> =
            loaded.into_iter().filter(|&node| elements.positions()[node].z > -0.9).collect();
        let solution =
            pool.install(|| solved(&elements, held, known, (&loaded, SolutionMethod::Compressed(1e-4))));
        solution.state(&[1.0], &vec![1.0; 3 * loaded.len()])
    };
    let one = run(1);
    assert!(run(2) == one && run(3) == one);
}

/// Truth: the blocks are stored in single precision, so tolerances below 1e-6 are refused. Tolerances that are too large or not a
/// number are also refused.
#[test]
fn tolerances_beyond_single_precision_are_refused() {
    let elements = body(1, Constant, &steel());
    let n = 3 * elements.n_nodes();
    let problem = BoundaryValueProblem {
        elements: &elements,
        domain: Domain::Interior,
        displacement_known: &vec![true; n],
        loads: &[],
        loaded: &[],
        free_motions: None,
    };
    for tolerance in [1e-9, 0.5, f64::NAN] {
        let error = problem.solve_by(SolutionMethod::Compressed(tolerance), Par::Seq).err().unwrap();
        assert!(error.kind() == ErrorKind::Input && error.message().contains("1e-6"), "{error}");
    }
}
