//! Strengths of a material.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::material::strength::PlyStrength;

/// Strengths along the material axes, all positive, for failure indices.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Strength {
    /// Tension along axis 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Xt: f64,
    /// Compression along axis 1.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Xc: f64,
    /// Tension along axis 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Yt: f64,
    /// Compression along axis 2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Yc: f64,
    /// Tension along axis 3; default Yt.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Zt: Option<f64>,
    /// Compression along axis 3; default Yc.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub Zc: Option<f64>,
    /// Shear of plane 1-2.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub S12: f64,
    /// Shear of plane 1-3; default S12.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub S13: Option<f64>,
    /// Shear of plane 2-3.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub S23: f64,
    /// Normalised Tsai-Wu interaction coefficient of axes 1 and 2; default -0.5.
    #[serde(default = "mises")]
    #[schemars(range(min = -1, max = 1))]
    pub F12: f64,
    /// Normalised Tsai-Wu interaction coefficient of axes 1 and 3; default -0.5.
    #[serde(default = "mises")]
    #[schemars(range(min = -1, max = 1))]
    pub F13: f64,
    /// Normalised Tsai-Wu interaction coefficient of axes 2 and 3; default -0.5.
    #[serde(default = "mises")]
    #[schemars(range(min = -1, max = 1))]
    pub F23: f64,
}

fn mises() -> f64 {
    -0.5
}

impl From<Strength> for PlyStrength {
    fn from(s: Strength) -> Self {
        Self {
            tension: [s.Xt, s.Yt, s.Zt.unwrap_or(s.Yt)],
            compression: [s.Xc, s.Yc, s.Zc.unwrap_or(s.Yc)],
            shear: [s.S23, s.S13.unwrap_or(s.S12), s.S12],
            interaction: [s.F23, s.F13, s.F12],
        }
    }
}
