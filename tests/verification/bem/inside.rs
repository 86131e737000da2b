//! Stress on and off the surface of finite bodies of boundary elements.

use nalgebra::Matrix3;
use orthowear::bem::finite::{BoundaryElements, Domain, Interpolation, SurfaceState};
use orthowear::geometry::Point;
use orthowear::material::Stiffness;

use super::finite::{cube, elements, solved, sphere};
use crate::common::{steel, tabulated_cfrp as cfrp};

/// Stress at the corners of elements, means over the elements around by equal weights, and where; `positions` by element and corner.
fn at_corners(elements: &BoundaryElements, state: &SurfaceState) -> Vec<(Point, Matrix3<f64>)> {
    let field = elements.on_surface(state);
    let mut all: Vec<(Point, Matrix3<f64>, f64)> = Vec::new();
    for i in 0..elements.n_elements() {
        let kind = elements.panel(i).kind;
        for xi in &kind.face_places()[..kind.n_corners()] {
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

#[test]
fn explore_cavity() {
    let (a, pressure) = (1.0, 100.0);
    for (interpolation, ns) in
        [(Interpolation::Constant, [4, 8]), (Interpolation::Linear, [4, 8]), (Interpolation::Quadratic, [2, 4])]
    {
        for n in ns {
            let mut panels = sphere(n, a, false);
            panels.iter_mut().for_each(|panel| panel.nodes.iter_mut().for_each(|x| x.x = -x.x));
            let elements = elements(panels, interpolation, &steel(), 1e-7);
            let data = (|_: &Point| Point::zeros(), |_: &Point, n: &Point| -n * pressure);
            let state = solved(&elements, Domain::Outside, |_| false, data).state(1.0, &[]);
            let (mut worst, mut mean, mut count) = (0.0f64, 0.0, 0);
            for (x, stress) in at_corners(&elements, &state) {
                let r = x.normalize();
                let exact = Matrix3::identity() * 50.0 - r * r.transpose() * 150.0;
                let e = (stress - exact).norm();
                worst = worst.max(e);
                mean += e * e;
                count += 1;
            }
            println!("{interpolation:?} {n} corners worst {worst} rms {}", (mean / count as f64).sqrt());
            let field = elements.inside(&state, Domain::Outside);
            for d in [0.001, 0.01, 0.03, 0.1, 0.3, 1.0] {
                let dir = Point::new(0.3, 0.5, 0.8).normalize();
                let x = dir * (a + d);
                let s = field.at(&x).stress;
                let q = 100.0 / (1.0f64 + d).powi(3);
                let exact = Matrix3::identity() * 0.5 * q - dir * dir.transpose() * 1.5 * q;
                println!("   d {d} err {:e}", (s - exact).norm() / 100.0);
            }
        }
    }
}
