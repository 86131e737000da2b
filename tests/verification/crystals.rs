//! Anisotropic materials of the literature that several tests share.

use nalgebra::Matrix6;
use orthowear::material::{Orthotropic, Stiffness};

/// Stiffness from the upper entries, numbered from 1 in the order 11 22 33 23 13 12.
pub fn voigt(entries: &[(usize, usize, f64)]) -> Stiffness {
    let mut c = Matrix6::zeros();
    for &(i, j, value) in entries {
        c[(i - 1, j - 1)] = value;
        c[(j - 1, i - 1)] = value;
    }
    Stiffness::from_voigt(c).expect("an admissible stiffness")
}

/// Cube axes along the coordinate axes.
pub fn cubic(c11: f64, c12: f64, c44: f64) -> Stiffness {
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c11), (1, 2, c12), (1, 3, c12), (2, 3, c12)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, c44)]].concat())
}

/// Zinc, axis along 3, in GPa times `unit`.
pub fn zinc(unit: f64) -> Stiffness {
    let [c11, c33, c12, c13, c44] = [165.0, 61.8, 31.1, 50.0, 39.6].map(|c| c * unit);
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c33), (1, 2, c12), (1, 3, c13), (2, 3, c13)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, (c11 - c12) / 2.0)]].concat())
}

/// Topaz, GPa.
pub fn topaz() -> Stiffness {
    let normal = [(1, 1, 287.0), (2, 2, 365.0), (3, 3, 300.0), (1, 2, 128.0), (1, 3, 85.0), (2, 3, 90.0)];
    voigt(&[&normal[..], &[(4, 4, 110.0), (5, 5, 135.0), (6, 6, 133.0)]].concat())
}

/// The CFRP of the published surface admittances: E = 140, 10, 9 GPa (MPa here), fibre along 1.
pub fn cfrp_of_tables() -> Stiffness {
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
    Stiffness::orthotropic(&constants).expect("CFRP")
}

/// Stiffness with the ratio E1 / E2, fibre along x.
pub fn with_ratio(ratio: f64) -> Stiffness {
    let e2 = 10e3;
    let g23 = e2 / 2.6;
    let constants = Orthotropic {
        e1: ratio * e2,
        e2,
        e3: e2,
        g12: e2 / 2.0,
        g13: e2 / 2.0,
        g23,
        nu12: 0.3,
        nu13: 0.3,
        nu23: 0.3,
    };
    Stiffness::orthotropic(&constants).expect("an admissible material")
}
