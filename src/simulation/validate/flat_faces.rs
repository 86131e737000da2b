//! What flat faces of a curved surface cut off of a gap that is taken from meshes, against the depth of the contact.
//!
//! An edge of length h on a surface of radius R lies up to h^2 / 8R inside it. In the gap of a condensed mesh this is distance; where
//! the near field is that of a half-space the faces are bowed, and what the curvatures at the two ends of an edge do not agree on
//! is left.

use crate::error::warning;
use crate::evolution::records::IncrementRecord;
use crate::evolution::step::Normal;
use crate::frame::{ContactFrame, EdgeSagitta, GapShape, edge_sagittas};
use crate::geometry::format_short;
use crate::mesh::faces::group_faces;
use crate::scene::plan::{MeshedBodyPlan, Plan};
use crate::simulation::build::bodies::{BODY_KEYS, face_map};
use crate::simulation::failure::{AtKey, SceneError};

/// More than this share of the approach cut off by flat faces puts loads in doubt. Tried with a cap of R = 20 mm as condensed mesh
/// (docs/theory-coupling.md): the load errs by one to two times the share.
const MAX_FACETING_ERROR_SHARE: f64 = 0.02;

/// An overlap of less than this share of the frame's size is rounding.
const MIN_OVERLAP_SHARE: f64 = 1e-6;

/// A bow of less than this share of an edge is rounding.
const ROUNDING: f64 = 1e-9;

/// A warning if flat faces of curved surfaces overlap where the surfaces first touch (`gap`, `[N]`, mm) and the steps prescribe no approach beyond it.
pub(in crate::simulation) fn preload_warning(
    plan: &Plan,
    frame: &ContactFrame,
    gap: &[f64],
) -> Option<String> {
    let overlap = -gap.iter().copied().fold(f64::INFINITY, f64::min);
    let pressed_by_approach = plan.max_prescribed_approach().is_some();
    let under_force = plan.steps.iter().any(|step| matches!(step.normal, Some(Normal::Force(_))));
    let certain = overlap > MIN_OVERLAP_SHARE * frame.size() && !pressed_by_approach && !under_force;
    certain.then(|| overlap_warning(plan, overlap))
}

/// A warning if a run under forces reaches an `approach` of no more than that of the first touch, in spite of an overlap of flat faces there: `gap` as in
/// [`preload_warning`], without loads of the bodies.
pub(in crate::simulation) fn reached_preload_warning(
    plan: &Plan,
    frame: &ContactFrame,
    (gap, approach): (&[f64], f64),
) -> Option<String> {
    let overlap = -gap.iter().copied().fold(f64::INFINITY, f64::min);
    let under_force =
        plan.steps.iter().any(|step| matches!(step.normal, Some(Normal::Force(value)) if value > 0.0));
    let certain = plan.gap.shape == GapShape::Mesh && overlap > MIN_OVERLAP_SHARE * frame.size();
    (certain && under_force && approach < overlap).then(|| overlap_warning(plan, overlap))
}

fn overlap_warning(plan: &Plan, overlap: f64) -> String {
    let unit = &plan.units.length;
    warning(&format!(
        "where the curved surfaces first touch, their flat faces overlap by up to {} {unit} elsewhere. Loads and pressures of an approach of this size come from the \
         mesh, not from the bodies: take elements of second order, or matching nodes on both surfaces",
        format_short(overlap)
    ))
}

/// The largest approach of a run whose steps prescribe none, mm; loads of the bodies themselves may make it negative.
pub(in crate::simulation) fn max_reached_approach(plan: &Plan, records: &[IncrementRecord]) -> Option<f64> {
    let most = records.iter().map(|record| record.approach).reduce(f64::max);
    most.filter(|_| plan.max_prescribed_approach().is_none())
}

/// Warnings where the flat faces over cells with a `gap` (`[N]`, mm) of at most `depth` cut off more than they should, or those over the nearest cells if the
/// gap of all is larger. Bodies that are `bowed` have the rest of it only.
///
/// # Errors
/// If frame and faces do not fit.
pub(in crate::simulation) fn check(
    plan: &Plan,
    frame: &ContactFrame,
    (gap, depth): (&[f64], f64),
    bowed: [bool; 2],
) -> Result<Vec<String>, SceneError> {
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
        doubts.push(faceting_warning(plan, BODY_KEYS[index], (&worst, lost(&worst)), (depth, bowed)));
    }
    Ok(doubts)
}

/// The most by which flat faces of body `index` under the frame are bowed in the gap, mm; `None` if they are plane, or the gap is not
/// that of the meshes.
///
/// # Errors
/// If frame and faces do not fit.
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

/// What the faces of body `index` cut off whose nodes all belong to cells that `counts`.
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

/// A warning where the `error` of what loads of body `key` do to its surface matters against the overlap of the
/// undeformed bodies, or what keeps them apart, at an `approach` over a normal `gap` that includes what its loads do to it (`[N]`), mm.
pub(in crate::simulation) fn own_load_warning(
    plan: &Plan,
    key: &str,
    error: Option<f64>,
    (gap, approach): (&[f64], f64),
) -> Option<String> {
    let overlap = approach - gap.iter().copied().fold(f64::INFINITY, f64::min);
    let depth = overlap.abs();
    let error = error.filter(|error| *error > MAX_FACETING_ERROR_SHARE * depth)?;
    let unit = &plan.units.length;
    let what = if overlap > 0.0 { "overlap" } else { "opening" };
    Some(warning(&format!(
        "what loads and prescribed displacements of {key} do to its surface under the frame is uncertain by an estimated {} {unit}, \
         {:.1} % of the {what} of {} {unit} of the bodies that do not touch yet, and loads and pressures by as much or twice as much: take \
         elements of second order, or smaller ones (`orthowear refine` says where)",
        format_short(error),
        100.0 * error / depth,
        format_short(depth)
    )))
}

fn faceting_warning(
    plan: &Plan,
    key: &str,
    (cut, lost): (&EdgeSagitta, f64),
    (depth, bowed): (f64, bool),
) -> String {
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
            "the flat contact faces of {key}, edges of {length} {unit}, are bowed in the gap by the curvature of the surface around \
             them, which differs from node to node: up to {lost} {unit} are uncertain, {share:.1} % of the approach of {depth} {unit}, \
             and loads and pressures with them"
        )
    } else {
        format!(
            "the contact faces of {key} are flat, with edges of {length} {unit} on a surface of radius {radius} {unit}, and cut off up \
             to {lost} {unit} of it, {share:.1} % of the approach of {depth} {unit}; in the gap (gap.kind = \"mesh\") this is distance, \
             and loads and pressures err by as much or twice as much"
        )
    };
    warning(&format!(
        "{what}: take elements of second order, faces of at most {fine} {unit} there, or the gap of the shape itself (gap.kind = \
         \"ellipsoid\", \"sphere\" or \"cylinder\", with its radii)"
    ))
}
