//! Checks that the frame, contact faces, supports and fibres of a plan are compatible.

use crate::body::half_space::plane_axes;
use crate::coupling::MeshedGap;
use crate::error::{Error, Warning};
use crate::frame::{ContactFrame, GapShape};
use crate::geometry::{bounds, format_number, format_short};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::scene::plan::{BodyPlan, FramePlan, Plan};
use crate::scene::spec::frame::FramePoints;
use crate::simulation::build::meshed_gap::surface_distances;
use crate::simulation::build::near_field::NearFieldModel;
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, face_map};
use crate::simulation::validate::cell_size::{area_per_node, check_cell_size};
use crate::simulation::validate::closing_motion::{first_touch_note, interference_note, long_motion_warning};
use crate::simulation::validate::fixed_contact_nodes::refuse_fixed_contact_nodes;
use crate::simulation::validate::flat_faces;
use crate::simulation::validate::height_map;
use crate::simulation::validate::inside;
use crate::simulation::validate::locking;
use crate::simulation::validate::periodic;
use crate::simulation::validate::region_fibre::region_fibre_warning;
use crate::simulation::validate::symmetry_planes;

/// Ratio of node spacing to the body's thickness above which a boundary element causes a warning. For a clamped plate
/// under a sphere, linear elements have an error of 40 % at a ratio of 1.25.
const MAX_NODE_SPACING_OVER_THICKNESS: f64 = 0.5;

/// Largest height difference of a surface that causes no note, relative to the approach.
const MAX_UNEVENNESS_OVER_APPROACH: f64 = 0.05;

/// Smallest motion to the first touch that is reported, relative to the frame's size. Smaller motions result from
/// rounding.
const MIN_REPORTED_MOTION: f64 = 1e-6;

const MAX_ROUNDING_OF_COORDINATES: f64 = 1e-3;

/// Checks that the bodies and the `frame` of `plan` are compatible. Returns notes and warnings for the user.
///
/// # Errors
/// - The frame is too far from the origin.
/// - An interior point lies outside its body.
/// - A support fixes contact nodes along the normal.
/// - The meshes overlap.
/// - The gap does not suit a periodic frame or symmetry planes.
/// - No body uses a half-space, and the cells are finer than the contact faces of every meshed body.
/// - A body uses a half-space, and the cells are far finer than the contact faces of a meshed body.
///
/// # Source
/// The frame must not have more points than the finer body has degrees of freedom, because the pressures would not be
/// unique.
pub(crate) fn check(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
) -> Result<Vec<Warning>, SceneError> {
    refuse_rounded_coordinates(plan, frame)?;
    inside::check(plan, frame)?;
    let mut notes = Vec::new();
    let mut per_node = [None, None];
    let mut heights = [None, None];
    let mut aligned = [false; 2];
    notes.extend(uncovered_cells_warning(plan, frame));
    notes.extend(periodic::check(plan, frame)?);
    for (index, (body, key)) in plan.bodies.iter().zip(BODY_KEYS).enumerate() {
        if matches!(body, BodyPlan::HalfSpace(_)) {
            plane_axes(frame).at(key)?;
        }
        let Some(fe) = body.as_meshed() else { continue };
        if body.as_be().is_none() {
            notes.extend(locking::locking_warning(fe, key));
        }
        let map = face_map(fe, index, frame)?;
        let faces = group_faces(&fe.mesh, &fe.contact).at(key)?;
        let mut under = vec![false; fe.mesh.points.len()];
        map.nodes().iter().for_each(|&node| under[node] = true);
        // The fit of a half-space near field already requires a distance between the supports and the frame.
        if let Some(be) = body.as_be() {
            let under = be.bem_spec(key).check(&fe.contact, SIDES[index], frame).at(key)?;
            aligned[index] = under.cells_within_elements;
            let thin = |(element, ratio)| thin_body_warning(key, &fe.mesh, element, ratio);
            notes.extend(under.thinnest_element.and_then(thin));
        } else if near[index].half_space_fit().is_none() {
            refuse_fixed_contact_nodes(plan, fe, index, &map, frame)?;
        }
        let faces: Vec<&SurfaceFace> =
            faces.iter().filter(|face| face.nodes.iter().all(|&node| under[node])).collect();
        notes.extend(region_fibre_warning(plan, fe, index, &faces));
        if near[index].is_condensed() {
            per_node[index] = Some(area_per_node(body, &fe.mesh, &faces));
        }
        let over_cells = map.mean_heights(frame, &fe.mesh);
        notes.extend(uneven(plan, key, &over_cells));
        heights[index] = Some(over_cells);
    }
    if plan.gap.shape == GapShape::Mesh && heights.iter().any(Option::is_some) {
        notes.extend(check_meshed_gap(plan, frame, heights, near)?);
    }
    if plan.gap.shape != GapShape::Mesh {
        symmetry_planes::refuse_closed_contact(plan, frame, false)?;
        let gap = plan.gap.evaluate(frame).at("gap")?;
        if matches!(plan.gap.shape, GapShape::Heights(_)) {
            notes.extend(height_map::check(plan, frame, &gap));
        }
    }
    notes.extend(check_cell_size(plan, frame, near, per_node, aligned)?);
    Ok(notes)
}

/// Checks the gap between meshed surfaces, whose mean heights in the cells are `heights`.
fn check_meshed_gap(
    plan: &Plan,
    frame: &ContactFrame,
    heights: [Option<Vec<f64>>; 2],
    near: &[NearFieldModel; 2],
) -> Result<Vec<Warning>, SceneError> {
    let mut notes = Vec::new();
    let MeshedGap { distance: gap, closing_motion } = surface_distances(plan, frame, heights, near)?;
    let moves = closing_motion.abs() > MIN_REPORTED_MOTION * frame.size();
    symmetry_planes::refuse_closed_contact(plan, frame, moves)?;
    notes.extend(moves.then(|| first_touch_note(plan, frame, closing_motion)));
    if plan.gap.as_meshed {
        notes.push(interference_note(plan, frame, &gap));
    } else {
        notes.extend(long_motion_warning(plan, frame, closing_motion));
        notes.extend(flat_faces::preload_warning(plan, frame, &gap));
    }
    if let Some(approach) = plan.max_prescribed_approach().filter(|_| !plan.gap.as_meshed) {
        let bowed = near.each_ref().map(NearFieldModel::corrects_face_curvature);
        notes.extend(flat_faces::check(plan, frame, &gap, approach, bowed)?);
    }
    Ok(notes)
}

fn refuse_rounded_coordinates(plan: &Plan, frame: &ContactFrame) -> Result<(), SceneError> {
    let distance = frame.origin.amax();
    let side = frame.mean_cell_side();
    if f64::EPSILON * distance <= MAX_ROUNDING_OF_COORDINATES * side {
        return Ok(());
    }
    let unit = &plan.units.length;
    Err(Error::input(format!(
        "the frame lies {} {unit} from the global origin, where coordinates are rounded to {} {unit}; its cells have sides of {} {unit}. Place \
         frame and bodies near the origin",
        format_short(distance),
        format_short(f64::EPSILON * distance),
        format_short(side)
    )))
    .at("frame.center")
}

/// Warns if a boundary element is too large to represent bending. `element` is the index of the element among the outer faces.
/// `ratio` is the node spacing of the element divided by the thickness of the body there.
fn thin_body_warning(key: &str, mesh: &Mesh, element: usize, ratio: f64) -> Option<Warning> {
    let face =
        outer_faces(mesh).into_iter().nth(element).filter(|_| ratio > MAX_NODE_SPACING_OVER_THICKNESS)?;
    Some(Warning::uncertain(&format!(
        "the node spacing of the boundary element {} of {key} is {} times the thickness of the body there: thin bodies become far too stiff (constant, linear elements) or too soft; use elements of at most half of the thickness, or finite elements (kind = \"fe\")",
        face.tag,
        format_short(ratio)
    )))
}

/// Note if the gap neglects height differences of a meshed surface. `heights` are the heights of the surface along n in
/// each cell, `[N]`, mm.
fn uneven(plan: &Plan, key: &str, heights: &[f64]) -> Option<Warning> {
    let approach = plan.max_prescribed_approach()?;
    let [low, high] = bounds(heights.iter().copied());
    let counts = !matches!(plan.gap.shape, GapShape::Mesh | GapShape::PerCell(_))
        && high - low > MAX_UNEVENNESS_OVER_APPROACH * approach;
    // Heights are measured from the cells. The cells of a mesh frame lie on one of the bodies.
    let what = match plan.frame {
        FramePlan::Mesh { body, .. } if BODY_KEYS[body] != key => {
            format!("the contact frame on {} is not parallel to the meshed surface of {key}", BODY_KEYS[body])
        }
        _ => format!("the meshed surface of {key} is not flat under the frame"),
    };
    counts.then(|| {
        Warning::note(format!(
            "{what}: heights along n differ by {} {}, which the gap neglects; use the gap of the meshes (gap.kind = \"mesh\"), unless the given gap already includes these heights",
            format_number(high - low),
            plan.units.length
        ))
    })
}

fn uncovered_cells_warning(plan: &Plan, frame: &ContactFrame) -> Option<Warning> {
    let FramePlan::Mesh { body, points, .. } = plan.frame else { return None };
    let cells = if points == FramePoints::Nodes { "cells" } else { "faces" };
    let group = plan.bodies[body].as_meshed().map_or("", |fe| fe.contact.as_str());
    let other = BODY_KEYS[1 - body];
    let why = match plan.bodies[1 - body].as_meshed() {
        Some(_) => format!("have nine tenths of their area opposite faces of {other}"),
        None => format!("face the plane of {other}"),
    };
    (frame.n_excluded > 0).then(|| {
        Warning::note(format!(
            "{} of the {} {cells} of `{group}` do not {why}; they are omitted from the frame and stay open",
            frame.n_excluded,
            frame.n_excluded + frame.n_cells(),
        ))
    })
}
