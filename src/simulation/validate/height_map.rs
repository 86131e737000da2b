//! Plausibility checks of a gap given by heights.

use nalgebra::{DMatrix, Matrix2, Vector6};

use crate::error::Warning;
use crate::frame::ContactFrame;
use crate::geometry::format_short;
use crate::linalg::pseudo_inverse::pseudo_inverse;
use crate::scene::plan::Plan;

/// Largest slope that causes no warning. Half-space theory and small displacements require slopes far below 1. If
/// heights in micrometres are read as millimetres, slopes are a thousand times too large.
const MAX_SLOPE: f64 = 0.5;

/// Singular value of the normal equations, relative to the largest, below which the value counts as zero.
const RANK_TOLERANCE: f64 = 1e-12;

/// Smallest ratio of the paraboloid's rise to the deviation of the heights at which radii are reported.
const MIN_SAGITTA_OVER_DEVIATION: f64 = 3.0;

/// Rise of the paraboloid, relative to the largest height, below which the rise results from rounding.
const ROUNDING: f64 = 1e-6;

/// Maximum ratio of the smaller to the larger curvature of a cylinder.
const CYLINDER_CURVATURE_RATIO: f64 = 1e-2;

/// Maximum difference of the two curvatures of a sphere, relative to the larger.
const SPHERE_CURVATURE_DIFFERENCE: f64 = 0.05;

struct BestParaboloid {
    /// Principal curvatures, the larger in magnitude first, positive if the gap increases away from the middle, 1/mm.
    curvatures: [f64; 2],
    /// Root mean square deviation of the heights from the paraboloid, mm.
    deviation: f64,
    /// Rise of the paraboloid from the centroid of the cells to the farthest cell, along the direction of the larger
    /// curvature, mm.
    sagitta: f64,
}

impl BestParaboloid {
    fn is_seen(&self, highest: f64) -> bool {
        self.sagitta.abs() >= MIN_SAGITTA_OVER_DEVIATION * self.deviation
            && self.sagitta.abs() > ROUNDING * highest
    }

    fn describe(&self, unit: &str) -> String {
        let [larger, smaller] = self.curvatures;
        let shape = if smaller.abs() < CYLINDER_CURVATURE_RATIO * larger.abs() {
            format!("the best-fit cylinder has a radius of {} {unit}", format_short(1.0 / larger))
        } else if (larger - smaller).abs() < SPHERE_CURVATURE_DIFFERENCE * larger.abs() {
            format!("the best-fit sphere has a radius of {} {unit}", format_short(2.0 / (larger + smaller)))
        } else {
            format!(
                "the best-fit ellipsoid has radii of {} and {} {unit}",
                format_short(1.0 / larger),
                format_short(1.0 / smaller)
            )
        };
        format!("{shape} (deviation {} {unit}, root mean square)", format_short(self.deviation))
    }
}

/// Describes the heights `gap` (`[N]`, mm) from a file, and warns if they are implausible.
pub(super) fn check(plan: &Plan, frame: &ContactFrame, gap: &[f64]) -> Vec<Warning> {
    let unit = &plan.units.length;
    let highest = gap.iter().copied().fold(0.0, f64::max);
    let mean = mean(frame, gap);
    let rms = mean_square(frame, gap.iter().map(|g| g - mean)).sqrt();
    let mut notes = Vec::new();
    let shape = best_paraboloid(frame, gap).filter(|shape| shape.is_seen(highest));
    let described = shape
        .as_ref()
        .map_or_else(|| "no sphere, cylinder or ellipsoid fits".to_owned(), |shape| shape.describe(unit));
    notes.push(Warning::note(format!(
        "gap.kind = \"heights\": the heights under the frame are 0 to {} {unit}, with a root mean square deviation of {} {unit} from their mean; {described}",
        format_short(highest),
        format_short(rms)
    )));
    let slope = steepest_slope(frame, gap);
    if slope > MAX_SLOPE {
        notes.push(Warning::uncertain(&format!(
            "the heights of the gap rise by up to {} {unit} per {unit} between neighbouring cells. Unless this is the edge of a punch, pressures there are wrong: check the file for a wrong unit ({unit} is expected) and for missing or misread values",
            format_short(slope)
        )));
    }
    let repeats = frame.is_periodic();
    if !repeats && shape.is_some_and(|shape| shape.curvatures.iter().sum::<f64>() < 0.0) {
        notes.push(Warning::uncertain(
            "the heights of the gap are largest in the middle, so that the bodies first touch at the edge of the frame. Heights are distances between the surfaces: change their sign if the map contains the height of the surface of body 2",
        ));
    }
    notes
}

fn mean(frame: &ContactFrame, gap: &[f64]) -> f64 {
    gap.iter().zip(&frame.areas).map(|(g, area)| g * area).sum::<f64>() / frame.areas.iter().sum::<f64>()
}

fn mean_square(frame: &ContactFrame, values: impl Iterator<Item = f64>) -> f64 {
    values.zip(&frame.areas).map(|(v, area)| v * v * area).sum::<f64>() / frame.areas.iter().sum::<f64>()
}

/// Area-weighted least-squares fit of c + b_x x + b_y y + (k_xx x^2 + 2 k_xy x y + k_yy y^2) / 2 over at least seven cells.
fn best_paraboloid(frame: &ContactFrame, gap: &[f64]) -> Option<BestParaboloid> {
    let n = gap.len();
    if n < 7 {
        return None;
    }
    // Scaled coordinates give terms of similar magnitudes.
    let size = frame.size();
    let places: Vec<[f64; 2]> = (0..n).map(|cell| frame.plane_coordinates(cell).map(|x| x / size)).collect();
    let terms = |cell: usize| {
        let [x, y] = places[cell];
        Vector6::new(1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y)
    };
    let (mut normal, mut right) = (DMatrix::zeros(6, 6), Vector6::zeros());
    for (cell, (height, area)) in gap.iter().zip(&frame.areas).enumerate() {
        let terms = terms(cell);
        normal += *area * terms * terms.transpose();
        right += area * height * terms;
    }
    // A single row of cells does not determine the shape across the row. The normal equations are then singular.
    let found = pseudo_inverse(&normal, RANK_TOLERANCE).ok()? * right;
    let deviation = mean_square(frame, (0..n).map(|cell| gap[cell] - found.dot(&terms(cell)))).sqrt();
    let mut curvatures: [f64; 2] =
        Matrix2::new(found[3], found[4], found[4], found[5]).symmetric_eigenvalues().into();
    curvatures.sort_by(|a, b| b.abs().total_cmp(&a.abs()));
    let middle = [0, 1].map(|k| mean(frame, &places.iter().map(|x| x[k]).collect::<Vec<_>>()));
    let farthest =
        places.iter().map(|[x, y]| (x - middle[0]).powi(2) + (y - middle[1]).powi(2)).fold(0.0, f64::max);
    Some(BestParaboloid {
        curvatures: curvatures.map(|k| k / (size * size)),
        deviation,
        sagitta: 0.5 * curvatures[0] * farthest,
    })
}

/// Largest slope between neighbouring cells of a grid; 0 for other frames.
fn steepest_slope(frame: &ContactFrame, gap: &[f64]) -> f64 {
    let Some(grid) = frame.grid else { return 0.0 };
    let [nx, ny] = grid.cells;
    let mut at = vec![f64::NAN; nx * ny];
    gap.iter().enumerate().for_each(|(cell, g)| at[frame.grid_index(cell)] = *g);
    let mut steepest: f64 = 0.0;
    for place in 0..nx * ny {
        let [ix, iy] = [place / ny, place % ny];
        // Positions outside an outline are NaN, which `max` ignores.
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

    /// Truth: for heights x^2 / (2 R1) + y^2 / (2 R2) plus a plane, the fit finds both radii, and the deviation is
    /// zero. A single row of cells shows one radius. Planes and waves show no radius.
    #[test]
    fn paraboloids() {
        for cells in [[20, 16], [20, 1]] {
            let frame = ContactFrame::grid([1.0, 0.6], cells, [0.3, 0.1], 0.2).unwrap();
            let of = |f: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
                (0..frame.n_cells()).map(|cell| frame.plane_coordinates(cell)).map(|[x, y]| f(x, y)).collect()
            };
            let found =
                best_paraboloid(&frame, &of(&|x, y| x * x / 40.0 + y * y / 100.0 + 0.01 * x)).unwrap();
            assert!((found.curvatures[0] * 20.0 - 1.0).abs() < 1e-8 && found.is_seen(0.04));
            assert!(cells[1] == 1 || (found.curvatures[1] * 50.0 - 1.0).abs() < 1e-8);
            assert!(found.deviation < 1e-12, "{}", found.deviation);
            let words = if cells[1] == 1 {
                "best-fit cylinder has a radius of 20 mm"
            } else {
                "radii of 20 and 50 mm"
            };
            assert!(found.describe("mm").contains(words), "{}", found.describe("mm"));
            let inverted = best_paraboloid(&frame, &of(&|x, y| -(x * x + y * y) / 100.0)).unwrap();
            assert!((inverted.curvatures[0] * 50.0 + 1.0).abs() < 1e-8 && inverted.is_seen(0.02));
            for plane in 0..40 {
                let (a, b) = (0.013 * f64::from(plane), 0.1 - 0.007 * f64::from(plane));
                assert!(!best_paraboloid(&frame, &of(&|x, y| a * x + b * y)).unwrap().is_seen(0.5));
            }
            assert!(!best_paraboloid(&frame, &of(&|x, _| 1e-3 * (31.0 * x).cos())).unwrap().is_seen(2e-3));
        }
    }

    /// Truth: the largest slope of the plane 0.3 x - 0.7 y along x or y is 0.7.
    #[test]
    fn slopes() {
        let frame = ContactFrame::grid([1.0, 0.6], [10, 12], [0.0; 2], 0.0).unwrap();
        let gap: Vec<f64> =
            (0..120).map(|cell| frame.plane_coordinates(cell)).map(|[x, y]| 0.3 * x - 0.7 * y).collect();
        assert!((steepest_slope(&frame, &gap) - 0.7).abs() < 1e-12);
    }
}
