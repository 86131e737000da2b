//! Stiffness tensors: isotropic, transversely isotropic, orthotropic, general; rotation and admissibility.
//!
//! Voigt order 11, 22, 33, 23, 13, 12 with engineering shear strains, everywhere.

use nalgebra::{Matrix3, Matrix6};

use crate::error::{Error, Result};

/// Voigt index to tensor indices.
pub const VOIGT: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// A symmetric positive definite stiffness `[6, 6]` (MPa) in Voigt order 11 22 33 23 13 12.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness(Matrix6<f64>);

/// Engineering constants of an orthotropic material (MPa; axis 1 = fibre).
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)]
pub struct Orthotropic {
    pub e1: f64,
    pub e2: f64,
    pub e3: f64,
    pub g12: f64,
    pub g13: f64,
    pub g23: f64,
    pub nu12: f64,
    pub nu13: f64,
    pub nu23: f64,
}

impl Stiffness {
    /// Isotropic material from Young's modulus (MPa) and Poisson's ratio.
    ///
    /// # Errors
    /// If the constants are not admissible (positive definite).
    pub fn isotropic(e: f64, nu: f64) -> Result<Self> {
        let g = e / (2.0 * (1.0 + nu));
        Self::orthotropic(&Orthotropic {
            e1: e,
            e2: e,
            e3: e,
            g12: g,
            g13: g,
            g23: g,
            nu12: nu,
            nu13: nu,
            nu23: nu,
        })
    }

    /// Transversely isotropic material about axis 1; G23 = E2 / (2 (1 + nu23)).
    ///
    /// # Errors
    /// If the constants are not admissible (positive definite).
    pub fn transversely_isotropic(e1: f64, e2: f64, g12: f64, nu12: f64, nu23: f64) -> Result<Self> {
        let g23 = e2 / (2.0 * (1.0 + nu23));
        Self::orthotropic(&Orthotropic { e1, e2, e3: e2, g12, g13: g12, g23, nu12, nu13: nu12, nu23 })
    }

    /// Orthotropic material from its nine engineering constants, through the compliance
    /// S_ij = -nu_ij / E_i.
    ///
    /// # Errors
    /// If the compliance is not positive definite; the message names what is violated.
    pub fn orthotropic(c: &Orthotropic) -> Result<Self> {
        for (name, value) in
            [("E1", c.e1), ("E2", c.e2), ("E3", c.e3), ("G12", c.g12), ("G13", c.g13), ("G23", c.g23)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::input(format!("{name} = {value} must be positive and finite")));
            }
        }
        let mut s = Matrix6::zeros();
        s[(0, 0)] = 1.0 / c.e1;
        s[(1, 1)] = 1.0 / c.e2;
        s[(2, 2)] = 1.0 / c.e3;
        s[(0, 1)] = -c.nu12 / c.e1;
        s[(0, 2)] = -c.nu13 / c.e1;
        s[(1, 2)] = -c.nu23 / c.e2;
        s[(1, 0)] = s[(0, 1)];
        s[(2, 0)] = s[(0, 2)];
        s[(2, 1)] = s[(1, 2)];
        s[(3, 3)] = 1.0 / c.g23;
        s[(4, 4)] = 1.0 / c.g13;
        s[(5, 5)] = 1.0 / c.g12;
        let inverse = s
            .cholesky()
            .ok_or_else(|| {
                Error::input(format!(
                    "the elastic constants are not positive definite: with nu12 = {}, nu13 = {}, nu23 = {} some \
                     strain would release energy; need nu_ij^2 < E_i/E_j and 1 - nu12 nu21 - nu23 nu32 - nu13 nu31 \
                     - 2 nu21 nu32 nu13 > 0 (nu_ij is minus the strain along j by the strain along i under stress i)",
                    c.nu12, c.nu13, c.nu23
                ))
            })?
            .inverse();
        Self::from_voigt(inverse)
    }

    /// General material from its 6 x 6 Voigt stiffness.
    ///
    /// # Errors
    /// If the matrix is not finite, symmetric (to 1e-9 of its largest entry) and positive definite.
    pub fn from_voigt(c: Matrix6<f64>) -> Result<Self> {
        if !c.iter().all(|x| x.is_finite()) {
            return Err(Error::input("the stiffness has an entry that is not a finite number"));
        }
        let asymmetry = (c - c.transpose()).amax();
        if asymmetry > 1e-9 * c.amax() {
            return Err(Error::input(format!(
                "the stiffness is not symmetric: C - C^T has an entry {asymmetry:e}"
            )));
        }
        let symmetric = (c + c.transpose()) * 0.5;
        if symmetric.cholesky().is_none() {
            let least = symmetric.symmetric_eigenvalues().min();
            return Err(Error::input(format!(
                "the stiffness is not positive definite: its smallest eigenvalue is {least:.6e}"
            )));
        }
        Ok(Self(symmetric))
    }

    /// The Voigt matrix `[6, 6]`, MPa.
    pub fn voigt(&self) -> &Matrix6<f64> {
        &self.0
    }

    /// Component C_ijkl (indices 0..3).
    pub fn component(&self, i: usize, j: usize, k: usize, l: usize) -> f64 {
        const INDEX: [[usize; 3]; 3] = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];
        self.0[(INDEX[i][j], INDEX[k][l])]
    }

    /// Active rotation: material axis i comes to lie along column i of `axes`,
    /// C'_ijkl = Q_ia Q_jb Q_kc Q_ld C_abcd.
    pub fn rotated(&self, axes: &Matrix3<f64>) -> Self {
        let mut turned = Matrix6::zeros();
        // Bond matrix M with stress' = M stress; C' = M C M^T.
        let mut bond = Matrix6::zeros();
        for (row, &(i, j)) in VOIGT.iter().enumerate() {
            for (column, &(a, b)) in VOIGT.iter().enumerate() {
                bond[(row, column)] = if a == b {
                    axes[(i, a)] * axes[(j, a)]
                } else {
                    axes[(i, a)] * axes[(j, b)] + axes[(i, b)] * axes[(j, a)]
                };
            }
        }
        turned.copy_from(&(bond * self.0 * bond.transpose()));
        Self((turned + turned.transpose()) * 0.5)
    }
}
