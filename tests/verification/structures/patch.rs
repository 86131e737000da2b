//! The patch test of MacNeal and Harder for every element.

use nalgebra::Vector6;
use orthowear::element::ElementKind::{Pyramid5, Tet4};
use orthowear::material::Stiffness;
use orthowear::mesh::quality::check;

use super::meshes::seven_hexahedra;
use crate::fem::patch_test;
use crate::fem_bodies::ELEMENTS;
use crate::fem_meshes::linear;

/// Truth: constant strain on the seven distorted hexahedra, whole or cut into other elements (MacNeal and Harder 1985). Normal
/// stresses are 2000, shear stresses 400. Displacements of inner nodes are exact, and reactions balance. The tolerance 1e-12
/// covers rounding. One of the published hexahedra is inverted at its inner corner, where the Jacobian determinant is -1.58e-3.
/// The mesh check therefore runs only on tetrahedra and pyramids.
#[test]
fn seven_distorted_hexahedra_in_every_element() {
    let strain = [1e-3; 6];
    let stiffness = Stiffness::isotropic(1e6, 0.25).unwrap();
    let published = Vector6::new(2000.0, 2000.0, 2000.0, 400.0, 400.0, 400.0);
    assert!((stiffness.voigt() * Vector6::from(strain) - published).amax() < 1e-9);
    for (kind, formulation) in ELEMENTS {
        let mesh = seven_hexahedra(kind);
        if matches!(linear(kind), Tet4 | Pyramid5) {
            let volume = check(&mesh).expect("a sound mesh").volume;
            assert!((volume - 1.0).abs() < 1e-13, "{}: volume {volume}", kind.name());
        }
        patch_test(mesh, stiffness.clone(), formulation, strain, 1.0, 1e-12);
    }
}
