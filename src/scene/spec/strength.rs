//! Strengths of a material.

use schemars::JsonSchema;
use serde::Deserialize;

use super::frame::Positive;
use crate::material::strength::PlyStrength;

/// Strengths along the material axes, all positive, for failure indices.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case)]
pub struct Strength {
    /// Tensile strength along axis 1.
    pub Xt: Positive,
    /// Compressive strength along axis 1.
    pub Xc: Positive,
    /// Tensile strength along axis 2.
    pub Yt: Positive,
    /// Compressive strength along axis 2.
    pub Yc: Positive,
    /// Tensile strength along axis 3; default `Yt`.
    pub Zt: Option<Positive>,
    /// Compressive strength along axis 3; default `Yc`.
    pub Zc: Option<Positive>,
    /// Shear strength in the plane 1-2.
    pub S12: Positive,
    /// Shear strength in the plane 1-3; default `S12`.
    pub S13: Option<Positive>,
    /// Shear strength in the plane 2-3.
    pub S23: Positive,
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
            tension: [s.Xt, s.Yt, s.Zt.unwrap_or(s.Yt)].map(|limit| limit.0),
            compression: [s.Xc, s.Yc, s.Zc.unwrap_or(s.Yc)].map(|limit| limit.0),
            shear: [s.S23, s.S13.unwrap_or(s.S12), s.S12].map(|limit| limit.0),
            interaction: [s.F23, s.F13, s.F12],
        }
    }
}
