//! Field of a point force by interpolation in a table over the directions into the body.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::angular_table::{NODES, lagrange_and_slope, lagrange_over_distance};
use super::interior::InteriorField;
use super::point_field::PointField;
use super::surface_field::SurfaceField;

/// First and largest number of angles of a turn; a third as many rows from the inner axis to the surface.
const ANGLES: [usize; 2] = [96, 960];

/// Wanted error of the gradient, over its largest entry.
const ERROR: f64 = 1e-6;

/// Change of the direct integral by doubling its points at which a node, or a point that is compared, is accepted: what is
/// left is about its square.
const CHANGE: f64 = 1e-7;

/// Directions in which a table is compared with the direct integral; as many again about the worst of them.
const COMPARED: usize = 1024;

/// Rows beyond the inner axis, angles beyond a whole turn.
const BEYOND: usize = NODES / 2 - 1;

/// r G at equidistant angles φ and t = tan(β/2), β being the angle from the inner axis: polynomials of degree 7 in both, whose
/// derivatives give the gradient.
///
/// Rows in t lie half as dense at the axis as at the surface, where their interpolation is one-sided; they go on beyond the
/// axis with the opposite angle.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct PointForceTable {
    /// `[row][angle][3 x 3]`, rows from −3, angles from −3 − half a turn.
    entries: Vec<f64>,
    angles: usize,
    rows: usize,
    /// Largest difference from the direct integral, over the largest entry of the gradient.
    error: f64,
}

impl PointForceTable {
    /// A table whose error is measured to be below 1e-6, or the largest one.
    pub(super) fn new(interior: &InteriorField, surface: &SurfaceField) -> Self {
        let mut angles = ANGLES[0];
        loop {
            let mut table = Self::sampled(angles, interior, surface);
            table.error = table.compared(interior, surface);
            if table.error <= ERROR || angles >= ANGLES[1] {
                return table;
            }
            // The derivative of the interpolation is of seventh order.
            let factor = (2.0 * table.error / ERROR).powf(1.0 / 7.0).clamp(1.1, 2.0);
            angles = (((angles as f64 * factor / 12.0).ceil() as usize) * 12).min(ANGLES[1]);
        }
    }

    /// Of `angles` angles, without its error.
    fn sampled(angles: usize, interior: &InteriorField, surface: &SurfaceField) -> Self {
        let rows = angles / 3;
        let nodes: Vec<[f64; 9]> = (0..(rows + 1) * angles)
            .into_par_iter()
            .map(|k| {
                let (row, angle) = (k / angles, k % angles);
                let phi = 2.0 * PI * angle as f64 / angles as f64;
                if row == rows {
                    return surface.gamma(phi.cos(), phi.sin());
                }
                // One direction for all angles of the axis.
                let phi = if row == 0 { 0.0 } else { phi };
                let (value, _) = interior.value(&direction(phi, row as f64 / rows as f64), CHANGE);
                std::array::from_fn(|k| value[(k / 3, k % 3)])
            })
            .collect();
        Self::of_nodes(angles, &nodes, 0.0)
    }

    /// From r G row by row at the angles of a turn, in rows from the axis to the surface.
    fn of_nodes(angles: usize, nodes: &[[f64; 9]], error: f64) -> Self {
        let rows = nodes.len() / angles - 1;
        let around = angles + NODES;
        let mut entries = Vec::with_capacity((rows + 1 + BEYOND) * around * 9);
        for row in 0..=rows + BEYOND {
            let from_axis = row.abs_diff(BEYOND);
            let turn = if row < BEYOND { 0 } else { angles / 2 };
            for angle in 0..around {
                let angle = (angle + turn + angles - BEYOND) % angles;
                entries.extend(nodes[from_axis * angles + angle]);
            }
        }
        Self { entries, angles, rows, error }
    }

    /// Largest difference found from the direct integral, over the largest entry of the gradient.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// The field at a point below the surface or on it.
    pub(super) fn at(&self, x: &Vector3<f64>) -> PointField {
        let (r, distance) = (x.x.hypot(x.y), x.norm());
        let (sin, cos) = (r / distance, -x.z / distance);
        let t = sin / (1.0 + cos);
        let (c, s) = if r > 0.0 { (x.x / r, x.y / r) } else { (1.0, 0.0) };
        let sums = self.sums(s.atan2(c), t);
        // dt/dβ = (1 + t²)/2 and sin β = t / ((1 + t²)/2).
        let half = 0.5 * (1.0 + t * t);
        let [value, polar, azimuthal] = sums.map(|sum| Matrix3::from_row_slice(&sum));
        let [polar, azimuthal] = [polar * half, azimuthal * half];
        let outward = polar * cos - value * sin;
        let gradient = [outward * c - azimuthal * s, outward * s + azimuthal * c, polar * sin + value * cos];
        PointField { value, gradient }.scaled(distance)
    }

    /// r G, its derivative in t, and that in φ over t.
    fn sums(&self, phi: f64, t: f64) -> [[f64; 9]; 3] {
        let around = self.angles + NODES;
        let per_radian = self.angles as f64 / (2.0 * PI);
        let position = ((phi + PI) * per_radian).min(self.angles as f64);
        let angle = position as usize;
        let [along, slope] = lagrange_and_slope(position - angle as f64);
        let height = (t * self.rows as f64).min(self.rows as f64);
        let row = (height as usize).min(self.rows - (NODES - 1 - BEYOND));
        let [across, steep] = lagrange_and_slope(height - row as f64);
        // Next to the axis the derivative along φ vanishes with t.
        let over_t = if row <= BEYOND {
            lagrange_over_distance(height - row as f64, BEYOND - row).map(|w| w * self.rows as f64)
        } else {
            across.map(|w| w / t)
        };
        let mut sums = [[0.0; 9]; 3];
        for j in 0..NODES {
            let from = ((row + j) * around + angle) * 9;
            let entries = &self.entries[from..from + NODES * 9];
            let (mut value, mut turned) = ([0.0; 9], [0.0; 9]);
            for (k, node) in entries.chunks_exact(9).enumerate() {
                for c in 0..9 {
                    value[c] += along[k] * node[c];
                    turned[c] += slope[k] * node[c];
                }
            }
            for c in 0..9 {
                sums[0][c] += across[j] * value[c];
                sums[1][c] += steep[j] * value[c];
                sums[2][c] += over_t[j] * turned[c];
            }
        }
        sums[1].iter_mut().for_each(|sum| *sum *= self.rows as f64);
        sums[2].iter_mut().for_each(|sum| *sum *= per_radian);
        sums
    }

    /// Largest difference of the gradient from the direct integral in evenly spread directions, about the worst of them, and on
    /// the surface, over its largest entry there.
    fn compared(&self, interior: &InteriorField, surface: &SurfaceField) -> f64 {
        let inside = |places: Vec<[f64; 2]>| -> Vec<[f64; 2]> {
            let apart = |[phi, t]: [f64; 2]| {
                let x = direction(phi, t);
                let (wanted, change) = interior.gradient(&x, CHANGE);
                let rest = if change > CHANGE { change * wanted.steepest() } else { 0.0 };
                [wanted.steepest_difference(&self.at(&x)) + rest, wanted.steepest()]
            };
            places.into_par_iter().map(apart).collect()
        };
        // The R2 sequence of the plastic number.
        let spread: Vec<[f64; 2]> = (1..=COMPARED)
            .map(|k| [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|a| (a * k as f64).fract()))
            .collect();
        let first: Vec<[f64; 2]> = spread.iter().map(|&[a, b]| [2.0 * PI * a, b]).collect();
        let mut found = inside(first.clone());
        let worst = (0..COMPARED).max_by(|&a, &b| found[a][0].total_cmp(&found[b][0])).unwrap_or(0);
        let [cell, row] = [2.0 * PI / self.angles as f64, 1.0 / self.rows as f64];
        let near = spread.iter().map(|&[a, b]| {
            let t = first[worst][1] + 8.0 * row * (b - 0.5);
            [first[worst][0] + 8.0 * cell * (a - 0.5), t.clamp(0.0, 1.0 - 0.1 * row)]
        });
        found.extend(inside(near.collect()));
        found.extend((0..4 * self.angles).map(|k| {
            let phi = 0.25 * k as f64 * cell;
            let wanted = surface.at(phi.cos(), phi.sin());
            let apart = self.at(&Vector3::new(phi.cos(), phi.sin(), 0.0));
            [wanted.steepest_difference(&apart), wanted.steepest()]
        }));
        let [apart, steepest] = [0, 1].map(|k| found.iter().map(|pair| pair[k]).fold(0.0, f64::max));
        apart / steepest
    }
}

/// The unit vector of φ and t = tan(β/2).
fn direction(phi: f64, t: f64) -> Vector3<f64> {
    let inverse = 1.0 / (1.0 + t * t);
    let sin = 2.0 * t * inverse;
    Vector3::new(sin * phi.cos(), sin * phi.sin(), -(1.0 - t * t) * inverse)
}
