//! Bodies and materials for several finite-element tests.

use std::sync::Arc;

use nalgebra::Vector3;
use orthowear::element::ElementKind::{self, Hex8, Tet4};
use orthowear::fem::{FeSpec, HexFormulation, Support};
use orthowear::material::Stiffness;
use orthowear::mesh::Mesh;

use super::crystals::cfrp_of_tables;

pub const ALL: [bool; 3] = [true; 3];
pub const ELEMENTS: [(ElementKind, HexFormulation); 13] = [
    (Hex8, HexFormulation::Enhanced),
    (Hex8, HexFormulation::Standard),
    (Hex8, HexFormulation::MeanDilatation),
    (Tet4, HexFormulation::Enhanced),
    (ElementKind::Wedge6, HexFormulation::Enhanced),
    (ElementKind::Pyramid5, HexFormulation::Enhanced),
    (ElementKind::Hex20, HexFormulation::Enhanced),
    (ElementKind::Hex27, HexFormulation::Enhanced),
    (ElementKind::Tet10, HexFormulation::Enhanced),
    (ElementKind::Wedge15, HexFormulation::Enhanced),
    (ElementKind::Wedge18, HexFormulation::Enhanced),
    (ElementKind::Pyramid13, HexFormulation::Enhanced),
    (ElementKind::Pyramid14, HexFormulation::Enhanced),
];

pub fn degree(kind: ElementKind) -> usize {
    if kind.n_nodes() == kind.n_corners() { 1 } else { 2 }
}

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
        temperature_change: 0.0,
    }
}

pub fn clamp(group: &str) -> Support {
    Support { group: group.into(), components: ALL, value: [0.0; 3], gradient: [[0.0; 3]; 3] }
}

/// CFRP of the catalogue (docs/verification.md), rotated by Rz(20) Ry(35) Rx(10), angles in degrees.
pub fn rotated_orthotropic() -> Stiffness {
    let turn = |axis: Vector3<f64>, degrees: f64| {
        nalgebra::Rotation3::from_axis_angle(&nalgebra::Unit::new_normalize(axis), degrees.to_radians())
    };
    let q = turn(Vector3::z(), 20.0) * turn(Vector3::y(), 35.0) * turn(Vector3::x(), 10.0);
    cfrp_of_tables().rotated(q.matrix())
}

pub fn isotropic() -> Stiffness {
    Stiffness::isotropic(210e3, 0.3).unwrap()
}

pub fn largest_difference<const N: usize>(a: &[[f64; N]], b: &[[f64; N]]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}
