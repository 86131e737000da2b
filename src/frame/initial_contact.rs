//! First touch of two surfaces: their smallest pointwise distance, not the smallest cell average.
//!
//! Over each cell, the distance is evaluated on the common refinement of the faces of both bodies. The points are
//! corners, midpoints of edges and centroids. Where the distance may be smaller between these points, a search finds
//! the minimum.

use rayon::prelude::*;

use super::ContactFrame;
use super::cell_coverage::FacetIndex;
use super::clip::{Polygon, area_and_centroid, intersect, twice_signed_area};
use super::face_curvature::{MeshedSurface, edge_midpoint_offsets, quadratic_kind};
use super::facets::is_quadratic;
use super::shape_integrals::ProjectedFacet;
use crate::element::{ElementKind, MAX_FACE_NODES};
use crate::geometry::{Point, bounds};

const MAX_STEP_HALVINGS: usize = 16;

const MAX_SEARCH_ROUNDS: usize = 200;

/// Tolerance for points inside a region: twice the area of the triangle from an edge to the point, relative to the
/// region's squared size.
const INSIDE_TOLERANCE: f64 = 1e-12;

struct CurvedSurface<'a> {
    surface: &'a MeshedSurface,
    space: FacetIndex<'a>,
    bows: Vec<[Point; 4]>,
}

/// Convex part of a cell under one face, with the heights of the face over the cell.
struct FacePiece {
    polygon: Polygon,
    plane: ProjectedFacet,
    kind: ElementKind,
    heights: [f64; MAX_FACE_NODES],
    /// Offsets of the edge midpoints from their chords, measured along the cell normal, mm.
    bows: [f64; 4],
}

/// Plane over a cell: height at the cell's centre, and slopes.
struct Plane {
    height: f64,
    slope: [f64; 2],
}

#[derive(Clone, Copy)]
enum LocalSurface<'a> {
    Piece(&'a FacePiece),
    Plane(&'a Plane),
}

/// Convex polygon of the common refinement, with the surfaces of both bodies.
struct OverlapRegion<'a> {
    polygon: Polygon,
    sides: [LocalSurface<'a>; 2],
}

/// Smallest sampled distance in a cell, and the largest variation within a region.
#[derive(Debug, Clone, Copy)]
struct DistanceRange {
    least: f64,
    spread: f64,
}

/// Motion of body 2 against the frame's n until first touch, mm. Infinite if no cell counts or neither body has a surface. If one
/// surface is `None`, the plane through the global origin perpendicular to n replaces it.
///
/// A cell counts if the component of its normal along n exceeds the fraction `facing` of the largest component. The result is the
/// minimum of the distance along the cell normal, divided by the component of this normal along n. First-order faces are
/// curvature-corrected, so that their corners do not touch first.
pub fn first_touch(frame: &ContactFrame, surfaces: [Option<&MeshedSurface>; 2], facing: f64) -> f64 {
    let sheets = surfaces.map(|surface| surface.map(CurvedSurface::new));
    let n = frame.axes.normal();
    let cosines = frame.triads.map(|triad| triad.normal().dot(&n)).into_vec();
    let largest = cosines.iter().copied().fold(0.0, f64::max);
    let cells: Vec<usize> = (0..frame.n_cells()).filter(|&cell| cosines[cell] > facing * largest).collect();
    let seen: Vec<DistanceRange> =
        cells.par_iter().map(|&cell| over_cell(frame, &sheets, cell, distance_range)).collect();
    let touch = |i: usize, distance: f64| distance / cosines[cells[i]];
    let first = (0..cells.len()).map(|i| touch(i, seen[i].least)).fold(f64::INFINITY, f64::min);
    let may_fall = |&i: &usize| touch(i, seen[i].least - seen[i].spread) < first;
    (0..cells.len())
        .into_par_iter()
        .filter(may_fall)
        .map(|i| touch(i, over_cell(frame, &sheets, cells[i], minimum_distance)))
        .reduce(|| first, f64::min)
}

impl<'a> CurvedSurface<'a> {
    fn new(surface: &'a MeshedSurface) -> Self {
        let space = FacetIndex::new(&surface.mesh, &surface.faces, surface.side);
        Self { surface, space, bows: edge_midpoint_offsets(&surface.mesh, &surface.faces) }
    }

    fn pieces(&self, frame: &ContactFrame, cell: usize) -> Vec<FacePiece> {
        let (normal, center) = (frame.triads[cell].normal(), frame.centers[cell]);
        let piece = |hit: super::cell_coverage::CellOverlap| {
            let index = self.space.face_of(&hit);
            let face = &self.surface.faces[index];
            let mut heights = [0.0; MAX_FACE_NODES];
            for (height, &node) in heights.iter_mut().zip(&face.nodes) {
                *height = normal.dot(&(Point::from(self.surface.mesh.points[node]) - center));
            }
            let bows = self.bows[index].map(|bow| normal.dot(&bow));
            FacePiece { polygon: hit.common, plane: hit.plane, kind: face.kind, heights, bows }
        };
        self.space.overlaps(frame, cell).0.into_iter().map(piece).collect()
    }
}

impl FacePiece {
    fn height(&self, x: [f64; 2]) -> f64 {
        let reference = self.plane.reference_at(x);
        let sum =
            |values: &[f64], weights: &[f64]| values.iter().zip(weights).map(|(v, w)| v * w).sum::<f64>();
        let height = sum(&self.heights, &self.kind.face_values(reference));
        if is_quadratic(self.kind) {
            return height;
        }
        let n = self.kind.n_corners();
        height + sum(&self.bows[..n], &quadratic_kind(self.kind).face_values(reference)[n..2 * n])
    }
}

impl Plane {
    /// The plane through the global origin perpendicular to the frame's n, over a cell.
    fn over(frame: &ContactFrame, cell: usize) -> Self {
        let n = frame.triads[cell].to_local(&frame.axes.normal());
        let height = -frame.axes.normal().dot(&frame.centers[cell]) / n.z;
        Self { height, slope: [-n.x / n.z, -n.y / n.z] }
    }
}

impl OverlapRegion<'_> {
    fn distance(&self, x: [f64; 2]) -> f64 {
        let [lower, upper] = self.sides.map(|side| match side {
            LocalSurface::Piece(piece) => piece.height(x),
            LocalSurface::Plane(plane) => plane.height + plane.slope[0] * x[0] + plane.slope[1] * x[1],
        });
        upper - lower
    }

    fn points(&self) -> impl Iterator<Item = [f64; 2]> + '_ {
        let n = self.polygon.len();
        let middle =
            move |i: usize| [0, 1].map(|k| 0.5 * (self.polygon[i][k] + self.polygon[(i + 1) % n][k]));
        let center = area_and_centroid(&self.polygon).1;
        self.polygon.iter().copied().chain((0..n).map(middle)).chain(std::iter::once(center))
    }

    /// Whether the point lies inside the region or on its border. `slack` is a tolerance, so that degenerate edges from
    /// clipping exclude no points.
    fn contains(&self, x: [f64; 2], slack: f64) -> bool {
        let n = self.polygon.len();
        (0..n).all(|i| twice_signed_area(self.polygon[i], self.polygon[(i + 1) % n], x) >= -slack)
    }

    fn directions(&self) -> Vec<[f64; 2]> {
        let n = self.polygon.len();
        let over = |i: usize, k: usize| {
            let (from, to) = (self.polygon[i], self.polygon[(i + k) % n]);
            [to[0] - from[0], to[1] - from[1]]
        };
        (0..n).flat_map(|i| [over(i, 1), over(i, 2)]).collect()
    }

    /// Minimum distance by pattern search along the edges and diagonals of the region. These directions also lead along borders and
    /// through narrow regions.
    ///
    /// # Source
    /// Lewis and Torczon (2000), SIAM J. Optim. 10, 917-941: pattern search under linear constraints.
    fn lowest(&self) -> f64 {
        let (mut least, mut place) = (f64::INFINITY, [0.0; 2]);
        for x in self.points() {
            let distance = self.distance(x);
            if distance < least {
                (least, place) = (distance, x);
            }
        }
        let directions = self.directions();
        let slack =
            INSIDE_TOLERANCE * directions.iter().map(|d| d[0] * d[0] + d[1] * d[1]).fold(0.0, f64::max);
        let (mut halvings, mut share) = (0, 0.5);
        for _ in 0..MAX_SEARCH_ROUNDS {
            let before = least;
            for (direction, sign) in directions.iter().flat_map(|d| [(d, share), (d, -share)]) {
                let x = [place[0] + sign * direction[0], place[1] + sign * direction[1]];
                if !self.contains(x, slack) {
                    continue;
                }
                let distance = self.distance(x);
                if distance < least {
                    (least, place) = (distance, x);
                }
            }
            if least == before {
                (halvings, share) = (halvings + 1, 0.5 * share);
            }
            if halvings == MAX_STEP_HALVINGS {
                break;
            }
        }
        least
    }
}

fn over_cell<T>(
    frame: &ContactFrame,
    sheets: &[Option<CurvedSurface>; 2],
    cell: usize,
    look: fn(&[OverlapRegion]) -> T,
) -> T {
    let plane = Plane::over(frame, cell);
    let [lower, upper] = sheets.each_ref().map(|sheet| sheet.as_ref().map(|sheet| sheet.pieces(frame, cell)));
    let mut parts = Vec::new();
    match (&lower, &upper) {
        (Some(lower), Some(upper)) => {
            let (mut common, mut spare) = (Polygon::new(), Polygon::new());
            for below in lower {
                for above in upper {
                    intersect(&below.polygon, &above.polygon, &mut common, &mut spare);
                    if area_and_centroid(&common).0 > 1e-15 * frame.areas[cell] {
                        let sides = [LocalSurface::Piece(below), LocalSurface::Piece(above)];
                        parts.push(OverlapRegion { polygon: common.clone(), sides });
                    }
                }
            }
        }
        (Some(pieces), None) | (None, Some(pieces)) => {
            for piece in pieces {
                let mut sides = [LocalSurface::Piece(piece), LocalSurface::Plane(&plane)];
                if lower.is_none() {
                    sides.reverse();
                }
                parts.push(OverlapRegion { polygon: piece.polygon.clone(), sides });
            }
        }
        (None, None) => {}
    }
    look(&parts)
}

fn distance_range(parts: &[OverlapRegion]) -> DistanceRange {
    let mut seen = DistanceRange { least: f64::INFINITY, spread: 0.0 };
    for part in parts {
        let [low, high] = bounds(part.points().map(|x| part.distance(x)));
        seen = DistanceRange { least: seen.least.min(low), spread: seen.spread.max(high - low) };
    }
    seen
}

fn minimum_distance(parts: &[OverlapRegion]) -> f64 {
    parts.iter().map(OverlapRegion::lowest).fold(f64::INFINITY, f64::min)
}
