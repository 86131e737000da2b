//! Anisotropic materials of the literature and of the catalogue (docs/verification.md), and closed forms of their half-spaces.

use nalgebra::Matrix6;
use orthowear::material::{Orthotropic, Stiffness};

/// Stiffness from entries (row, column, value) of the upper triangle of its Voigt matrix. Rows and columns are numbered from 1 in
/// the order 11, 22, 33, 23, 13, 12.
pub fn voigt(entries: &[(usize, usize, f64)]) -> Stiffness {
    let mut c = Matrix6::zeros();
    for &(i, j, value) in entries {
        c[(i - 1, j - 1)] = value;
        c[(j - 1, i - 1)] = value;
    }
    Stiffness::from_voigt(c).expect("an admissible stiffness")
}

pub fn cubic(c11: f64, c12: f64, c44: f64) -> Stiffness {
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c11), (1, 2, c12), (1, 3, c12), (2, 3, c12)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, c44)]].concat())
}

/// Stiffness of zinc, with the axis of symmetry along 3. Entries are in GPa, multiplied by `unit` (1000 for MPa).
pub fn zinc(unit: f64) -> Stiffness {
    let [c11, c33, c12, c13, c44] = [165.0, 61.8, 31.1, 50.0, 39.6].map(|c| c * unit);
    let normal = [(1, 1, c11), (2, 2, c11), (3, 3, c33), (1, 2, c12), (1, 3, c13), (2, 3, c13)];
    voigt(&[&normal[..], &[(4, 4, c44), (5, 5, c44), (6, 6, (c11 - c12) / 2.0)]].concat())
}

/// Stiffness of topaz, GPa.
pub fn topaz() -> Stiffness {
    let normal = [(1, 1, 287.0), (2, 2, 365.0), (3, 3, 300.0), (1, 2, 128.0), (1, 3, 85.0), (2, 3, 90.0)];
    voigt(&[&normal[..], &[(4, 4, 110.0), (5, 5, 135.0), (6, 6, 133.0)]].concat())
}

/// The CFRP of the catalogue, with the fibre along 1. Moduli are in MPa.
pub const CFRP: Orthotropic = Orthotropic {
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

pub fn cfrp_of_tables() -> Stiffness {
    Stiffness::orthotropic(&CFRP).expect("CFRP")
}

/// Stiffness of a material with E1 / E2 = `ratio` and the fibre along x.
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

/// Stiffness of steel with a small anisotropy. Its moduli differ by fractions of `e`.
pub fn nearly_isotropic(e: f64) -> Stiffness {
    let (young, nu) = (210e3, 0.3);
    let g = young / 2.6;
    let constants = Orthotropic {
        e1: young * (1.0 + e),
        e2: young,
        e3: young * (1.0 - e / 2.0),
        g12: g,
        g13: g,
        g23: g * (1.0 + e / 3.0),
        nu12: nu,
        nu13: nu,
        nu23: nu,
    };
    Stiffness::orthotropic(&constants).expect("an admissible material")
}

/// Diagonal of the real part of the surface admittance W for waves along axis 1 of an orthotropic solid, in its material axes
/// (Ting 1996).
pub fn admittance_along_1(stiffness: &Stiffness) -> [f64; 3] {
    let c = stiffness.voigt();
    let s = (c[(0, 0)] * c[(2, 2)]).sqrt();
    let root = c[(4, 4)] * (s - c[(0, 2)]) / (c[(2, 2)] * (c[(0, 2)] + 2.0 * c[(4, 4)] + s));
    let l11 = (c[(0, 2)] + s) * root.sqrt();
    [1.0 / l11, 1.0 / (c[(3, 3)] * c[(5, 5)]).sqrt(), (c[(0, 0)] / c[(2, 2)]).sqrt() / l11]
}

/// Indentation modulus of a transversely isotropic solid with its axis along the normal (Elliott 1949).
pub fn modulus_along_the_axis(stiffness: &Stiffness) -> f64 {
    let c = stiffness.voigt();
    let (c11, c33, c13, c44) = (c[(0, 0)], c[(2, 2)], c[(0, 2)], c[(3, 3)]);
    2.0 * ((c11 * c33 - c13 * c13) / c11 / (1.0 / c44 + 2.0 / (c13 + (c11 * c33).sqrt()))).sqrt()
}
