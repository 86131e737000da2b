//! Convergence of finite elements: a manufactured solution and a cantilever.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::element::ShapeFunctions;
use orthowear::fem::{FeModel, HexFormulation};
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;
use orthowear::quadrature::{RulePoint, hexahedron, pyramid, tetrahedron, wedge};

use super::fem_bodies::{ELEMENTS, clamp, degree, isotropic, spec};
use super::fem_meshes::{block, linear, wavy};
use crate::by_kind;
use crate::common::usual_or_finest;

/// L2 norm and H1 seminorm of the error of `u` against the field (sin πx sin πy sin πz, 0, 0).
fn mms_errors<S: ShapeFunctions<N, 3>, const N: usize>(mesh: &Mesh, u: &[[f64; 3]]) -> (f64, f64) {
    let rule = rule(mesh.kind(mesh.volume_cells().next().unwrap()));
    let (mut l2, mut h1) = (0.0, 0.0);
    for cell in mesh.volume_cells() {
        let nodes = mesh.cell_nodes(cell);
        for &(xi, weight) in &rule {
            let (values, gradients) = (S::values(xi), S::gradients(xi));
            let mut j = Matrix3::zeros();
            let mut du = Matrix3::zeros();
            let (mut x, mut uh) = (Vector3::zeros(), Vector3::zeros());
            for (a, &node) in nodes.iter().enumerate() {
                let g = Vector3::from(gradients[a]).transpose();
                j += Vector3::from(mesh.points[node]) * g;
                du += Vector3::from(u[node]) * g;
                x += Vector3::from(mesh.points[node]) * values[a];
                uh += Vector3::from(u[node]) * values[a];
            }
            let volume = weight * j.determinant();
            let s = x.map(|c| (PI * c).sin());
            let c = x.map(|c| PI * (PI * c).cos());
            uh.x -= s.x * s.y * s.z;
            let mut gradient = du * j.try_inverse().unwrap();
            gradient[(0, 0)] -= c.x * s.y * s.z;
            gradient[(0, 1)] -= s.x * c.y * s.z;
            gradient[(0, 2)] -= s.x * s.y * c.z;
            l2 += volume * uh.norm_squared();
            h1 += volume * gradient.norm_squared();
        }
    }
    (l2.sqrt(), h1.sqrt())
}

fn rule(kind: ElementKind) -> Vec<RulePoint<3>> {
    match linear(kind) {
        Hex8 => hexahedron(4),
        Tet4 => tetrahedron(5),
        ElementKind::Wedge6 => wedge(5, 4),
        _ => pyramid(4),
    }
}

fn solve_mms(
    kind: ElementKind,
    formulation: HexFormulation,
    n: usize,
    map: fn([f64; 3]) -> [f64; 3],
) -> (f64, f64, f64) {
    let (e, nu) = (1.0, 0.3);
    let (lambda, mu) = (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
    let mesh = block(kind, [n, n, n], [1.0; 3], map);
    let supports = ["x0", "x1", "y0", "y1", "z0", "z1"].map(clamp).to_vec();
    let mut model =
        FeModel::new(spec(mesh, Stiffness::isotropic(e, nu).unwrap(), formulation, supports)).unwrap();
    model.add_body_force(|x| {
        let s = x.map(|c| (PI * c).sin());
        let c = x.map(|c| (PI * c).cos());
        [
            PI * PI * (lambda + 4.0 * mu) * s[0] * s[1] * s[2],
            -(lambda + mu) * PI * PI * c[0] * c[1] * s[2],
            -(lambda + mu) * PI * PI * c[0] * s[1] * c[2],
        ]
    });
    let body = model.condense(&[]).unwrap();
    let u = body.contact_free_displacement();
    let (l2, h1) = by_kind!(kind, mms_errors(body.model().mesh(), u));
    (l2, h1, body.model().strain_energy(u).unwrap())
}

/// Truth: errors of elements of degree p have the order p + 1 in L2 and p in H1. The strain energy converges to 1.304876 (method
/// of manufactured solutions, Roache 1998). Between the two finest of three meshes, the orders agree to 0.15, the tolerance of
/// the catalogue (docs/verification.md). The error of the energy decreases with order 2 p, and is below 6 % on the finest mesh.
#[test]
fn mms_isotropic() {
    let maps: [fn([f64; 3]) -> [f64; 3]; 2] = [wavy, |x| x];
    let energy: f64 = 1.304876;
    for (kind, formulation) in ELEMENTS {
        let p = degree(kind) as f64;
        for (index, map) in maps.into_iter().enumerate().take(usual_or_finest(1, 2)) {
            let meshes = match linear(kind) {
                Tet4 if p == 1.0 => [6, 12, 24],
                _ if p == 1.0 => [5, 10, 20],
                _ if index == 0 => [4, 8, 12],
                _ => [3, 5, 10],
            };
            let runs = meshes.map(|n| solve_mms(kind, formulation, n, map));
            let finer = meshes[2] as f64 / meshes[1] as f64;
            let order = |f: fn(&(f64, f64, f64)) -> f64| (f(&runs[1]) / f(&runs[2])).ln() / finer.ln();
            let (l2, h1) = (order(|r| r.0), order(|r| r.1));
            let name = format!("{} {} map {index}", kind.name(), formulation.name());
            println!("{name}: L2 order {l2:.3}, H1 order {h1:.3}, {runs:?}");
            assert!((l2 - p - 1.0).abs() < 0.15, "{name}: L2 order {l2}");
            assert!((h1 - p).abs() < 0.15, "{name}: H1 order {h1}");
            let gaps = runs.map(|r| (r.2 - energy).abs());
            assert!(
                gaps[2] < 1.4 * finer.powf(-2.0 * p) * gaps[1] && gaps[2] < 0.06 * energy,
                "{name}: energy {gaps:?}"
            );
        }
    }
}

/// End deflection, mm, of a cantilever of 100 x 10 x 10 mm with `n` elements across and 10 `n` along. The force on its end is
/// 1000 N.
fn cantilever(kind: ElementKind, formulation: HexFormulation, n: usize) -> f64 {
    let mesh = block(kind, [10 * n, n, n], [100.0, 10.0, 10.0], |x| x);
    let end = mesh.points.iter().position(|x| *x == [100.0, 5.0, 5.0]).unwrap();
    let mut spec = spec(mesh, isotropic(), formulation, vec![clamp("x0")]);
    spec.tractions = vec![("x1".into(), [0.0, 0.0, 10.0])];
    let body = FeModel::new(spec).unwrap().condense(&[]).unwrap();
    let u = body.contact_free_displacement();
    let reactions = body.model().reactions(u).unwrap();
    let sum: f64 = reactions.iter().map(|r| r[2]).sum();
    // Rounding of a reaction: the last bits of displacements (1e-16 x 2 mm) times the axial stiffness of an element (1e7 N/mm).
    assert!((sum + 1000.0).abs() < 1e-9 * 1000.0, "reaction {sum}");
    let moment: f64 = reactions.iter().zip(&body.model().mesh().points).map(|(r, x)| r[0] * x[2]).sum();
    // Moment of the traction about y at the root: 1000 N times 100 mm.
    assert!((moment.abs() / 1e5 - 1.0).abs() < 1e-9, "moment {moment}");
    u[end][2]
}

/// Truth: the end deflection of the clamped cantilever is 1.9066 +- 0.0002 mm (three-dimensional solution). Enhanced hexahedra
/// agree to 1 % with two cells across the height, and to 0.3 % with four. Shear locking of standard hexahedra changes the bending
/// deflection by a fraction of about (cell length / beam height)^2 / 2.
#[test]
fn cantilever_end_shear() {
    let exact: f64 = 1.9066;
    let enhanced = [2, 4].map(|n| (cantilever(Hex8, HexFormulation::Enhanced, n) / exact - 1.0).abs());
    let plain = [2, 4].map(|n| (cantilever(Hex8, HexFormulation::Standard, n) / exact - 1.0).abs());
    let tets = cantilever(Tet4, HexFormulation::Enhanced, 4) / exact - 1.0;
    println!("cantilever: enhanced {enhanced:?}, plain {plain:?}, tet4 {tets}");
    assert!(enhanced[0] < 0.01 && enhanced[1] < 0.003);
    assert!(plain[0] > 10.0 * enhanced[0] && plain[1] > 10.0 * enhanced[1]);
    assert!(plain[1] < 0.35 * plain[0]);
    assert!(tets < plain[1]);
}
