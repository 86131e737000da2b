//! The variants of a scene: each meshed body as it is, or as the half-space of its material, on the same frame.

use super::bodies::{KEYS, distances, face_map, frame};
use super::failure::Failure;
use super::near_field::choose;
use crate::error::{Error, Result};
use crate::frame::{ContactFrame, GapShape};
use crate::scene::plan::{BodySpec, MeshedSpec, Plan, Support};
use crate::scene::surface::surface_material;

/// Largest angle (degrees) of a material axis under the frame from those of the half-space that stands for it.
const LARGEST_SPREAD: f64 = 5.0;

/// One way to compute a scene.
pub struct Variant {
    /// What body 1 and body 2 are: "FE-BE"; BE is a half-space.
    pub name: String,
    /// The plan, or why there is none.
    pub plan: Result<Plan>,
    /// What the user should know of it.
    pub notes: Vec<String>,
}

impl Variant {
    /// Name of its folder: "fe-be".
    pub fn folder(&self) -> String {
        self.name.to_lowercase()
    }
}

/// The variants of `plan` on its frame, the scene as it is written first.
///
/// # Errors
/// If the frame cannot be made, or the gap of two meshes cannot be taken on it.
pub fn variants(plan: &Plan) -> std::result::Result<(ContactFrame, Vec<Variant>), Failure> {
    let frame = frame(plan)?;
    let mut shared = plan.clone();
    let gap = (plan.gap.shape == GapShape::Mesh).then(|| mesh_gap(plan, &frame)).transpose()?;
    let meshed = [0, 1].map(|index| plan.bodies[index].fe().is_some());
    let choices = |index: usize| if meshed[index] { vec![false, true] } else { vec![false] };
    let mut variants = Vec::new();
    for replace1 in choices(0) {
        for replace2 in choices(1) {
            let replaced = [replace1, replace2];
            if replaced == [false; 2] {
                let name = name(plan, replaced);
                variants.push(Variant { name, plan: Ok(plan.clone()), notes: Vec::new() });
                continue;
            }
            if let Some(shape) = &gap {
                shared.gap = shape.clone().into();
            }
            variants.push(variant(&shared, &frame, replaced));
        }
    }
    Ok((frame, variants))
}

fn name(plan: &Plan, replaced: [bool; 2]) -> String {
    let kinds = [0, 1].map(|index| match &plan.bodies[index] {
        BodySpec::Fe(_) if !replaced[index] => "FE",
        BodySpec::Rigid => "rigid",
        _ => "BE",
    });
    kinds.join("-")
}

/// The plan with some of its meshed bodies replaced by half-spaces.
fn variant(plan: &Plan, frame: &ContactFrame, replaced: [bool; 2]) -> Variant {
    let mut notes = Vec::new();
    let mut changed = plan.clone();
    let mut refused = None;
    for index in (0..2).filter(|&index| replaced[index]) {
        let Some(fe) = plan.bodies[index].fe() else { continue };
        match half_space(plan, fe, index, &mut notes) {
            Ok(body) => changed.bodies[index] = body,
            Err(error) => refused = refused.or(Some(error)),
        }
    }
    if !is_plane(frame) {
        refused = Some(Error::input("the contact frame is curved, a half-space needs a plane one"));
    }
    Variant { name: name(plan, replaced), plan: refused.map_or(Ok(changed), Err), notes }
}

/// Whether all cells lie in one plane, as a half-space needs it.
fn is_plane(frame: &ContactFrame) -> bool {
    let (Some(axes), Some(first)) = (frame.triads.first(), frame.centers.first()) else { return false };
    let size = frame.areas.iter().sum::<f64>().sqrt();
    let level = frame.triads.distinct().iter().all(|triad| (triad.0 - axes.0).amax() < 1e-6);
    level && frame.centers.iter().all(|centre| axes.normal().dot(&(centre - first)).abs() < 1e-6 * size)
}

/// The half-space of the material that a meshed body has under the frame.
fn half_space(plan: &Plan, fe: &MeshedSpec, index: usize, notes: &mut Vec<String>) -> Result<BodySpec> {
    let surface = surface_material(fe, &plan.frame)?;
    let body = KEYS[index];
    if surface.materials.len() > 1 {
        return Err(Error::input(format!(
            "{body} has several materials under the frame ({}), a half-space has one",
            surface.materials.join(", ")
        )));
    }
    let spread = surface.axes_spread.to_degrees();
    if spread > LARGEST_SPREAD {
        return Err(Error::input(format!(
            "the material axes of {body} vary by up to {spread:.1} degrees under the frame (at most {LARGEST_SPREAD}), \
             a half-space has one direction"
        )));
    }
    let moved = |support: &Support| {
        let values = support.values.iter().zip(&support.gradient);
        values
            .into_iter()
            .any(|(value, row)| value.is_some_and(|v| v != 0.0) || row.iter().any(|g| *g != 0.0))
    };
    let lost = [
        (!fe.pressures.is_empty() || !fe.tractions.is_empty() || fe.body_force != [0.0; 3], "loads"),
        (!fe.foundations.is_empty(), "foundations"),
        (fe.supports.iter().any(moved), "prescribed displacements"),
    ];
    let lost: Vec<&str> = lost.into_iter().filter(|(is_there, _)| *is_there).map(|(_, what)| what).collect();
    if !lost.is_empty() {
        notes.push(format!("the {} of {body} have no place in a half-space", lost.join(" and ")));
    }
    if fe.regions.len() > 1 {
        notes.push(format!("the half-space in the place of {body} is all of {}", surface.elastic.name));
    }
    Ok(BodySpec::HalfSpace(Box::new(surface.elastic)))
}

/// The distance of the meshed surfaces, cell by cell, for bodies that do not have their meshes any more.
fn mesh_gap(plan: &Plan, frame: &ContactFrame) -> std::result::Result<GapShape, Failure> {
    let mut heights = [None, None];
    for (index, (heights, body)) in heights.iter_mut().zip(&plan.bodies).enumerate() {
        if let Some(fe) = body.fe() {
            *heights = Some(face_map(fe, index, frame)?.heights(frame, &fe.mesh));
        }
    }
    Ok(GapShape::Cells(distances(plan, frame, heights, &choose(plan, frame)?)?))
}
