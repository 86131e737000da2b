//! Finite-element correction of the half-space, against an exact solution.

use nalgebra::Vector3;
use orthowear::bem::half_space::PointForceField;
use orthowear::body::hybrid::{ContactPatch, Correction, PatchForces};
use orthowear::element::ElementKind::{self, Hex8, Hex27};
use orthowear::fem::{ColumnSolver, FeModel, FeSpec, HexFormulation};
use orthowear::frame::Side;
use orthowear::geometry::{Point, Triad};
use orthowear::linalg::memory::MemoryLimit;
use orthowear::material::Stiffness;

use super::blocks::{FRAME, body, cfrp};
use crate::common::{assert_order, steel, usual_or_finest};

/// Positions of point forces: a grid on the contact patch, and one position beside the body.
fn places() -> Vec<[f64; 2]> {
    let line: Vec<f64> = (0..4).map(|k| FRAME * f64::from(2 * k - 3) / 4.0).collect();
    let mut places: Vec<[f64; 2]> = line.iter().flat_map(|&x| line.iter().map(move |&y| [x, y])).collect();
    places.push([5.0, 1.0]);
    places
}

/// Relative errors of the correction at the points on the patch, for a force beside a body of half-width 3 mm. The first
/// correction is evaluated by Betti's theorem, the second by the displacement at the mesh nodes.
fn beside(kind: ElementKind, cells: usize, stiffness: &Stiffness, field: &PointForceField) -> [f64; 2] {
    let spec = FeSpec { formulation: HexFormulation::Standard, ..body(kind, (3.0, cells, 1.0), stiffness) };
    let model = FeModel::new(spec).unwrap();
    let patch = ContactPatch::on_body(&Triad::horizontal(0.0), Side::Lower, Point::zeros(), [FRAME; 2]);
    let forces = PatchForces { patch, stiffness, field, points: places(), curved_faces: &[] };
    let solver = ColumnSolver::new(&model, &MemoryLimit::of_machine()).unwrap();
    let found = Correction::unsymmetric(&model, &solver, &forces, 0.2).unwrap();
    let on_patch = PatchForces { points: places()[..16].to_vec(), ..forces };
    let direct = found.at_mesh_nodes(&model, &on_patch).unwrap();
    let (mut off, mut size) = ([0.0, 0.0], 0.0);
    for (i, place) in on_patch.points.iter().enumerate() {
        // The force does not act on the body. The correction therefore cancels the half-space field u_hs of the force.
        let exact = -field.at(&Vector3::new(place[0] - 5.0, place[1] - 1.0, 0.0)).value;
        for (a, b) in (0..9).map(|k| (k % 3, k / 3)) {
            let values = [found.matrix.at(3 * i + a, 48 + b), direct.at(3 * i + a, 48 + b)];
            (0..2).for_each(|k| off[k] += (values[k] - exact[(a, b)]).powi(2));
            size += exact[(a, b)].powi(2);
        }
    }
    off.map(|sum| (sum / size).sqrt())
}

/// Truth: a force beside the body, in the plane of the contact, does not move the body. The correction is therefore exactly
/// -u_hs, with the field u_hs of the half-space. Evaluated by Betti's theorem, the correction has twice the order of the energy
/// norm: 2 for trilinear and 4 for triquadratic elements. Evaluated by the displacement at mesh nodes, it has the orders 2 and 3.
#[test]
fn forces_beside_the_body() {
    for stiffness in usual_or_finest(vec![cfrp()], vec![steel(), cfrp()]) {
        let field = PointForceField::new(&stiffness).unwrap();
        for (kind, cells, wanted) in [(Hex8, [6, 12, 24], [1.9, 1.9]), (Hex27, [3, 6, 12], [3.8, 2.8])] {
            let errors = cells.map(|n| beside(kind, n, &stiffness, &field));
            for (k, wanted) in wanted.into_iter().enumerate() {
                assert_order(&errors.map(|errors| errors[k]), &cells, wanted, &format!("{kind:?} {k}"));
            }
        }
    }
}
