//! Initial gap between two meshed surfaces or a meshed surface and a plane, and checks for bodies that overlap before loading.

use crate::error::{Error, Result};
use crate::frame::{ContactFrame, MeshedSurface, edge_sagittas, first_touch};
use crate::geometry::Point;

/// Smallest cosine n_I.n of the cells that determine the first touch, as a share of the largest cosine. n_I is the
/// normal of cell I, n the normal of the frame. In steeper cells, a small error of the meshes causes a large motion of
/// body 2.
const MIN_FACING_COSINE: f64 = 0.5;

/// Value that replaces `MIN_FACING_COSINE` if the first touch leaves an overlap. Also the smallest admissible cosine
/// n_I.n of a cell opposite a plane.
pub const MIN_STEEP_COSINE: f64 = 0.05;

/// Allowed overlap, as a share of the mean cell side, because flat faces deviate from the curved surface.
const OVERLAP_TOLERANCE_CELLS: f64 = 0.1;

/// Possible error of the estimated sagitta of a straight edge, as a share of the larger sagitta at the two ends of the
/// edge. The total error also includes the difference between the larger sagitta and the sagitta that the correction
/// applies.
const CURVED_SHAPE_ERROR: f64 = 0.01;

const SHAPE_ERROR_MARGIN: f64 = 3.0;

/// Largest error of the gap due to straight faces, as a share of the largest overlap of the bodies as meshed.
const MAX_INTERFERENCE_ERROR: f64 = 0.05;

/// Rounding error of overlaps, as a share of the mean cell side.
const ROUNDING_SHARE: f64 = 1e-6;

/// Initial gap between two meshed surfaces.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshedGap {
    /// Mean distance over each cell, along the cell normal, with body 2 at the first touch, `[N]`, mm.
    pub distance: Vec<f64>,
    /// Motion of body 2 against n from its meshed position to the first touch, mm. Negative if body 2 moves away from body 1.
    pub closing_motion: f64,
}

/// Distance of the surfaces as meshed, with body 2 in its meshed position; negative where the surfaces overlap. A
/// surface that is `None` is a plane, as in [`mesh_distance`].
///
/// # Errors
/// If straight faces deviate too much from curved surfaces that overlap. If a plane is opposite to cells that do not face it.
pub fn as_meshed_distance(frame: &ContactFrame, surfaces: [Option<&MeshedSurface>; 2]) -> Result<MeshedGap> {
    let n = frame.axes.normal();
    let cosines = frame.triads.map(|triad| triad.normal().dot(&n)).into_vec();
    if surfaces.iter().any(Option::is_none) {
        refuse_steep(frame, &cosines)?;
    }
    let of_heights =
        |heights: [Option<Vec<f64>>; 2]| distances(frame, &cosines, heights.each_ref().map(Option::as_deref));
    let distance = of_heights(surfaces.map(|surface| surface.map(|surface| surface.gap_heights(frame))));
    let curved = of_heights(surfaces.map(|surface| surface.map(|surface| surface.curved_heights(frame))));
    let overlap = deepest(&curved).max(deepest(&distance)).max(0.0);
    let error = distance.iter().zip(&curved).map(|(flat, curved)| (flat - curved).abs()).fold(0.0, f64::max);
    if error > MAX_INTERFERENCE_ERROR * overlap && overlap > ROUNDING_SHARE * frame.mean_cell_side() {
        return Err(Error::input(format!(
            "straight faces change the gap by up to {error:.6}, which is {:.0} % of the largest overlap {overlap:.6}: mesh the contact surfaces with faces of second order, or with matching nodes",
            100.0 * error / overlap
        )));
    }
    Ok(MeshedGap { distance, closing_motion: 0.0 })
}

/// Distance of the undeformed surfaces with body 2 at the first touch. A surface that is `None` is the plane through
/// the global origin normal to the frame's n.
///
/// A motion of body 2 along n by t opens cell I by t n_I.n, with the cell normal n_I. For the first touch, body 2 moves
/// against n by the minimum of d / n_I.n. The minimum is taken over points with distance d in the cells that face n.
///
/// The heights of a mesh are means over its flat faces, because the displacements of the mesh are averaged with the
/// same shape functions. With [`MeshedSurface::curved_gap`], the heights are means over the curved surface.
///
/// # Errors
/// If the first touch needs a motion away from body 1 above a tenth of the mean cell side. If the motion to the first touch does
/// not remove an overlap of curved surfaces (interference fit). If no motion along n separates the bodies, no cell faces n, or a
/// plane is opposite to cells that do not face it.
pub fn mesh_distance(frame: &ContactFrame, surfaces: [Option<&MeshedSurface>; 2]) -> Result<MeshedGap> {
    let n = frame.axes.normal();
    let cosines = frame.triads.map(|triad| triad.normal().dot(&n)).into_vec();
    if surfaces.iter().any(Option::is_none) {
        refuse_steep(frame, &cosines)?;
    }
    let heights = surfaces.map(|surface| surface.map(|surface| surface.gap_heights(frame)));
    let distance = distances(frame, &cosines, heights.each_ref().map(Option::as_deref));
    let moved =
        |by: f64| -> Vec<f64> { distance.iter().zip(&cosines).map(|(d, cosine)| d - by * cosine).collect() };
    let mut first = first_touch(frame, surfaces, MIN_FACING_COSINE);
    if !first.is_finite() {
        return Err(Error::input(
            "no cell of the contact frame faces along its n, so that body 2 cannot be moved towards body 1: let frame.normal point from body 1 to body 2",
        ));
    }
    // An overlap may remain on steep cells that the first touch did not consider.
    if !frame.has_uniform_axes() {
        let flanks = curved_overlap(frame, &cosines, first, surfaces);
        if first < 0.0 {
            refuse_interference(&flanks, first)?;
        }
        if flanks.is_certain() || deepest(&moved(first)) > tolerance(frame) {
            first = first_touch(frame, surfaces, MIN_STEEP_COSINE);
        }
    }
    let touching = moved(first);
    if deepest(&distance) > 0.0 {
        refuse_overlap(frame, &distance, deepest(&touching), Overlap::EveryPosition)?;
    }
    refuse_overlap(frame, &distance, -first, Overlap::InitialPosition)?;
    Ok(MeshedGap { distance: touching, closing_motion: first })
}

fn distances(frame: &ContactFrame, cosines: &[f64], heights: [Option<&[f64]>; 2]) -> Vec<f64> {
    let n = frame.axes.normal();
    let plane = |cell: usize| -n.dot(&frame.centers[cell]) / cosines[cell];
    let [lower, upper] =
        heights.map(|heights| move |cell: usize| heights.map_or_else(|| plane(cell), |h| h[cell]));
    (0..frame.n_cells()).map(|cell| upper(cell) - lower(cell)).collect()
}

fn deepest(distances: &[f64]) -> f64 {
    -distances.iter().copied().fold(f64::INFINITY, f64::min)
}

struct CurvedOverlap {
    /// Largest overlap in the meshed position, mm; negative if no cell overlaps.
    meshed: f64,
    /// Largest overlap after the motion to the first touch, mm; negative if no cell overlaps.
    left: f64,
    shape_error: f64,
    /// Number of cells that overlap in the meshed position, and number of all cells.
    cells: [usize; 2],
}

impl CurvedOverlap {
    fn is_certain(&self) -> bool {
        self.left > self.shape_error
    }
}

fn curved_overlap(
    frame: &ContactFrame,
    cosines: &[f64],
    first: f64,
    surfaces: [Option<&MeshedSurface>; 2],
) -> CurvedOverlap {
    let curved = surfaces.map(|surface| surface.map(|surface| surface.curved_heights(frame)));
    let meshed = distances(frame, cosines, curved.each_ref().map(Option::as_deref));
    let moved: Vec<f64> = meshed.iter().zip(cosines).map(|(d, cosine)| d - first * cosine).collect();
    let shape_error: f64 = surfaces.into_iter().flatten().map(shape_error).sum();
    CurvedOverlap {
        meshed: deepest(&meshed),
        left: deepest(&moved),
        shape_error: shape_error + ROUNDING_SHARE * frame.mean_cell_side(),
        cells: [meshed.iter().filter(|distance| **distance < 0.0).count(), meshed.len()],
    }
}

/// Refuses an interference fit: curved surfaces that overlap by more than the shape error, as meshed and also after the
/// motion to the first touch.
fn refuse_interference(overlap: &CurvedOverlap, first: f64) -> Result<()> {
    if overlap.meshed <= overlap.shape_error || !overlap.is_certain() {
        return Ok(());
    }
    let CurvedOverlap { meshed, left, cells: [count, n], .. } = overlap;
    Err(Error::input(format!(
        "the contact surfaces overlap by up to {meshed:.6} in {count} of {n} cells. A motion of body 2 by {:.6} along n still leaves an overlap of {left:.6}. For an interference fit, set gap.reference = \"as-meshed\". Otherwise mesh body 2 smaller, or at a distance from body 1 along n",
        -first
    )))
}

/// Possible error of a curved surface between the nodes of its mesh, mm. For a circle, quadratic interpolation over an
/// edge of length h with sagitta s has an error of at most s^3 / h^2. The result is 4/3 `SHAPE_ERROR_MARGIN` times this
/// error.
fn shape_error(surface: &MeshedSurface) -> f64 {
    let edges = edge_sagittas(&surface.mesh, &surface.faces).into_iter().flatten().flatten();
    let flat = edges.map(|edge| edge.disagreement() + CURVED_SHAPE_ERROR * edge.largest());
    let point = |node: usize| Point::from(surface.mesh.points[node]);
    let interpolation = |nodes: &[usize], n: usize, i: usize| {
        let (start, end) = (point(nodes[i]), point(nodes[(i + 1) % n]));
        let sagitta = (point(nodes[n + i]) - 0.5 * (start + end)).norm();
        4.0 / 3.0 * sagitta.powi(3) / (end - start).norm_squared()
    };
    let quadratic = surface.faces.iter().filter(|face| face.kind.n_nodes() >= 2 * face.kind.n_corners());
    let curved = quadratic.flat_map(|face| {
        let n = face.kind.n_corners();
        (0..n).map(move |i| interpolation(&face.nodes, n, i))
    });
    flat.chain(curved.map(|error| SHAPE_ERROR_MARGIN * error)).fold(0.0, f64::max)
}

/// Refuses cells that do not face the plane, because their distance from the plane is uncertain or undefined.
fn refuse_steep(frame: &ContactFrame, cosines: &[f64]) -> Result<()> {
    let Some(cell) = cosines.iter().position(|cosine| *cosine < MIN_STEEP_COSINE) else { return Ok(()) };
    let x = frame.centers[cell];
    Err(Error::input(format!(
        "the body without a mesh is treated as a plane, but cell {cell} of the contact frame at ({:.6}, {:.6}, {:.6}) does not face it: use fewer faces in the contact group, or mesh both bodies",
        x.x, x.y, x.z
    )))
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Overlap {
    /// The bodies overlap as meshed, but a motion along n separates them.
    InitialPosition,
    /// No motion along n separates the bodies.
    EveryPosition,
}

fn tolerance(frame: &ContactFrame) -> f64 {
    OVERLAP_TOLERANCE_CELLS * frame.mean_cell_side()
}

fn refuse_overlap(frame: &ContactFrame, distance: &[f64], depth: f64, when: Overlap) -> Result<()> {
    let tolerance = tolerance(frame);
    if depth <= tolerance {
        return Ok(());
    }
    let side = frame.mean_cell_side();
    let cell = (0..distance.len()).fold(0, |best, i| if distance[i] < distance[best] { i } else { best });
    let x = frame.centers[cell];
    let count = distance.iter().filter(|d| **d < 0.0).count();
    let mend = match when {
        Overlap::InitialPosition => format!(
            "move the mesh of body 2 away from body 1 by at least {depth:.6} along the frame's n, and check that body1 is the lower body (`approach` presses the bodies together)"
        ),
        Overlap::EveryPosition => {
            "no motion along the frame's n separates them: set gap.reference = \"as-meshed\" for an interference fit, make body 2 smaller, or rotate frame.normal"
                .to_owned()
        }
    };
    Err(Error::input(format!(
        "the meshes of the two bodies overlap before loading: in {count} of {} cells, by up to {:.6} at ({:.6}, {:.6}, {:.6}), mean cell side {side:.6}; {mend}",
        distance.len(),
        -distance[cell],
        x.x,
        x.y,
        x.z
    )))
}
