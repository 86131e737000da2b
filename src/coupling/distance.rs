//! The initial gap between two meshed surfaces, and bodies that overlap before they are pressed together.

use crate::error::{Error, Result};
use crate::frame::{ContactFrame, MeshedSurface, first_touch};

/// Cells whose normal has less than this share of the largest component along the frame's n do not say where the
/// surfaces first touch: there a small error of the meshes is a large motion.
const MIN_FACING_COSINE: f64 = 0.5;

/// They count where the others alone would leave an overlap, down to this share.
const MIN_STEEP_COSINE: f64 = 0.05;

/// Bodies may overlap by this share of the cells' mean side: curved faces differ from their surface by less.
const OVERLAP_TOLERANCE_CELLS: f64 = 0.1;

/// Mean distance of the undeformed surfaces over each cell, along its normal, `[N]`, mm, with body 2 at the first touch;
/// `None` is the plane through the global origin across the frame's n.
///
/// Body 2 is moved along the frame's n by t, which opens a cell by t n_I.n: the first touch is the smallest d / n_I.n,
/// point by point, in the cells that look along n ([`first_touch`]). The means of a condensed mesh are those of the faces as
/// they are: the displacement of its contact surface is averaged with the same shape functions, and where it follows a curved
/// surface its nodes do. Those of a body with the near field of a half-space are bowed ([`MeshedSurface::curved_heights`]).
///
/// # Errors
/// If the bodies overlap as they are meshed, or no motion along n separates them, or a plane is to meet cells that do
/// not look at it.
pub fn mesh_distance(frame: &ContactFrame, surfaces: [Option<&MeshedSurface>; 2]) -> Result<Vec<f64>> {
    let n = frame.axes.normal();
    let cosines = frame.triads.map(|triad| triad.normal().dot(&n)).into_vec();
    if surfaces.iter().any(Option::is_none) {
        refuse_steep(frame, &cosines)?;
    }
    let [lower, upper] = surfaces.map(|surface| surface.map(|surface| surface.mean_heights.as_slice()));
    let plane = |cell: usize| -n.dot(&frame.centers[cell]) / cosines[cell];
    let at = |heights: Option<&[f64]>, cell: usize| heights.map_or_else(|| plane(cell), |h| h[cell]);
    let distance: Vec<f64> = (0..frame.n_cells()).map(|cell| at(upper, cell) - at(lower, cell)).collect();
    let moved =
        |by: f64| -> Vec<f64> { distance.iter().zip(&cosines).map(|(d, cosine)| d - by * cosine).collect() };
    let deepest = |values: &[f64]| -values.iter().copied().fold(f64::INFINITY, f64::min);
    let mut first = first_touch(frame, surfaces, MIN_FACING_COSINE);
    if !first.is_finite() {
        return Err(Error::input(
            "no cell of the contact frame looks along its n, so that body 2 cannot be moved towards body 1: turn \
             frame.normal from body 1 to body 2",
        ));
    }
    if deepest(&moved(first)) > tolerance(frame) {
        first = first_touch(frame, surfaces, MIN_STEEP_COSINE);
    }
    let touching = moved(first);
    if deepest(&distance) > 0.0 {
        refuse_overlap(frame, &distance, deepest(&touching), Overlap::EveryPosition)?;
    }
    refuse_overlap(frame, &distance, -first, Overlap::InitialPosition)?;
    Ok(touching)
}

/// A plane has no distance from cells that are perpendicular to it or look away.
fn refuse_steep(frame: &ContactFrame, cosines: &[f64]) -> Result<()> {
    let Some(cell) = cosines.iter().position(|cosine| *cosine < MIN_STEEP_COSINE) else { return Ok(()) };
    let x = frame.centers[cell];
    Err(Error::input(format!(
        "the body without a mesh counts as a plane, and cell {cell} of the contact frame at ({:.6}, {:.6}, {:.6}) does not \
         look at it: take fewer faces into the contact group, or mesh both bodies",
        x.x, x.y, x.z
    )))
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Overlap {
    /// A motion along n separates the bodies.
    InitialPosition,
    /// None does.
    EveryPosition,
}

/// Overlap that is taken for the difference between faces and the curved surface, mm.
fn tolerance(frame: &ContactFrame) -> f64 {
    OVERLAP_TOLERANCE_CELLS * (frame.areas.iter().sum::<f64>() / frame.n_cells() as f64).sqrt()
}

/// Refuses a `depth` of penetration beyond what curved faces explain.
fn refuse_overlap(frame: &ContactFrame, distance: &[f64], depth: f64, when: Overlap) -> Result<()> {
    let tolerance = tolerance(frame);
    if depth <= tolerance {
        return Ok(());
    }
    let side = tolerance / OVERLAP_TOLERANCE_CELLS;
    let cell = (0..distance.len()).fold(0, |best, i| if distance[i] < distance[best] { i } else { best });
    let x = frame.centers[cell];
    let count = distance.iter().filter(|d| **d < 0.0).count();
    let mend = match when {
        Overlap::InitialPosition => format!(
            "move the mesh of body 2 away from body 1 by at least {depth:.6} (along the frame's n; `approach` presses them \
             together), and check which of the bodies is body1, the lower one"
        ),
        Overlap::EveryPosition => {
            "no motion along the frame's n separates them (an interference fit is not available): \
                                  make body 2 smaller or turn frame.normal"
                .to_owned()
        }
    };
    Err(Error::input(format!(
        "the meshes of the two bodies overlap before they are pressed together: in {count} of {} cells, most by {:.6} at \
         ({:.6}, {:.6}, {:.6}), where the cells' mean side is {side:.6}; {mend}",
        distance.len(),
        -distance[cell],
        x.x,
        x.y,
        x.z
    )))
}
