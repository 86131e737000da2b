//! Bodies and materials that the finite-element tests share.

use std::sync::Arc;

use nalgebra::Vector3;
use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::fem::{FeSpec, HexFormulation, Support};
use orthowear::material::{Orthotropic, Stiffness};
use orthowear::mesh::Mesh;

/// All components.
pub const ALL: [bool; 3] = [true; 3];
/// The elements: kind and formulation.
pub const ELEMENTS: [(ElementKind, HexFormulation); 3] =
    [(Hex8, HexFormulation::Enhanced), (Hex8, HexFormulation::Standard), (Tet4, HexFormulation::Enhanced)];

/// A body of one material without loads.
pub fn spec(mesh: Mesh, stiffness: Stiffness, formulation: HexFormulation, supports: Vec<Support>) -> FeSpec {
    FeSpec {
        name: "body1".into(),
        mesh: Arc::new(mesh),
        regions: vec![(None, stiffness.into())],
        formulation,
        supports,
        foundations: vec![],
        pressures: vec![],
        tractions: vec![],
        body_force: [0.0; 3],
    }
}

/// All components of a group held.
pub fn clamp(group: &str) -> Support {
    Support { group: group.into(), components: ALL, value: [0.0; 3], gradient: [[0.0; 3]; 3] }
}

/// Orthotropic material of the catalogue, rotated by Rz(20) Ry(35) Rx(10).
pub fn rotated_orthotropic() -> Stiffness {
    let constants = Orthotropic {
        e1: 140e3,
        e2: 10e3,
        e3: 9e3,
        g12: 5.2e3,
        g13: 4.8e3,
        g23: 3.3e3,
        nu12: 0.30,
        nu13: 0.28,
        nu23: 0.45,
    };
    let turn = |axis: Vector3<f64>, degrees: f64| {
        nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), degrees.to_radians())
    };
    let q = turn(Vector3::z(), 20.0) * turn(Vector3::y(), 35.0) * turn(Vector3::x(), 10.0);
    Stiffness::orthotropic(&constants).unwrap().rotated(q.matrix())
}

/// Steel.
pub fn isotropic() -> Stiffness {
    Stiffness::isotropic(210e3, 0.3).unwrap()
}

/// Largest difference of two fields.
pub fn largest_difference<const N: usize>(a: &[[f64; N]], b: &[[f64; N]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
