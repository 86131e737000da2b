//! Contact faces of any order, divided into facets with linear or bilinear maps.
//!
//! A second-order face is straight if middle nodes lie at the midpoints of edges and a central node at the mean of the
//! corners. Linear and straight faces are one facet. Other faces are divided at their middle nodes into four facets.
//!
//! Facets serve only to find the point of the face that lies over a point of a contact cell, along the cell normal. On
//! curved faces, this point has an error of the order of the squared face size. The shape functions still belong to the
//! whole face.

use crate::element::ElementKind::{self, Quad8, Quad9, Tri6};
use crate::geometry::{Point, Side};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Maximum distance of a middle node from the midpoint of its edge, relative to the edge length, for a straight edge.
const MIDSIDE_TOLERANCE: f64 = 1e-9;

/// Corners of the four facets of a curved triangle, as node numbers of the face.
const FOUR_TRIANGLES: [&[usize]; 4] = [&[0, 3, 5], &[3, 1, 4], &[5, 4, 2], &[3, 4, 5]];
/// Corners of the four facets of a curved quadrangle, as node numbers of the face; 8 is the centre.
const FOUR_SQUARES: [&[usize]; 4] = [&[0, 4, 8, 7], &[4, 1, 5, 8], &[8, 5, 2, 6], &[7, 8, 6, 3]];

/// Part of a face: three or four corners with their reference coordinates in the face. The corners run counter-clockwise seen
/// against the outward normal of body 1.
#[derive(Debug, Clone)]
pub(super) struct Facet {
    pub(super) face: usize,
    pub(super) corners: Vec<Point>,
    pub(super) reference: Vec<[f64; 2]>,
    /// Largest squared distance of a corner from the first one, mm2.
    pub(super) scale: f64,
}

/// Reference coordinates of a face's corners, of the midpoints of its edges, and of the centre (not used for a triangle).
fn reference_nodes(kind: ElementKind) -> Vec<[f64; 2]> {
    let n = kind.n_corners();
    let corners = &kind.face_reference_nodes()[..n];
    let mut nodes = corners.to_vec();
    nodes.extend((0..n).map(|i| middle(corners[i], corners[(i + 1) % n])));
    nodes.push([0.0, 0.0]);
    nodes
}

fn middle(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])]
}

pub(super) fn is_quadratic(kind: ElementKind) -> bool {
    matches!(kind, Tri6 | Quad8 | Quad9)
}

fn bends(mesh: &Mesh, face: &SurfaceFace, i: usize) -> bool {
    let n = face.kind.n_corners();
    let at = |node: usize| Point::from(mesh.points[face.nodes[node]]);
    let (a, b, m) = (at(i), at((i + 1) % n), at(n + i));
    (m - 0.5 * (a + b)).norm() > MIDSIDE_TOLERANCE * (b - a).norm()
}

fn is_straight(mesh: &Mesh, face: &SurfaceFace) -> bool {
    let n = face.kind.n_corners();
    if !is_quadratic(face.kind) {
        return true;
    }
    if (0..n).any(|i| bends(mesh, face, i)) {
        return false;
    }
    let at = |node: usize| Point::from(mesh.points[face.nodes[node]]);
    let mean = (0..n).map(at).sum::<Point>() / n as f64;
    face.kind != Quad9 || (at(8) - mean).norm() <= MIDSIDE_TOLERANCE * (at(2) - at(0)).norm()
}

/// Outline of a face: its corners and the middle nodes of curved edges, counter-clockwise seen against the outward
/// normal of the face. For the upper body the order is reversed.
pub(super) fn face_polygon(mesh: &Mesh, face: &SurfaceFace, side: Side) -> Vec<Point> {
    let n = face.kind.n_corners();
    let mut points = Vec::with_capacity(2 * n);
    for i in 0..n {
        points.push(Point::from(mesh.points[face.nodes[i]]));
        if is_quadratic(face.kind) && bends(mesh, face, i) {
            points.push(Point::from(mesh.points[face.nodes[n + i]]));
        }
    }
    if side == Side::Upper {
        points.reverse();
    }
    points
}

pub(super) fn facets_of_face(mesh: &Mesh, face: &SurfaceFace, index: usize, side: Side) -> Vec<Facet> {
    let n = face.kind.n_corners();
    let whole: Vec<usize> = (0..n).collect();
    let parts: Vec<&[usize]> = match (is_straight(mesh, face), n) {
        (true, _) => vec![&whole],
        (false, 3) => FOUR_TRIANGLES.to_vec(),
        (false, _) => FOUR_SQUARES.to_vec(),
    };
    let reference = reference_nodes(face.kind);
    let place = |node: usize| match face.nodes.get(node) {
        Some(&node) => Point::from(mesh.points[node]),
        None => {
            let values = face.kind.face_values(reference[node]);
            face.nodes.iter().zip(values).map(|(&node, n)| n * Point::from(mesh.points[node])).sum()
        }
    };
    let facet = |part: &[usize]| {
        let mut nodes = part.to_vec();
        if side == Side::Upper {
            nodes.reverse();
        }
        let corners: Vec<Point> = nodes.iter().map(|&node| place(node)).collect();
        let scale = corners.iter().map(|x| (x - corners[0]).norm_squared()).fold(0.0, f64::max);
        Facet { face: index, corners, reference: nodes.iter().map(|&node| reference[node]).collect(), scale }
    };
    parts.into_iter().map(facet).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{self, ShapeFunctions};

    /// Truth: the reference coordinates equal `NODES` of the elements.
    #[test]
    fn reference_coordinates_of_the_nodes() {
        assert_eq!(reference_nodes(Tri6)[..6], element::Tri6::NODES);
        assert_eq!(reference_nodes(Quad9)[..9], element::Quad9::NODES);
        assert_eq!(reference_nodes(Quad8)[..8], element::Quad8::NODES);
    }
}
