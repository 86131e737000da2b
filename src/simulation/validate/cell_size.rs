//! Compares the cells of the frame with the contact faces of condensed meshes.

use nalgebra::Vector6;

use crate::element::ElementKind;
use crate::error::{Error, Warning};
use crate::frame::ContactFrame;
use crate::geometry::{format_number, format_short};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;
use crate::scene::plan::{BodyPlan, FramePlan, MeshedBodyPlan, Plan};
use crate::scene::spec::body::NearField;
use crate::scene::spec::frame::FramePoints;
use crate::simulation::build::near_field::{NearFieldModel, fit_half_space};
use crate::simulation::failure::SceneError;
use crate::simulation::plan_bodies::BODY_KEYS;

/// Smallest ratio of cell area to area per contact node. Smaller cells are refused or cause a warning.
const MIN_CELL_AREA_RATIO: f64 = 0.9;

/// Minimum ratio of cell area to area per contact node if one of the bodies uses a half-space. Bodies with
/// `near_field = "mesh"` are exempt.
const MIN_CELL_AREA_RATIO_BESIDE_HALF_SPACE: f64 = 0.01;

/// Smallest share of a body in the normal compliance for which coarse contact faces of the body cause a warning.
/// Measured for a flat pin: pressure peaks are 72, 24 and 3 % too high at shares of 0.96, 0.69 and 0.18.
const MIN_COMPLIANCE_SHARE: f64 = 0.1;

/// Minimum number of cells along each side of a recommended grid.
const MIN_ADVISED_CELLS: usize = 4;

/// Smallest ratio of cell area to area per contact node at which the peak pressure is reliable. For a rigid sphere
/// (Hertz), the error is 1 to 3 % at a ratio of 1, and at most 0.5 % from 1.19.
const RELIABLE_CELL_AREA_RATIO: f64 = 1.15;

/// Ratios of cell area to area per contact node below this value cause a note.
const SMOOTH_CELL_AREA_RATIO: f64 = 2.0;

/// Compares the cells of the frame with `per_node`, the mean face area per contact node of both bodies (mm2; `None`
/// without a condensed mesh). `aligned` states for each body whether each cell lies within one boundary element.
pub(super) fn check_cell_size(
    plan: &Plan,
    frame: &ContactFrame,
    near: &[NearFieldModel; 2],
    per_node: [Option<f64>; 2],
    aligned: [bool; 2],
) -> Result<Vec<Warning>, SceneError> {
    let is_half_space = |index: usize| {
        near[index].half_space_fit().is_some() || matches!(plan.bodies[index], BodyPlan::HalfSpace(_))
    };
    let mut why = Vec::new();
    for (near, (body, key)) in near.iter().zip(plan.bodies.iter().zip(BODY_KEYS)) {
        let auto =
            body.as_meshed().is_some_and(|fe| fe.near_field == NearField::Auto) && frame.grid.is_some();
        if let (NearFieldModel::Mesh(reason), true) = (near, auto) {
            why.push(format!("{key} does not allow the near field of a half-space: {reason}"));
        }
    }
    let why = why.join("; ");
    if [0, 1].into_iter().any(is_half_space) {
        let mut warnings = Vec::new();
        for (index, area) in per_node.into_iter().enumerate() {
            let Some(area_per_node) = area else { continue };
            refuse_far_finer_cells(plan, frame, index, area_per_node, &why)?;
            warnings.extend(coarse_faces_warning(plan, frame, index, area_per_node, frame.mean_cell_area()));
        }
        return Ok(with_reasons(warnings, &why));
    }
    // A nodal cell has the area of one contact node. It is not smaller than the area per node of the finest body.
    let nodal = matches!(plan.frame, FramePlan::Mesh { points: FramePoints::Nodes, .. });
    let finest = per_node.into_iter().flatten().reduce(f64::min).filter(|_| !nodal);
    // If each cell lies within one boundary element, no cell couples the tractions of two elements, and the tractions are unique.
    let cell_area = frame.mean_cell_area();
    let by_boundary = |area: &f64| {
        let of_boundary = |index: usize| aligned[index] && per_node[index] == Some(*area);
        (0..2).any(of_boundary) && cell_area >= MIN_CELL_AREA_RATIO * area
    };
    let finest = finest.filter(|area| !by_boundary(area));
    let note = finest.map(|area| check_cell_area_ratio(plan, frame, area, &why)).transpose()?.flatten();
    let least = per_node.into_iter().flatten().fold(f64::INFINITY, f64::min);
    // Nodal cells at an edge have half the area of inner cells.
    let cell_area = match plan.frame {
        FramePlan::Mesh { body, .. } if nodal => per_node[body].unwrap_or(cell_area),
        _ => cell_area,
    };
    let coarse = |index: usize| {
        let area_per_node = per_node[index].filter(|area| *area > least)?;
        let matters = compliance_share(plan, frame, index) >= MIN_COMPLIANCE_SHARE;
        coarse_faces_warning(plan, frame, index, area_per_node, cell_area).filter(|_| matters)
    };
    Ok(with_reasons(note.into_iter().chain((0..2).filter_map(coarse)).collect(), &why))
}

/// If there are warnings, appends the note `why`, which tells why a body uses no half-space.
fn with_reasons(mut warnings: Vec<Warning>, why: &str) -> Vec<Warning> {
    if !why.is_empty() && !warnings.is_empty() {
        warnings.push(Warning::note(why));
    }
    warnings
}

/// Sentence for a refusal of small cells. `why` tells why a body uses no half-space; empty if it does not matter.
fn half_space_sentence(why: &str) -> String {
    if why.is_empty() {
        return String::new();
    }
    format!(". The near field of a half-space allows smaller cells, but {why}")
}

/// Share of body `index` in the compliance of both bodies along the frame's n. The compliance of a body is the inverse
/// of the uniaxial modulus of its material.
fn compliance_share(plan: &Plan, frame: &ContactFrame, index: usize) -> f64 {
    let n = frame.axes.normal();
    let stress = Vector6::new(n.x * n.x, n.y * n.y, n.z * n.z, n.y * n.z, n.x * n.z, n.x * n.y);
    let compliances = plan.bodies.each_ref().map(|body| {
        let stiffness = body.material().map(|material| material.stiffness_in_frame(0.0));
        stiffness.map_or(0.0, |stiffness| stress.dot(&(stiffness.compliance() * stress)))
    });
    compliances[index] / compliances.iter().sum::<f64>()
}

/// Warns if the contact faces of body `index` are coarser than the cells of the frame. The pressure then peaks along
/// these faces.
///
/// Measured for a sphere on a block with a twentieth of the sphere's stiffness, at `cell_area` / `area_per_node` =
/// 0.16, 0.36 and 0.92. Peaks are too high by factors of 1.7 to 3.3, by 25 %, and by less than 1 %, respectively.
fn coarse_faces_warning(
    plan: &Plan,
    frame: &ContactFrame,
    index: usize,
    area_per_node: f64,
    cell_area: f64,
) -> Option<Warning> {
    let ratio = cell_area / area_per_node;
    (ratio < MIN_CELL_AREA_RATIO).then(|| {
        let (unit, key, partner) = (&plan.units.length, BODY_KEYS[index], BODY_KEYS[1 - index]);
        Warning::uncertain(&format!(
            "the contact faces of {key} are coarser than the cells of the frame: node spacing {} {unit}, mean cell side {} {unit} (cell area: {} times the area per node). Pressures peak along these faces, several times too high if {key} is softer than {partner}; {}",
            format_short(area_per_node.sqrt()),
            format_short(cell_area.sqrt()),
            format_short(ratio),
            coarse_faces_remedy(plan, frame, index, area_per_node)
        ))
    })
}

/// Refuses cells that are far finer than the contact faces of body `index`, if one of the bodies uses a half-space. A
/// body with `near_field = "mesh"` is exempt.
fn refuse_far_finer_cells(
    plan: &Plan,
    frame: &ContactFrame,
    index: usize,
    area_per_node: f64,
    why: &str,
) -> Result<(), SceneError> {
    let ratio = frame.mean_cell_area() / area_per_node;
    let auto = plan.bodies[index].as_fe().is_some_and(|fe| fe.near_field == NearField::Auto);
    if ratio >= MIN_CELL_AREA_RATIO_BESIDE_HALF_SPACE || !auto {
        return Ok(());
    }
    let (unit, key) = (&plan.units.length, BODY_KEYS[index]);
    let error = Error::input(format!(
        "the cells of the frame are far smaller than the contact faces of {key}: cell side {} {unit}, node spacing {} {unit}. Pressures would be several times too high; {}, or accept this with {key}.near_field = \"mesh\"{}",
        format_short(frame.mean_cell_area().sqrt()),
        format_short(area_per_node.sqrt()),
        coarse_faces_remedy(plan, frame, index, area_per_node),
        half_space_sentence(why)
    ));
    Err(SceneError { error, key: format!("{key}.near_field") })
}

/// Recommendation for contact faces of body `index` that are coarser than the cells of the frame.
fn coarse_faces_remedy(plan: &Plan, frame: &ContactFrame, index: usize, area_per_node: f64) -> String {
    let (unit, key) = (&plan.units.length, BODY_KEYS[index]);
    let area = format_number(area_per_node * MIN_CELL_AREA_RATIO);
    let smaller = format!("use smaller faces of {key} under the contact");
    match plan.frame {
        FramePlan::Mesh { .. } => format!("{smaller}, or its faces as cells (frame.body = {})", index + 1),
        FramePlan::Grid { .. } => {
            let own = plan.bodies[index].as_fe().filter(|fe| fe.near_field == NearField::Mesh);
            let fits = own.is_some_and(|fe| matches!(fit_half_space(plan, fe, index, frame), Ok(Ok(_))));
            let half_space = if fits { format!(", or {key}.near_field = \"auto\"") } else { String::new() };
            let cells = at_most(frame, frame.mean_cell_area() / area_per_node, MIN_CELL_AREA_RATIO);
            let cells = if cells.is_empty() {
                cells
            } else {
                format!(", or cells of at least {area} {unit}2{cells}")
            };
            format!("{smaller}{cells}{half_space}")
        }
    }
}

/// Compares the mean cell area with the area per contact node of the finest body. `why` tells why a body uses no
/// half-space.
fn check_cell_area_ratio(
    plan: &Plan,
    frame: &ContactFrame,
    area_per_node: f64,
    why: &str,
) -> Result<Option<Warning>, SceneError> {
    let cell_area = frame.mean_cell_area();
    let ratio = cell_area / area_per_node;
    if ratio >= SMOOTH_CELL_AREA_RATIO {
        return Ok(None);
    }
    let unit = &plan.units.length;
    let first_order =
        |body: usize| plan.bodies[body].as_meshed().is_some_and(MeshedBodyPlan::has_linear_contact_faces);
    let own_nodes = matches!(plan.frame, FramePlan::Mesh { body, .. } if first_order(body));
    let (cell_side, node_spacing) = (cell_area.sqrt(), area_per_node.sqrt());
    // Only the cells of a grid are independent of the mesh. The message names a finer mesh first, because a finer mesh
    // keeps the number of cells in contact.
    let remedy = |wanted: f64| match (frame.grid, own_nodes) {
        (Some(_), _) => format!(
            "a finer mesh, elements of order 2, cells of at least {} {unit}2{}",
            format_number(area_per_node * wanted),
            at_most(frame, ratio, wanted)
        ),
        (None, true) => "frame.points = \"nodes\", elements of order 2".to_owned(),
        (None, false) => "elements of order 2".to_owned(),
    };
    if ratio >= MIN_CELL_AREA_RATIO {
        let note = format!(
            "the area of a cell of the frame is {ratio:.2} times the area that belongs to a contact node, but should be at least {SMOOTH_CELL_AREA_RATIO} times that area"
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
        "the cells of the frame are too small for the meshes: cell side {} {unit}, node spacing of the finest body {} {unit}. The tractions are not determined; use {}, or a half-space body{}",
        format_short(cell_side),
        format_short(node_spacing),
        remedy(MIN_CELL_AREA_RATIO),
        half_space_sentence(why)
    ));
    let key = match (frame.grid, own_nodes) {
        (Some(_), _) => "frame.cells",
        (None, true) => "frame.points",
        (None, false) => "frame.body",
    };
    Err(SceneError { error, key: key.to_owned() })
}

/// Recommends the finest grid whose cells have at least `wanted` times the area per contact node. `ratio` is the value
/// of the present cells. Empty if the recommended grid would be too coarse.
fn at_most(frame: &ContactFrame, ratio: f64, wanted: f64) -> String {
    let Some(grid) = frame.grid else { return String::new() };
    let directions = grid.cells.iter().filter(|n| **n > 1).count() as f64;
    let coarser = |n: usize| (n as f64 * (ratio / wanted).powf(1.0 / directions)).floor() as usize;
    let [x, y] = grid.cells.map(|n| if n > 1 { coarser(n) } else { 1 });
    let usable = grid.cells.iter().zip([x, y]).all(|(n, fewer)| *n == 1 || fewer >= MIN_ADVISED_CELLS);
    if usable { format!(" (cells = [{x}, {y}] or fewer)") } else { String::new() }
}

/// Mean face area per contact node, mm2. A face counts for as many nodes as there are per face in a large regular mesh of its type.
pub(super) fn area_per_node(body: &BodyPlan, mesh: &Mesh, faces: &[&SurfaceFace]) -> f64 {
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
