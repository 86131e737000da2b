//! Checks that gap and steps of a plan suit a periodic frame.

use crate::error::{Error, Warning};
use crate::evolution::step::{Normal, StepKind};
use crate::frame::{ContactFrame, Grid};
use crate::geometry::format_number;
use crate::scene::plan::Plan;
use crate::simulation::failure::{AtKey, SceneError, step_key};

/// Maximum ratio of a gap step across the periodic boundary to the largest inner step.
const MAX_SEAM_STEP_RATIO: f64 = 5.0;

/// Minimum number of cells along a direction for the check of [`MAX_SEAM_STEP_RATIO`].
const MIN_CELLS_ALONG_SEAM: usize = 4;

/// Checks a periodic frame and returns notes for the user.
///
/// # Errors
/// If the frame is periodic in both directions and an approach is not less than the mean gap. Contact is complete
/// before this approach, and more pressure does not reduce the mean gap. A frame with an outline is exempt.
pub(super) fn check(plan: &Plan, frame: &ContactFrame) -> Result<Vec<Warning>, SceneError> {
    let Some(grid) = frame.grid.filter(|grid| grid.periodic != [false; 2]) else { return Ok(Vec::new()) };
    let gap = plan.gap.evaluate(frame).at("gap")?;
    // Cells outside an outline stay open, so that the contact is never complete.
    let whole = frame.grid_indices.is_none();
    if grid.periodic == [true; 2] && whole {
        refuse_complete_contact(plan, gap.iter().sum::<f64>() / gap.len() as f64)?;
    }
    let seams =
        [0, 1].into_iter().filter(|&axis| grid.periodic[axis] && grid.cells[axis] >= MIN_CELLS_ALONG_SEAM);
    let mut heights = vec![None; grid.cells[0] * grid.cells[1]];
    gap.iter().enumerate().for_each(|(cell, height)| heights[frame.grid_index(cell)] = Some(*height));
    Ok(seams.filter_map(|axis| seam_warning(plan, &grid, axis, &heights)).collect())
}

/// Refuses a positive approach that is not less than the `mean` gap. Steps after the first wear are not checked.
fn refuse_complete_contact(plan: &Plan, mean: f64) -> Result<(), SceneError> {
    let wears = plan.wear.specific_rate(plan.friction.ellipse()).is_some();
    for (index, step) in plan.steps.iter().enumerate() {
        let loaded = step.tangential.is_some() || step.spin.is_some();
        if wears && (loaded || !matches!(step.kind, StepKind::Monotone)) {
            break;
        }
        let Some(Normal::Approach(approach)) = step.normal else { continue };
        if approach > 0.0 && approach >= mean {
            let error = Error::input(format!(
                "the approach of {} is not less than the mean gap of {} at first touch, on a frame that is periodic in both directions. The contact is already complete at a smaller approach, and more pressure does not reduce the mean gap; use a smaller approach, or prescribe normal_force",
                format_number(approach),
                format_number(mean)
            ));
            return Err(SceneError { error, key: step_key(&plan.steps, index, "approach") });
        }
    }
    Ok(())
}

/// Note if the gap is discontinuous across the periodic boundary. `gap` contains the value at each grid position;
/// `None` where the frame has no cell.
fn seam_warning(plan: &Plan, grid: &Grid, axis: usize, gap: &[Option<f64>]) -> Option<Warning> {
    let ny = grid.cells[1];
    let (along, across) = (grid.cells[axis], grid.cells[1 - axis]);
    let at = |i: usize, j: usize| if axis == 0 { gap[i * ny + j] } else { gap[j * ny + i] };
    let step = |i: usize| -> f64 {
        let pairs = (0..across).filter_map(|j| Some(at((i + 1) % along, j)? - at(i, j)?));
        let (count, sum) = pairs.fold((0, 0.0), |(count, sum), step| (count + 1, sum + step * step));
        if count == 0 { 0.0 } else { sum / f64::from(count) }
    };
    let inside = (0..along - 1).map(step).fold(0.0, f64::max).sqrt();
    let seam = step(along - 1).sqrt();
    (seam > MAX_SEAM_STEP_RATIO * inside).then(|| {
        Warning::note(format!(
            "the gap is not periodic along {}: it changes by {} {} from the last cell to the first, and by {} at most between other neighbours; this discontinuity acts as an edge",
            ["x", "y"][axis],
            format_number(seam),
            plan.units.length,
            format_number(inside)
        ))
    })
}
