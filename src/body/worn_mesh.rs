//! Mesh of a worn body: its contact surface is moved inward by the wear depth.
//!
//! The map Iᵀ A distributes the wear volume of the cells to the nodes of the contact faces. I averages nodal values
//! over the cells, and A contains the cell areas. The volume of a middle node is divided equally among the adjacent
//! corners. The depth of corner c is its volume divided by its area ∫ L_c dS. L_c is the linear or bilinear shape
//! function of the corner. The area is positive because L_c is not negative. Middle nodes move by the mean displacement
//! of the adjacent corners. The motion preserves the wear volume, and a uniform depth stays uniform
//! (docs/theory-wear.md).

use crate::element::ElementKind::{self, Quad8, Quad9, Tri6};
use crate::error::Result;
use crate::fem::{FeSpec, move_mesh, nodal_area_vectors};
use crate::frame::{ContactFrame, FaceMap, Side};
use crate::geometry::Point;
use crate::linalg::memory::MemoryLimit;
use crate::mesh::Mesh;
use crate::mesh::faces::group_faces;

/// Mesh of a body after wear on the faces of the group `contact`. `depth` is the wear depth of the cells of `frame`
/// along their normals, `[N]`, mm.
///
/// # Errors
/// If group and frame do not fit, or memory does not suffice. Also if an element would become inverted or too flat.
pub fn worn_mesh(
    spec: &FeSpec,
    contact: &str,
    side: Side,
    frame: &ContactFrame,
    depth: &[f64],
    memory: &MemoryLimit,
) -> Result<Mesh> {
    let mesh = &spec.mesh;
    let faces = group_faces(mesh, contact)?;
    let map = FaceMap::new(frame, mesh, &faces, side)?;
    let [lost, covered] = [depth, &vec![1.0; depth.len()]].map(|depth| volumes(&map, depth, mesh.n_points()));
    let areas = nodal_area_vectors(mesh, &faces);
    let mut corners = vec![[Point::zeros(); 3]; mesh.n_points()];
    let mut parents: Vec<Vec<usize>> = vec![Vec::new(); mesh.n_points()];
    for face in &faces {
        for (i, &node) in face.nodes.iter().enumerate() {
            if parents[node].is_empty() {
                parents[node] =
                    parent_corners(face.kind, i).iter().map(|&corner| face.nodes[corner]).collect();
                let share = 1.0 / parents[node].len() as f64;
                for &corner in &parents[node] {
                    let sums = &mut corners[corner];
                    sums[0] += share * lost[node];
                    sums[1] += share * covered[node];
                    sums[2] += share * Point::from(areas[node]);
                }
            }
        }
    }
    let inward = |[lost, covered, area]: &[Point; 3]| match covered.try_normalize(0.0) {
        Some(normal) => side.gap_sign() / area.dot(&normal).abs() * lost,
        None => Point::zeros(),
    };
    let by: Vec<Point> = corners.iter().map(inward).collect();
    let motion: Vec<Option<Point>> = parents
        .iter()
        .map(|corners| {
            let mean = corners.iter().map(|&corner| by[corner]).sum::<Point>() / corners.len().max(1) as f64;
            (!corners.is_empty()).then(|| frame.axes.to_local(&mean))
        })
        .collect();
    move_mesh(spec, &faces, &motion, &frame.axes, memory)
}

/// Vector of each node, `[n_points]`, mm3: wear volume times normal, for the `depth` of the cells.
fn volumes(map: &FaceMap, depth: &[f64], n_points: usize) -> Vec<Point> {
    let mut planes = vec![0.0; 3 * depth.len()];
    planes[2 * depth.len()..].copy_from_slice(depth);
    let mut nodal = vec![0.0; 3 * map.nodes().len()];
    map.apply_transpose(&planes, &mut nodal);
    let mut volumes = vec![Point::zeros(); n_points];
    for (&node, volume) in map.nodes().iter().zip(nodal.chunks_exact(3)) {
        volumes[node] = Point::new(volume[0], volume[1], volume[2]);
    }
    volumes
}

/// Corners of a face whose mean position in reference coordinates is node `i`. If node `i` is a corner, only this
/// corner.
fn parent_corners(kind: ElementKind, i: usize) -> &'static [usize] {
    const CORNERS: [&[usize]; 4] = [&[0], &[1], &[2], &[3]];
    const OF_SQUARE: [&[usize]; 5] = [&[0, 1], &[1, 2], &[2, 3], &[3, 0], &[0, 1, 2, 3]];
    const OF_TRIANGLE: [&[usize]; 3] = [&[0, 1], &[1, 2], &[2, 0]];
    let n = kind.n_corners();
    match kind {
        Tri6 if i >= n => OF_TRIANGLE[i - n],
        Quad8 | Quad9 if i >= n => OF_SQUARE[i - n],
        _ => CORNERS[i],
    }
}

/// Height of the solid element behind each contact node, `[n_points]`, mm; infinite at other nodes. The height is the
/// distance along the face normal from the face to the opposite corners. Where faces meet, the smallest height counts.
///
/// # Errors
/// If the group does not consist of outer faces.
pub fn element_height_at_nodes(mesh: &Mesh, contact: &str) -> Result<Vec<f64>> {
    let mut heights = vec![f64::INFINITY; mesh.n_points()];
    for face in group_faces(mesh, contact)? {
        let n = mesh.kind(face.owner).n_corners();
        let (solid, own) = (&mesh.cell_nodes(face.owner)[..n], &face.nodes[..face.kind.n_corners()]);
        let mean = |nodes: &[usize]| {
            nodes.iter().map(|&node| Point::from(mesh.points[node])).sum::<Point>() / nodes.len() as f64
        };
        let behind: Vec<usize> = solid.iter().copied().filter(|node| !own.contains(node)).collect();
        let normal = face.area_vector(mesh).try_normalize(0.0).unwrap_or_default();
        let height = normal.dot(&(mean(own) - mean(&behind))).abs();
        face.nodes.iter().for_each(|&node| heights[node] = heights[node].min(height));
    }
    Ok(heights)
}
