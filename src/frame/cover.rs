//! Which faces lie over a cell, seen along its normal, and the averages of their shape functions.

use super::clip::{Polygon, area_and_centroid, intersect};
use super::faces::vector_area;
use super::search::{Bins, Extent, extent};
use super::shape_integrals::{Facing, PlaneFace};
use super::{ContactFrame, Side};
use crate::element::ElementKind;
use crate::error::{Error, Result};
use crate::geometry::{Point, Triad};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Largest part of a cell that may be uncovered by faces, or covered twice.
const COVERAGE_TOLERANCE: f64 = 1e-9;

/// What was found under one cell.
pub(super) struct CellCover {
    /// (mesh node, weight), ascending.
    pub(super) weights: Vec<(usize, f64)>,
    /// Covered part of the cell.
    coverage: f64,
}

/// Corner positions of the contact faces, counter-clockwise seen against n, and where to search for them.
pub(super) struct SpaceFaces<'a> {
    faces: Vec<SpaceFace<'a>>,
    bins: Bins,
    /// The plane of the search.
    mean: Triad,
    /// Largest distance between cells and faces along the mean normal.
    depth: f64,
}

struct SpaceFace<'a> {
    face: &'a SurfaceFace,
    corners: Vec<Point>,
    nodes: Vec<usize>,
    /// Square of its size.
    scale: f64,
}

impl<'a> SpaceFaces<'a> {
    pub(super) fn new(
        frame: &ContactFrame,
        mesh: &Mesh,
        faces: &'a [SurfaceFace],
        side: Side,
    ) -> Result<Self> {
        let faces: Vec<SpaceFace> =
            faces.iter().map(|face| SpaceFace::new(mesh, face, side)).collect::<Result<_>>()?;
        let normal: Point = frame.corners.iter().map(|corners| vector_area(corners)).sum();
        let mean = Triad::from_normal(normal, Point::x());
        let in_plane = |x: &Point| {
            let local = mean.to_local(x);
            [local.x, local.y]
        };
        let extents = faces.iter().map(|face| extent(face.corners.iter().map(in_plane))).collect();
        let height = |x: &Point| mean.normal().dot(x);
        let range = |points: &mut dyn Iterator<Item = f64>| {
            points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
        };
        let below = range(&mut frame.corners.iter().flatten().map(height));
        let above = range(&mut faces.iter().flat_map(|face| &face.corners).map(height));
        let depth = (below[1] - above[0]).abs().max((above[1] - below[0]).abs());
        Ok(Self { bins: Bins::new(extents), faces, mean, depth })
    }

    /// Weights and coverage of one cell.
    pub(super) fn cover(&self, frame: &ContactFrame, cell: usize) -> Result<CellCover> {
        let (triad, center) = (&frame.triads[cell], &frame.centers[cell]);
        let flat = |x: &Point| {
            let local = triad.to_local(&(x - center));
            [local.x, local.y]
        };
        let outline: Polygon = frame.corners[cell].iter().map(flat).collect();
        let (mut candidates, mut common, mut spare) = (Vec::new(), Polygon::new(), Polygon::new());
        self.bins.query(&self.reach(frame, cell), &mut candidates);
        let area = frame.areas[cell];
        let (mut weights, mut coverage) = (Vec::<(usize, f64)>::new(), 0.0);
        for &candidate in &candidates {
            let face = &self.faces[candidate];
            let corners: Polygon = face.corners.iter().map(flat).collect();
            let plane = PlaneFace::new(&corners);
            let facing = plane.facing(face.scale);
            if facing == Facing::Away || !overlap(&corners, &outline) {
                continue;
            }
            if facing == Facing::Folded {
                return Err(face.folded());
            }
            intersect(&outline, plane.corners(), &mut common, &mut spare);
            let part = area_and_centroid(&common).0;
            if part <= 1e-15 * area {
                continue;
            }
            coverage += part / area;
            for (&node, integral) in face.nodes.iter().zip(plane.integrate(&common, area)) {
                weights.push((node, integral / area));
            }
        }
        Ok(CellCover { weights: merge(weights), coverage })
    }

    /// Where faces over a cell may lie in the plane of the search: its extent, widened where its normal is
    /// inclined to the mean one.
    fn reach(&self, frame: &ContactFrame, cell: usize) -> Extent {
        let mut reach = extent(frame.corners[cell].iter().map(|x| {
            let local = self.mean.to_local(x);
            [local.x, local.y]
        }));
        let cosine = self.mean.normal().dot(&frame.triads[cell].normal()).clamp(0.05, 1.0);
        let slope = (1.0 - cosine * cosine).sqrt() / cosine;
        let size = (0..2).map(|k| reach[1][k] - reach[0][k]).fold(0.0, f64::max);
        let margin = slope * self.depth + 1e-9 * size;
        (0..2).for_each(|k| {
            reach[0][k] -= margin;
            reach[1][k] += margin;
        });
        reach
    }
}

/// Whether the extents of two polygons overlap.
fn overlap(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    let (a, b) = (extent(a.iter().copied()), extent(b.iter().copied()));
    (0..2).all(|k| a[0][k] < b[1][k] && b[0][k] < a[1][k])
}

/// Sums the weights of equal nodes, ascending.
fn merge(mut weights: Vec<(usize, f64)>) -> Vec<(usize, f64)> {
    weights.sort_by_key(|w| w.0);
    weights.dedup_by(|later, kept| {
        let same = later.0 == kept.0;
        if same {
            kept.1 += later.1;
        }
        same
    });
    weights
}

impl<'a> SpaceFace<'a> {
    fn new(mesh: &Mesh, face: &'a SurfaceFace, side: Side) -> Result<Self> {
        if !matches!(face.kind, ElementKind::Tri3 | ElementKind::Quad4) {
            return Err(Error::input(format!(
                "the contact face {} of {} is a {}; contact faces may be tri3 or quad4: mesh with elements of \
                 order 1",
                face.tag,
                mesh.source,
                face.kind.name()
            )));
        }
        let mut nodes = face.nodes.clone();
        if side == Side::Upper {
            nodes.reverse();
        }
        let corners: Vec<Point> = nodes.iter().map(|&node| Point::from(mesh.points[node])).collect();
        let scale = corners.iter().map(|x| (x - corners[0]).norm_squared()).fold(0.0, f64::max);
        Ok(Self { face, corners, nodes, scale })
    }

    fn folded(&self) -> Error {
        Error::input(format!(
            "the contact face {} ({}) is folded or not convex as seen along the normal of the contact frame: mend \
             the mesh there, or leave it out of the contact group",
            self.face.tag,
            self.face.kind.name()
        ))
    }
}

/// Refuses cells that hang over the edge of the faces, or lie over two sheets of them.
pub(super) fn refuse_uncovered(frame: &ContactFrame, covers: &[CellCover], side: Side) -> Result<()> {
    let bad = |c: &&CellCover| (c.coverage - 1.0).abs() > COVERAGE_TOLERANCE;
    let Some(cell) = covers.iter().position(|c| bad(&c)) else { return Ok(()) };
    let count = covers.iter().filter(bad).count();
    let coverage = covers[cell].coverage;
    let place = frame.centers[cell];
    let name = match frame.grid {
        Some(grid) => format!("{} (ix = {}, iy = {})", cell, cell / grid.cells[1], cell % grid.cells[1]),
        None => cell.to_string(),
    };
    let (what, mend) = if coverage < 1.0 {
        (
            format!("is covered by the contact faces of {} to {:.4} %", side.name(), 100.0 * coverage),
            "make the frame smaller, move its center, or enlarge the contact group (its faces must look towards \
             the other body)",
        )
    } else {
        (
            format!("is covered {coverage:.4} times by the contact faces of {}", side.name()),
            "leave only one sheet of faces in the contact group",
        )
    };
    Err(Error::input(format!(
        "cell {name} of the contact frame at ({:.6}, {:.6}, {:.6}) {what}; all {} cells must be covered once \
         ({count} are not): {mend}",
        place.x,
        place.y,
        place.z,
        covers.len()
    )))
}
