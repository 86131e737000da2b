//! How far a curved surface lies outside its flat faces, from the nodes around.
//!
//! Faces of first order have their nodes on the surface and cut off what bulges between them, h^2 / 8R along an edge of
//! length h. A quadratic surface through the nodes around each node gives the curvature there; an edge is bowed by the
//! smaller of the curvatures at its ends, and not at all where they differ in sign, so that a crease between plane
//! faces stays one.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use super::faces::vector_area;
use super::facets::is_quadratic;
use crate::geometry::{Point, Triad};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Faces whose normals turn by more than this from that of a node (cosine) meet there in an edge of the body.
const SMOOTH: f64 = 0.9;

/// Fewer neighbours than this do not determine a quadratic surface.
const ENOUGH: usize = 8;

/// Layers of faces around a node that are looked at to find them.
const LAYERS: usize = 3;

/// The second derivatives of the surface at a node, over the plane of two unit vectors.
struct Curvature {
    axes: Triad,
    second: Matrix2<f64>,
}

/// Offsets of the middles of the edges of `faces` from their chords, global, mm, one list per face in the order of its
/// edges; zero for faces of second order, whose middle nodes say where they are.
pub(super) fn edge_bows(mesh: &Mesh, faces: &[SurfaceFace]) -> Vec<[Point; 4]> {
    let mut around: HashMap<usize, Vec<usize>> = HashMap::new();
    let flat = faces.iter().enumerate().filter(|(_, face)| !is_quadratic(face.kind));
    flat.for_each(|(i, face)| face.nodes.iter().for_each(|&node| around.entry(node).or_default().push(i)));
    let curvatures: HashMap<usize, Curvature> =
        around.keys().filter_map(|&node| Some((node, curvature(mesh, faces, &around, node)?))).collect();
    let bow = |a: usize, b: usize| {
        let chord = Point::from(mesh.points[b]) - Point::from(mesh.points[a]);
        let ends = [curvatures.get(&a)?, curvatures.get(&b)?];
        let sags = ends.map(|end| end.along(&chord));
        let least = if sags[0].abs() < sags[1].abs() { 0 } else { 1 };
        (sags[0] * sags[1] > 0.0).then(|| -0.125 * sags[least] * ends[least].axes.normal())
    };
    let of_face = |face: &SurfaceFace| {
        let n = face.kind.n_corners();
        std::array::from_fn(|i| {
            let edge = (i < n && !is_quadratic(face.kind)).then(|| [face.nodes[i], face.nodes[(i + 1) % n]]);
            edge.and_then(|[a, b]| bow(a, b)).unwrap_or_else(Point::zeros)
        })
    };
    faces.iter().map(of_face).collect()
}

impl Curvature {
    /// d^T C d for a chord d.
    fn along(&self, chord: &Point) -> f64 {
        let local = self.axes.to_local(chord);
        let flat = Vector2::new(local.x, local.y);
        flat.dot(&(self.second * flat))
    }
}

/// The quadratic surface through a node that fits the nodes around best; `None` at an edge of the body.
fn curvature(
    mesh: &Mesh,
    faces: &[SurfaceFace],
    around: &HashMap<usize, Vec<usize>>,
    node: usize,
) -> Option<Curvature> {
    let at = |node: usize| Point::from(mesh.points[node]);
    let areas: Vec<Point> = around[&node]
        .iter()
        .map(|&face| vector_area(&faces[face].nodes.iter().map(|&node| at(node)).collect::<Vec<_>>()))
        .collect();
    let normal = areas.iter().sum::<Point>().normalize();
    if areas.iter().any(|area| area.normalize().dot(&normal) < SMOOTH) {
        return None;
    }
    let axes = Triad::from_normal(normal, Point::x());
    let near: Vec<Point> = neighbours(faces, around, node)
        .into_iter()
        .map(|other| axes.to_local(&(at(other) - at(node))))
        .collect();
    let size = near.iter().map(|x| x.x.hypot(x.y)).fold(0.0, f64::max);
    let terms = |i: usize, term: usize| {
        let (x, y) = (near[i].x / size, near[i].y / size);
        [x, y, 0.5 * x * x, x * y, 0.5 * y * y][term]
    };
    let matrix = DMatrix::from_fn(near.len(), 5, terms);
    let heights = DVector::from_fn(near.len(), |i, _| near[i].z);
    // Of several surfaces that fit (a single row of faces) the smallest coefficients.
    let found = matrix.svd(true, true).solve(&heights, 1e-6).ok()?;
    let second = Matrix2::new(found[2], found[3], found[3], found[4]) / (size * size);
    Some(Curvature { axes, second })
}

/// The nodes around a node, in as many layers of faces as it takes, ascending.
fn neighbours(faces: &[SurfaceFace], around: &HashMap<usize, Vec<usize>>, node: usize) -> Vec<usize> {
    let mut found = vec![node];
    for _ in 0..LAYERS {
        let layer = found.iter().flat_map(|node| &around[node]).flat_map(|&face| &faces[face].nodes);
        let mut next: Vec<usize> = layer.copied().collect();
        next.sort_unstable();
        next.dedup();
        found = next;
        if found.len() > ENOUGH {
            break;
        }
    }
    found.retain(|&other| other != node);
    found
}
