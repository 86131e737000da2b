//! Whether frame, contact faces, supports and fibres of a plan fit together.

use super::bodies::{KEYS, face_map};
use super::failure::{AtKey, Failure};
use crate::error::Error;
use crate::frame::ContactFrame;
use crate::friction::FrictionLaw;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};
use crate::scene::keys::frame::FramePoints;
use crate::scene::plan::{BodySpec, FeSpec, FrameSpec, Plan};
use crate::wear::WearLaw;

/// Cells smaller than this share of the finest body's faces are refused.
const LEAST_RATIO: f64 = 0.9;

/// Cells smaller than this many of the finest body's faces are warned about.
const SAFE_RATIO: f64 = 2.0;

/// Keys of the supports of the two bodies.
const SUPPORTS: [[&str; 2]; 2] = [["body1.fixed", "body1.displaced"], ["body2.fixed", "body2.displaced"]];

/// What the user should know of how `plan` and its `frame` fit.
///
/// # Errors
/// If a support holds contact nodes along the normal, or the cells are finer than every meshed body although no
/// half-space takes part.
///
/// # Source
/// formulation 3.1: never more points of the frame than degrees of freedom of the finer side.
pub(super) fn check(plan: &Plan, frame: &ContactFrame) -> Result<Vec<String>, Failure> {
    let mut notes = Vec::new();
    let mut finest: Option<f64> = None;
    for (index, (body, key)) in plan.bodies.iter().zip(KEYS).enumerate() {
        let Some(fe) = body.fe() else { continue };
        let map = face_map(fe, index, frame)?;
        let faces = group_faces(&fe.mesh, &fe.contact).at(key)?;
        let mut under = vec![false; fe.mesh.points.len()];
        map.nodes().iter().for_each(|&node| under[node] = true);
        free_along_normal(fe, index, &under)?;
        let faces: Vec<&SurfaceFace> =
            faces.iter().filter(|face| face.nodes.iter().all(|&node| under[node])).collect();
        notes.extend(other_fibre(plan, fe, index, &faces));
        let area = faces.iter().map(|face| area(&fe.mesh, face)).sum::<f64>() / faces.len() as f64;
        finest = Some(finest.map_or(area, |least| least.min(area)));
    }
    let half_space = plan.bodies.iter().any(|body| matches!(body, BodySpec::HalfSpace(_)));
    // A cell per node is as many as the nodes can feel.
    let nodal = matches!(plan.frame, FrameSpec::Mesh { points: FramePoints::Nodes, .. });
    if let (Some(face), false, false) = (finest, half_space, nodal) {
        notes.extend(cells_against_faces(frame, face)?);
    }
    Ok(notes)
}

/// Refuses supports that leave no freedom along z to a node under the frame.
fn free_along_normal(fe: &FeSpec, index: usize, under: &[bool]) -> Result<(), Failure> {
    for support in fe.supports.iter().filter(|support| support.values[2].is_some()) {
        let nodes = fe.mesh.group_nodes(&support.group).at(KEYS[index])?;
        let held = nodes.iter().filter(|&&node| under[node]).count();
        if held > 0 {
            let displaced = support.values.iter().flatten().any(|&value| value != 0.0);
            let error = Error::input(format!(
                "the support on group `{}` holds {held} of the {} nodes under the frame along z; contact \
                 nodes must be free along the normal: support another group, take a smaller frame, or leave z out \
                 of `components`",
                support.group,
                under.iter().filter(|&&is| is).count()
            ));
            return Err(Failure { error, key: SUPPORTS[index][usize::from(displaced)].to_owned() });
        }
    }
    Ok(())
}

/// The mean cell of the frame against the mean face (mm2) of the finest body.
fn cells_against_faces(frame: &ContactFrame, face: f64) -> Result<Option<String>, Failure> {
    let cell = frame.areas.iter().sum::<f64>() / frame.n_cells() as f64;
    let ratio = cell / face;
    if ratio >= SAFE_RATIO {
        return Ok(None);
    }
    let (cell, face) = (cell.sqrt(), face.sqrt());
    if ratio >= LEAST_RATIO {
        return Ok(Some(format!(
            "cells about as fine as the elements ({cell:.3e} mm, elements {face:.3e} mm): tractions may \
             oscillate; take cells of at least {:.3e} mm{} or pair with a half-space",
            face * SAFE_RATIO.sqrt(),
            at_most(frame, ratio, SAFE_RATIO)
        )));
    }
    let error = Error::input(format!(
        "the cells of the frame (mean side {cell:.3e} mm) are finer than the contact faces of the finest body \
         (mean side {face:.3e} mm), so that their tractions are not determined; take cells of at least {:.3e} mm{}, \
         refine a mesh, or make one body a half-space",
        face * LEAST_RATIO.sqrt(),
        at_most(frame, ratio, LEAST_RATIO)
    ));
    Err(Failure { error, key: if frame.grid.is_some() { "frame.cells" } else { "frame.body" }.to_owned() })
}

/// The finest grid whose cells reach `wanted` faces each, in words, from the present `ratio`.
fn at_most(frame: &ContactFrame, ratio: f64, wanted: f64) -> String {
    let Some(grid) = frame.grid else { return String::new() };
    let [x, y] = grid.cells.map(|n| ((n as f64 * (ratio / wanted).sqrt()).floor() as usize).max(1));
    format!(" (cells = [{x}, {y}] or fewer)")
}

/// A note if a law takes the body's fibre although a region with another one lies under the frame.
fn other_fibre(plan: &Plan, fe: &FeSpec, index: usize, faces: &[&SurfaceFace]) -> Option<String> {
    let own = fe.elastic.fibre?;
    let mut laws = Vec::new();
    if matches!(plan.friction, FrictionLaw::Frp { tilt, .. } if tilt == own.tilt) {
        laws.push("friction");
    }
    if matches!(plan.wear, WearLaw::Frp { tilt, .. } if tilt == own.tilt) {
        laws.push("wear");
    }
    let (group, _) = fe.regions.iter().find(|(group, elastic)| {
        let cells = fe.mesh.group(group).map(|group| group.cells.as_slice()).unwrap_or_default();
        elastic.fibre != Some(own) && faces.iter().any(|face| cells.contains(&face.owner))
    })?;
    (!laws.is_empty()).then(|| {
        format!(
            "region `{group}` of {} lies under the frame with another fibre than the body's; {} take the fibre of \
             the body",
            KEYS[index],
            laws.join(" and ")
        )
    })
}

/// Area of a face between its corners, mm2.
fn area(mesh: &Mesh, face: &SurfaceFace) -> f64 {
    let corner = |i: usize| crate::geometry::Point::from(mesh.points[face.nodes[i]]);
    let fan = 1..face.kind.n_corners() - 1;
    let first = corner(0);
    0.5 * fan.map(|i| (corner(i) - first).cross(&(corner(i + 1) - first)).norm()).sum::<f64>()
}
