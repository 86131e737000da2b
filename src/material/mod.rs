//! Elastic materials: [`Stiffness`] tensors of any anisotropy, material axes of elements ([`Orientation`]), and materials of
//! regions ([`RegionMaterial`]). The Voigt order is always 11, 22, 33, 23, 13, 12, with engineering shear strains.

mod directions;
mod element_axes;
mod orientation;
mod region_material;
pub mod strength;
mod winding;

use nalgebra::{Matrix3, Matrix6, Vector6};

use crate::error::{Error, Result};

pub use directions::{axes_from_directions, centroid};
pub use element_axes::ElementAxes;
pub use orientation::Orientation;
pub use region_material::{PlacedMaterial, Ply, RegionMaterial};
pub use winding::{Winding, WoundLayer};

/// Tensor indices of each Voigt component.
pub const VOIGT: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// Stress tensor from its Voigt components.
pub fn voigt_to_tensor(s: &[f64; 6]) -> Matrix3<f64> {
    Matrix3::new(s[0], s[5], s[4], s[5], s[1], s[3], s[4], s[3], s[2])
}

/// Voigt components of a symmetric stress tensor.
pub fn tensor_to_voigt(tensor: &Matrix3<f64>) -> [f64; 6] {
    VOIGT.map(|(i, j)| tensor[(i, j)])
}

/// Strain of a displacement gradient in Voigt order, with engineering shear strains.
pub fn strain_of_gradient(gradient: &Matrix3<f64>) -> Vector6<f64> {
    let entry = |(i, j)| if i == j { gradient[(i, i)] } else { gradient[(i, j)] + gradient[(j, i)] };
    Vector6::from(VOIGT.map(entry))
}

/// A symmetric positive definite stiffness `[6, 6]` in Voigt order, MPa.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness(Matrix6<f64>);

/// Engineering constants of an orthotropic material (MPa; axis 1 = fibre). ν_ij is minus the ratio of the strain along j to the
/// strain along i, under a stress along i.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Orthotropic {
    /// Young's modulus along axis 1.
    pub e1: f64,
    /// Young's modulus along axis 2.
    pub e2: f64,
    /// Young's modulus along axis 3.
    pub e3: f64,
    /// Shear modulus of the plane 1-2.
    pub g12: f64,
    /// Shear modulus of the plane 1-3.
    pub g13: f64,
    /// Shear modulus of the plane 2-3.
    pub g23: f64,
    /// Poisson's ratio ν12.
    pub nu12: f64,
    /// Poisson's ratio ν13.
    pub nu13: f64,
    /// Poisson's ratio ν23.
    pub nu23: f64,
}

impl Orthotropic {
    /// Compliance `[6, 6]`, 1/MPa.
    fn compliance(&self) -> Matrix6<f64> {
        let mut s = Matrix6::from_diagonal(&nalgebra::vector![
            1.0 / self.e1,
            1.0 / self.e2,
            1.0 / self.e3,
            1.0 / self.g23,
            1.0 / self.g13,
            1.0 / self.g12
        ]);
        for (i, j, value) in
            [(0, 1, -self.nu12 / self.e1), (0, 2, -self.nu13 / self.e1), (1, 2, -self.nu23 / self.e2)]
        {
            s[(i, j)] = value;
            s[(j, i)] = value;
        }
        s
    }

    fn check_signs(&self) -> Result<()> {
        let moduli = [
            ("E1", self.e1),
            ("E2", self.e2),
            ("E3", self.e3),
            ("G12", self.g12),
            ("G13", self.g13),
            ("G23", self.g23),
        ];
        for (name, value) in moduli {
            check_modulus(name, value)?;
        }
        match [("nu12", self.nu12), ("nu13", self.nu13), ("nu23", self.nu23)]
            .iter()
            .find(|(_, nu)| !nu.is_finite())
        {
            Some((name, nu)) => Err(Error::input(format!("{name} = {nu} is not a finite number"))),
            None => Ok(()),
        }
    }

    fn explain_indefinite(&self) -> Error {
        let pairs = [
            ("nu12", self.nu12, "E1/E2", self.e1 / self.e2),
            ("nu13", self.nu13, "E1/E3", self.e1 / self.e3),
            ("nu23", self.nu23, "E2/E3", self.e2 / self.e3),
        ];
        for (name, nu, moduli, ratio) in pairs {
            if nu * nu >= ratio {
                let (i, j) = (&name[2..3], &name[3..4]);
                return Error::input(format!(
                    "{name} = {nu} is too large: {name}^2 must be below {moduli} = {ratio:.6}, that is |{name}| < {:.6}. Perhaps nu{j}{i} was given for {name} (nu{j}{i} = {name} E{j}/E{i})",
                    ratio.sqrt()
                ));
            }
        }
        let (nu21, nu31) = (self.nu12 * self.e2 / self.e1, self.nu13 * self.e3 / self.e1);
        let nu32 = self.nu23 * self.e3 / self.e2;
        let volume =
            1.0 - self.nu12 * nu21 - self.nu23 * nu32 - self.nu13 * nu31 - 2.0 * nu21 * nu32 * self.nu13;
        Error::input(format!(
            "the Poisson's ratios nu12 = {}, nu13 = {}, nu23 = {} are too large together: 1 - nu12 nu21 - nu23 nu32 - \
             nu13 nu31 - 2 nu21 nu32 nu13 = {volume:.6} must be positive; make them smaller",
            self.nu12, self.nu13, self.nu23
        ))
    }
}

/// Largest difference from an isotropic stiffness, relative to the largest entry, that counts as rounding.
const ISOTROPY_TOLERANCE: f64 = 1e-11;

impl Stiffness {
    /// Isotropic material from Young's modulus (MPa) and Poisson's ratio.
    ///
    /// # Errors
    /// If E is not positive and finite, or nu does not lie between -1 and 0.5 (kind `Input`).
    pub fn isotropic(e: f64, nu: f64) -> Result<Self> {
        check_modulus("E", e)?;
        if !(nu > -1.0 && nu < 0.5) {
            return Err(Error::input(format!(
                "nu = {nu}, but Poisson's ratio of an isotropic material must lie between -1 and 0.5 (both excluded)"
            )));
        }
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
    /// If a constant is not finite, or the compliance is not positive definite (kind `Input`).
    pub fn transversely_isotropic(e1: f64, e2: f64, g12: f64, nu12: f64, nu23: f64) -> Result<Self> {
        check_modulus("E2", e2)?;
        if !(nu23 > -1.0 && nu23 < 1.0) {
            return Err(Error::input(format!(
                "nu23 = {nu23}, but in the plane across the fibre it must lie between -1 and 1"
            )));
        }
        let g23 = e2 / (2.0 * (1.0 + nu23));
        Self::orthotropic(&Orthotropic { e1, e2, e3: e2, g12, g13: g12, g23, nu12, nu13: nu12, nu23 })
    }

    /// Orthotropic material from its nine engineering constants.
    ///
    /// # Errors
    /// If a constant is not finite, or the compliance is not positive definite.
    pub fn orthotropic(constants: &Orthotropic) -> Result<Self> {
        constants.check_signs()?;
        let inverse =
            constants.compliance().cholesky().ok_or_else(|| constants.explain_indefinite())?.inverse();
        Self::from_voigt(inverse)
    }

    /// General material from its 6 x 6 Voigt stiffness.
    ///
    /// # Errors
    /// If the matrix is not finite, symmetric (to 1e-9 of its largest entry) and positive definite.
    pub fn from_voigt(c: Matrix6<f64>) -> Result<Self> {
        if !c.iter().all(|x| x.is_finite()) {
            return Err(Error::input(
                "the stiffness has an entry that is not a finite number; all 36 entries must be finite",
            ));
        }
        let asymmetry = c - c.transpose();
        let (i, j) = asymmetry.abs().iamax_full();
        if asymmetry[(i, j)].abs() > 1e-9 * c.amax() {
            return Err(Error::input(format!(
                "the stiffness is not symmetric: C{}{} = {:e} but C{}{} = {:e} (order 11 22 33 23 13 12)",
                i + 1,
                j + 1,
                c[(i, j)],
                j + 1,
                i + 1,
                c[(j, i)]
            )));
        }
        let symmetric = (c + c.transpose()) * 0.5;
        if symmetric.cholesky().is_none() {
            let least = symmetric.symmetric_eigenvalues().min();
            return Err(Error::input(format!(
                "the stiffness is not positive definite: its smallest eigenvalue is {least:.6e}, so some strain would release energy. Check the order 11 22 33 23 13 12 of rows and columns, and that the matrix is a stiffness, not a compliance"
            )));
        }
        Ok(Self(symmetric))
    }

    /// Voigt matrix `[6, 6]`, MPa.
    pub fn voigt(&self) -> &Matrix6<f64> {
        &self.0
    }

    /// Compliance `[6, 6]`, 1/MPa, for engineering shear strains.
    pub fn compliance(&self) -> Matrix6<f64> {
        self.0.cholesky().expect("a stiffness is positive definite").inverse()
    }

    /// Poisson's ratio ν for changes of volume: 1 - 2 ν = Σ_ij S_ij / Σ_i S_ii over the normal components of the compliance S. For
    /// an isotropic material, ν is its Poisson's ratio.
    pub fn volumetric_poisson_ratio(&self) -> f64 {
        let s = self.compliance();
        let normal = s.fixed_view::<3, 3>(0, 0);
        0.5 * (1.0 - normal.sum() / normal.trace())
    }

    /// Component C_ijkl (indices 0..3).
    pub fn component(&self, i: usize, j: usize, k: usize, l: usize) -> f64 {
        const INDEX: [[usize; 3]; 3] = [[0, 5, 4], [5, 1, 3], [4, 3, 2]];
        self.0[(INDEX[i][j], INDEX[k][l])]
    }

    /// Shear modulus (MPa) and Poisson's ratio of a stiffness that is isotropic up to rounding; `None` for other stiffnesses.
    pub fn isotropic_constants(&self) -> Option<[f64; 2]> {
        let c = &self.0;
        let mu = (c[(3, 3)] + c[(4, 4)] + c[(5, 5)]) / 3.0;
        let lambda = (c[(0, 1)] + c[(0, 2)] + c[(1, 2)]) / 3.0;
        let isotropic = Matrix6::from_fn(|i, j| {
            let normal = if i < 3 && j < 3 { lambda } else { 0.0 };
            let shear = if i == j { mu * if i < 3 { 2.0 } else { 1.0 } } else { 0.0 };
            normal + shear
        });
        ((c - isotropic).amax() <= ISOTROPY_TOLERANCE * c.amax())
            .then(|| [mu, lambda / (2.0 * (lambda + mu))])
    }

    /// Stress of a displacement gradient, MPa.
    pub fn stress(&self, gradient: &Matrix3<f64>) -> Matrix3<f64> {
        voigt_to_tensor(&(self.0 * strain_of_gradient(gradient)).into())
    }

    /// Stiffness after a rotation that turns material axis i into column i of Q = `axes`: C'_ijkl = Q_ia Q_jb Q_kc Q_ld C_abcd.
    pub fn rotated(&self, axes: &Matrix3<f64>) -> Self {
        // Bond matrix M: stress' = M stress, and therefore C' = M C M^T.
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
        let turned = bond * self.0 * bond.transpose();
        Self((turned + turned.transpose()) * 0.5)
    }
}

fn check_modulus(name: &str, value: f64) -> Result<()> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Error::input(format!("{name} = {value} is not admissible: a modulus must be positive and finite")))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fibre_axes;

    const IM7: Orthotropic = Orthotropic {
        e1: 167230.0,
        e2: 9544.0,
        e3: 9000.0,
        g12: 5292.0,
        g13: 5000.0,
        g23: 3483.0,
        nu12: 0.272,
        nu13: 0.25,
        nu23: 0.369,
    };

    fn message(result: Result<Stiffness>) -> String {
        result.expect_err("a refusal").to_string()
    }

    /// Truth: C = λ 1⊗1 + 2 μ I with Lamé's constants λ and μ.
    #[test]
    fn isotropic_stiffness_has_lames_constants() {
        let (e, nu) = (210e3, 0.3);
        let (lambda, mu) = (e * nu / (1.0 + nu) / (1.0 - 2.0 * nu), e / 2.0 / (1.0 + nu));
        let c = Stiffness::isotropic(e, nu).expect("steel");
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    for l in 0..3 {
                        let d = |a: usize, b: usize| f64::from(u8::from(a == b));
                        let expected =
                            lambda * d(i, j) * d(k, l) + mu * (d(i, k) * d(j, l) + d(i, l) * d(j, k));
                        assert!((c.component(i, j, k, l) - expected).abs() < 1e-10 * e);
                    }
                }
            }
        }
    }

    /// Truth: E_i = 1 / S_ii, ν_ij = -S_ji / S_ii, and G = 1 / S_kk on the shear diagonal of the compliance S.
    #[test]
    fn compliance_gives_back_the_engineering_constants() {
        let s = Stiffness::orthotropic(&IM7).expect("IM7").compliance();
        let pairs = [
            (1.0 / s[(0, 0)], IM7.e1),
            (1.0 / s[(2, 2)], IM7.e3),
            (1.0 / s[(3, 3)], IM7.g23),
            (1.0 / s[(4, 4)], IM7.g13),
            (1.0 / s[(5, 5)], IM7.g12),
            (-s[(1, 0)] / s[(0, 0)], IM7.nu12),
            (-s[(2, 0)] / s[(0, 0)], IM7.nu13),
            (-s[(2, 1)] / s[(1, 1)], IM7.nu23),
        ];
        for (found, expected) in pairs {
            assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
        }
    }

    /// Truth: the tensor sums Q_ia Q_jb Q_kc Q_ld C_abcd over all indices.
    #[test]
    fn rotation_is_the_tensor_transformation() {
        let stiffness = Stiffness::orthotropic(&IM7).expect("IM7");
        let q = fibre_axes(0.5, 1.1);
        let turned = stiffness.rotated(&q);
        for (i, j) in VOIGT {
            for (k, l) in VOIGT {
                let mut expected = 0.0;
                for (a, b, c, d) in (0..81).map(|index| (index / 27, index / 9 % 3, index / 3 % 3, index % 3))
                {
                    expected +=
                        q[(i, a)] * q[(j, b)] * q[(k, c)] * q[(l, d)] * stiffness.component(a, b, c, d);
                }
                assert!((turned.component(i, j, k, l) - expected).abs() < 1e-12 * IM7.e1);
            }
        }
    }

    /// Truth: a rotation about the fibre changes nothing. With the fibre along z, Young's modulus along z is E1.
    #[test]
    fn transverse_isotropy_is_invariant_about_the_fibre() {
        let ti = Stiffness::transversely_isotropic(167230.0, 9544.0, 5292.0, 0.272, 0.369).expect("CFRP");
        let (s, c) = 0.7f64.sin_cos();
        let about_fibre = Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c);
        assert!((ti.rotated(&about_fibre).voigt() - ti.voigt()).amax() < 1e-11 * ti.voigt().amax());
        let upright = ti.rotated(&fibre_axes(std::f64::consts::FRAC_PI_2, 0.3));
        assert!((1.0 / upright.compliance()[(2, 2)] / 167230.0 - 1.0).abs() < 1e-12);
    }

    /// Truth: constants without a positive definite strain energy are errors.
    #[test]
    fn inadmissible_constants_are_refused_by_name() {
        let refused = |change: fn(&mut Orthotropic)| {
            let mut constants = IM7;
            change(&mut constants);
            message(Stiffness::orthotropic(&constants))
        };
        assert!(refused(|c| c.e2 = -1.0).contains("E2 = -1"));
        assert!(refused(|c| c.g23 = f64::NAN).contains("G23 = NaN"));
        assert!(refused(|c| c.nu13 = f64::NAN).contains("nu13 = NaN"));
        let swapped = refused(|c| c.nu12 = 4.9);
        assert!(swapped.contains("nu12 = 4.9") && swapped.contains("nu21"), "{swapped}");
        assert!(refused(|c| (c.nu23, c.nu13, c.nu12) = (0.9, 3.0, 3.0)).contains("together"));
        assert!(message(Stiffness::isotropic(210e3, 0.5)).contains("nu = 0.5"));
        assert!(message(Stiffness::isotropic(0.0, 0.3)).contains("E = 0"));
        assert!(message(Stiffness::isotropic(f64::INFINITY, 0.3)).contains("E = inf"));
        assert!(message(Stiffness::transversely_isotropic(1e5, 1e4, 5e3, 0.3, 1.0)).contains("nu23 = 1"));
    }

    #[test]
    fn inadmissible_matrices_are_refused() {
        let mut c = *Stiffness::isotropic(210e3, 0.3).expect("steel").voigt();
        c[(0, 4)] = 7.0;
        let asymmetric = message(Stiffness::from_voigt(c));
        assert!(asymmetric.contains("C15") || asymmetric.contains("C51"), "{asymmetric}");
        c[(0, 4)] = f64::NAN;
        assert!(message(Stiffness::from_voigt(c)).contains("finite"));
        assert!(message(Stiffness::from_voigt(Matrix6::zeros())).contains("positive definite"));
        assert!(message(Stiffness::from_voigt(-Matrix6::identity())).contains("positive definite"));
    }
}
