//! Requested and reached accuracy of the results, for `summary.json`.

use serde::Serialize;

/// Requested and reached accuracy: the entry `accuracy` of `summary.json`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AccuracyRecord {
    /// Requested relative error.
    pub requested: f64,
    /// Quantities with a requested accuracy.
    #[serde(rename = "of")]
    pub quantities: Vec<&'static str>,
    /// Whether the last run reached the requested accuracy.
    pub met: bool,
    /// Reason why the refinement ended early: a failed run, a value that does not converge, or a setting without a
    /// finer level.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
    /// Results with estimated errors.
    pub results: Vec<EstimatedResult>,
    /// Converged runs. The last one gave the results.
    pub runs: Vec<RefinementRun>,
}

/// Result with its estimated error.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EstimatedResult {
    /// Name of the step at whose end the result is taken.
    pub step: String,
    /// Name of the result: a key of `summary.steps`. The name of a vector's component also contains the component
    /// ("shift x").
    pub name: &'static str,
    /// Result of the last converged run.
    pub value: f64,
    /// Estimated error: `relative` times the reference.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub estimate: Option<f64>,
    /// Estimated error divided by a reference value. The reference value is the total force for forces, the total
    /// displacement for tangential displacements, and the value itself for other results. It is at least 1 % of the
    /// largest reference value of the same result in any step. For the wear volume, it is the largest wear volume of
    /// all steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
    /// Contribution of the cell size to `relative`.
    #[serde(rename = "of_cells", skip_serializing_if = "Option::is_none")]
    pub cell_error: Option<f64>,
    /// Contribution of the increments to `relative`.
    #[serde(rename = "of_increments", skip_serializing_if = "Option::is_none")]
    pub increment_error: Option<f64>,
    /// Contribution of the wear jumps to `relative`.
    #[serde(rename = "of_jumps", skip_serializing_if = "Option::is_none")]
    pub jump_error: Option<f64>,
    /// Order of convergence in the setting that was refined last; `None` if the order is out of bounds or there are too few values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub order: Option<f64>,
    /// Richardson extrapolation, if the last three differences of the values have the same sign and about the same
    /// order.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extrapolated: Option<f64>,
}

/// Run of the refinement, with its settings.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RefinementRun {
    /// Numbers of cells of the frame, if it is a grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cells: Option<[usize; 2]>,
    /// Factor by which the numbers of increments in the scene are multiplied.
    #[serde(rename = "increments")]
    pub increment_factor: usize,
    /// Tolerance or number of the wear jumps in the first step with wear jumps.
    #[serde(rename = "jumps", skip_serializing_if = "Option::is_none")]
    pub jump_setting: Option<f64>,
    /// Computing time, s.
    pub seconds: f64,
    /// Values of the run, in the order of `results`.
    pub values: Vec<f64>,
}
