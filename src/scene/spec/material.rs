//! `[materials.NAME]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::frame::Positive;
use super::strength::Strength;
use crate::material::strength::MaterialStrength;

/// An elastic material; `model` selects its kind of anisotropy and its constants.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(tag = "model", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(non_snake_case, missing_docs)]
pub enum Material {
    /// Isotropic elasticity with two constants.
    Isotropic {
        /// Young's modulus.
        E: Positive,
        /// Poisson's ratio, between -1 and 0.5.
        nu: f64,
        /// Coefficient of thermal expansion, 1/K.
        alpha: Option<f64>,
        /// Yield stress, for the von Mises failure index.
        #[serde(rename = "yield")]
        yield_stress: Option<Positive>,
    },
    /// Five constants. The material is isotropic in the plane across axis 1 (the fibre): G23 = E2 / (2 (1 + nu23)).
    TransverselyIsotropic {
        /// Young's modulus along the fibre.
        E1: Positive,
        /// Young's modulus across the fibre.
        E2: Positive,
        /// Shear modulus in planes that contain the fibre.
        G12: Positive,
        /// Poisson's ratio: contraction across the fibre under tension along it.
        nu12: f64,
        /// Poisson's ratio in the plane across the fibre.
        nu23: f64,
        /// Coefficient of thermal expansion along the fibre, 1/K.
        alpha1: Option<f64>,
        /// Coefficient of thermal expansion across the fibre, 1/K.
        alpha2: Option<f64>,
        /// Strengths, for failure indices.
        strength: Option<Strength>,
    },
    /// Nine constants. Axis 1 is along the fibre. nu_ij is the contraction along j under tension along i.
    Orthotropic {
        /// Young's modulus along axis 1.
        E1: Positive,
        /// Young's modulus along axis 2.
        E2: Positive,
        /// Young's modulus along axis 3.
        E3: Positive,
        /// Shear modulus of plane 1-2.
        G12: Positive,
        /// Shear modulus of plane 1-3.
        G13: Positive,
        /// Shear modulus of plane 2-3.
        G23: Positive,
        /// Poisson's ratio: contraction along axis 2 under tension along axis 1.
        nu12: f64,
        /// Poisson's ratio: contraction along axis 3 under tension along axis 1.
        nu13: f64,
        /// Poisson's ratio: contraction along axis 3 under tension along axis 2.
        nu23: f64,
        /// Coefficient of thermal expansion along axis 1, 1/K.
        alpha1: Option<f64>,
        /// Coefficient of thermal expansion along axis 2, 1/K.
        alpha2: Option<f64>,
        /// Coefficient of thermal expansion along axis 3, 1/K.
        alpha3: Option<f64>,
        /// Strengths, for failure indices.
        strength: Option<Strength>,
    },
    /// General anisotropy: all constants as a symmetric 6 x 6 stiffness matrix.
    Stiffness {
        /// Stiffness matrix, rows and columns in the order 11 22 33 23 13 12, engineering shear strains.
        C: Box<[[f64; 6]; 6]>,
        /// Coefficient of thermal expansion along axis 1, 1/K.
        alpha1: Option<f64>,
        /// Coefficient of thermal expansion along axis 2, 1/K.
        alpha2: Option<f64>,
        /// Coefficient of thermal expansion along axis 3, 1/K.
        alpha3: Option<f64>,
        /// Strengths, for failure indices.
        strength: Option<Strength>,
    },
}

impl Material {
    /// Keys of the coefficients of thermal expansion along axes 1, 2 and 3, with their values.
    pub(crate) fn thermal_expansions(&self) -> [(&'static str, Option<f64>); 3] {
        match *self {
            Self::Isotropic { alpha, .. } => [("alpha", alpha); 3],
            Self::TransverselyIsotropic { alpha1, alpha2, .. } => {
                [("alpha1", alpha1), ("alpha2", alpha2), ("alpha2", alpha2)]
            }
            Self::Orthotropic { alpha1, alpha2, alpha3, .. }
            | Self::Stiffness { alpha1, alpha2, alpha3, .. } => {
                [("alpha1", alpha1), ("alpha2", alpha2), ("alpha3", alpha3)]
            }
        }
    }

    /// Strength of the material, if given.
    pub(crate) fn strength_limit(&self) -> Option<MaterialStrength> {
        match self {
            Self::Isotropic { yield_stress, .. } => {
                yield_stress.map(|limit| MaterialStrength::Yield(limit.0))
            }
            Self::TransverselyIsotropic { strength, .. }
            | Self::Orthotropic { strength, .. }
            | Self::Stiffness { strength, .. } => {
                strength.map(|strength| MaterialStrength::Ply(strength.into()))
            }
        }
    }
}
