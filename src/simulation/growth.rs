//! Frames that are enlarged when wear brings the contact to their edge.
//!
//! A quarter of the cells that the frame began with are added on each side, twice at most, so that the largest frame has four times
//! the cells. Cells so far stay where they are: the state goes on in them bit by bit ([`RunCheckpoint::transfer_to`]).

use crate::body::hybrid::Unsuitable;
use crate::error::{Error, Result};
use crate::evolution::RunCheckpoint;
use crate::frame::{ContactFrame, Grid};
use crate::geometry::format_number;
use crate::omitted::OmittedWork;
use crate::scene::plan::{FramePlan, Plan};
use crate::simulation::build::Simulation;
use crate::simulation::build::bodies::{self, BODY_KEYS, ensure_grid};
use crate::simulation::build::frame_edges::continuing_axes;
use crate::simulation::build::near_field;
use crate::simulation::failure::SceneError;
use crate::simulation::mesh_motion;

/// A frame is enlarged so often at most.
pub const MAX_GROWTHS: usize = 2;

/// Difference of the gaps of a cell on two frames over the largest gap that counts as none: averages over the faces of a mesh
/// are rounded.
const GAP_TOLERANCE: f64 = 1e-9;

/// The same of what own loads of a body with a half-space do to it, over the largest of that: polynomials and quadrature are those of the frame.
const OWN_LOAD_GAP_TOLERANCE: f64 = 1e-4;

/// What the study on the larger frame goes on from.
pub struct FrameGrowth {
    /// The frame that contact has outgrown.
    pub frame: ContactFrame,
    /// Initial gap there, `[3, N]` by planes, mm.
    pub gap: Vec<f64>,
    /// Whether the near fields of the bodies there are those of half-spaces under their meshes.
    pub half_spaces: [bool; 2],
    /// The state before the jump in which it did.
    pub checkpoint: RunCheckpoint,
}

/// Why the frame of a plan, enlarged `growths` times so far, is not enlarged (once more); `None` if it is.
pub fn why_not_growable(plan: &Plan, growths: usize) -> Option<String> {
    let why = match &plan.frame {
        FramePlan::Grid { grow: false, .. } => "frame.grow is false: set it to true and go on with --resume",
        FramePlan::Grid { outline: Some(_), .. } => "a frame with an outline is not enlarged",
        FramePlan::Grid { periodic, .. } if *periodic != [false; 2] => "a periodic frame is not enlarged",
        FramePlan::Mesh { .. } => {
            "a frame of the faces of a mesh is not enlarged: mesh a larger contact group"
        }
        FramePlan::Grid { .. } if growths >= MAX_GROWTHS => {
            "the frame has four times the cells it began with, and is not enlarged again"
        }
        FramePlan::Grid { .. } => return None,
    };
    Some(why.to_owned())
}

/// The frame of a plan after it was enlarged `growths` times.
///
/// # Errors
/// If it is none that can be enlarged, or the cells do not fit into the memory.
pub fn grown_frame(plan: &Plan, growths: usize) -> std::result::Result<ContactFrame, SceneError> {
    let start = bodies::contact_frame(plan)?;
    if growths == 0 {
        return Ok(start);
    }
    let axes = continuing_axes(plan, &start)?;
    let frame = enlarged(plan, (&start, axes), growths)
        .map_err(|error| SceneError { error, key: "frame.grow".to_owned() })?;
    bodies::with_ends(plan, frame)
}

/// The frame of `start` with more cells along the `axes` along which the bodies continue.
fn enlarged(plan: &Plan, (start, axes): (&ContactFrame, [bool; 2]), growths: usize) -> Result<ContactFrame> {
    let Some(grid) = start.whole_grid() else { return Err(no_grid()) };
    let more_cells = |n: usize| if growths < MAX_GROWTHS { n.div_ceil(4) } else { n / 2 };
    let more = [0, 1].map(|axis| if axes[axis] { more_cells(grid.cells[axis]) } else { 0 });
    if (0..2).any(|axis| axes[axis] && more[axis] == 0) {
        return Err(Error::input("a frame of one cell across is not enlarged"));
    }
    ensure_grid(plan, [0, 1].map(|axis| grid.cells[axis].saturating_add(2 * more[axis])))?;
    start.enlarged(more)?.ok_or_else(no_grid)
}

fn no_grid() -> Error {
    Error::input("only a grid frame without an outline that does not repeat itself is enlarged")
}

impl FrameGrowth {
    /// Refuses a larger `frame` under which a body has no place for the half-space that it has had so far.
    ///
    /// # Errors
    /// If that is so, or the body is not sound.
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

    /// The same state on the larger frame of `study`, with a note, and the numbers of the cells there, `[N]`.
    ///
    /// # Errors
    /// If a near field is no longer that of a half-space, or has become that; if the surfaces have another gap in the cells so
    /// far, or come nearer beyond them; if a body cannot be solved.
    pub fn transfer_to(self, plan: &Plan, study: &Simulation) -> Result<(RunCheckpoint, Vec<usize>)> {
        let model = study.model();
        for (index, key) in BODY_KEYS.into_iter().enumerate() {
            let record = study.near_fields.iter().find(|record| record.body == index + 1);
            if study.has_half_space_near_field(index + 1) != self.half_spaces[index] {
                let reason = record.and_then(|record| record.reason.as_deref());
                let why = reason
                    .map_or_else(|| "so far that of its mesh, to that of a half-space".to_owned(), no_place);
                return Err(other_near_field(key, &why));
            }
        }
        let (Some(before), Some(now)) = (self.frame.grid, model.frame.grid) else { return Err(no_grid()) };
        let places = before.indices_in(&now);
        ensure_same_gap(
            &self.gap,
            &model.initial_gap,
            &places,
            OWN_LOAD_GAP_TOLERANCE * study.max_gap_of_own_loads(),
        )?;
        let mut snapshot = self.checkpoint.transfer_to(&places, model, &plan.steps, None)?;
        snapshot.add_warning(note(plan, &snapshot, &before, &now));
        Ok((snapshot, places))
    }
}

/// That a body would have another near field on a larger frame, where the state would be none of its.
fn other_near_field(key: &str, why: &str) -> Error {
    Error::input(format!(
        "the larger frame would change the near field of {key}, {why}; begin with a frame of the final size, or mesh a larger body"
    ))
}

fn no_place(why: &str) -> String {
    format!("which has no place for that of a half-space there: {why}")
}

/// Whether gaps are the same to rounding and an `uncertainty`, mm.
fn ensure_same_gap(before: &[f64], now: &[f64], places: &[usize], uncertainty: f64) -> Result<()> {
    let [n_before, n] = [before.len() / 3, now.len() / 3];
    let largest = before.iter().fold(0.0_f64, |largest, gap| largest.max(gap.abs()));
    let most = GAP_TOLERANCE * largest + uncertainty;
    for plane in 0..3 {
        for (cell, &place) in places.iter().enumerate() {
            let difference = now[plane * n + place] - before[plane * n_before + cell];
            if difference.abs() > most {
                return Err(Error::input(
                    "on a larger frame the surfaces first touch elsewhere, and `approach` would count from there",
                ));
            }
        }
    }
    let nearest = |gap: &[f64]| gap.iter().copied().fold(f64::INFINITY, f64::min);
    if nearest(&now[2 * n..]) < nearest(&before[2 * n_before..]) - most {
        return Err(Error::input("beyond the frame the surfaces are nearer to each other than within it"));
    }
    Ok(())
}

/// Says when the frame grew, and to what.
fn note(plan: &Plan, snapshot: &RunCheckpoint, before: &Grid, now: &Grid) -> String {
    let after = mesh_motion::position_in_run(plan, snapshot);
    let [x, y] = now.half_width().map(format_number);
    format!(
        "wear brought the contact to the edge of the frame{after}; the frame was enlarged from {} x {} to {} x {} cells, half_width = \
         [{x}, {y}]: where that is known before, a frame of this size from the start saves the work done twice",
        before.cells[0], before.cells[1], now.cells[0], now.cells[1]
    )
}

/// The entry of the ledger for the cells that a frame may get.
pub(super) fn omitted_work(plan: &Plan) -> Option<OmittedWork> {
    let wears = plan.steps.iter().any(|step| step.cycles.is_some() && plan.has_wear(step));
    (wears && why_not_growable(plan, 0).is_none()).then(|| {
        let why = "they join when wear brings the contact to its edge (frame.grow)";
        OmittedWork::new(None, "cells beyond the frame", why)
    })
}
