//! Curvature correction of flat faces: estimates from neighbouring nodes how far a curved surface lies from its flat faces.
//!
//! An edge of length h deviates from a surface of radius R by up to h^2 / (8 R). A quadratic fit through the neighbours of each
//! node gives the curvature at the node. An edge is corrected by the smaller of the curvatures at its ends. If these curvatures
//! differ in sign or one is unknown, the edge is not corrected, so that creases between plane faces stay.

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};
use rayon::prelude::*;

use super::ContactFrame;
use super::cell_coverage::FacetIndex;
use super::faces::vector_area;
use super::facets::is_quadratic;
use crate::element::ElementKind::{self, Quad8, Tri6};
use crate::geometry::{Point, Side, Triad};
use crate::linalg::pseudo_inverse::pseudo_inverse;
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Smallest cosine of the angle between a face normal and the nodal normal. Below this value, the node counts as a node
/// on an edge of the body.
const MIN_SMOOTH_COSINE: f64 = 0.9;

/// Number of neighbours from which no further layer of faces is searched.
const MIN_FIT_NEIGHBOURS: usize = 8;

const MAX_NEIGHBOUR_LAYERS: usize = 3;

/// Fraction of the largest singular value below which terms of the fit are undetermined, for example on a single row of faces.
const RANK_TOLERANCE: f64 = 1e-6;

/// Edge of a flat face, and its distance from the curved surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeSagitta {
    /// Length of the edge, mm.
    pub length: f64,
    /// Height of the curved surface over the midpoint of the edge, for the curvature at each end, positive outward, mm.
    /// If one end lies on a crease, both heights are for the curvature at the other end.
    pub sagittas_at_ends: [f64; 2],
    /// Offset by which the correction moves the midpoint, global axes, mm.
    midpoint_offset: Point,
}

impl EdgeSagitta {
    /// Larger absolute height of the two ends, mm.
    pub fn largest(&self) -> f64 {
        self.sagittas_at_ends[0].abs().max(self.sagittas_at_ends[1].abs())
    }

    /// Absolute height that the correction applies, mm.
    pub fn applied(&self) -> f64 {
        self.midpoint_offset.norm()
    }

    /// Difference between the larger absolute height and the applied height, mm.
    pub fn disagreement(&self) -> f64 {
        self.largest() - self.applied()
    }
}

/// Second derivatives of the surface at a node, in its tangent plane.
struct Curvature {
    axes: Triad,
    second: Matrix2<f64>,
}

/// Sagittas of the edges of `faces`, one list per face in the order of its edges. `None` for second-order faces, for edges with
/// both ends on creases, and for the fourth entry of triangles.
pub fn edge_sagittas(mesh: &Mesh, faces: &[SurfaceFace]) -> Vec<[Option<EdgeSagitta>; 4]> {
    let mut around: HashMap<usize, Vec<usize>> = HashMap::new();
    let flat = faces.iter().enumerate().filter(|(_, face)| !is_quadratic(face.kind));
    flat.for_each(|(i, face)| face.nodes.iter().for_each(|&node| around.entry(node).or_default().push(i)));
    let curvatures: HashMap<usize, Curvature> =
        around.keys().filter_map(|&node| Some((node, curvature(mesh, faces, &around, node)?))).collect();
    let cut = |a: usize, b: usize| {
        let chord = Point::from(mesh.points[b]) - Point::from(mesh.points[a]);
        let ends = [curvatures.get(&a), curvatures.get(&b)];
        let sag = |end: &Curvature| -0.125 * end.along(&chord);
        let midpoint_offset = match ends {
            [Some(start), Some(end)] if sag(start) * sag(end) > 0.0 => {
                let least = if sag(start).abs() < sag(end).abs() { start } else { end };
                sag(least) * least.axes.normal()
            }
            _ => Point::zeros(),
        };
        let known = ends[0].or(ends[1])?;
        Some(EdgeSagitta {
            length: chord.norm(),
            sagittas_at_ends: ends.map(|end| sag(end.unwrap_or(known))),
            midpoint_offset,
        })
    };
    let of_face = |face: &SurfaceFace| {
        let n = face.kind.n_corners();
        std::array::from_fn(|i| {
            let edge = (i < n && !is_quadratic(face.kind)).then(|| [face.nodes[i], face.nodes[(i + 1) % n]]);
            edge.and_then(|[a, b]| cut(a, b))
        })
    };
    faces.iter().map(of_face).collect()
}

/// Offsets of the edge midpoints of `faces` from their chords, global axes, mm.
pub(super) fn edge_midpoint_offsets(mesh: &Mesh, faces: &[SurfaceFace]) -> Vec<[Point; 4]> {
    let bows = |cuts: [Option<EdgeSagitta>; 4]| {
        cuts.map(|cut| cut.map_or_else(Point::zeros, |cut| cut.midpoint_offset))
    };
    edge_sagittas(mesh, faces).into_iter().map(bows).collect()
}

pub(super) fn quadratic_kind(flat: ElementKind) -> ElementKind {
    if flat.n_corners() == 3 { Tri6 } else { Quad8 }
}

/// Height of a surface along `normal` above the midpoint of a chord. `bow` is the offset of the surface perpendicular
/// to the chord.
fn offset_along_normal(bow: &Point, normal: &Point) -> f64 {
    let along = normal.dot(bow);
    // At more than 60 degrees between offset and normal, the component of the offset along the normal is used.
    if along.abs() > 0.5 * bow.norm() { bow.norm_squared() / along } else { along }
}

/// Meshed surface of a body under a frame.
#[derive(Debug, Clone)]
pub struct MeshedSurface {
    /// The body's mesh.
    pub mesh: Arc<Mesh>,
    /// Contact faces of the body, oriented outward.
    pub faces: Vec<SurfaceFace>,
    /// Side of the body.
    pub side: Side,
    /// Mean height of the faces over each cell, along the cell normal from the cell centre, `[N]`, mm.
    pub mean_heights: Vec<f64>,
    /// Whether the gap includes the curvature correction of flat faces.
    pub curved_gap: bool,
}

impl MeshedSurface {
    /// Heights from which the gap is computed, `[N]`, mm: [`Self::curved_heights`] if `curved_gap` is set, otherwise
    /// the mean heights.
    pub fn gap_heights(&self, frame: &ContactFrame) -> Vec<f64> {
        if self.curved_gap { self.curved_heights(frame) } else { self.mean_heights.clone() }
    }

    /// Mean heights of the curvature-corrected faces over the cells, along the cell normals, `[N]`, mm.
    pub fn curved_heights(&self, frame: &ContactFrame) -> Vec<f64> {
        let bows = edge_midpoint_offsets(&self.mesh, &self.faces);
        if bows.iter().flatten().all(|bow| bow.norm_squared() == 0.0) {
            return self.mean_heights.clone();
        }
        let space = FacetIndex::new(&self.mesh, &self.faces, self.side);
        let bowed = |cell: usize| {
            let normal = frame.triads[cell].normal();
            let (mut added, mut covered) = (0.0, 0.0);
            for hit in space.overlaps(frame, cell).0 {
                covered += hit.area;
                let index = space.face_of(&hit);
                let flat = self.faces[index].kind;
                if is_quadratic(flat) {
                    continue;
                }
                let n = flat.n_corners();
                let plane = hit.plane.of_kind(quadratic_kind(flat));
                let integrals = plane.integrate(&hit.common, frame.areas[cell]);
                let offsets = bows[index].iter().map(|bow| offset_along_normal(bow, &normal));
                added +=
                    integrals[n..2 * n].iter().zip(offsets).map(|(part, offset)| part * offset).sum::<f64>();
            }
            self.mean_heights[cell] + added / if frame.grid.is_some() { frame.areas[cell] } else { covered }
        };
        (0..frame.n_cells()).into_par_iter().map(bowed).collect()
    }
}

impl Curvature {
    /// Second derivative d^T C d of the surface along a chord d, with the matrix C of second derivatives.
    fn along(&self, chord: &Point) -> f64 {
        let local = self.axes.to_local(chord);
        let flat = Vector2::new(local.x, local.y);
        flat.dot(&(self.second * flat))
    }
}

/// Curvature at a node from a least-squares quadratic surface through this node. `None` at an edge of the body, or if the fit
/// fails.
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
    if areas.iter().any(|area| area.normalize().dot(&normal) < MIN_SMOOTH_COSINE) {
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
    // On a single row of faces several quadratic surfaces fit. The pseudo-inverse gives the surface with the smallest
    // coefficients.
    let found = pseudo_inverse(&matrix, RANK_TOLERANCE).ok()? * heights;
    let second = Matrix2::new(found[2], found[3], found[3], found[4]) / (size * size);
    Some(Curvature { axes, second })
}

fn neighbours(faces: &[SurfaceFace], around: &HashMap<usize, Vec<usize>>, node: usize) -> Vec<usize> {
    let mut found = vec![node];
    for _ in 0..MAX_NEIGHBOUR_LAYERS {
        let layer = found.iter().flat_map(|node| &around[node]).flat_map(|&face| &faces[face].nodes);
        let mut next: Vec<usize> = layer.copied().collect();
        next.sort_unstable();
        next.dedup();
        found = next;
        if found.len() > MIN_FIT_NEIGHBOURS {
            break;
        }
    }
    found.retain(|&other| other != node);
    found
}
