//! The manufactured solution u = (sin πx sin πy sin πz, 0, 0) in the unit cube.

use std::f64::consts::PI;

use nalgebra::Vector6;
use orthowear::element::ElementKind;
use orthowear::fem::{CondensedBody, FeModel, HexFormulation};
use orthowear::material::Stiffness;

use crate::fem_bodies::{clamp, spec};
use crate::fem_meshes::block;

/// Strain energy of the manufactured solution for an isotropic material with E = 1 and ν = 0.3.
pub const ENERGY: f64 = 1.304876;

fn material() -> Stiffness {
    Stiffness::isotropic(1.0, 0.3).unwrap()
}

/// Stress of the manufactured solution in Voigt order.
pub fn stress(x: [f64; 3]) -> [f64; 6] {
    let s = x.map(|c| (PI * c).sin());
    let c = x.map(|c| PI * (PI * c).cos());
    let strain = Vector6::new(c[0] * s[1] * s[2], 0.0, 0.0, 0.0, s[0] * s[1] * c[2], s[0] * c[1] * s[2]);
    (material().voigt() * strain).into()
}

pub fn body(
    kind: ElementKind,
    formulation: HexFormulation,
    n: usize,
    map: fn([f64; 3]) -> [f64; 3],
) -> CondensedBody {
    let (lambda, mu) = (0.3 / (1.3 * 0.4), 1.0 / 2.6);
    let mesh = block(kind, [n, n, n], [1.0; 3], map);
    let supports = ["x0", "x1", "y0", "y1", "z0", "z1"].map(clamp).to_vec();
    let mut model = FeModel::new(spec(mesh, material(), formulation, supports)).unwrap();
    model.add_body_force(|x| {
        let s = x.map(|c| (PI * c).sin());
        let c = x.map(|c| (PI * c).cos());
        [
            PI * PI * (lambda + 4.0 * mu) * s[0] * s[1] * s[2],
            -(lambda + mu) * PI * PI * c[0] * c[1] * s[2],
            -(lambda + mu) * PI * PI * c[0] * s[1] * c[2],
        ]
    });
    model.condense(&[]).unwrap()
}
