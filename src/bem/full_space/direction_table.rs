//! Field of a point force in a full space by interpolation in a table over directions.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::barnett::BarnettField;
use crate::bem::half_space::PointField;
use crate::bem::half_space::angular_table::{NODES, lagrange};
use crate::error::Result;
use crate::interrupt;
use crate::linalg::wide::wide;

/// First and largest number of angles of a turn; a quarter as many rows from the pole to the equator.
const ANGLES: [usize; 2] = [96, 768];

/// Wanted error, over the largest entry.
const ERROR: f64 = 1e-9;

/// Directions in which a table is compared with the integrals.
const COMPARED: usize = 2048;

/// Rows beyond the pole and the equator, angles beyond a whole turn.
const BEYOND: usize = NODES / 2 - 1;

/// Entries of a node: r U (xx, yy, zz, yz, xz, xy) and r² ∂U along x, y, z likewise.
const ENTRIES: usize = 24;

/// Rows and columns of the entries of a symmetric matrix.
const SYMMETRIC: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

/// r U and r² ∂U at equidistant polar angles and azimuths, polynomials of degree 7 in both.
///
/// U is even and ∂U odd in x: the upper half of the directions suffices. Both are smooth on the sphere, so that rows go on beyond the
/// pole with the opposite azimuth and beyond the equator with the opposite direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DirectionTable {
    /// `[row][angle][24]`, rows from -3, angles from -3 - half a turn.
    entries: Vec<f64>,
    angles: usize,
    /// Largest difference from the integrals, over the largest entry.
    error: f64,
}

type Entries = [f64; ENTRIES];

fn entries(field: &PointField) -> Entries {
    let parts = [&field.value, &field.gradient[0], &field.gradient[1], &field.gradient[2]];
    std::array::from_fn(|k| parts[k / 6][SYMMETRIC[k % 6]])
}

fn direction(polar: f64, azimuth: f64) -> Vector3<f64> {
    Vector3::new(polar.sin() * azimuth.cos(), polar.sin() * azimuth.sin(), polar.cos())
}

impl DirectionTable {
    /// A table whose error is measured to be below 1e-9, or the largest one.
    ///
    /// # Errors
    /// If the integrals do not converge, or a stop is wished.
    pub(super) fn new(integrals: &BarnettField) -> Result<Self> {
        let compared: Vec<(Vector3<f64>, PointField)> = (1..=COMPARED)
            .into_par_iter()
            .map(|k| {
                // The R2 sequence of the plastic number on the sphere.
                let [a, b] =
                    [0.754_877_666_246_692_8, 0.569_840_290_998_053_3].map(|step| step * k as f64 % 1.0);
                let x = direction((1.0 - 2.0 * b).acos(), 2.0 * PI * a);
                Ok((x, integrals.at(&x)?))
            })
            .collect::<Result<_>>()?;
        let mut angles = ANGLES[0];
        loop {
            let mut table = Self::sampled(angles, integrals)?;
            table.error = table.compared(&compared);
            interrupt::check()?;
            if table.error <= ERROR || angles >= ANGLES[1] {
                return Ok(table);
            }
            let factor = (2.0 * table.error / ERROR).powf(1.0 / 8.0).clamp(1.1, 2.0);
            angles = (((angles as f64 * factor / 16.0).ceil() as usize) * 16).min(ANGLES[1]);
        }
    }

    fn sampled(angles: usize, integrals: &BarnettField) -> Result<Self> {
        let rows = angles / 4;
        let step = 2.0 * PI / angles as f64;
        let row = |row: usize| -> Result<Vec<Entries>> {
            interrupt::check()?;
            let node = |angle: usize| {
                Ok(entries(&integrals.at(&direction(row as f64 * step, angle as f64 * step))?))
            };
            // All angles of the pole are one direction.
            if row == 0 { Ok(vec![node(0)?; angles]) } else { (0..angles).map(node).collect() }
        };
        let nodes: Vec<Vec<Entries>> = (0..=rows).into_par_iter().map(row).collect::<Result<_>>()?;
        let around = angles + NODES;
        let mut entries = Vec::with_capacity((rows + 1 + 2 * BEYOND + 1) * around * ENTRIES);
        for place in 0..rows + 2 * BEYOND + 2 {
            let below = place < BEYOND;
            let row = place.abs_diff(BEYOND);
            let beyond = row > rows;
            let from = if beyond { 2 * rows - row } else { row };
            let turn = if below || beyond { angles / 2 } else { 0 };
            for angle in 0..around {
                let node = &nodes[from][(angle + turn + angles / 2 + angles - BEYOND) % angles];
                let sign = |k: usize| if beyond && k >= 6 { -1.0 } else { 1.0 };
                entries.extend(node.iter().enumerate().map(|(k, value)| sign(k) * value));
            }
        }
        Ok(Self { entries, angles, error: 0.0 })
    }

    /// Largest difference from the integrals, over the largest entry.
    fn compared(&self, wanted: &[(Vector3<f64>, PointField)]) -> f64 {
        let mut apart = [0.0_f64; 2];
        let mut size = [0.0_f64; 2];
        for (x, wanted) in wanted {
            let found = self.at(x);
            apart[0] = apart[0].max((found.value - wanted.value).amax());
            size[0] = size[0].max(wanted.value.amax());
            for k in 0..3 {
                apart[1] = apart[1].max((found.gradient[k] - wanted.gradient[k]).amax());
                size[1] = size[1].max(wanted.gradient[k].amax());
            }
        }
        (apart[0] / size[0]).max(apart[1] / size[1])
    }

    /// Largest difference found from the integrals, over the largest entry.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// What a table is restored from: the angles, the error, the entries.
    pub(super) fn values(&self) -> Vec<f64> {
        [self.angles as f64, self.error].into_iter().chain(self.entries.iter().copied()).collect()
    }

    /// The table of such values; `None` if they are none of a table.
    pub(super) fn restored(mut values: Vec<f64>) -> Option<Self> {
        let &[angles, error, ..] = &values[..] else { return None };
        let angles = angles as usize;
        if !(ANGLES[0]..=ANGLES[1]).contains(&angles) {
            return None;
        }
        values.drain(..2);
        let size = (angles / 4 + 2 * BEYOND + 2) * (angles + NODES) * ENTRIES;
        (values.len() == size).then_some(Self { entries: values, angles, error })
    }

    /// The field at a point other than the origin.
    #[inline]
    pub(super) fn at(&self, x: &Vector3<f64>) -> PointField {
        let sign = if x.z < 0.0 { -1.0 } else { 1.0 };
        let (x, y, z) = (sign * x.x, sign * x.y, sign * x.z);
        let rho = x.hypot(y);
        let per_radian = self.angles as f64 / (2.0 * PI);
        let height = rho.atan2(z) * per_radian;
        let around = (y.atan2(x) + PI) * per_radian;
        let (row, angle) = ((height as usize).min(self.angles / 4), (around as usize).min(self.angles));
        let weights = [lagrange(height - row as f64), lagrange(around - angle as f64)];
        let stride = (self.angles + NODES) * ENTRIES;
        let mut sums = [0.0; ENTRIES];
        weigh(&self.entries[row * stride + angle * ENTRIES..], stride, &weights, &mut sums);
        let inverse = 1.0 / rho.hypot(z);
        let matrix = |part: usize, factor: f64| {
            let [xx, yy, zz, yz, xz, xy] = std::array::from_fn(|k| factor * sums[6 * part + k]);
            Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
        };
        let slope = sign * inverse * inverse;
        PointField {
            value: matrix(0, inverse),
            gradient: [matrix(1, slope), matrix(2, slope), matrix(3, slope)],
        }
    }
}

/// The weighted sums over nodes whose rows lie `stride` entries apart.
fn weigh(entries: &[f64], stride: usize, weights: &[[f64; NODES]; 2], sums: &mut Entries) {
    wide!(weigh_inline(
        entries => entries: &[f64], stride => stride: usize, weights => weights: &[[f64; NODES]; 2], sums => sums: &mut Entries
    ))
}

#[inline(always)]
fn weigh_inline(entries: &[f64], stride: usize, weights: &[[f64; NODES]; 2], sums: &mut Entries) {
    let [down, around] = weights;
    let mut total = [0.0; ENTRIES];
    for (row, down) in down.iter().enumerate() {
        let mut of_row = [0.0; ENTRIES];
        let nodes = entries[row * stride..row * stride + NODES * ENTRIES].chunks_exact(ENTRIES);
        for (node, weight) in nodes.zip(around) {
            (0..ENTRIES).for_each(|k| of_row[k] += weight * node[k]);
        }
        (0..ENTRIES).for_each(|k| total[k] += down * of_row[k]);
    }
    *sums = total;
}
