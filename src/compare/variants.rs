//! Replaces a body by another discretisation: finite elements, boundary elements or a half-space.

use std::sync::Arc;

use crate::body::truncated_half_space::HALF_SIZE_TO_FRAME_RANGE;
use crate::error::{Context, Error, Result, Warning};
use crate::frame::ContactFrame;
use crate::geometry::{Point, format_point};
use crate::material::{Orientation, PlacedMaterial, RegionMaterial};
use crate::mesh::faces::group_faces;
use crate::mesh::{Mesh, closed_surface};
use crate::scene::mean_material::{MeanMaterial, mean_material_of_body, mean_material_under_frame};
use crate::scene::plan::{BeBodyPlan, BodyMaterial, BodyPlan, MeshedBodyPlan, Plan, PrescribedDisplacement};
use crate::scene::spec::body::NearField;
use crate::scene::variant::Discretisation;
use crate::simulation::plan_bodies::{BODY_KEYS, free_motions};

/// Largest angle, degrees, between the material axes of a body and the axes of the half-space that replaces the body.
const MAX_AXES_SPREAD_DEG: f64 = 5.0;

/// Limit up to which a group of faces counts as equal in two meshes: for |A2 / A1 - 1| (areas A) and |c2 - c1| / √A1
/// (centroids c).
const ALIKE: f64 = 0.05;

/// Largest angle between material axes, degrees, that counts as rounding error.
const ROUNDING_SPREAD_DEG: f64 = 1e-6;

/// Body `index` of the plan with the discretisation `kind`. An error if the body cannot be replaced.
pub(super) fn replace_body(
    plan: &Plan,
    index: usize,
    kind: Discretisation,
    notes: &mut Vec<Warning>,
) -> Result<BodyPlan> {
    let body = &plan.bodies[index];
    if body.discretisation() == kind {
        return Ok(body.clone());
    }
    let key = BODY_KEYS[index];
    if let (BodyPlan::TruncatedHalfSpace(body), Discretisation::HalfSpace) = (body, kind) {
        return Ok(BodyPlan::HalfSpace(Box::new(body.material.clone())));
    }
    if kind == Discretisation::TruncatedHalfSpace {
        return Err(Error::input(format!(
            "{key} is not a truncated half-space (THS) in the scene: use kind = \"half-space\" with truncated = HALF_SIDE, {} to {} times the half-width of the frame",
            HALF_SIZE_TO_FRAME_RANGE[0], HALF_SIZE_TO_FRAME_RANGE[1]
        )));
    }
    let Some(meshed) = body.as_meshed() else {
        let what = if matches!(body, BodyPlan::Rigid) { "is rigid" } else { "is a half-space" };
        return Err(Error::input(format!(
            "{key} {what} in the scene and has no mesh for another model: use a variant with {} for {key}",
            body.discretisation().name()
        )));
    };
    match (kind, body) {
        (Discretisation::HalfSpace, _) => half_space(plan, meshed, index, notes),
        (Discretisation::BoundaryElements, _) => boundary_elements(plan, meshed, index, notes),
        (Discretisation::FiniteElements, BodyPlan::Be(be)) => finite_elements(plan, be, index, notes),
        _ => Err(Error::input(format!(
            "{key} is elastic in the scene: use a variant with FE, BE or HS for {key}, or a scene with {key}.kind = \"rigid\""
        ))),
    }
}

pub(super) fn is_plane(frame: &ContactFrame) -> bool {
    let (Some(axes), Some(first)) = (frame.triads.first(), frame.centers.first()) else { return false };
    let size = frame.areas.iter().sum::<f64>().sqrt();
    let level = frame.triads.distinct().iter().all(|triad| (triad.0 - axes.0).amax() < 1e-6);
    level && frame.centers.iter().all(|centre| axes.normal().dot(&(centre - first)).abs() < 1e-6 * size)
}

/// Material of `found`. An error if there are several materials, or if the axes vary by more than `most` degrees.
/// `place` names the averaged part of the body and `what` the new model in messages.
fn single(found: MeanMaterial, body: &str, place: &str, what: &str, most: f64) -> Result<BodyMaterial> {
    if found.materials.len() > 1 {
        let names = found.materials.join(", ");
        return Err(Error::input(format!(
            "{body} has several materials {place} ({names}), but {what} has one: use a variant with FE for {body}"
        )));
    }
    let spread = found.axes_spread.to_degrees();
    if spread > most {
        let allowed = match most > ROUNDING_SPREAD_DEG {
            true => format!("allows {most}"),
            false => "has one direction".to_owned(),
        };
        return Err(Error::input(format!(
            "the material axes of {body} vary by {spread:.1} degrees {place}; {what} {allowed}: use a variant with FE for {body}"
        )));
    }
    Ok(found.material)
}

/// Half-space that replaces a body with a mesh. It has the material of the body under the frame. An unconstrained body
/// causes an error. Notes report omitted loads, foundations and prescribed displacements, and other materials of the
/// body.
fn half_space(
    plan: &Plan,
    meshed: &MeshedBodyPlan,
    index: usize,
    notes: &mut Vec<Warning>,
) -> Result<BodyPlan> {
    let body = BODY_KEYS[index];
    if let Some(free) = free_motions(&plan.bodies[index], body).map_err(|failure| failure.error)? {
        let names = free.names.join(", ");
        return Err(Error::input(format!(
            "{body} has unconstrained rigid-body modes ({names}), but a half-space has neither rigid-body modes nor loads of its own: use a variant with FE or BE for {body}"
        )));
    }
    let elastic = if plan.bodies[index].as_be().is_some() {
        meshed.material.clone()
    } else {
        let found = mean_material_under_frame(meshed, &plan.frame)?;
        single(found, body, "under the frame", "a half-space", MAX_AXES_SPREAD_DEG)?
    };
    let moved = |support: &PrescribedDisplacement| {
        let values = support.values.iter().zip(&support.gradient);
        values
            .into_iter()
            .any(|(value, row)| value.is_some_and(|v| v != 0.0) || row.iter().any(|g| *g != 0.0))
    };
    if meshed.temperature.is_some() {
        notes.push(Warning::note(format!(
            "the half-space that replaces {body} expands along its surface only: its thickness does not grow, and no supports hold it"
        )));
    }
    let lost = [
        (!meshed.pressures.is_empty(), "pressures"),
        (!meshed.tractions.is_empty(), "tractions"),
        (meshed.body_force != [0.0; 3], "body force"),
        (!meshed.foundations.is_empty(), "foundations"),
        (meshed.supports.iter().any(moved), "prescribed displacements"),
    ];
    let lost: Vec<&str> = lost.into_iter().filter(|(is_there, _)| *is_there).map(|(_, what)| what).collect();
    if !lost.is_empty() {
        notes.push(Warning::note(format!("the half-space omits the {} of {body}", lost.join(" and "))));
    }
    let whole = mean_material_of_body(meshed).ok().filter(|_| plan.bodies[index].as_fe().is_some());
    if whole.is_some_and(|all| all.materials.len() > 1 || all.axes_spread.to_degrees() > MAX_AXES_SPREAD_DEG)
    {
        notes.push(Warning::uncertain(&format!(
            "the half-space that replaces {body} has the material under the frame, {}, everywhere; elsewhere {body} has other materials or directions",
            elastic.name
        )));
    }
    Ok(BodyPlan::HalfSpace(Box::new(elastic)))
}

/// Boundary-element body that replaces a finite-element body. The body must have one material with uniform axes.
fn boundary_elements(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    notes: &mut Vec<Warning>,
) -> Result<BodyPlan> {
    let (body, other) = (BODY_KEYS[index], &plan.compare.alternatives[index]);
    if !fe.foundations.is_empty() {
        return Err(Error::input(format!(
            "{body} has foundations, which boundary elements do not support: use a variant with FE or HS for {body}"
        )));
    }
    let material =
        single(mean_material_of_body(fe)?, body, "in it", "a boundary-element body", ROUNDING_SPREAD_DEG)?;
    let inner = || format!("{body} as a boundary-element body can be fixed and loaded on surfaces only");
    for group in fe.groups() {
        group_faces(&fe.mesh, group).context(inner)?;
    }
    let mesh = match &other.surface {
        Some(mesh) => {
            notes.extend(group_mismatch_warnings(fe, &fe.mesh, mesh, body));
            mesh.clone()
        }
        None => Arc::new(skin(&fe.mesh).context(|| body.to_owned())?),
    };
    let near_field = NearField::Mesh;
    let meshed =
        MeshedBodyPlan { material, mesh, regions: Vec::new(), element: None, near_field, ..fe.clone() };
    let solids = Some(fe.mesh.clone());
    Ok(BodyPlan::Be(Box::new(BeBodyPlan { meshed, solids, interpolation: other.interpolation })))
}

/// Area and centroid of a group of faces. The centroid of a face is approximated by the mean of its corners.
fn area_and_centroid(mesh: &Mesh, group: &str) -> Option<(f64, Point)> {
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

/// Warnings about groups of supports, foundations and loads whose area or centroid differs between two meshes.
fn group_mismatch_warnings(meshed: &MeshedBodyPlan, own: &Mesh, other: &Mesh, body: &str) -> Vec<Warning> {
    let mut told: Vec<&str> = Vec::new();
    let mut notes = Vec::new();
    for group in meshed.groups().skip(1) {
        let (Some((area, middle)), Some((other_area, other_middle))) =
            (area_and_centroid(own, group), area_and_centroid(other, group))
        else {
            continue;
        };
        let apart = (middle - other_middle).norm();
        let alike = (other_area / area - 1.0).abs() < ALIKE && apart < ALIKE * area.sqrt();
        if alike || told.contains(&group) {
            continue;
        }
        told.push(group);
        notes.push(Warning::uncertain(&format!(
            "the group \"{group}\" of {body} has an area of {area:.4} with its centre at {} in {}, but of {other_area:.4} at {} in {}: supports and loads differ between the meshes",
            format_point(&middle.into()),
            own.source,
            format_point(&other_middle.into()),
            other.source
        )));
    }
    notes
}

fn skin(mesh: &Mesh) -> Result<Mesh> {
    closed_surface::orient_outward(&closed_surface::boundary_surface(mesh)).map(|(mesh, _)| mesh)
}

/// Finite-element body that replaces a boundary-element body. An error if the scene gives no volume mesh.
fn finite_elements(plan: &Plan, be: &BeBodyPlan, index: usize, notes: &mut Vec<Warning>) -> Result<BodyPlan> {
    let (body, other) = (BODY_KEYS[index], &plan.compare.alternatives[index]);
    let Some(mesh) = other.solids.as_ref().or(be.solids.as_ref()) else {
        return Err(Error::input(format!(
            "{body} has only a surface mesh: name a volume mesh with compare.{body}.fe.mesh"
        )));
    };
    if other.solids.is_some() {
        notes.extend(group_mismatch_warnings(&be.meshed, &be.meshed.mesh, mesh, body));
    }
    let elastic = &be.meshed.material;
    let placed = PlacedMaterial {
        name: elastic.name.clone(),
        stiffness: elastic.stiffness.clone(),
        expansion: elastic.expansion,
        orientation: Orientation::Uniform(elastic.material_axes(0.0)),
    };
    Ok(BodyPlan::Fe(Box::new(MeshedBodyPlan {
        mesh: mesh.clone(),
        regions: vec![(None, RegionMaterial::Single(Box::new(placed)))],
        element: other.element,
        near_field: other.near_field,
        ..be.meshed.clone()
    })))
}
