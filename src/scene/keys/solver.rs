//! `[solver]` and `[output]`.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::results::fields::FieldKind;

/// How the contact problem is solved.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Solver {
    /// Largest natural residual of the certificate, relative to the peak pressure.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: f64,
    /// Iteration.
    pub method: Method,
    /// Largest number of iterations per increment.
    #[schemars(range(min = 1))]
    pub max_iterations: usize,
    /// How finite-element bodies are tied to the frame.
    pub coupling: Coupling,
    /// Whether work that the scene does not need is skipped; the answers are the same either way.
    pub skip: bool,
}

impl Default for Solver {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            method: Method::Auto,
            max_iterations: 20_000,
            coupling: Coupling::Schur,
            skip: true,
        }
    }
}

/// Iterations for the contact problem.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The fastest that suits the scene.
    Auto,
    /// Barzilai-Borwein projection.
    Bb,
    /// Uzawa predictor-corrector with radial return.
    Uzawa,
}

/// Ways to tie a finite-element body to the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Coupling {
    /// Condensed on the frame once (Schur complement).
    Schur,
    /// The assembled block system, solved anew for every traction: slow, the reference.
    Block,
}

/// What is written besides summary.json and history.csv.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Kinds of fields; [] writes none.
    pub fields: Vec<FieldKind>,
}

impl Default for Output {
    fn default() -> Self {
        Self { fields: vec![FieldKind::Vtu, FieldKind::Svg] }
    }
}
