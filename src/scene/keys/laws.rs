//! `[friction]` and `[wear]`.

use schemars::JsonSchema;
use serde::Deserialize;

use super::body::Fibre;

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
    /// Fibre-reinforced plastic: an ellipse along the fibre, interpolated with its tilt.
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
        /// Body whose fibre counts, 1 or 2; required if both have one.
        #[serde(default)]
        #[schemars(with = "u8", range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction that counts instead of a body's.
        #[serde(default)]
        #[schemars(with = "Fibre")]
        fibre: Option<Fibre>,
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
    /// Volume i per load and sliding distance.
    Archard {
        /// Wear intensity, 1/stress.
        #[schemars(range(min = 0))]
        i: f64,
        /// Fraction of the worn depth taken from body 1.
        #[serde(default = "one")]
        #[schemars(range(min = 0, max = 1))]
        share: f64,
        /// Integration of wear over a cycle jump.
        #[serde(default)]
        integrator: Integrator,
        /// Error of the worn depth over the largest worn depth, where the number of jumps is not given.
        #[serde(default)]
        tolerance: Tolerance,
        /// Whether explicit jumps may be longer than is stable.
        #[serde(default)]
        beyond_critical: bool,
        /// Worn depth over the size of the elements beyond which meshes move with wear; they do not if it is absent.
        #[serde(default)]
        #[schemars(with = "MoveMesh")]
        move_mesh: Option<MoveMesh>,
    },
    /// Intensities along two axes.
    Orthotropic {
        /// Wear intensity along the first axis, 1/stress.
        #[schemars(range(min = 0))]
        i1: f64,
        /// Wear intensity along the second axis, 1/stress.
        #[schemars(range(min = 0))]
        i2: f64,
        /// Angle of the first axis from +x towards +y, degrees.
        #[serde(default)]
        angle: f64,
        /// Fraction of the worn depth taken from body 1.
        #[serde(default = "one")]
        #[schemars(range(min = 0, max = 1))]
        share: f64,
        /// Integration of wear over a cycle jump.
        #[serde(default)]
        integrator: Integrator,
        /// Error of the worn depth over the largest worn depth, where the number of jumps is not given.
        #[serde(default)]
        tolerance: Tolerance,
        /// Whether explicit jumps may be longer than is stable.
        #[serde(default)]
        beyond_critical: bool,
        /// Worn depth over the size of the elements beyond which meshes move with wear; they do not if it is absent.
        #[serde(default)]
        #[schemars(with = "MoveMesh")]
        move_mesh: Option<MoveMesh>,
    },
    /// Fibre-reinforced plastic: intensities along the fibre, interpolated with its tilt.
    #[allow(non_snake_case)]
    Frp {
        /// Wear intensity along fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_L: f64,
        /// Wear intensity across fibres in the surface, 1/stress.
        #[schemars(range(min = 0))]
        i_T: f64,
        /// Wear intensity for fibres along the normal, 1/stress.
        #[schemars(range(min = 0))]
        i_N: f64,
        /// Body whose fibre counts, 1 or 2; default that of the friction law.
        #[serde(default)]
        #[schemars(with = "u8", range(min = 1, max = 2))]
        body: Option<u8>,
        /// Fibre direction that counts instead of a body's; default that of the friction law.
        #[serde(default)]
        #[schemars(with = "Fibre")]
        fibre: Option<Fibre>,
        /// Fraction of the worn depth taken from body 1.
        #[serde(default = "one")]
        #[schemars(range(min = 0, max = 1))]
        share: f64,
        /// Integration of wear over a cycle jump.
        #[serde(default)]
        integrator: Integrator,
        /// Error of the worn depth over the largest worn depth, where the number of jumps is not given.
        #[serde(default)]
        tolerance: Tolerance,
        /// Whether explicit jumps may be longer than is stable.
        #[serde(default)]
        beyond_critical: bool,
        /// Worn depth over the size of the elements beyond which meshes move with wear; they do not if it is absent.
        #[serde(default)]
        #[schemars(with = "MoveMesh")]
        move_mesh: Option<MoveMesh>,
    },
    /// Volume k per friction energy.
    Energy {
        /// Worn volume per dissipated energy, 1/stress.
        #[schemars(range(min = 0))]
        k: f64,
        /// Fraction of the worn depth taken from body 1.
        #[serde(default = "one")]
        #[schemars(range(min = 0, max = 1))]
        share: f64,
        /// Integration of wear over a cycle jump.
        #[serde(default)]
        integrator: Integrator,
        /// Error of the worn depth over the largest worn depth, where the number of jumps is not given.
        #[serde(default)]
        tolerance: Tolerance,
        /// Whether explicit jumps may be longer than is stable.
        #[serde(default)]
        beyond_critical: bool,
        /// Worn depth over the size of the elements beyond which meshes move with wear; they do not if it is absent.
        #[serde(default)]
        #[schemars(with = "MoveMesh")]
        move_mesh: Option<MoveMesh>,
    },
}

/// Integration of wear over a cycle jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Implicit, second order, damps whatever the size of the jump.
    #[default]
    Sdirk2,
    /// Implicit, first order.
    BackwardEuler,
    /// Explicit, first order; stable for small jumps only.
    Explicit,
}

/// Error of the worn depth over the largest worn depth, default 1e-3.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct Tolerance(#[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))] pub f64);

impl Default for Tolerance {
    fn default() -> Self {
        Self(1e-3)
    }
}

/// Worn depth over the size of the elements.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(inline)]
pub struct MoveMesh(#[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.5))] pub f64);

fn one() -> f64 {
    1.0
}
