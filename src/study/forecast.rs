//! What a run of a plan would compute, skip and need, without doing it.

use crate::scene::plan::Plan;

use super::failure::Failure;

/// Expectations of a run.
#[derive(Debug, Clone)]
pub struct Forecast {
    /// Cells of the frame.
    pub n_cells: usize,
}

/// The forecast of a plan.
///
/// # Errors
/// If a mesh, support, material or frame of the plan is wrong.
pub fn forecast(plan: &Plan) -> Result<Forecast, Failure> {
    Ok(Forecast { n_cells: super::bodies::frame(plan)?.n_cells() })
}
