//! `[friction]` and `[wear]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::UniformFibre;
use crate::evolution::step::Integrator;

/// The friction law.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Friction {
    /// No friction.
    #[default]
    None,
    /// The same coefficient in all directions.
    Coulomb {
        /// Coefficient.
        #[schemars(range(min = 0))]
        mu: f64,
    },
    /// An ellipse of admissible tangential tractions.
    Elliptic {
        /// Coefficient along the first axis.
        #[schemars(range(min = 0))]
        mu1: f64,
        /// Coefficient along the second axis.
        #[schemars(range(min = 0))]
        mu2: f64,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
    },
    /// Fibre-reinforced plastic: friction ellipse aligned with the fibre, coefficients interpolated with the fibre tilt.
    #[allow(non_snake_case)]
    Frp {
        /// Coefficient along fibres in the surface.
        #[schemars(range(min = 0))]
        mu_L: f64,
        /// Coefficient across fibres in the surface.
        #[schemars(range(min = 0))]
        mu_T: f64,
        /// Coefficient for fibres along the normal.
        #[schemars(range(min = 0))]
        mu_N: f64,
        /// Body whose fibre direction is used, 1 or 2; required if both have one.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction to use instead of a body's.
        fibre: Option<UniformFibre>,
    },
}

/// The wear law with its share and time integration.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Wear {
    /// No wear.
    #[default]
    None,
    /// Archard: wear volume = i x normal load x sliding distance.
    Archard {
        /// Specific wear rate: wear volume per load and sliding distance, 1/stress (mm3/(N mm) = 1/MPa).
        #[schemars(range(min = 0))]
        i: f64,
        #[serde(flatten)]
        integration: WearIntegration,
    },
    /// Specific wear rates along two axes.
    Orthotropic {
        /// Specific wear rate along the first axis, 1/stress.
        #[schemars(range(min = 0))]
        i1: f64,
        /// Specific wear rate along the second axis, 1/stress.
        #[schemars(range(min = 0))]
        i2: f64,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        #[serde(flatten)]
        integration: WearIntegration,
    },
    /// Fibre-reinforced plastic: specific wear rates along and across the fibre, interpolated with the fibre tilt.
    #[allow(non_snake_case)]
    Frp {
        /// Specific wear rate along fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_L: f64,
        /// Specific wear rate across fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_T: f64,
        /// Specific wear rate for fibres along the normal, 1/stress.
        #[schemars(range(min = 0))]
        i_N: f64,
        /// Body whose fibre direction is used, 1 or 2; default that of the friction law.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction to use instead of a body's; default that of the friction law.
        fibre: Option<UniformFibre>,
        #[serde(flatten)]
        integration: WearIntegration,
    },
    /// Wear volume = k x dissipated friction energy.
    Energy {
        /// Wear volume per dissipated friction energy, 1/stress.
        #[schemars(range(min = 0))]
        k: f64,
        #[serde(flatten)]
        integration: WearIntegration,
    },
}

/// How wear is divided between the bodies and integrated over time, the same for all laws.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(default)]
pub struct WearIntegration {
    /// Fraction of the wear depth assigned to body 1; the rest goes to body 2.
    #[schemars(range(min = 0, max = 1))]
    pub share: f64,
    /// Time integration of wear over a jump of many cycles.
    pub integrator: Integrator,
    /// Tolerance of the estimated error of the wear depth, relative to the largest wear depth; controls the length of jumps if `jumps` is not given.
    pub tolerance: WearTolerance,
    /// Wear depth, as a fraction of the element size, at which meshes are moved to the worn surface and the stiffness is recomputed. Default: meshes do not move.
    pub move_mesh: Option<MeshMotionThreshold>,
}

impl Default for WearIntegration {
    fn default() -> Self {
        Self {
            share: 1.0,
            integrator: Integrator::default(),
            tolerance: WearTolerance::default(),
            move_mesh: None,
        }
    }
}

/// Estimated error of the wear depth relative to the largest wear depth; default 1e-3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct WearTolerance(#[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))] pub f64);

impl Default for WearTolerance {
    fn default() -> Self {
        Self(1e-3)
    }
}

/// Wear depth as a fraction of the element size.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct MeshMotionThreshold(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.5))] pub f64);
