//! Frames that are enlarged when wear brings the contact to their edge.
//!
//! An enlargement adds cells at both ends of each axis along which both bodies continue beyond the frame. At each end
//! it adds a quarter of the initial number of cells along the axis. After two enlargements, the frame thus has twice
//! the initial cells along an axis, and up to four times the initial cells in total.

use crate::error::{Error, Result};
use crate::frame::ContactFrame;
use crate::omitted::OmittedWork;
use crate::scene::plan::{FramePlan, Plan};
use crate::simulation::build::contact_frame::{contact_frame, ensure_grid, with_ends};
use crate::simulation::build::frame_edges::continuing_axes;
use crate::simulation::failure::SceneError;

/// Maximum number of enlargements of a frame.
pub const MAX_GROWTHS: usize = 2;

/// Reason why the frame of a plan is not enlarged again after `growths` enlargements; `None` if it can be enlarged.
pub fn why_not_growable(plan: &Plan, growths: usize) -> Option<String> {
    let why = match &plan.frame {
        FramePlan::Grid { grow: false, .. } => "frame.grow is false: set it to true and resume with --resume",
        FramePlan::Grid { outline: Some(_), .. } => "a frame with an outline is not enlarged",
        FramePlan::Grid { periodic, .. } if *periodic != [false; 2] => "a periodic frame is not enlarged",
        FramePlan::Mesh { .. } => {
            "a frame of the faces of a mesh is not enlarged: mesh a larger contact group"
        }
        FramePlan::Grid { .. } if growths >= MAX_GROWTHS => {
            "the frame was enlarged twice and is not enlarged again"
        }
        FramePlan::Grid { .. } => return None,
    };
    Some(why.to_owned())
}

/// Frame of a plan after `growths` enlargements.
///
/// # Errors
/// If the frame cannot be enlarged, or the cells do not fit into memory.
pub fn grown_frame(plan: &Plan, growths: usize) -> std::result::Result<ContactFrame, SceneError> {
    let start = contact_frame(plan)?;
    if growths == 0 {
        return Ok(start);
    }
    let axes = continuing_axes(plan, &start)?;
    let frame = enlarged(plan, &start, axes, growths)
        .map_err(|error| SceneError { error, key: "frame.grow".to_owned() })?;
    with_ends(plan, frame)
}

fn enlarged(plan: &Plan, start: &ContactFrame, axes: [bool; 2], growths: usize) -> Result<ContactFrame> {
    let Some(grid) = start.whole_grid() else { return Err(no_grid()) };
    let more_cells = |n: usize| if growths < MAX_GROWTHS { n.div_ceil(4) } else { n / 2 };
    let more = [0, 1].map(|axis| if axes[axis] { more_cells(grid.cells[axis]) } else { 0 });
    if (0..2).any(|axis| axes[axis] && more[axis] == 0) {
        return Err(Error::input("a frame with one cell across is not enlarged"));
    }
    ensure_grid(plan, [0, 1].map(|axis| grid.cells[axis].saturating_add(2 * more[axis])))?;
    start.enlarged(more)?.ok_or_else(no_grid)
}

pub(super) fn no_grid() -> Error {
    Error::input("only a grid frame that is not periodic and has no outline is enlarged")
}

pub(super) fn omitted_work(plan: &Plan) -> Option<OmittedWork> {
    let wears = plan.steps.iter().any(|step| step.kind.cycles().is_some() && plan.has_wear(step));
    (wears && why_not_growable(plan, 0).is_none()).then(|| {
        let why = "they are added when wear extends the contact to the edge of the frame (frame.grow)";
        OmittedWork::new(None, "cells outside the frame", why)
    })
}
