//! Faces that intersect one another.

use super::Mesh;
use super::faces::SurfaceFace;
use crate::geometry::{Point, bounds};

/// Indices of two faces that share no node and intersect one another; `None` if there are no such faces. Faces are
/// divided into triangles between their corners.
pub fn find_intersecting_faces(mesh: &Mesh, faces: &[SurfaceFace]) -> Option<[usize; 2]> {
    let corners = |face: &SurfaceFace| -> Vec<Point> {
        face.nodes[..face.kind.n_corners()].iter().map(|&node| Point::from(mesh.points[node])).collect()
    };
    let all: Vec<Vec<Point>> = faces.iter().map(corners).collect();
    let ends = |k: usize, axis: usize| bounds(all[k].iter().map(|x| x[axis]));
    let boxes: Vec<[[f64; 2]; 3]> = (0..all.len()).map(|k| [0, 1, 2].map(|axis| ends(k, axis))).collect();
    // A sweep along the longest side of the bounding box of all faces leaves the fewest pairs.
    let extent = |axis: usize| {
        let [low, high] = bounds(boxes.iter().flat_map(|of_face| of_face[axis]));
        high - low
    };
    let sweep = (1..3).fold(0, |longest, axis| if extent(axis) > extent(longest) { axis } else { longest });
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by(|&a, &b| boxes[a][sweep][0].total_cmp(&boxes[b][sweep][0]));
    for (rank, &a) in order.iter().enumerate() {
        for &b in order[rank + 1..].iter().take_while(|&&b| boxes[b][sweep][0] <= boxes[a][sweep][1]) {
            let apart = (0..3)
                .any(|axis| boxes[a][axis][0] > boxes[b][axis][1] || boxes[b][axis][0] > boxes[a][axis][1]);
            let joined = || faces[a].nodes.iter().any(|node| faces[b].nodes.contains(node));
            if !apart
                && !joined()
                && (edge_pierces_face(&all[a], &all[b]) || edge_pierces_face(&all[b], &all[a]))
            {
                return Some([a, b]);
            }
        }
    }
    None
}

fn edge_pierces_face(a: &[Point], b: &[Point]) -> bool {
    let edges = (0..a.len()).map(|k| (a[k], a[(k + 1) % a.len()]));
    let through = |(from, to): (Point, Point)| {
        (1..b.len() - 1).any(|k| {
            let (u, v) = (b[k] - b[0], b[k + 1] - b[0]);
            let normal = u.cross(&v);
            let [first, last] = [from, to].map(|x| normal.dot(&(x - b[0])));
            if first * last >= 0.0 {
                return false;
            }
            let x = from + (to - from) * (first / (first - last)) - b[0];
            let square = normal.norm_squared();
            let [s, t] = [x.cross(&v).dot(&normal) / square, u.cross(&x).dot(&normal) / square];
            s > 0.0 && t > 0.0 && s + t < 1.0
        })
    };
    edges.into_iter().any(through)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::mesh::CellBlock;
    use crate::mesh::faces::outer_faces;

    /// Truth: two triangles intersect by construction, and do not after one is moved away. Each axis is once the longest.
    #[test]
    fn faces_that_cross() {
        let at = |height: f64, turn: usize| {
            let mut points = vec![
                [0.0, 0.0, 0.0],
                [2.0, 0.0, 0.0],
                [0.0, 2.0, 0.0],
                [0.5, 0.5, height - 1.0],
                [0.6, 0.5, height + 1.0],
                [0.5, 0.7, height + 1.0],
            ];
            points.iter_mut().for_each(|x| {
                x[0] *= 3.0;
                x.rotate_right(turn);
            });
            let block = CellBlock { kind: ElementKind::Tri3, nodes: (0..6).collect(), tags: vec![1, 2] };
            let mesh = Mesh { source: "two".into(), points, blocks: vec![block], ..Mesh::default() };
            find_intersecting_faces(&mesh, &outer_faces(&mesh))
        };
        for turn in 0..3 {
            assert_eq!(at(0.0, turn), Some([0, 1]));
            assert_eq!(at(1.5, turn), None);
        }
    }
}
