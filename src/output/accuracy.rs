//! How accurate the results are, where an accuracy was asked for.

use serde::Serialize;

/// What was asked for and reached: the entry `accuracy` of `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AccuracyRecord {
    /// The relative error that was asked for.
    pub requested: f64,
    /// Of what.
    #[serde(rename = "of")]
    pub quantities: Vec<&'static str>,
    /// Whether all estimates are below it.
    pub met: bool,
    /// Why there was nothing finer, if something failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// The results with their estimated errors.
    pub results: Vec<EstimatedResult>,
    /// The runs that converged, the last one that of the results.
    pub runs: Vec<RefinementRun>,
}

/// A result with its estimated error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimatedResult {
    /// At the end of this step.
    pub step: String,
    /// What it is, as in `steps`.
    pub name: &'static str,
    /// The result of the last run that converged.
    pub value: f64,
    /// Its estimated error.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<f64>,
    /// The same relative: of forces to the length of the force, of shifts to that of the motion, of others to themselves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
    /// The part of the cells.
    #[serde(rename = "of_cells", skip_serializing_if = "Option::is_none")]
    pub cell_error: Option<f64>,
    /// The part of the increments.
    #[serde(rename = "of_increments", skip_serializing_if = "Option::is_none")]
    pub increment_error: Option<f64>,
    /// The part of the jumps.
    #[serde(rename = "of_jumps", skip_serializing_if = "Option::is_none")]
    pub jump_error: Option<f64>,
    /// The order by which it converges with what was refined last, if its changes show one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
    /// Its limit (Richardson), where its last changes show one order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrapolated: Option<f64>,
}

/// A run of the search.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RefinementRun {
    /// Cells of the frame, where it is a grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<[usize; 2]>,
    /// How many times the increments of the scene.
    #[serde(rename = "increments")]
    pub increment_factor: usize,
    /// Tolerance or number of the jumps over cycles.
    #[serde(rename = "jumps", skip_serializing_if = "Option::is_none")]
    pub jump_setting: Option<f64>,
    /// Its time.
    pub seconds: f64,
    /// Its results, in the order of `results`.
    pub values: Vec<f64>,
}
