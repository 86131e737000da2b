//! Torsion of a square bar.

use orthowear::element::ElementKind::{self, Hex8, Hex20, Hex27, Tet10, Wedge15};
use orthowear::fem::{FeModel, HexFormulation, StressRecovery};
use orthowear::material::Stiffness;

use crate::fem_bodies::spec;
use crate::fem_meshes::{block, prescribe};

/// Torque, and largest shear stress at the middle of a side, of a bar with unit shear modulus, side and twist per length. Both
/// ends rotate in their planes and can warp freely, as in Saint-Venant's solution.
fn twisted(kind: ElementKind, n: usize) -> (f64, f64) {
    let length = 0.25;
    let centred = |[x, y, z]: [f64; 3]| [x - 0.5, y - 0.5, z];
    let mut mesh = block(kind, [n, n, 2], [1.0, 1.0, length], centred);
    let end = |z: f64| -> Vec<usize> {
        (0..mesh.n_points()).filter(|&node| (mesh.points[node][2] - z).abs() < 1e-12).collect()
    };
    let (lower, upper) = (end(0.0), end(length));
    let at =
        |x: [f64; 3]| mesh.points.iter().position(|p| (0..3).all(|k| (p[k] - x[k]).abs() < 1e-12)).unwrap();
    let (axis, side) = (at([0.0; 3]), at([0.5, 0.0, length / 2.0]));
    let turn = |[x, y, z]: [f64; 3]| [-y * z, x * z, 0.0];
    let mut supports = prescribe(&mut mesh, &lower, [true, true, false], turn);
    supports.extend(prescribe(&mut mesh, &upper, [true, true, false], turn));
    supports.extend(prescribe(&mut mesh, &[axis], [false, false, true], turn));
    let material = Stiffness::isotropic(2.6, 0.3).unwrap();
    let body = FeModel::new(spec(mesh, material, HexFormulation::Enhanced, supports))
        .unwrap()
        .condense(&[])
        .unwrap();
    let (model, u) = (body.model(), body.contact_free_displacement());
    let reactions = model.reactions(u).unwrap();
    let moment = |&node: &usize| {
        let (x, r) = (model.mesh().points[node], reactions[node]);
        x[0] * r[1] - x[1] * r[0]
    };
    let torque: f64 = upper.iter().map(moment).sum();
    let recovery = StressRecovery::new(model).unwrap();
    let stress = recovery.stress(model, u).unwrap()[side];
    (torque, stress[3].hypot(stress[4]))
}

/// Truth: case `torsion-square-bar` of docs/verification.md (Saint-Venant 1855). A bar of side s has the torque T = 0.1405770 G
/// theta' s⁴ for the twist theta' per length. The largest shear stress is 0.6753145 G theta' s, at the middle of the sides. The
/// tolerance is 0.5 %. Linear elements need to meet it only for the torque.
#[test]
fn torsion_of_a_square_bar() {
    for (kind, n) in [(Hex20, 16), (Hex20, 8), (Hex27, 8), (Wedge15, 8), (Tet10, 8), (Hex8, 16)] {
        let (torque, shear) = twisted(kind, n);
        let (torque, shear) = (torque / 0.140577015 - 1.0, shear / 0.6753144833 - 1.0);
        println!("torsion {} {n}: torque {torque:+.2e}, shear {shear:+.2e}", kind.name());
        assert!(torque.abs() < 0.005, "{}: {torque}", kind.name());
        assert!(shear.abs() < 0.005 || kind == Hex8, "{}: {shear}", kind.name());
    }
}
