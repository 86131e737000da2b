//! Intersections of a cell with the contact faces, projected along the cell normal, and cell averages of the face shape functions.

use super::clip::{Polygon, area_and_centroid, convex_parts, intersect};
use super::facets::{Facet, facets_of_face};
use super::shape_integrals::{Facing, ProjectedFacet};
use super::{ContactFrame, Side};
use crate::error::{Error, Result};
use crate::geometry::ball_tree::{Ball, BallTree};
use crate::geometry::{Point, bounds};
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;

/// Maximum share of a cell that may be covered twice, without the allowance for rounding; on grids also the maximum uncovered
/// share.
const COVERAGE_TOLERANCE: f64 = 1e-9;

/// Relative rounding error of a cell's area, divided by the rounding error of the coordinates relative to the cell's side.
const AREA_PER_COORDINATE_ROUNDING: f64 = 8.0;

/// Maximum uncovered share of a cell outside grids. Where two bodies end at the same edge, the gap between them slightly separates
/// their edges in the projection along an inclined cell normal.
const MAX_UNCOVERED_SHARE: f64 = 0.1;

pub(super) struct CellCoverage {
    /// Pairs (index, weight) of the cell average, in ascending order. The index is a mesh node or another basis function.
    pub(super) weights: Vec<(usize, f64)>,
    pub(super) coverage: f64,
    /// A face that is folded in the projection along the cell's normal, if any.
    folded: Option<usize>,
}

pub(super) struct FacetIndex<'a> {
    faces: &'a [SurfaceFace],
    facets: Vec<Facet>,
    tree: BallTree,
}

pub(super) struct CellOverlap {
    facet: usize,
    pub(super) plane: ProjectedFacet,
    pub(super) common: Polygon,
    pub(super) area: f64,
    /// Height of the mean of the facet's corners above the cell's centre, along the cell's normal.
    height: f64,
}

impl<'a> FacetIndex<'a> {
    pub(super) fn new(mesh: &Mesh, faces: &'a [SurfaceFace], side: Side) -> Self {
        let facets: Vec<Facet> = faces
            .iter()
            .enumerate()
            .flat_map(|(index, face)| facets_of_face(mesh, face, index, side))
            .collect();
        let tree = BallTree::new(facets.iter().map(|facet| Ball::around(&facet.corners)).collect());
        Self { faces, facets, tree }
    }

    pub(super) fn face_of(&self, hit: &CellOverlap) -> usize {
        self.facets[hit.facet].face
    }

    /// Overlaps of a cell with the facets, and a folded face, if any. If faces cover a cell outside grids more than
    /// once, only the nearest sheets count. A sheet consists of faces connected through their nodes.
    pub(super) fn overlaps(&self, frame: &ContactFrame, cell: usize) -> (Vec<CellOverlap>, Option<usize>) {
        let (mut hits, folded) = self.hits(frame, cell);
        let area = frame.areas[cell];
        let covered = hits.iter().map(|hit| hit.area).sum::<f64>();
        let most = area * (1.0 + coverage_tolerance(frame, cell));
        if frame.grid.is_none() && covered > most {
            self.keep_nearest(&mut hits, most);
        }
        (hits, folded)
    }

    pub(super) fn cover(&self, frame: &ContactFrame, cell: usize) -> CellCoverage {
        self.cover_of(frame, cell, &|face, local| vec![(self.faces[face].nodes[local], 1.0)])
    }

    /// As [`Self::cover`], for other basis functions. `parts(face, local)` expresses the shape function of a local node by pairs
    /// (basis function, coefficient).
    pub(super) fn cover_of(
        &self,
        frame: &ContactFrame,
        cell: usize,
        parts: &dyn Fn(usize, usize) -> Vec<(usize, f64)>,
    ) -> CellCoverage {
        let (hits, folded) = self.overlaps(frame, cell);
        let area = frame.areas[cell];
        let coverage = hits.iter().map(|hit| hit.area).sum::<f64>() / area;
        // Averages over cells outside grids refer to the covered part, because the faces of two meshes may end slightly apart.
        let whole = if frame.grid.is_some() { area } else { area * coverage };
        let mut weights = Vec::new();
        for hit in &hits {
            let face = self.face_of(hit);
            let n_nodes = self.faces[face].nodes.len();
            for (local, integral) in
                hit.plane.integrate(&hit.common, area).into_iter().enumerate().take(n_nodes)
            {
                let weight = integral / whole;
                weights.extend(parts(face, local).into_iter().map(|(of, share)| (of, share * weight)));
            }
        }
        CellCoverage { weights: merge(weights), coverage, folded }
    }

    /// Overlaps of a cell with the facets that face it, and a folded face, if any.
    fn hits(&self, frame: &ContactFrame, cell: usize) -> (Vec<CellOverlap>, Option<usize>) {
        let (triad, center) = (&frame.triads[cell], &frame.centers[cell]);
        let normal = triad.normal();
        let flat = |x: &Point| {
            let local = triad.to_local(&(x - center));
            [local.x, local.y]
        };
        let outline: Polygon = frame.corners(cell).iter().map(flat).collect();
        let reach = outline.iter().map(|x| x[0].hypot(x[1])).fold(0.0, f64::max);
        let parts = convex_parts(outline.clone());
        let (mut candidates, mut common, mut spare) = (Vec::new(), Polygon::new(), Polygon::new());
        self.tree.query(center, &normal, reach, &mut candidates);
        let (mut hits, mut folded) = (Vec::new(), None);
        for &candidate in &candidates {
            let facet = &self.facets[candidate];
            let corners: Polygon = facet.corners.iter().map(flat).collect();
            let plane = ProjectedFacet::new(self.faces[facet.face].kind, &corners, &facet.reference);
            let facing = plane.facing(facet.scale);
            if facing == Facing::Away || !overlap(&corners, &outline) {
                continue;
            }
            if facing == Facing::Folded {
                folded = folded.or(Some(facet.face));
                continue;
            }
            let mean = facet.corners.iter().sum::<Point>() / corners.len() as f64;
            let height = normal.dot(&(mean - center));
            for part in &parts {
                intersect(part, plane.corners(), &mut common, &mut spare);
                let area = area_and_centroid(&common).0;
                if area > 1e-15 * frame.areas[cell] {
                    hits.push(CellOverlap { facet: candidate, plane, common: common.clone(), area, height });
                }
            }
        }
        (hits, folded)
    }

    /// Keeps the nearest sheet of `hits`, and each further sheet that leaves the covered area within `most`.
    fn keep_nearest(&self, hits: &mut Vec<CellOverlap>, most: f64) {
        let mut sheets: Vec<(Vec<usize>, f64, f64)> = Vec::new();
        let mut sheet_of = vec![usize::MAX; hits.len()];
        for first in 0..hits.len() {
            if sheet_of[first] != usize::MAX {
                continue;
            }
            let (mut members, mut next) = (vec![first], 0);
            sheet_of[first] = sheets.len();
            while next < members.len() {
                for other in 0..hits.len() {
                    if sheet_of[other] == usize::MAX && self.joined(&hits[members[next]], &hits[other]) {
                        sheet_of[other] = sheets.len();
                        members.push(other);
                    }
                }
                next += 1;
            }
            let covered: f64 = members.iter().map(|&i| hits[i].area).sum();
            let moment: f64 = members.iter().map(|&i| hits[i].area * hits[i].height).sum();
            sheets.push((members, covered, (moment / covered).abs()));
        }
        let mut order: Vec<usize> = (0..sheets.len()).collect();
        order.sort_by(|&a, &b| sheets[a].2.total_cmp(&sheets[b].2).then(a.cmp(&b)));
        let mut kept = vec![false; hits.len()];
        let mut total = 0.0;
        for sheet in order {
            let (members, covered, _) = &sheets[sheet];
            if total == 0.0 || total + covered <= most {
                total += covered;
                members.iter().for_each(|&i| kept[i] = true);
            }
        }
        let mut index = 0;
        hits.retain(|_| {
            index += 1;
            kept[index - 1]
        });
    }

    fn joined(&self, a: &CellOverlap, b: &CellOverlap) -> bool {
        let nodes = |hit: &CellOverlap| &self.faces[self.facets[hit.facet].face].nodes;
        nodes(a).iter().any(|node| nodes(b).contains(node))
    }
}

fn overlap(a: &[[f64; 2]], b: &[[f64; 2]]) -> bool {
    let ends = |polygon: &[[f64; 2]], k: usize| bounds(polygon.iter().map(|x| x[k]));
    (0..2).all(|k| {
        let (a, b) = (ends(a, k), ends(b, k));
        a[0] < b[1] && b[0] < a[1]
    })
}

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

fn folded(face: &SurfaceFace) -> Error {
    Error::input(format!(
        "the contact face {} ({}) is folded or not convex as seen along the normal of the contact frame: fix the mesh there, or remove the face from the contact group",
        face.tag,
        face.kind.name()
    ))
}

fn coverage_tolerance(frame: &ContactFrame, cell: usize) -> f64 {
    let rounding = f64::EPSILON * frame.centers[cell].amax() / frame.areas[cell].sqrt();
    COVERAGE_TOLERANCE + AREA_PER_COORDINATE_ROUNDING * rounding
}

pub(super) fn is_covered(frame: &ContactFrame, cell: usize, cover: &CellCoverage) -> bool {
    let missing = if frame.grid.is_some() { coverage_tolerance(frame, cell) } else { MAX_UNCOVERED_SHARE };
    cover.coverage >= 1.0 - missing
}

/// Returns an error if the faces cover a cell more than once or not sufficiently.
pub(super) fn refuse_uncovered(
    frame: &ContactFrame,
    covers: &[CellCoverage],
    faces: &[SurfaceFace],
    side: Side,
) -> Result<()> {
    let is_bad = |&cell: &usize| {
        let cover = &covers[cell];
        !is_covered(frame, cell, cover) || cover.coverage > 1.0 + coverage_tolerance(frame, cell)
    };
    let bad: Vec<usize> = (0..covers.len()).filter(is_bad).collect();
    let Some(&cell) = bad.first() else { return Ok(()) };
    let count = bad.len();
    let coverage = covers[cell].coverage;
    if let Some(face) = covers[cell].folded {
        return Err(folded(&faces[face]));
    }
    let place = frame.centers[cell];
    let name = match frame.grid {
        Some(grid) => {
            let [ix, iy] = grid.cell_indices(frame.grid_index(cell));
            format!("{cell} (ix = {ix}, iy = {iy})")
        }
        None => cell.to_string(),
    };
    let (what, mend) = if coverage < 1.0 {
        (
            format!("is covered to {:.4} % only", 100.0 * coverage.max(0.0)),
            "use a smaller frame, move its center, or enlarge the contact group (its outward normals must point towards the other body)",
        )
    } else {
        (format!("is covered {coverage:.4} times"), "keep only one layer of faces in the contact group")
    };
    Err(Error::input(format!(
        "the contact faces of {} do not cover {count} of the {} cells of the contact frame exactly once. For example, \
         cell {name} at ({:.6}, {:.6}, {:.6}) {what}: {mend}",
        side.name(),
        covers.len(),
        place.x,
        place.y,
        place.z
    )))
}
