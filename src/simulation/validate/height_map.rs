//! Whether the heights of a gap can be meant: their extent, slopes and curvature under the frame.

use nalgebra::{DMatrix, DVector};

use crate::error::warning;
use crate::frame::ContactFrame;
use crate::geometry::format_number;
use crate::scene::plan::Plan;

/// Slopes between neighbouring cells above this are warned of: half-spaces and small displacements stand for slopes far below 1, and heights in micrometres that
/// are taken for millimetres rise a thousand times as fast.
const MAX_SLOPE: f64 = 0.5;

/// The rise of the best sphere from its middle to the farthest cell over the deviation from it from which on the heights count as those of a sphere.
const MIN_SAGITTA_OVER_DEVIATION: f64 = 3.0;

/// Heights with a spread below this share of the size of the frame are a plane.
const ROUNDING: f64 = 1e-12;

/// The sphere (paraboloid) on a tilted plane that fits heights best.
struct BestSphere {
    /// 1 / R, positive where the gap opens away from the middle, 1/mm.
    curvature: f64,
    /// Root mean square of the heights about it, mm.
    deviation: f64,
    /// Rise from its middle to the farthest cell, mm.
    sagitta: f64,
}

impl BestSphere {
    fn is_seen(&self) -> bool {
        self.sagitta.abs() >= MIN_SAGITTA_OVER_DEVIATION * self.deviation
    }
}

/// A note of what the heights `gap` (`[N]`, mm) of a file are under the frame, and warnings where they can hardly be meant.
pub(super) fn check(plan: &Plan, frame: &ContactFrame, gap: &[f64]) -> Vec<String> {
    let unit = &plan.units.length;
    let highest = gap.iter().copied().fold(0.0, f64::max);
    let mean = mean(frame, gap);
    let rms = mean_square(frame, gap.iter().map(|g| g - mean)).sqrt();
    let mut notes = Vec::new();
    let sphere = (rms > ROUNDING * frame.size()).then(|| best_sphere(frame, gap)).flatten();
    let of_sphere = match &sphere {
        Some(sphere) if sphere.is_seen() => format!(
            "the best sphere has a radius of {} {unit} (deviation {} {unit}, root mean square)",
            short(1.0 / sphere.curvature),
            short(sphere.deviation)
        ),
        _ => "no sphere fits".to_owned(),
    };
    notes.push(format!(
        "gap.kind = \"heights\": 0 to {} {unit} under the frame, {} {unit} about their mean (root mean square); {of_sphere}",
        short(highest),
        short(rms)
    ));
    let slope = steepest_slope(frame, gap);
    if slope > MAX_SLOPE {
        notes.push(warning(&format!(
            "the heights of the gap rise by up to {} {unit} per {unit} between neighbouring cells: pressures under them mean nothing. Check that they are \
             given in {unit}, not in micrometres, and that no values are missing or misread",
            short(slope)
        )));
    }
    if sphere.is_some_and(|sphere| sphere.is_seen() && sphere.curvature < 0.0) {
        notes.push(warning(
            "the heights of the gap are largest in the middle, so that the bodies touch at the edge of the frame first. Heights are distances, large where the \
             surfaces are far apart: change the sign if the map is one of the height of body 2's surface",
        ));
    }
    notes
}

fn short(value: f64) -> String {
    format_number(format!("{value:.2e}").parse().unwrap_or(value))
}

/// Mean over the area.
fn mean(frame: &ContactFrame, gap: &[f64]) -> f64 {
    gap.iter().zip(&frame.areas).map(|(g, area)| g * area).sum::<f64>() / frame.areas.iter().sum::<f64>()
}

fn mean_square(frame: &ContactFrame, values: impl Iterator<Item = f64>) -> f64 {
    values.zip(&frame.areas).map(|(v, area)| v * v * area).sum::<f64>() / frame.areas.iter().sum::<f64>()
}

/// Least squares of c + b_x x + b_y y + (x^2 + y^2) / (2 R) over the cells; `None` of fewer than five.
fn best_sphere(frame: &ContactFrame, gap: &[f64]) -> Option<BestSphere> {
    let n = gap.len();
    if n < 5 {
        return None;
    }
    // In lengths of the frame, so that all terms are of one size.
    let size = frame.size();
    let places: Vec<[f64; 2]> = (0..n).map(|cell| frame.plane_coordinates(cell).map(|x| x / size)).collect();
    let term = |cell: usize, k: usize| {
        let [x, y] = places[cell];
        [1.0, x, y, 0.5 * (x * x + y * y)][k]
    };
    let normal = DMatrix::from_fn(4, 4, |i, j| {
        (0..n).map(|cell| frame.areas[cell] * term(cell, i) * term(cell, j)).sum::<f64>()
    });
    let right =
        DVector::from_fn(4, |i, _| (0..n).map(|cell| frame.areas[cell] * term(cell, i) * gap[cell]).sum());
    // A single row of cells does not determine the slope across it.
    let scale = normal.amax();
    let found = normal.svd(true, true).solve(&right, 1e-12 * scale).ok()?;
    let off = |cell: usize| gap[cell] - (0..4).map(|k| found[k] * term(cell, k)).sum::<f64>();
    let deviation = mean_square(frame, (0..n).map(off)).sqrt();
    let middle = [1, 2].map(|k| mean(frame, &(0..n).map(|cell| term(cell, k)).collect::<Vec<_>>()));
    let farthest =
        places.iter().map(|[x, y]| (x - middle[0]).powi(2) + (y - middle[1]).powi(2)).fold(0.0, f64::max);
    Some(BestSphere { curvature: found[3] / (size * size), deviation, sagitta: 0.5 * found[3] * farthest })
}

/// The largest slope between neighbouring cells of a grid; 0 of other frames.
fn steepest_slope(frame: &ContactFrame, gap: &[f64]) -> f64 {
    let Some(grid) = frame.grid else { return 0.0 };
    let [nx, ny] = grid.cells;
    let mut at = vec![f64::NAN; nx * ny];
    gap.iter().enumerate().for_each(|(cell, g)| at[frame.grid_index(cell)] = *g);
    let mut steepest: f64 = 0.0;
    for place in 0..nx * ny {
        let [ix, iy] = [place / ny, place % ny];
        // Places outside of an outline have no height, and the largest leaves them out.
        if ix + 1 < nx {
            steepest = steepest.max((at[place + ny] - at[place]).abs() / grid.spacing[0]);
        }
        if iy + 1 < ny {
            steepest = steepest.max((at[place + 1] - at[place]).abs() / grid.spacing[1]);
        }
    }
    steepest
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: heights (x^2 + y^2) / (2 R) plus a plane have the radius R and no deviation, on a square and on a single row; a cosine about a plane
    /// has no sphere.
    #[test]
    fn spheres() {
        for cells in [[20, 20], [20, 1]] {
            let frame = ContactFrame::grid([1.0, 0.6], cells, [0.3, 0.1], 0.2).unwrap();
            let of = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
                (0..frame.n_cells()).map(|cell| frame.plane_coordinates(cell)).map(|[x, y]| f(x, y)).collect()
            };
            let gap = of(&|x, y| (x * x + y * y) / 100.0 + 0.01 * x);
            let found = best_sphere(&frame, &gap).unwrap();
            assert!((found.curvature * 50.0 - 1.0).abs() < 1e-9 && found.is_seen(), "{}", found.curvature);
            assert!(found.deviation < 1e-12, "{}", found.deviation);
            let inverted = best_sphere(&frame, &of(&|x, y| -(x * x + y * y) / 100.0)).unwrap();
            assert!((inverted.curvature * 50.0 + 1.0).abs() < 1e-9 && inverted.is_seen());
            let waves = of(&|x, _| 1e-3 * (31.0 * x).cos());
            assert!(!best_sphere(&frame, &waves).unwrap().is_seen());
        }
    }

    /// Truth: a plane of the slope 0.3 along x and -0.7 along y.
    #[test]
    fn slopes() {
        let frame = ContactFrame::grid([1.0, 0.6], [10, 12], [0.0; 2], 0.0).unwrap();
        let gap: Vec<f64> =
            (0..120).map(|cell| frame.plane_coordinates(cell)).map(|[x, y]| 0.3 * x - 0.7 * y).collect();
        assert!((steepest_slope(&frame, &gap) - 0.7).abs() < 1e-12);
    }
}
