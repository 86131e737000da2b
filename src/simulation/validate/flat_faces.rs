//! Faceting error of a gap from meshes: the distance between a curved surface and its flat faces, relative to the
//! approach.
//!
//! An edge of length h on a surface of radius R lies up to h^2 / (8 R) inside the surface. The gap of a condensed mesh
//! contains this error in full. The gap of a half-space near field is corrected for the curvature. The correction is
//! uncertain only if the curvatures at the two ends of an edge differ.

use crate::error::Warning;
use crate::evolution::records::IncrementRecord;
use crate::evolution::step::Normal;
use crate::frame::{ContactFrame, EdgeSagitta, GapShape, edge_sagittas};
use crate::geometry::format_short;
use crate::mesh::faces::group_faces;
use crate::scene::plan::{MeshedBodyPlan, Plan};
use crate::simulation::failure::{AtKey, SceneError};
use crate::simulation::plan_bodies::{BODY_KEYS, face_map};

/// Largest faceting error of reliable loads, relative to the approach. The relative load error is one to two times the
/// relative faceting error (docs/theory-coupling.md).
const MAX_FACETING_ERROR_SHARE: f64 = 0.02;

/// Overlap, relative to the frame's size, below which the overlap results from rounding.
const MIN_OVERLAP_SHARE: f64 = 1e-6;

/// Curvature correction, relative to the edge length, below which the correction results from rounding.
const ROUNDING: f64 = 1e-9;

/// Warns if flat faces overlap at first touch, and the steps prescribe neither a positive approach nor a force. `gap`
/// is the gap at first touch, `[N]`, mm.
pub(crate) fn preload_warning(plan: &Plan, frame: &ContactFrame, gap: &[f64]) -> Option<Warning> {
    let overlap = -gap.iter().copied().fold(f64::INFINITY, f64::min);
    let pressed_by_approach = plan.max_prescribed_approach().is_some();
    let under_force = plan.steps.iter().any(|step| matches!(step.normal, Some(Normal::Force(_))));
    let certain = overlap > MIN_OVERLAP_SHARE * frame.size() && !pressed_by_approach && !under_force;
    certain.then(|| overlap_warning(plan, overlap))
}

/// Warns if the `approach` (mm) that prescribed forces reach is smaller than the overlap of flat faces at first touch. `gap` as in
/// [`preload_warning`], without applied loads of the bodies.
pub(crate) fn reached_preload_warning(
    plan: &Plan,
    frame: &ContactFrame,
    gap: &[f64],
    approach: f64,
) -> Option<Warning> {
    let overlap = -gap.iter().copied().fold(f64::INFINITY, f64::min);
    let under_force =
        plan.steps.iter().any(|step| matches!(step.normal, Some(Normal::Force(value)) if value > 0.0));
    let certain = plan.gap.shape == GapShape::Mesh && overlap > MIN_OVERLAP_SHARE * frame.size();
    (certain && under_force && approach < overlap).then(|| overlap_warning(plan, overlap))
}

fn overlap_warning(plan: &Plan, overlap: f64) -> Warning {
    let unit = &plan.units.length;
    Warning::uncertain(&format!(
        "when the curved surfaces first touch, their flat mesh faces already overlap elsewhere by up to {} {unit}. At an approach of this size the mesh, not the shape of the bodies, determines loads and pressures: use elements of second order, or matching nodes on both surfaces",
        format_short(overlap)
    ))
}

/// Largest approach of `records`, mm; `None` if the plan prescribes a positive approach. Applied loads can make the approach
/// negative.
pub(crate) fn max_reached_approach(plan: &Plan, records: &[IncrementRecord]) -> Option<f64> {
    let most = records.iter().map(|record| record.approach).reduce(f64::max);
    most.filter(|_| plan.max_prescribed_approach().is_none())
}

/// Warns about faceting errors under the contact that exceed 2 % of the approach `depth` (mm). The check includes faces
/// under cells whose `gap` (`[N]`, mm) is at most `depth`, and at least those with the smallest gap.
///
/// `bowed` states for each body whether its gap is corrected for curvature. For such a body, only the error of the
/// correction counts.
///
/// # Errors
/// If frame and faces are incompatible.
pub(crate) fn check(
    plan: &Plan,
    frame: &ContactFrame,
    gap: &[f64],
    depth: f64,
    bowed: [bool; 2],
) -> Result<Vec<Warning>, SceneError> {
    let mut doubts = Vec::new();
    let reach = gap.iter().copied().fold(f64::INFINITY, f64::min).max(depth);
    for (index, bowed) in bowed.into_iter().enumerate() {
        let Some(fe) = plan.bodies[index].as_meshed().filter(|_| plan.gap.shape == GapShape::Mesh) else {
            continue;
        };
        let cuts = faceting_errors(fe, index, frame, &|cell| gap[cell] <= reach)?;
        let lost = |cut: &EdgeSagitta| if bowed { cut.disagreement() } else { cut.largest() };
        let worst = cuts.into_iter().max_by(|a, b| lost(a).total_cmp(&lost(b)));
        let Some(worst) = worst.filter(|cut| lost(cut) > MAX_FACETING_ERROR_SHARE * depth) else { continue };
        doubts.push(faceting_warning(plan, BODY_KEYS[index], &worst, lost(&worst), depth, bowed));
    }
    Ok(doubts)
}

/// Largest curvature correction of the flat faces of body `index` under the frame, mm. `None` if no correction is
/// applied.
///
/// # Errors
/// If frame and faces are incompatible.
pub(crate) fn max_curvature_correction(
    plan: &Plan,
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
) -> Result<Option<f64>, SceneError> {
    if plan.gap.shape != GapShape::Mesh {
        return Ok(None);
    }
    let cuts = faceting_errors(fe, index, frame, &|_| true)?;
    let bowed = cuts.iter().filter(|cut| cut.applied() > ROUNDING * cut.length);
    Ok(bowed.map(EdgeSagitta::applied).reduce(f64::max))
}

/// Faceting errors of the edges of body `index`, on faces whose nodes all lie under cells for which `counts` is true.
fn faceting_errors(
    fe: &MeshedBodyPlan,
    index: usize,
    frame: &ContactFrame,
    counts: &dyn Fn(usize) -> bool,
) -> Result<Vec<EdgeSagitta>, SceneError> {
    let map = face_map(fe, index, frame)?;
    let faces = group_faces(&fe.mesh, &fe.contact).at(BODY_KEYS[index])?;
    let mut under = vec![false; fe.mesh.n_points()];
    for cell in (0..map.n_cells()).filter(|&cell| counts(cell)) {
        map.row(cell).for_each(|(node, _)| under[map.nodes()[node]] = true);
    }
    let cuts = edge_sagittas(&fe.mesh, &faces);
    let counted = faces.iter().zip(cuts).filter(|(face, _)| face.nodes.iter().all(|&node| under[node]));
    Ok(counted.flat_map(|(_, cuts)| cuts.into_iter().flatten()).collect())
}

/// Warns if `error` (mm) of the surface displacement due to applied loads of body `key` is significant. The reference
/// is the overlap or opening of the surfaces at the approach `approach` (mm) without contact forces. `gap` (`[N]`, mm)
/// includes the displacement.
pub(crate) fn own_load_warning(
    plan: &Plan,
    key: &str,
    error: Option<f64>,
    gap: &[f64],
    approach: f64,
) -> Option<Warning> {
    let overlap = approach - gap.iter().copied().fold(f64::INFINITY, f64::min);
    let depth = overlap.abs();
    let error = error.filter(|error| *error > MAX_FACETING_ERROR_SHARE * depth)?;
    let unit = &plan.units.length;
    let what = if overlap > 0.0 { "overlap" } else { "opening" };
    Some(Warning::uncertain(&format!(
        "the own loads and supports of {key} displace its surface under the frame with an estimated error of {} {unit}. This is {:.1} % of the {what} of the surfaces without contact forces ({} {unit}). Loads and pressures err by one to two times this share; use elements of second order, or smaller ones",
        format_short(error),
        100.0 * error / depth,
        format_short(depth)
    )))
}

/// Warning about the edge `cut` of body `key`, whose faceting error is `lost` (mm), at the approach `depth` (mm).
/// `bowed` states whether the gap is corrected for curvature.
fn faceting_warning(
    plan: &Plan,
    key: &str,
    cut: &EdgeSagitta,
    lost: f64,
    depth: f64,
    bowed: bool,
) -> Warning {
    let unit = &plan.units.length;
    let share = 100.0 * lost / depth;
    let fine = cut.length * (MAX_FACETING_ERROR_SHARE * depth / lost).sqrt();
    let radius = cut.length * cut.length / (8.0 * cut.largest());
    let (length, lost, depth, fine, radius) = (
        format_short(cut.length),
        format_short(lost),
        format_short(depth),
        format_short(fine),
        format_short(radius),
    );
    let what = if bowed {
        format!(
            "the gap corrects the flat contact faces of {key} (edges of {length} {unit}) for the curvature of the surface. The gap is uncertain by up to {lost} {unit}, {share:.1} % of the approach of {depth} {unit}, and loads and pressures by this share"
        )
    } else {
        format!(
            "the flat contact faces of {key} (edges of {length} {unit}, radius {radius} {unit}) lie up to {lost} {unit} inside the curved surface, {share:.1} % of the approach of {depth} {unit}. Loads and pressures err by one to two times this share"
        )
    };
    Warning::uncertain(&format!(
        "{what}. Use elements of second order, faces of at most {fine} {unit}, or a gap.kind such as \"sphere\" or \"cylinder\""
    ))
}
