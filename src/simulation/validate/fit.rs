//! Checks that the frame, contact faces, supports and fibres of a plan are compatible.

use std::collections::{HashMap, HashSet};

use nalgebra::Vector6;

use crate::body::half_space::plane_axes;
use crate::coupling::MeshedGap;
use crate::element::ElementKind;
use crate::error::{Error, Warning};
use crate::fem::ElementMaterials;
use crate::frame::{ContactFrame, FaceMap, GapShape};
use crate::geometry::{Point, bounds, format_direction, format_number, format_short};
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::mesh::{CellRef, Mesh};
use crate::scene::plan::{BodyPlan, FramePlan, MeshedBodyPlan, Plan};
use crate::scene::spec::body::NearField;
use crate::scene::spec::frame::FramePoints;
use crate::simulation::build::meshed_gap::surface_distances;
use crate::simulation::build::near_field::{NearFieldModel, fit_half_space};
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, SIDES, face_map};
use crate::simulation::validate::flat_faces;
use crate::simulation::validate::height_map;
use crate::simulation::validate::inside;
use crate::simulation::validate::locking;
use crate::simulation::validate::periodic;
use crate::simulation::validate::symmetry_planes;

/// Cells smaller than this share of the area per contact node of the finest body are refused.
const MIN_CELL_AREA_RATIO: f64 = 0.9;

/// Minimum ratio of cell area to area per contact node beside a half-space, unless the scene selects the near field of the mesh.
const MIN_CELL_AREA_RATIO_BESIDE_HALF_SPACE: f64 = 0.01;

/// Smallest share of a body in the normal compliance for which its coarse contact faces cause a warning. Measured for a flat pin of
/// 8 mm on a plate with faces of 3.3 cells per node: peaks are 72, 24 and 3 % too high at shares of 0.96, 0.69 and 0.18.
const MIN_COMPLIANCE_SHARE: f64 = 0.1;

/// Minimum number of cells along each side of a grid that a message recommends.
const MIN_ADVISED_CELLS: usize = 4;

/// Cells smaller than this multiple of the area per contact node make the peak pressure unreliable. Measured for a rigid sphere on
/// 16 and 24 faces (Hertz): errors of 1 to 3 % after up to 1800 iterations at a ratio of 1. At ratios of 1.19 to 2, errors are at
/// most 0.5 % after fewer than 100 iterations.
const RELIABLE_CELL_AREA_RATIO: f64 = 1.15;

/// Cells smaller than this multiple of the area per contact node cause a note.
const SMOOTH_CELL_AREA_RATIO: f64 = 2.0;

/// Boundary-element nodes farther apart than this share of the body's thickness behind them cause a warning. Measured for a clamped
/// plate under a sphere: it is 24 times too stiff at 2.5 (constant elements), and the error is 40 % at 1.25 (linear elements).
const MAX_NODE_SPACING_OVER_THICKNESS: f64 = 0.5;

/// Height differences of a surface under the frame cause a note if they exceed this share of the approach.
const MAX_UNEVENNESS_OVER_APPROACH: f64 = 0.05;

/// A motion to the first touch counts as rounding and is not reported if it is below this share of the frame's size.
const MIN_REPORTED_MOTION: f64 = 1e-6;

/// Maximum rounding error of coordinates relative to the side of a cell.
const MAX_ROUNDING_OF_COORDINATES: f64 = 1e-3;

/// Maximum uncertainty that the motion to the first touch causes in the distances, relative to the approach.
const MAX_MOTION_ERROR_SHARE: f64 = 0.02;

/// A node is fixed along the normal if the fixed components contain this share of the normal vector.
const FIXED_NORMAL_SHARE: f64 = 0.999;

/// Checks that the bodies and the `frame` of `plan` are compatible. Returns notes and warnings for the user.
///
/// # Errors
/// If the frame is too far from the origin, an interior point lies outside its body, or a support fixes contact nodes along the
/// normal. If the meshes overlap, or the gap does not suit a periodic frame or symmetry planes. If no half-space takes part and the
/// cells are finer than every meshed body, or if cells beside a half-space are far finer than a mesh.
///
/// # Source
/// The frame must not have more points than the finer body has degrees of freedom, because the pressures would not be unique.
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
        // With a half-space near field, supports need only be far enough from the frame.
        if let Some(be) = body.as_be() {
            let under = be.bem_spec(key).check(&fe.contact, SIDES[index], frame).at(key)?;
            aligned[index] = under.cells_within_elements;
            notes.extend(under.thinnest_element.and_then(|thin| thin_body_warning(key, &fe.mesh, thin)));
        } else if near[index].half_space_fit().is_none() {
            refuse_fixed_contact_nodes(plan, (fe, index), &map, frame)?;
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
        let MeshedGap { distance: gap, closing_motion } = surface_distances(plan, frame, heights, near)?;
        let moves = closing_motion.abs() > MIN_REPORTED_MOTION * frame.size();
        symmetry_planes::refuse_closed_contact(plan, frame, moves)?;
        notes.extend(moves.then(|| first_touch_note(plan, frame, closing_motion)));
        notes.extend(long_motion_warning(plan, frame, closing_motion));
        notes.extend(flat_faces::preload_warning(plan, frame, &gap));
        if let Some(approach) = plan.max_prescribed_approach() {
            let bowed = near.each_ref().map(NearFieldModel::corrects_face_curvature);
            notes.extend(flat_faces::check(plan, frame, (&gap, approach), bowed)?);
        }
    }
    if plan.gap.shape != GapShape::Mesh {
        symmetry_planes::refuse_closed_contact(plan, frame, false)?;
        let gap = plan.gap.evaluate(frame).at("gap")?;
        if matches!(plan.gap.shape, GapShape::Heights(_)) {
            notes.extend(height_map::check(plan, frame, &gap));
        }
    }
    notes.extend(check_cell_size(plan, frame, near, (per_node, aligned))?);
    Ok(notes)
}

/// Refuses a frame so far from the global origin that the rounding of coordinates is significant relative to a cell.
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

/// Warns if body 2 is moved far along a curved frame. Distances are measured along the cell normals, with body 2 at its meshed
/// position. On a frame of radius R, a motion u changes them by about u^2 / R in addition. Measured for a pin in a bore of 25 mm,
/// clearance 0.01 mm, approach 0.005 mm: a motion of 0.03 mm reduces the load by 1.4 %, and a motion of 0.11 mm halves it.
fn long_motion_warning(plan: &Plan, frame: &ContactFrame, closing_motion: f64) -> Option<Warning> {
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

/// Note on the motion along n that brings body 2 from its meshed position to the first touch.
fn first_touch_note(plan: &Plan, frame: &ContactFrame, closing_motion: f64) -> Warning {
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

/// Warns if a boundary element is too large to represent bending of the body. The pair is the element's index among the outer faces
/// and the ratio of its node spacing to the thickness of the body behind it.
fn thin_body_warning(key: &str, mesh: &Mesh, (element, ratio): (usize, f64)) -> Option<Warning> {
    let face =
        outer_faces(mesh).into_iter().nth(element).filter(|_| ratio > MAX_NODE_SPACING_OVER_THICKNESS)?;
    Some(Warning::uncertain(&format!(
        "the node spacing of the boundary element {} of {key} is {} times the thickness of the body there: thin bodies become far too stiff (constant, linear elements) or too soft; use elements of at most half of the thickness, or finite elements (kind = \"fe\")",
        face.tag,
        format_short(ratio)
    )))
}

/// Compares the cells of the frame with the contact areas per node of condensed meshes.
fn check_cell_size(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
    (per_node, aligned): ([Option<f64>; 2], [bool; 2]),
) -> Result<Vec<Warning>, SceneError> {
    let is_half_space = |index: usize| {
        near[index].half_space_fit().is_some() || matches!(plan.bodies[index], BodyPlan::HalfSpace(_))
    };
    let mut why = String::new();
    for (near, (body, key)) in near.iter().zip(plan.bodies.iter().zip(BODY_KEYS)) {
        let auto =
            body.as_meshed().is_some_and(|fe| fe.near_field == NearField::Auto) && frame.grid.is_some();
        if let (NearFieldModel::Mesh(reason), true) = (near, auto) {
            why.push_str(&format!("; {key} does not allow the near field of a half-space: {reason}"));
        }
    }
    if [0, 1].into_iter().any(is_half_space) {
        let mut warnings = Vec::new();
        for (index, face) in per_node.into_iter().enumerate() {
            let Some(face) = face else { continue };
            refuse_far_finer_cells(plan, frame, (index, face), &why)?;
            warnings.extend(coarse_faces_warning(plan, frame, (index, face, frame.mean_cell_area())));
        }
        return Ok(with_reasons(warnings, &why));
    }
    // On nodal frames, every cell belongs to one node, so the cells are not compared with the finest body.
    let nodal = matches!(plan.frame, FramePlan::Mesh { points: FramePoints::Nodes, .. });
    let finest = per_node.into_iter().flatten().reduce(f64::min).filter(|_| !nodal);
    // Boundary elements resolve the traction of each of their nodes if no cell covers two elements.
    let cell = frame.mean_cell_area();
    let by_boundary = |face: &f64| {
        let of_boundary = |index: usize| aligned[index] && per_node[index] == Some(*face);
        (0..2).any(of_boundary) && cell >= MIN_CELL_AREA_RATIO * face
    };
    let finest = finest.filter(|face| !by_boundary(face));
    let note = finest.map(|face| check_cell_area_ratio(plan, frame, face, &why)).transpose()?.flatten();
    let least = per_node.into_iter().flatten().fold(f64::INFINITY, f64::min);
    // Nodal cells at an edge have half the area of inner cells.
    let cell = match plan.frame {
        FramePlan::Mesh { body, .. } if nodal => per_node[body].unwrap_or(cell),
        _ => cell,
    };
    let coarse = |index: usize| {
        let face = per_node[index].filter(|face| *face > least)?;
        let matters = compliance_share(plan, frame, index) >= MIN_COMPLIANCE_SHARE;
        coarse_faces_warning(plan, frame, (index, face, cell)).filter(|_| matters)
    };
    Ok(with_reasons(note.into_iter().chain((0..2).filter_map(coarse)).collect(), &why))
}

/// Adds to warnings, if any, the note `why` no half-space is used.
fn with_reasons(mut warnings: Vec<Warning>, why: &str) -> Vec<Warning> {
    let reasons = why.strip_prefix("; ").filter(|_| !warnings.is_empty());
    warnings.extend(reasons.map(Warning::note));
    warnings
}

/// Share of body `index` in the compliance of both bodies along the frame's n, from the uniaxial moduli of their materials.
fn compliance_share(plan: &Plan, frame: &ContactFrame, index: usize) -> f64 {
    let n = frame.axes.normal();
    let stress = Vector6::new(n.x * n.x, n.y * n.y, n.z * n.z, n.y * n.z, n.x * n.z, n.x * n.y);
    let compliances = plan.bodies.each_ref().map(|body| {
        let stiffness = body.material().map(|material| material.stiffness_in_frame(0.0));
        stiffness.map_or(0.0, |stiffness| stress.dot(&(stiffness.compliance() * stress)))
    });
    compliances[index] / compliances.iter().sum::<f64>()
}

/// Warns if the condensed mesh of body `index` is coarser than the cells of the frame, which the other body resolves. `face` is the
/// area per contact node, `cell` the area of a cell. Measured for a sphere on a block with a twentieth of the sphere's stiffness,
/// at `cell` / `face` = 0.16, 0.36 and 0.92. Peaks are too high by factors of 1.7 to 3.3, by 25 %, and by less than 1 %.
fn coarse_faces_warning(
    plan: &Plan,
    frame: &ContactFrame,
    (index, face, cell): (usize, f64, f64),
) -> Option<Warning> {
    let ratio = cell / face;
    (ratio < MIN_CELL_AREA_RATIO).then(|| {
        let (unit, key, partner) = (&plan.units.length, BODY_KEYS[index], BODY_KEYS[1 - index]);
        Warning::uncertain(&format!(
            "the contact faces of {key} are coarser than the cells of the frame: node spacing {} {unit}, mean cell side {} {unit} (cell area {} of the area per node). Pressures peak along these faces, several times too high if {key} is softer than {partner}; {}",
            format_short(face.sqrt()),
            format_short(cell.sqrt()),
            format_short(ratio),
            coarse_faces_remedy(plan, frame, (index, face))
        ))
    })
}

/// Refuses cells that are far finer than the contact faces of body `index`, if the other body is a half-space.
///
/// # Errors
/// If the cells are far finer, unless the scene selects the near field of the mesh.
fn refuse_far_finer_cells(
    plan: &Plan,
    frame: &ContactFrame,
    (index, face): (usize, f64),
    why: &str,
) -> Result<(), SceneError> {
    let ratio = frame.mean_cell_area() / face;
    let auto = plan.bodies[index].as_fe().is_some_and(|fe| fe.near_field == NearField::Auto);
    if ratio >= MIN_CELL_AREA_RATIO_BESIDE_HALF_SPACE || !auto {
        return Ok(());
    }
    let (unit, key) = (&plan.units.length, BODY_KEYS[index]);
    let error = Error::input(format!(
        "the cells of the frame are far smaller than the contact faces of {key}: cell side {} {unit}, node spacing {} {unit}. Pressures would be several times too high; {}, or accept this with {key}.near_field = \"mesh\"{why}",
        format_short(frame.mean_cell_area().sqrt()),
        format_short(face.sqrt()),
        coarse_faces_remedy(plan, frame, (index, face))
    ));
    Err(SceneError { error, key: format!("{key}.near_field") })
}

/// Recommendation for contact faces of body `index` that are coarser than the cells of the frame.
fn coarse_faces_remedy(plan: &Plan, frame: &ContactFrame, (index, face): (usize, f64)) -> String {
    let (unit, key) = (&plan.units.length, BODY_KEYS[index]);
    let side = format_number((face * MIN_CELL_AREA_RATIO).sqrt());
    let smaller = format!("use smaller faces of {key} under the contact");
    match plan.frame {
        FramePlan::Mesh { .. } => format!("{smaller}, or its faces as cells (frame.body = {})", index + 1),
        FramePlan::Grid { .. } => {
            let own = plan.bodies[index].as_fe().filter(|fe| fe.near_field == NearField::Mesh);
            let fits = own.is_some_and(|fe| matches!(fit_half_space(plan, fe, index, frame), Ok(Ok(_))));
            let half_space = if fits { format!(", or {key}.near_field = \"auto\"") } else { String::new() };
            let cells = at_most(frame, frame.mean_cell_area() / face, MIN_CELL_AREA_RATIO);
            let cells =
                if cells.is_empty() { cells } else { format!(", or cells of at least {side} {unit}{cells}") };
            format!("{smaller}{cells}{half_space}")
        }
    }
}

/// Note if the gap neglects height differences of the surface of body `key`. `heights` are along n in each cell, `[N]`, mm.
fn uneven(plan: &Plan, key: &str, heights: &[f64]) -> Option<Warning> {
    let approach = plan.max_prescribed_approach()?;
    let [low, high] = bounds(heights.iter().copied());
    let counts = !matches!(plan.gap.shape, GapShape::Mesh | GapShape::PerCell(_))
        && high - low > MAX_UNEVENNESS_OVER_APPROACH * approach;
    // Heights are measured from the cells, which lie on the body of a mesh frame.
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

/// Note if cells of a mesh frame have no opposite faces of the other body.
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

/// Refuses supports that fix a node under the frame along the normal.
fn refuse_fixed_contact_nodes(
    plan: &Plan,
    (fe, index): (&MeshedBodyPlan, usize),
    map: &FaceMap,
    frame: &ContactFrame,
) -> Result<(), SceneError> {
    let local: HashMap<usize, usize> = map.nodes().iter().enumerate().map(|(i, &node)| (node, i)).collect();
    for support in &fe.supports {
        let held = |node: &usize| {
            let normal: Point = map.column(local[node]).map(|(cell, _)| frame.triads[cell].normal()).sum();
            let part = Point::from_fn(|c, _| if support.values[c].is_some() { normal[c] } else { 0.0 });
            part.norm() >= FIXED_NORMAL_SHARE * normal.norm()
        };
        let nodes = fe.mesh.group_nodes(&support.group).at(BODY_KEYS[index])?;
        let count = nodes.iter().filter(|node| local.contains_key(node) && held(node)).count();
        if count > 0 {
            let level = frame.has_uniform_axes();
            let along = if level { "z" } else { "the normal of the surface" };
            let all = map.nodes().len();
            let smaller = if count < all && frame.grid.is_some() { ", or use a smaller frame" } else { "" };
            let nodes = if count == all { format!("all {all}") } else { format!("{count} of the {all}") };
            let components = plan.document.get(&format!("{}.components", support.key)).is_some();
            let normal_is_z = level && frame.axes.normal().z.abs() > FIXED_NORMAL_SHARE;
            let free = match (components, normal_is_z && support.key.contains(".fixed.")) {
                (true, _) => ", or remove this direction from `components`",
                (false, true) => ", or add components = [\"x\", \"y\"]",
                (false, false) => "",
            };
            let error = Error::input(format!(
                "the support on group `{}` fixes {nodes} contact nodes under the frame along {along}, where they must be free: support another group{smaller}{free}",
                support.group,
            ));
            return Err(SceneError { error, key: support.key.clone() });
        }
    }
    Ok(())
}

/// Compares the mean cell area with the area per contact node of the finest body (`face`). `why` is the reason why no half-space is
/// used.
fn check_cell_area_ratio(
    plan: &Plan,
    frame: &ContactFrame,
    face: f64,
    why: &str,
) -> Result<Option<Warning>, SceneError> {
    let cell = frame.mean_cell_area();
    let ratio = cell / face;
    if ratio >= SMOOTH_CELL_AREA_RATIO {
        return Ok(None);
    }
    let unit = &plan.units.length;
    let first_order =
        |body: usize| plan.bodies[body].as_meshed().is_some_and(MeshedBodyPlan::has_linear_contact_faces);
    let own_nodes = matches!(plan.frame, FramePlan::Mesh { body, .. } if first_order(body));
    let (cell, face) = (cell.sqrt(), face.sqrt());
    // Only a grid has cells of its own. A finer mesh keeps the number of cells in contact.
    let remedy = |wanted: f64| match (frame.grid, own_nodes) {
        (Some(_), _) => format!(
            "a finer mesh, elements of order 2, cells of at least {} {unit}{}",
            format_number(face * wanted.sqrt()),
            at_most(frame, ratio, wanted)
        ),
        (None, true) => "frame.points = \"nodes\", elements of order 2".to_owned(),
        (None, false) => "elements of order 2".to_owned(),
    };
    if ratio >= MIN_CELL_AREA_RATIO {
        let note = format!(
            "a cell of the frame has {ratio:.2} times the area that belongs to a contact node; at least {SMOOTH_CELL_AREA_RATIO} are needed"
        );
        let mend = format!("use {}, or a half-space body", remedy(SMOOTH_CELL_AREA_RATIO));
        return Ok(Some(if ratio < RELIABLE_CELL_AREA_RATIO {
            Warning::uncertain(&format!(
                "{note}. Peak pressures are not reliable and need not converge (forces do); {mend}"
            ))
        } else {
            Warning::note(format!("{note}. Tractions may oscillate from cell to cell; {mend}"))
        }));
    }
    let error = Error::input(format!(
        "the cells of the frame are too small for the meshes: cell side {} {unit}, node spacing of the finest body {} {unit}. The tractions are not determined; use {}, or a half-space body{why}",
        format_short(cell),
        format_short(face),
        remedy(MIN_CELL_AREA_RATIO)
    ));
    let key = match (frame.grid, own_nodes) {
        (Some(_), _) => "frame.cells",
        (None, true) => "frame.points",
        (None, false) => "frame.body",
    };
    Err(SceneError { error, key: key.to_owned() })
}

/// Recommends the finest grid whose cells have `wanted` times the nodal area. `ratio` is the present multiple. The text is empty if
/// this grid is too coarse.
fn at_most(frame: &ContactFrame, ratio: f64, wanted: f64) -> String {
    let Some(grid) = frame.grid else { return String::new() };
    // A direction with a single cell keeps its cell.
    let directions = grid.cells.iter().filter(|n| **n > 1).count() as f64;
    let coarser = |n: usize| (n as f64 * (ratio / wanted).powf(1.0 / directions)).floor() as usize;
    let [x, y] = grid.cells.map(|n| if n > 1 { coarser(n) } else { 1 });
    let usable = grid.cells.iter().zip([x, y]).all(|(n, fewer)| *n == 1 || fewer >= MIN_ADVISED_CELLS);
    if usable { format!(" (cells = [{x}, {y}] or fewer)") } else { String::new() }
}

/// Note if a law takes the body's fibre direction, but elements under the frame have another one.
fn region_fibre_warning(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    faces: &[&SurfaceFace],
) -> Option<Warning> {
    fe.material.fibre?;
    let named = ["friction", "wear"].into_iter().zip(plan.fibre_bodies);
    let laws: Vec<&str> = named.filter(|(_, body)| *body == Some(index)).map(|(law, _)| law).collect();
    if laws.is_empty() {
        return None;
    }
    let regions = ElementMaterials::new(&fe.fem_spec(BODY_KEYS[index])).ok()?;
    let fibre: Point = fe.material.material_axes(0.0).column(0).into();
    let turned = |group: &str| {
        let cells = fe.mesh.group_of_dim(group, 3).map(|group| group.cells.as_slice()).unwrap_or_default();
        let cells: HashSet<CellRef> = cells.iter().copied().collect();
        faces.iter().filter(|face| cells.contains(&face.owner)).any(|face| {
            let element = regions.element(face.owner);
            element.is_some_and(|i| regions.axes(i).column(0).cross(&fibre).norm() > 1e-9)
        })
    };
    let group = fe.regions.iter().filter_map(|(group, _)| group.as_deref()).find(|group| turned(group))?;
    Some(Warning::note(format!(
        "region `{group}` of {} lies under the frame and has another fibre direction than the body; {} use the fibre of the body",
        BODY_KEYS[index],
        laws.join(" and ")
    )))
}

/// Mean face area per contact node, mm2. A face counts for as many nodes as there are per face in a large regular mesh of its type.
fn area_per_node(body: &BodyPlan, mesh: &Mesh, faces: &[&SurfaceFace]) -> f64 {
    let nodes = |face: &&SurfaceFace| match (face.kind, body.as_be()) {
        (kind, Some(be)) => be.interpolation.n_nodes(kind.n_corners() == 3) as f64,
        (ElementKind::Tri3, None) => 0.5,
        (ElementKind::Tri6, None) => 2.0,
        (ElementKind::Quad8, None) => 3.0,
        (ElementKind::Quad9, None) => 4.0,
        _ => 1.0,
    };
    faces.iter().map(|face| face.area(mesh)).sum::<f64>() / faces.iter().map(nodes).sum::<f64>()
}
