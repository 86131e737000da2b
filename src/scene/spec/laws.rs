//! `[friction]` and `[wear]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::UniformFibre;
use crate::evolution::step::Integrator;

/// Friction law.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(tag = "law", rename_all = "kebab-case", deny_unknown_fields)]
#[allow(missing_docs)]
pub enum Friction {
    /// No friction.
    #[default]
    None,
    /// Coulomb friction: the same coefficient in all directions.
    Coulomb {
        /// Friction coefficient.
        #[schemars(range(min = 0))]
        mu: f64,
    },
    /// Elliptic friction: tangential tractions are limited by an ellipse with semi-axes mu1 p and mu2 p, p the pressure.
    Elliptic {
        /// Friction coefficient along the first axis.
        #[schemars(range(min = 0))]
        mu1: f64,
        /// Friction coefficient along the second axis.
        #[schemars(range(min = 0))]
        mu2: f64,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
    },
    /// Fibre-reinforced plastic: friction ellipse aligned with the fibre. The coefficients are interpolated over the
    /// fibre tilt.
    #[allow(non_snake_case)]
    Frp {
        /// Friction coefficient along the fibre, for fibres in the surface.
        #[schemars(range(min = 0))]
        mu_L: f64,
        /// Friction coefficient across the fibre, for fibres in the surface.
        #[schemars(range(min = 0))]
        mu_T: f64,
        /// Friction coefficient for fibres along the normal.
        #[schemars(range(min = 0))]
        mu_N: f64,
        /// Body whose fibre direction is used, 1 or 2; required if both bodies have a fibre and `fibre` is not given.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction of the law; default: the fibre direction of the body.
        fibre: Option<UniformFibre>,
    },
}

/// Wear law, division of the wear depth between the bodies, and time integration of wear.
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
    /// Orthotropic law: specific wear rates for sliding along two perpendicular axes.
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
    /// Fibre-reinforced plastic: specific wear rates along and across the fibre. The rates are interpolated over the
    /// fibre tilt.
    #[allow(non_snake_case)]
    Frp {
        /// Specific wear rate along the fibre, for fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_L: f64,
        /// Specific wear rate across the fibre, for fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_T: f64,
        /// Specific wear rate for fibres along the normal, 1/stress.
        #[schemars(range(min = 0))]
        i_N: f64,
        /// Body whose fibre direction is used, 1 or 2; default: the body of friction law "frp", else the only body with a fibre.
        #[schemars(range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction of the law. Default: the fibre of `body` if given, else the fibre direction of friction law
        /// "frp".
        fibre: Option<UniformFibre>,
        #[serde(flatten)]
        integration: WearIntegration,
    },
    /// Energy law: wear volume = k x dissipated friction energy.
    Energy {
        /// Wear volume per dissipated friction energy, 1/stress.
        #[schemars(range(min = 0))]
        k: f64,
        #[serde(flatten)]
        integration: WearIntegration,
    },
}

/// Division of the wear depth between the bodies, and time integration of wear. The keys are the same for all laws.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(default)]
pub struct WearIntegration {
    /// Fraction of the wear depth assigned to body 1; the rest goes to body 2.
    #[schemars(range(min = 0, max = 1))]
    pub share: f64,
    /// Time integration of wear over a wear jump; default "sdirk2".
    pub integrator: Integrator,
    /// Tolerance of the estimated wear depth error (root mean square), relative to the largest wear depth; default
    /// 1e-3.
    ///
    /// The tolerance sets the length of wear jumps if `jumps` is not given. It also sets the accuracy of resolved
    /// cycles, which correct the wear of cycles with few increments (see `increments`).
    pub tolerance: WearTolerance,
    /// Meshes move to the worn surface when the wear depth since the last move reaches this fraction of the element
    /// height.
    ///
    /// The stiffness is recomputed after each move. Needs a finite-element body that wears. Default: meshes do not
    /// move.
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

/// Tolerance of the estimated wear depth error, relative to the largest wear depth; default 1e-3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct WearTolerance(#[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))] pub f64);

impl Default for WearTolerance {
    fn default() -> Self {
        Self(1e-3)
    }
}

/// Wear depth as a fraction of the element height.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct MeshMotionThreshold(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.5))] pub f64);
