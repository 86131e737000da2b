//! Maps from the nodes of a body's contact faces to the cells of the frame, consistent with the patch test.
//!
//! Row I of the map is the average of the face shape functions over cell I,
//! I_Ij = (1 / A_I) int_{cell I} N_j dS, integrated exactly on the intersections of the cell with the faces, all
//! seen along the cell's normal; so sum_I A_I I_Ij = int N_j dS wherever the cells tile the faces.
//!
//! # Source
//! formulation 3.1 (d).

use rayon::prelude::*;

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

/// Sparse map I from nodal values on the contact faces to cell averages, and its transpose.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceMap {
    nodes: Vec<usize>,
    rows: Rows,
    columns: Rows,
    triads: Vec<Triad>,
    areas: Vec<f64>,
}

/// Compressed sparse rows of weights.
#[derive(Debug, Clone, PartialEq, Default)]
struct Rows {
    starts: Vec<usize>,
    indices: Vec<usize>,
    weights: Vec<f64>,
}

impl Rows {
    fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        let range = self.starts[row]..self.starts[row + 1];
        self.indices[range.clone()].iter().copied().zip(self.weights[range].iter().copied())
    }

    fn n_rows(&self) -> usize {
        self.starts.len() - 1
    }

    fn from_lists(lists: &[Vec<(usize, f64)>]) -> Self {
        let mut rows = Self { starts: vec![0], ..Self::default() };
        for list in lists {
            rows.indices.extend(list.iter().map(|entry| entry.0));
            rows.weights.extend(list.iter().map(|entry| entry.1));
            rows.starts.push(rows.indices.len());
        }
        rows
    }

    fn transposed(&self, n_columns: usize) -> Self {
        let mut lists = vec![Vec::new(); n_columns];
        for row in 0..self.n_rows() {
            for (column, weight) in self.row(row) {
                lists[column].push((row, weight));
            }
        }
        Self::from_lists(&lists)
    }
}

impl FaceMap {
    /// The map between `frame` and `faces` (of `mesh`, the contact faces of body `side`, outward).
    ///
    /// # Errors
    /// If a face is neither tri3 nor quad4 or folded as seen along a cell's normal, or a cell is not covered
    /// exactly once by the faces.
    pub fn new(frame: &ContactFrame, mesh: &Mesh, faces: &[SurfaceFace], side: Side) -> Result<Self> {
        let faces = SpaceFaces::new(frame, mesh, faces, side)?;
        let found: Vec<CellCover> = (0..frame.n_cells())
            .into_par_iter()
            .map(|cell| faces.cover(frame, cell))
            .collect::<Result<_>>()?;
        refuse_uncovered(frame, &found, side)?;
        let mut nodes: Vec<usize> = found.iter().flat_map(|c| c.weights.iter().map(|w| w.0)).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut local = vec![usize::MAX; mesh.points.len()];
        nodes.iter().enumerate().for_each(|(i, &node)| local[node] = i);
        let lists: Vec<Vec<(usize, f64)>> = found
            .into_iter()
            .map(|c| c.weights.into_iter().map(|(node, w)| (local[node], w)).collect())
            .collect();
        let rows = Rows::from_lists(&lists);
        let columns = rows.transposed(nodes.len());
        Ok(Self { nodes, rows, columns, triads: frame.triads.clone(), areas: frame.areas.clone() })
    }

    /// Mesh nodes that the cells touch (the contact nodes), ascending, `[n_c]`.
    pub fn nodes(&self) -> &[usize] {
        &self.nodes
    }

    /// Number of cells N.
    pub fn n_cells(&self) -> usize {
        self.rows.n_rows()
    }

    /// Local axes of the cells.
    pub fn triads(&self) -> &[Triad] {
        &self.triads
    }

    /// Areas of the cells, mm2.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Entries (cell, weight) of a contact node's column.
    pub fn column(&self, node: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.columns.row(node)
    }

    /// Entries (contact node, weight) of a cell's row.
    pub fn row(&self, cell: usize) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows.row(cell)
    }

    /// Cell averages in local axes, `[3, N]` by planes, of nodal vectors `[n_c, 3]` in global axes; overwrites.
    pub fn apply(&self, nodal: &[f64], local: &mut [f64]) {
        let n = self.n_cells();
        for cell in 0..n {
            let mut mean = Point::zeros();
            for (node, weight) in self.rows.row(cell) {
                mean += weight * Point::new(nodal[3 * node], nodal[3 * node + 1], nodal[3 * node + 2]);
            }
            let mean = self.triads[cell].to_local(&mean);
            (0..3).for_each(|k| local[k * n + cell] = mean[k]);
        }
    }

    /// Nodal forces I^T A t, `[n_c, 3]` in global axes (N), of tractions t in local axes, `[3, N]` by planes
    /// (MPa); overwrites.
    pub fn apply_transpose(&self, tractions: &[f64], forces: &mut [f64]) {
        let n = self.n_cells();
        for (node, force) in forces.chunks_exact_mut(3).enumerate() {
            let mut sum = Point::zeros();
            for (cell, weight) in self.columns.row(node) {
                let local = Point::new(tractions[cell], tractions[n + cell], tractions[2 * n + cell]);
                sum += self.triads[cell].to_global(&local) * (weight * self.areas[cell]);
            }
            force.copy_from_slice(sum.as_slice());
        }
    }

    /// Cell averages `[N]` of nodal scalars `[n_c]`; overwrites.
    pub fn average(&self, nodal: &[f64], cells: &mut [f64]) {
        for (cell, mean) in cells.iter_mut().enumerate() {
            *mean = self.rows.row(cell).map(|(node, weight)| weight * nodal[node]).sum();
        }
    }

    /// Nodal sums `[n_c]`, sum_I A_I I_Ij p_I, of cell values p `[N]`; overwrites.
    pub fn spread(&self, cells: &[f64], nodal: &mut [f64]) {
        for (node, sum) in nodal.iter_mut().enumerate() {
            *sum = self.columns.row(node).map(|(cell, weight)| weight * self.areas[cell] * cells[cell]).sum();
        }
    }

    /// Mean height of the faces over each cell, along its normal from its centre, `[N]`, mm.
    pub fn heights(&self, frame: &ContactFrame, mesh: &Mesh) -> Vec<f64> {
        (0..self.n_cells())
            .map(|cell| {
                let mean: Point =
                    self.row(cell).map(|(j, weight)| weight * Point::from(mesh.points[self.nodes[j]])).sum();
                frame.triads[cell].normal().dot(&(mean - frame.centers[cell]))
            })
            .collect()
    }
}

/// What was found under one cell.
struct CellCover {
    /// (mesh node, weight), ascending.
    weights: Vec<(usize, f64)>,
    /// Covered part of the cell.
    coverage: f64,
}

/// Corner positions of the contact faces, counter-clockwise seen against n, and where to search for them.
struct SpaceFaces<'a> {
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
    fn new(frame: &ContactFrame, mesh: &Mesh, faces: &'a [SurfaceFace], side: Side) -> Result<Self> {
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
    fn cover(&self, frame: &ContactFrame, cell: usize) -> Result<CellCover> {
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
fn refuse_uncovered(frame: &ContactFrame, covers: &[CellCover], side: Side) -> Result<()> {
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
