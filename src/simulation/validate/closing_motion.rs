//! Checks the motion along n that brings body 2 from its meshed position to the first touch.

use crate::body::INTERFERENCE;
use crate::error::Warning;
use crate::frame::ContactFrame;
use crate::geometry::{format_direction, format_number, format_short};
use crate::scene::plan::Plan;

/// Largest overlap of bodies as meshed that causes no WARNING, divided by the size of the frame.
const MAX_INTERFERENCE: f64 = 0.01;

/// Maximum uncertainty of distances due to the motion to the first touch, relative to the approach.
const MAX_MOTION_ERROR_SHARE: f64 = 0.02;

/// Warns if body 2 is moved far along a curved frame. Distances are measured along the cell normals with body 2 at its
/// meshed position. On a frame of radius R, a motion u along n changes these distances by an additional u^2 / R,
/// approximately. For a pin in a bore of 25 mm, a motion of 0.11 mm halves the load.
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

/// Note with the overlap of bodies as meshed. Large overlap causes a WARNING.
pub(super) fn interference_note(plan: &Plan, frame: &ContactFrame, gap: &[f64]) -> Warning {
    let unit = &plan.units.length;
    let least = gap.iter().copied().fold(f64::INFINITY, f64::min);
    let (cells, n) = (gap.iter().filter(|gap| **gap < 0.0).count(), gap.len());
    if cells == 0 {
        return Warning::note(format!(
            "gap.reference = \"as-meshed\": the meshes do not overlap; the smallest gap of a cell is {} {unit}",
            format_short(least.max(0.0))
        ));
    }
    let text = format!(
        "gap.reference = \"as-meshed\": the meshes overlap by up to {} {unit} in {cells} of {n} cells. The load \"{INTERFERENCE}\" removes the overlap",
        format_short(-least)
    );
    let amplitudes = plan.steps.iter().flat_map(|step| &step.loads).filter(|(name, _)| name == INTERFERENCE);
    let interference = -least * amplitudes.fold(1.0, |largest: f64, (_, amplitude)| largest.max(*amplitude));
    if interference > MAX_INTERFERENCE * frame.size() {
        return Warning::uncertain(&format!(
            "{text}. An interference of {} {unit} is more than {} % of the size of the frame: check the positions of the meshes and the amplitudes",
            format_short(interference),
            100.0 * MAX_INTERFERENCE
        ));
    }
    Warning::note(text)
}
