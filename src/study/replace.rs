//! A body as something else that may stand for it: finite elements, boundary elements, a half-space.

use std::sync::Arc;

use super::bodies::{KEYS, free_motions};
use crate::error::{Context, Error, Result, doubtful};
use crate::frame::ContactFrame;
use crate::geometry::{Point, place};
use crate::material::{Orientation, Placed, Placement};
use crate::mesh::faces::group_faces;
use crate::mesh::{Mesh, surface};
use crate::scene::keys::body::NearField;
use crate::scene::plan::{BeSpec, BodySpec, Elastic, MeshedSpec, Plan, Support};
use crate::scene::surface::{SurfaceMaterial, body_material, surface_material};
use crate::scene::variant::Discretisation;

/// Largest angle (degrees) of a material axis under the frame from those of the half-space that stands for it.
const LARGEST_SPREAD: f64 = 5.0;

/// Share of its size by which a group may differ from mesh to mesh.
const ALIKE: f64 = 0.05;

/// Angle (degrees) of material axes that is rounding.
const NO_SPREAD: f64 = 1e-6;

/// Body `index` as `kind`.
///
/// # Errors
/// If it cannot be that.
pub(super) fn replaced(
    plan: &Plan,
    index: usize,
    kind: Discretisation,
    notes: &mut Vec<String>,
) -> Result<BodySpec> {
    let body = &plan.bodies[index];
    if body.discretisation() == kind {
        return Ok(body.clone());
    }
    let key = KEYS[index];
    if let (BodySpec::Truncated(body), Discretisation::HalfSpace) = (body, kind) {
        return Ok(BodySpec::HalfSpace(Box::new(body.elastic.clone())));
    }
    if kind == Discretisation::Truncated {
        return Err(Error::input(format!(
            "{key} is no half-space with a meshed surface (THS) in the scene: write kind = \"half-space\" with `truncated`"
        )));
    }
    let Some(meshed) = body.meshed() else {
        let what = if matches!(body, BodySpec::Rigid) { "is rigid" } else { "is a half-space" };
        return Err(Error::input(format!(
            "{key} {what} in the scene, and has no mesh to become anything else"
        )));
    };
    match (kind, body) {
        (Discretisation::HalfSpace, _) => half_space(plan, meshed, index, notes),
        (Discretisation::BoundaryElements, _) => boundary_elements(plan, meshed, index, notes),
        (Discretisation::FiniteElements, BodySpec::Be(be)) => finite_elements(plan, be, index, notes),
        _ => Err(Error::input(format!(
            "{key} deforms in the scene: for one that does not write kind = \"rigid\""
        ))),
    }
}

/// Whether all cells lie in one plane, as a half-space needs it.
pub(super) fn is_plane(frame: &ContactFrame) -> bool {
    let (Some(axes), Some(first)) = (frame.triads.first(), frame.centers.first()) else { return false };
    let size = frame.areas.iter().sum::<f64>().sqrt();
    let level = frame.triads.distinct().iter().all(|triad| (triad.0 - axes.0).amax() < 1e-6);
    level && frame.centers.iter().all(|centre| axes.normal().dot(&(centre - first)).abs() < 1e-6 * size)
}

/// The only material of `found` in `place`, whose axes vary by at most `most` degrees, as `what` has it.
fn single(found: SurfaceMaterial, (body, place, what): (&str, &str, &str), most: f64) -> Result<Elastic> {
    if found.materials.len() > 1 {
        let names = found.materials.join(", ");
        return Err(Error::input(format!("{body} has several materials {place} ({names}), {what} has one")));
    }
    let spread = found.axes_spread.to_degrees();
    if spread > most {
        let allowed = if most > NO_SPREAD { format!(" (at most {most})") } else { String::new() };
        return Err(Error::input(format!(
            "the material axes of {body} vary by up to {spread:.1} degrees {place}{allowed}, {what} has one direction"
        )));
    }
    Ok(found.elastic)
}

/// The half-space of the material that a meshed body has under the frame.
fn half_space(plan: &Plan, meshed: &MeshedSpec, index: usize, notes: &mut Vec<String>) -> Result<BodySpec> {
    let body = KEYS[index];
    if let Some(free) = free_motions(&plan.bodies[index], body).map_err(|failure| failure.error)? {
        let names = free.names.join(", ");
        return Err(Error::input(format!(
            "{body} floats by {names}: a half-space has neither motions nor loads of its own"
        )));
    }
    let elastic = if plan.bodies[index].be().is_some() {
        meshed.elastic.clone()
    } else {
        let found = surface_material(meshed, &plan.frame)?;
        single(found, (body, "under the frame", "a half-space"), LARGEST_SPREAD)?
    };
    let moved = |support: &Support| {
        let values = support.values.iter().zip(&support.gradient);
        values
            .into_iter()
            .any(|(value, row)| value.is_some_and(|v| v != 0.0) || row.iter().any(|g| *g != 0.0))
    };
    let loaded =
        !meshed.pressures.is_empty() || !meshed.tractions.is_empty() || meshed.body_force != [0.0; 3];
    let lost = [
        (loaded, "loads"),
        (!meshed.foundations.is_empty(), "foundations"),
        (meshed.supports.iter().any(moved), "prescribed displacements"),
    ];
    let lost: Vec<&str> = lost.into_iter().filter(|(is_there, _)| *is_there).map(|(_, what)| what).collect();
    if !lost.is_empty() {
        notes.push(format!("the {} of {body} have no place in a half-space", lost.join(" and ")));
    }
    let whole = body_material(meshed).ok().filter(|_| plan.bodies[index].fe().is_some());
    if whole.is_some_and(|all| all.materials.len() > 1 || all.axes_spread.to_degrees() > LARGEST_SPREAD) {
        notes.push(doubtful(&format!(
            "the half-space in the place of {body} is all of the material under the frame, {}: {body} has others, or other directions, elsewhere",
            elastic.name
        )));
    }
    Ok(BodySpec::HalfSpace(Box::new(elastic)))
}

/// A body of finite elements as one of boundary elements.
fn boundary_elements(
    plan: &Plan,
    fe: &MeshedSpec,
    index: usize,
    notes: &mut Vec<String>,
) -> Result<BodySpec> {
    let (body, other) = (KEYS[index], &plan.compare.others[index]);
    if !fe.foundations.is_empty() {
        return Err(Error::input(format!("{body} has foundations, which boundary elements have not")));
    }
    let elastic = single(body_material(fe)?, (body, "in it", "a body of boundary elements"), NO_SPREAD)?;
    let inner = || format!("{body} of boundary elements can be held and loaded on surfaces only");
    for group in fe.groups() {
        group_faces(&fe.mesh, group).context(inner)?;
    }
    let mesh = match &other.surface {
        Some(mesh) => {
            notes.extend(unlike(fe, &fe.mesh, mesh, body));
            mesh.clone()
        }
        None => Arc::new(skin(&fe.mesh).context(|| body.to_owned())?),
    };
    let near_field = NearField::Mesh;
    let meshed = MeshedSpec { elastic, mesh, regions: Vec::new(), element: None, near_field, ..fe.clone() };
    let solids = Some(fe.mesh.clone());
    Ok(BodySpec::Be(Box::new(BeSpec { meshed, solids, interpolation: other.interpolation })))
}

/// Area (mm2) and middle of a group of faces.
fn place_of(mesh: &Mesh, group: &str) -> Option<(f64, Point)> {
    let faces = group_faces(mesh, group).ok()?;
    let (mut area, mut sum) = (0.0, Point::zeros());
    for face in &faces {
        let own = face.area(mesh);
        let nodes = face.nodes[..face.kind.n_corners()].iter().map(|&node| Point::from(mesh.points[node]));
        sum += nodes.sum::<Point>() * (own / face.kind.n_corners() as f64);
        area += own;
    }
    Some((area, sum / area))
}

/// What the user should know of groups that lie elsewhere in the other mesh of a body, or are larger; its contact group may be, unless it bears loads.
fn unlike(meshed: &MeshedSpec, own: &Mesh, other: &Mesh, body: &str) -> Vec<String> {
    let mut told: Vec<&str> = Vec::new();
    let mut notes = Vec::new();
    for group in meshed.groups().skip(1) {
        let (Some((area, middle)), Some((other_area, other_middle))) =
            (place_of(own, group), place_of(other, group))
        else {
            continue;
        };
        let apart = (middle - other_middle).norm();
        let alike = (other_area / area - 1.0).abs() < ALIKE && apart < ALIKE * area.sqrt();
        if alike || told.contains(&group) {
            continue;
        }
        told.push(group);
        notes.push(doubtful(&format!(
            "the group \"{group}\" of {body} has an area of {area:.4} about {} in {}, and of {other_area:.4} about {} in {}: supports and loads \
             are not the same",
            place(&middle.into()),
            own.source,
            place(&other_middle.into()),
            other.source
        )));
    }
    notes
}

fn skin(mesh: &Mesh) -> Result<Mesh> {
    surface::outward(&surface::skin(mesh)).map(|(mesh, _)| mesh)
}

/// A body of boundary elements as one of finite elements.
fn finite_elements(plan: &Plan, be: &BeSpec, index: usize, notes: &mut Vec<String>) -> Result<BodySpec> {
    let (body, other) = (KEYS[index], &plan.compare.others[index]);
    let Some(mesh) = other.solids.as_ref().or(be.solids.as_ref()) else {
        return Err(Error::input(format!(
            "{body} has a surface mesh only: name one of its solids, compare.{body}.fe.mesh"
        )));
    };
    if other.solids.is_some() {
        notes.extend(unlike(&be.meshed, &be.meshed.mesh, mesh, body));
    }
    let elastic = &be.meshed.elastic;
    let placed = Placed {
        name: elastic.name.clone(),
        stiffness: elastic.stiffness.clone(),
        orientation: Orientation::Uniform(elastic.axes(0.0)),
    };
    Ok(BodySpec::Fe(Box::new(MeshedSpec {
        mesh: mesh.clone(),
        regions: vec![(None, Placement::Single(Box::new(placed)))],
        element: other.element,
        near_field: other.near_field,
        ..be.meshed.clone()
    })))
}
