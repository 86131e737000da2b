//! Checks the motion along n that brings body 2 from its meshed position to the first touch.

use crate::error::Warning;
use crate::frame::ContactFrame;
use crate::geometry::{format_direction, format_number, format_short};
use crate::scene::plan::Plan;

/// Maximum uncertainty of distances due to the motion to the first touch, relative to the approach.
const MAX_MOTION_ERROR_SHARE: f64 = 0.02;

/// Warns if body 2 is moved far along a curved frame. Distances are measured along the cell normals with body 2 at its meshed
/// position. On a frame of radius R, a motion u changes the distances by about u^2 / R in addition. For a pin in a bore of 25 mm, a
/// motion of 0.11 mm halves the load.
pub(super) fn long_motion_warning(plan: &Plan, frame: &ContactFrame, closing_motion: f64) -> Option<Warning> {
    let (first, start) = (frame.triads[0].normal(), frame.centers[0]);
    // On a circle of radius R, the normals at two points with the distance d differ by d / R.
    let curvature = (1..frame.n_cells())
        .map(|cell| (frame.triads[cell].normal() - first).norm() / (frame.centers[cell] - start).norm())
        .fold(0.0, f64::max);
    let error = closing_motion * closing_motion * curvature;
    let allowed = match plan.max_prescribed_approach() {
        Some(approach) => MAX_MOTION_ERROR_SHARE * approach,
        None => MAX_MOTION_ERROR_SHARE * closing_motion.abs(),
    };
    (error > allowed).then(|| {
        let unit = &plan.units.length;
        Warning::uncertain(&format!(
            "the frame is curved, and moving body 2 by {} {unit} to the first touch makes the gap uncertain by about {} {unit}: mesh body 2 so that it nearly touches body 1",
            format_short(closing_motion.abs()),
            format_short(error)
        ))
    })
}

pub(super) fn first_touch_note(plan: &Plan, frame: &ContactFrame, closing_motion: f64) -> Warning {
    let unit = &plan.units.length;
    let normal = format_direction(&frame.axes.normal());
    let (direction, reason) = if closing_motion > 0.0 {
        ("against", "to the first touch of the surfaces")
    } else {
        ("along", "to the first touch of the surfaces, because the meshes overlap")
    };
    Warning::note(format!(
        "gap.kind = \"mesh\": body 2 is moved by {} {unit} {direction} n = {normal} {reason}; `approach` is measured from there",
        format_number(format!("{:.3e}", closing_motion.abs()).parse().unwrap_or(closing_motion.abs()))
    ))
}
