//! Outlines of groups of faces in the plane of a patch.

use std::collections::BTreeMap;

use super::patch::ContactPatch;
use crate::geometry::Point;
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Sine of the angle below which a corner counts as straight.
const COLLINEAR_TOLERANCE: f64 = 1e-9;

/// Closed polygons around `faces` in the plane of `patch`. Seen against the normal, the faces lie to the left of each
/// polygon. A curved edge becomes two straight edges.
pub(super) fn outline_loops<'a>(
    mesh: &Mesh,
    faces: impl Iterator<Item = &'a SurfaceFace>,
    patch: &ContactPatch,
) -> Vec<Vec<[f64; 2]>> {
    // Positions of the start and the middle of each edge. The key contains the end nodes of the edge.
    let mut edges: BTreeMap<[usize; 2], [[f64; 2]; 2]> = BTreeMap::new();
    for face in faces {
        let n = face.kind.n_corners();
        let nodes: Vec<Point> = face.nodes.iter().map(|&node| mesh.points[node].into()).collect();
        let corners = &face.kind.face_reference_nodes()[..n];
        let at = |xi: [f64; 2]| -> [f64; 2] {
            let x = face.kind.face_values(xi).iter().zip(&nodes).map(|(value, node)| node * *value).sum();
            let local = patch.local(&x);
            [local.x, local.y]
        };
        for k in 0..n {
            let (a, b) = (corners[k], corners[(k + 1) % n]);
            let [from, to] = [face.nodes[k], face.nodes[(k + 1) % n]];
            // An edge between two faces occurs in both directions, and is not part of the outline.
            if edges.remove(&[to, from]).is_none() {
                let middle = [0, 1].map(|c| 0.5 * (a[c] + b[c]));
                edges.insert([from, to], [at(a), at(middle)]);
            }
        }
    }
    let mut lines = Vec::new();
    while let Some((&[first, _], _)) = edges.first_key_value() {
        let mut line = Vec::new();
        let mut node = first;
        while let Some((&key, _)) = edges.range([node, 0]..=[node, usize::MAX]).next() {
            line.extend(edges.remove(&key).into_iter().flatten());
            node = key[1];
        }
        lines.push(without_straight(&line));
    }
    lines
}

fn without_straight(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut kept: Vec<[f64; 2]> = Vec::with_capacity(line.len());
    let goes_on = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        let [u, v] = [[b[0] - a[0], b[1] - a[1]], [c[0] - b[0], c[1] - b[1]]];
        let [sizes, dot] = [u[0].hypot(u[1]) * v[0].hypot(v[1]), u[0] * v[0] + u[1] * v[1]];
        (u[0] * v[1] - u[1] * v[0]).abs() <= COLLINEAR_TOLERANCE * sizes && dot >= 0.0
    };
    let n = line.len();
    for (k, &point) in line.iter().enumerate() {
        let before = kept.last().copied().unwrap_or(line[n - 1]);
        if !goes_on(before, point, line[(k + 1) % n]) {
            kept.push(point);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Side, Triad};
    use crate::mesh::faces::outer_faces;
    use crate::mesh::structured::GradedBlock;

    /// Truth: the outline of a rectangle has four corners. A ring has two outlines with four corners each. The polygons
    /// enclose the known areas.
    #[test]
    fn rectangle_and_ring() {
        let mesh = GradedBlock::uniform([2.0, 3.0], 1.0, [6, 6, 2]).mesh().unwrap();
        let patch = ContactPatch::on_body(&Triad::horizontal(0.3), Side::Lower, Point::zeros(), [1.0; 2]);
        let top =
            outer_faces(&mesh).into_iter().filter(|face| super::super::forces::in_plane(&mesh, face, &patch));
        let top: Vec<SurfaceFace> = top.collect();
        let area = |lines: &[Vec<[f64; 2]>]| -> f64 {
            let edges = lines.iter().flat_map(|line| line.iter().zip(line.iter().cycle().skip(1)));
            edges.map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
        };
        let whole = outline_loops(&mesh, top.iter(), &patch);
        assert_eq!(whole.iter().map(Vec::len).collect::<Vec<_>>(), [4]);
        assert!((area(&whole) - 24.0).abs() < 1e-12);
        let ring = top.iter().filter(|face| {
            let middle: Point = face.nodes.iter().map(|&node| Point::from(mesh.points[node])).sum();
            middle.x.abs() > 4.0 * 2.0 / 3.0 || middle.y.abs() > 4.0
        });
        let ring = outline_loops(&mesh, ring, &patch);
        assert_eq!(ring.iter().map(Vec::len).collect::<Vec<_>>(), [4, 4]);
        assert!((area(&ring) - (24.0 - 8.0 / 3.0)).abs() < 1e-12, "{}", area(&ring));
    }
}
