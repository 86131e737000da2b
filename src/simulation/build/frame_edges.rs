//! Finds the edges of the frame at which a body also ends. At these edges, the frame does not cut off contact.

use std::collections::{HashMap, HashSet};

use crate::frame::face_map::covered_cells;
use crate::frame::{ContactFrame, Side};
use crate::geometry::Point;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces, outer_faces};
use crate::scene::plan::Plan;
use crate::simulation::failure::{AtKey, SceneError};

/// Minimum cosine of the angle between face normals at which a surface continues smoothly over an edge.
const MIN_SMOOTH_COSINE: f64 = 0.9;

/// Marks the cells at whose outer edges a meshed body ends. The body may end at its own edge, at a symmetry plane, or
/// at a side of a slice in plane strain. A surface that continues smoothly beyond its contact group does not end at the
/// edge of the group.
///
/// A cell is not marked if both bodies continue beyond another of its outer edges.
///
/// # Errors
/// If a contact group is invalid.
pub(crate) fn with_body_ends(plan: &Plan, frame: ContactFrame) -> Result<ContactFrame, SceneError> {
    let mut ends = vec![false; frame.n_cells()];
    let edges = outer_edges(plan, &frame)?;
    edges.iter().for_each(|edge| ends[edge.cell] = true);
    edges.iter().filter(|edge| edge.continues).for_each(|edge| ends[edge.cell] = false);
    let body_ends = ends.contains(&true).then_some(ends);
    Ok(ContactFrame { body_ends, ..frame })
}

/// Grid axes along which both bodies continue beyond an edge of the frame.
///
/// # Errors
/// If a contact group is invalid.
pub(crate) fn continuing_axes(plan: &Plan, frame: &ContactFrame) -> Result<[bool; 2], SceneError> {
    if plan.bodies.iter().all(|body| body.as_meshed().is_none()) {
        return Ok([true; 2]);
    }
    let mut found = [false; 2];
    for edge in outer_edges(plan, frame)?.iter().filter(|edge| edge.continues) {
        found[usize::from(edge.outward[0].abs() < edge.outward[1].abs())] = true;
    }
    Ok(found)
}

struct OuterEdge {
    cell: usize,
    /// Outward direction along the frame's x and y.
    outward: [f64; 2],
    /// Whether both bodies continue beyond the edge.
    continues: bool,
}

/// Outer edges of the frame's cells. Empty if no body is meshed, because the surfaces of other bodies are unbounded.
fn outer_edges(plan: &Plan, frame: &ContactFrame) -> Result<Vec<OuterEdge>, SceneError> {
    if plan.bodies.iter().all(|body| body.as_meshed().is_none()) {
        return Ok(Vec::new());
    }
    let (strips, cells) = frame.strips_beyond_edges();
    let outward = |(strip, &cell): (usize, &usize)| {
        let local = frame.axes.to_local(&(strips.centers[strip] - frame.centers[cell]));
        OuterEdge { cell, outward: [local.x, local.y], continues: true }
    };
    let mut edges: Vec<OuterEdge> = cells.iter().enumerate().map(outward).collect();
    for (side, body) in [Side::Lower, Side::Upper].into_iter().zip(&plan.bodies) {
        let Some(fe) = body.as_meshed() else { continue };
        let mut faces = group_faces(&fe.mesh, &fe.contact).at(side.key())?;
        let mut covered = covered_cells(&strips, &fe.mesh, &faces, side);
        if covered.contains(&false) {
            faces.extend(smooth_continuation(&fe.mesh, &faces));
            covered = covered_cells(&strips, &fe.mesh, &faces, side);
        }
        edges.iter_mut().zip(covered).for_each(|(edge, covered)| edge.continues &= covered);
    }
    Ok(edges)
}

/// Outer faces next to `faces` that continue the surface of `faces` smoothly.
fn smooth_continuation(mesh: &Mesh, faces: &[SurfaceFace]) -> Vec<SurfaceFace> {
    let edges = |face: &SurfaceFace| -> Vec<[usize; 2]> {
        let n = face.kind.n_corners();
        let ends = |k: usize| [face.nodes[k], face.nodes[(k + 1) % n]];
        (0..n).map(ends).map(|[a, b]| [a.min(b), a.max(b)]).collect()
    };
    let normals: HashMap<[usize; 2], Point> = faces
        .iter()
        .flat_map(|face| edges(face).into_iter().map(|edge| (edge, face.area_vector(mesh).normalize())))
        .collect();
    let own: HashSet<_> = faces.iter().map(SurfaceFace::id).collect();
    let continues = |face: &SurfaceFace| {
        let normal = face.area_vector(mesh).normalize();
        let smooth =
            |edge: &[usize; 2]| normals.get(edge).is_some_and(|n| n.dot(&normal) >= MIN_SMOOTH_COSINE);
        !own.contains(&face.id()) && edges(face).iter().any(smooth)
    };
    outer_faces(mesh).into_iter().filter(continues).collect()
}
