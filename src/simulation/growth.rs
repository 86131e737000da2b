//! Continues a run on a larger frame when wear brings the contact to the edge of its frame. Existing cells keep their
//! tractions and wear depths ([`RunCheckpoint::transfer_to`]).

use crate::body::hybrid::Unsuitable;
use crate::error::{Error, Result};
use crate::evolution::RunCheckpoint;
use crate::frame::{ContactFrame, Grid};
use crate::geometry::format_number;
use crate::scene::plan::Plan;
use crate::simulation::build::Simulation;
use crate::simulation::build::near_field;
use crate::simulation::failure::SceneError;
use crate::simulation::grown_frame::no_grid;
use crate::simulation::mesh_motion;
use crate::simulation::plan_bodies::BODY_KEYS;

/// Largest change of a cell's gap that an enlargement of the frame may cause, relative to the largest gap. Averages
/// over mesh faces change by rounding.
const GAP_TOLERANCE: f64 = 1e-9;

/// Additional tolerance of bodies with half-space near fields, relative to the largest gap due to their applied loads.
/// Polynomials and quadrature points approximate this gap, and depend on the frame.
const OWN_LOAD_GAP_TOLERANCE: f64 = 1e-4;

/// State from which a run continues on a larger frame.
pub struct FrameGrowth {
    /// Frame before the enlargement.
    pub frame: ContactFrame,
    /// Gap on `frame` with all loads at amplitude 1, `[3, N]` by components, mm.
    pub gap: Vec<f64>,
    /// Whether the near field of each body on `frame` is a half-space.
    pub half_spaces: [bool; 2],
    /// State before the wear jump that would bring the contact to the edge.
    pub checkpoint: RunCheckpoint,
}

impl Simulation<'_> {
    /// Keeps the data to continue from `checkpoint` on a larger frame. Bodies and operators are dropped.
    pub fn into_frame_growth(self, checkpoint: RunCheckpoint) -> FrameGrowth {
        let half_spaces = [1, 2].map(|body| self.has_half_space_near_field(body));
        let model = self.into_model();
        let gap = model.gap_of_full_loads();
        FrameGrowth { frame: model.frame, gap, half_spaces, checkpoint }
    }
}

impl FrameGrowth {
    /// Refuses a larger `frame` on which a body no longer admits its half-space near field.
    ///
    /// # Errors
    /// If a body admits no half-space on `frame`, or its mesh is invalid.
    pub fn ensure_half_spaces_fit(
        &self,
        plan: &Plan,
        frame: &ContactFrame,
    ) -> std::result::Result<(), SceneError> {
        for (index, key) in BODY_KEYS.into_iter().enumerate() {
            let Some(fe) = plan.bodies[index].as_fe().filter(|_| self.half_spaces[index]) else { continue };
            if let Err(Unsuitable(why)) = near_field::fit_half_space(plan, fe, index, frame)? {
                return Err(SceneError {
                    error: other_near_field(key, &no_place(&why)),
                    key: "frame.grow".to_owned(),
                });
            }
        }
        Ok(())
    }

    /// Transfers the state to the larger frame of `simulation`, and adds a note. Also returns the new indices of the
    /// old cells, `[N]`.
    ///
    /// # Errors
    /// * The near field of a body changes to or from a half-space.
    /// * The gap of an old cell changes, or a new cell has a smaller gap than all old cells.
    /// * A frame is no grid.
    /// * A body cannot be solved.
    pub fn transfer_to(self, plan: &Plan, simulation: &Simulation) -> Result<(RunCheckpoint, Vec<usize>)> {
        let model = simulation.model();
        for (index, key) in BODY_KEYS.into_iter().enumerate() {
            let record = simulation.report.near_fields.iter().find(|record| record.body == index + 1);
            if simulation.has_half_space_near_field(index + 1) != self.half_spaces[index] {
                let reason = record.and_then(|record| record.reason.as_deref());
                let why = reason
                    .map_or_else(|| "it would change from the mesh to a half-space".to_owned(), no_place);
                return Err(other_near_field(key, &why));
            }
        }
        let (Some(before), Some(now)) = (self.frame.grid, model.frame.grid) else { return Err(no_grid()) };
        let places = before.indices_in(&now);
        ensure_same_gap(
            &self.gap,
            &model.gap_of_full_loads(),
            &places,
            OWN_LOAD_GAP_TOLERANCE * simulation.max_gap_of_applied_loads(),
        )?;
        let mut checkpoint = self.checkpoint.transfer_to(&places, model, &plan.steps, None)?;
        checkpoint.add_warning(note(plan, &checkpoint, &before, &now));
        Ok((checkpoint, places))
    }
}

fn other_near_field(key: &str, why: &str) -> Error {
    Error::input(format!(
        "the larger frame would change the near field of {key}: {why}; start with a frame of the final size, or mesh a larger body"
    ))
}

fn no_place(why: &str) -> String {
    format!("the body does not allow a half-space there, because {why}")
}

/// Refuses an enlargement that changes the gap of an old cell by more than rounding plus `uncertainty` (mm). Also
/// refuses new cells whose gap is smaller than the gaps of all old cells.
///
/// `before` and `now` are the gaps on both frames, `[3, N]`. `places` are the new indices of the old cells.
fn ensure_same_gap(before: &[f64], now: &[f64], places: &[usize], uncertainty: f64) -> Result<()> {
    let [n_before, n] = [before.len() / 3, now.len() / 3];
    let largest = before.iter().fold(0.0_f64, |largest, gap| largest.max(gap.abs()));
    let most = GAP_TOLERANCE * largest + uncertainty;
    for plane in 0..3 {
        for (cell, &place) in places.iter().enumerate() {
            let difference = now[plane * n + place] - before[plane * n_before + cell];
            if difference.abs() > most {
                return Err(Error::input(
                    "on a larger frame the surfaces first touch at another point, and `approach` would be measured from there",
                ));
            }
        }
    }
    let nearest = |gap: &[f64]| gap.iter().copied().fold(f64::INFINITY, f64::min);
    if nearest(&now[2 * n..]) < nearest(&before[2 * n_before..]) - most {
        return Err(Error::input("outside the frame the surfaces are closer to each other than inside it"));
    }
    Ok(())
}

fn note(plan: &Plan, checkpoint: &RunCheckpoint, before: &Grid, now: &Grid) -> String {
    let after = mesh_motion::position_in_run(plan, checkpoint);
    let [x, y] = now.half_width().map(format_number);
    format!(
        "the contact reached the edge of the frame{after}; the frame was enlarged from {} x {} to {} x {} cells, half_width = [{x}, {y}]. Starting with a frame of this size avoids repeated work",
        before.cells[0], before.cells[1], now.cells[0], now.cells[1]
    )
}
