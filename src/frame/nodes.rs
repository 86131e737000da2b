//! Contact frames with one cell per node of a body's contact faces. A cell is the polygon through the midpoints of
//! the edges and faces around its node.
//!
//! On a uniform mesh of quadrangles, tractions that alternate in sign from face to face give no nodal forces. One
//! traction per face of the finer of the two meshes thus leaves a checkerboard mode undetermined, but one traction per
//! node does not. Tractions are unique only if no part of the contact surface has more cells than nodes of the finer mesh.

use std::collections::HashMap;

use super::faces::FrameBuilder;
use super::symmetry::SymmetryNodes;
use super::{ContactFrame, Side};
use crate::error::{Context, Error, Result};
use crate::geometry::{Point, format_point};
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, group_faces};

/// A face at a node: the next and the previous corner of the face, counter-clockwise from the node, and the centre of the
/// face.
struct FaceCorner {
    after: usize,
    before: usize,
    middle: Point,
}

impl ContactFrame {
    /// One cell per node of the physical group `group` of the mesh of body `side`, in the order of the nodes. The cell
    /// is the polygon through the midpoints of the edges and faces around the node. At the border of the group the
    /// polygon also contains the node itself. If several fans of faces meet only at a node, each fan gives a cell. Axes
    /// and other arguments are as in [`ContactFrame::from_faces`].
    ///
    /// The nodes in `planes` lie on symmetry planes at which the body is cut. The cell of such a node is a part of a
    /// cell of the full model. It has the axes and the centre of the whole cell, and the area of the part.
    ///
    /// # Errors
    /// As [`ContactFrame::from_faces`], and if a face is of second order.
    pub fn from_nodes(
        mesh: &Mesh,
        group: &str,
        side: Side,
        center: [f64; 2],
        azimuth: f64,
        planes: &SymmetryNodes,
    ) -> Result<Self> {
        let faces = group_faces(mesh, group).context(|| format!("contact frame of {}", side.name()))?;
        let mut around = wedges(mesh, &faces, side)?;
        let mut nodes: Vec<usize> = around.keys().copied().collect();
        nodes.sort_unstable();
        let mut cells = FrameBuilder::default();
        let toward = Point::new(azimuth.cos(), azimuth.sin(), 0.0);
        for node in nodes {
            let mut rest = around.remove(&node).unwrap_or_default();
            while !rest.is_empty() {
                let (corners, open) = next_fan(mesh, node, &mut rest);
                let planes = planes.get(&node).copied().unwrap_or_default();
                cells.push_part(corners, open, planes, toward).ok_or_else(|| {
                    Error::input(format!(
                        "the contact faces around the node at {} of {} have no area: fix the mesh there",
                        format_point(&mesh.points[node]),
                        mesh.source
                    ))
                })?;
            }
        }
        Ok(cells.frame(center, azimuth))
    }
}

fn wedges(mesh: &Mesh, faces: &[SurfaceFace], side: Side) -> Result<HashMap<usize, Vec<FaceCorner>>> {
    let mut around: HashMap<usize, Vec<FaceCorner>> = HashMap::new();
    for face in faces {
        let n = face.kind.n_corners();
        if face.nodes.len() != n {
            return Err(Error::input(format!(
                "the contact face {} of {} is a {}, but cells around nodes need faces of first order: use frame.points = \"faces\"",
                face.tag,
                mesh.source,
                face.kind.name()
            )));
        }
        let mut corners = face.nodes.clone();
        if side == Side::Upper {
            corners.reverse();
        }
        let middle = corners.iter().map(|&node| Point::from(mesh.points[node])).sum::<Point>() / n as f64;
        for k in 0..n {
            let wedge = FaceCorner { after: corners[(k + 1) % n], before: corners[(k + n - 1) % n], middle };
            around.entry(corners[k]).or_default().push(wedge);
        }
    }
    Ok(around)
}

/// Removes a connected fan of faces around `node` from `rest`. Returns the corners of the cell that the fan gives, and
/// whether the fan is open.
fn next_fan(mesh: &Mesh, node: usize, rest: &mut Vec<FaceCorner>) -> (Vec<Point>, bool) {
    let at = Point::from(mesh.points[node]);
    let middle_to = |other: usize| 0.5 * (at + Point::from(mesh.points[other]));
    // An open fan starts at a face without a predecessor; a closed fan starts anywhere.
    let first = rest
        .iter()
        .position(|wedge| rest.iter().all(|other| other.before != wedge.after))
        .map(|index| (index, true));
    let (index, open) = first.unwrap_or((0, false));
    let mut wedge = rest.swap_remove(index);
    let start = wedge.after;
    let mut corners = if open { vec![at, middle_to(start)] } else { vec![middle_to(start)] };
    loop {
        corners.push(wedge.middle);
        if wedge.before == start {
            return (corners, open);
        }
        corners.push(middle_to(wedge.before));
        match rest.iter().position(|other| other.after == wedge.before) {
            Some(next) => wedge = rest.swap_remove(next),
            None => return (corners, open),
        }
    }
}
