//! Field of a point force by interpolation in a table over the directions into the body.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::green::angular_table::{NODES, lagrange_over_distance, lagrange_with_derivative};
use crate::bem::half_space::subsurface::point_force_integral::{DirectionRule, PointForceIntegral};
use crate::bem::half_space::subsurface::surface_point_force::SurfacePointForce;
use crate::cancel;
use crate::error::Result;
use crate::linalg::simd::wide;

/// First and largest number of angles of a turn; a third as many rows from the inner axis to the surface.
const ANGLES: [usize; 2] = [96, 960];

/// Wanted error of the gradient, over its largest entry.
const ERROR: f64 = 1e-6;

/// Change of the direct integral by doubling its points at which a node, or a point that is compared, is accepted: what is
/// left is about its square.
const MAX_INTEGRAL_CHANGE: f64 = 1e-8;

/// Directions in which a table is compared with the direct integral; as many again where it is expected to be worst.
const COMPARED: usize = 1024;

/// Rows beyond the inner axis, angles beyond a whole turn.
const N_GHOST_ROWS: usize = NODES / 2 - 1;

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
    ///
    /// # Errors
    /// If a stop is wished.
    pub(super) fn new(interior: &PointForceIntegral, surface: &SurfacePointForce) -> Result<Self> {
        let mut angles = ANGLES[0];
        let compared = COMPARED / MirrorPlanes(interior.mirrors()).count();
        let spread = reference_values(
            low_discrepancy_points().take(compared).map(|[a, b]| [2.0 * PI * a, b]).collect(),
            interior,
        );
        loop {
            let mut table = Self::sampled(angles, interior, surface);
            table.error = table.measure_error(&spread, interior, surface);
            cancel::check()?;
            if table.error <= ERROR || angles >= ANGLES[1] {
                return Ok(table);
            }
            // The derivative of the interpolation is of seventh order.
            let factor = (2.0 * table.error / ERROR).powf(1.0 / 7.0).clamp(1.1, 2.0);
            angles = (((angles as f64 * factor / 12.0).ceil() as usize) * 12).min(ANGLES[1]);
        }
    }

    /// Of `angles` angles, without its error.
    fn sampled(angles: usize, interior: &PointForceIntegral, surface: &SurfacePointForce) -> Self {
        let rows = angles / 3;
        let images = MirrorPlanes(interior.mirrors());
        let row = |row: usize| -> Vec<[f64; 9]> {
            let phi = |angle: usize| 2.0 * PI * angle as f64 / angles as f64;
            if cancel::requested() {
                return vec![[0.0; 9]; angles];
            }
            if row == rows {
                return (0..angles).map(|angle| surface.gamma(phi(angle).cos(), phi(angle).sin())).collect();
            }
            let mut rule = rule_at(row as f64 / rows as f64);
            let mut node = |angle: usize| {
                let (value, _) = interior.value(&mut rule, phi(angle), MAX_INTEGRAL_CHANGE);
                std::array::from_fn(|k| value[(k / 3, k % 3)])
            };
            // All angles of the axis are one direction.
            if row == 0 {
                return vec![node(0); angles];
            }
            let mut nodes = vec![[0.0; 9]; angles];
            let own = |angle: usize| images.source(angle, angles).0 == angle;
            (0..angles).filter(|&angle| own(angle)).for_each(|angle| nodes[angle] = node(angle));
            for angle in 0..angles {
                let (from, signs) = images.source(angle, angles);
                nodes[angle] = std::array::from_fn(|k| nodes[from][k] * signs[k / 3] * signs[k % 3]);
            }
            nodes
        };
        let nodes: Vec<[f64; 9]> = (0..=rows).into_par_iter().flat_map_iter(row).collect();
        Self::of_nodes(angles, &nodes, 0.0)
    }

    /// From r G row by row at the angles of a turn, in rows from the axis to the surface.
    fn of_nodes(angles: usize, nodes: &[[f64; 9]], error: f64) -> Self {
        let rows = nodes.len() / angles - 1;
        let around = angles + NODES;
        let mut entries = Vec::with_capacity((rows + 1 + N_GHOST_ROWS) * around * 9);
        for row in 0..=rows + N_GHOST_ROWS {
            let from_axis = row.abs_diff(N_GHOST_ROWS);
            let turn = if row < N_GHOST_ROWS { 0 } else { angles / 2 };
            for angle in 0..around {
                let angle = (angle + turn + angles - N_GHOST_ROWS) % angles;
                entries.extend(nodes[from_axis * angles + angle]);
            }
        }
        Self { entries, angles, rows, error }
    }

    /// What a table is restored from: the angles, the error, the entries.
    pub(super) fn values(&self) -> Vec<f64> {
        [self.angles as f64, self.error].into_iter().chain(self.entries.iter().copied()).collect()
    }

    /// The table of such values; `None` if they are none of a table.
    pub(super) fn from_values(mut values: Vec<f64>) -> Option<Self> {
        let &[angles, error, ..] = &values[..] else { return None };
        let angles = angles as usize;
        if !(ANGLES[0]..=ANGLES[1]).contains(&angles) {
            return None;
        }
        let rows = angles / 3;
        values.drain(..2);
        (values.len() == (rows + 1 + N_GHOST_ROWS) * (angles + NODES) * 9).then_some(Self {
            entries: values,
            angles,
            rows,
            error,
        })
    }

    /// Largest difference found from the direct integral, over the largest entry of the gradient.
    pub(super) fn error(&self) -> f64 {
        self.error
    }

    /// The field at a point below the surface or on it.
    pub(in crate::bem::half_space) fn at(&self, x: &Vector3<f64>) -> GreenTensor {
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
        GreenTensor { value, gradient }.at_distance(distance)
    }

    /// r G, its derivative in t, and that in φ over t.
    fn sums(&self, phi: f64, t: f64) -> [[f64; 9]; 3] {
        let around = self.angles + NODES;
        let per_radian = self.angles as f64 / (2.0 * PI);
        let position = ((phi + PI) * per_radian).min(self.angles as f64);
        let angle = position as usize;
        let [angle_weights, angle_slopes] = lagrange_with_derivative(position - angle as f64);
        let height = (t * self.rows as f64).min(self.rows as f64);
        let row = (height as usize).min(self.rows - (NODES - 1 - N_GHOST_ROWS));
        let [row_weights, row_slopes] = lagrange_with_derivative(height - row as f64);
        // Next to the axis the derivative along φ vanishes with t.
        let row_weights_over_t = if row <= N_GHOST_ROWS {
            lagrange_over_distance(height - row as f64, N_GHOST_ROWS - row).map(|w| w * self.rows as f64)
        } else {
            row_weights.map(|w| w / t)
        };
        let weights =
            StencilWeights { angle_weights, angle_slopes, row_weights, row_slopes, row_weights_over_t };
        let mut sums = [[0.0; 9]; 3];
        weigh(&self.entries[(row * around + angle) * 9..], around * 9, &weights, &mut sums);
        sums[1].iter_mut().for_each(|sum| *sum *= self.rows as f64);
        sums[2].iter_mut().for_each(|sum| *sum *= per_radian);
        sums
    }

    /// Largest difference of the gradient from what is wanted at places, and the largest entry wanted.
    fn apart(&self, wanted: &[ReferenceValue]) -> [f64; 2] {
        let largest = |of: &dyn Fn(&ReferenceValue) -> f64| wanted.iter().map(of).fold(0.0, f64::max);
        [largest(&|wanted| wanted.difference_from(self)), largest(&|wanted| wanted.field.max_gradient())]
    }

    /// Largest difference of the gradient from the direct integral in evenly spread directions, on the surface, and where the
    /// interpolation is expected to be worst, over its largest entry there.
    fn measure_error(
        &self,
        spread: &[ReferenceValue],
        interior: &PointForceIntegral,
        surface: &SurfacePointForce,
    ) -> f64 {
        let cell = 2.0 * PI / self.angles as f64;
        let on_surface: Vec<ReferenceValue> = (0..4 * self.angles)
            .map(|k| {
                let phi = 0.25 * k as f64 * cell;
                ReferenceValue {
                    place: [phi, 1.0],
                    field: surface.at(phi.cos(), phi.sin()),
                    error_bound: 0.0,
                }
            })
            .collect();
        let mut found = vec![self.apart(spread), self.apart(&on_surface)];
        let error = |found: &[[f64; 2]]| {
            let [apart, steepest] = [0, 1].map(|k| found.iter().map(|pair| pair[k]).fold(0.0, f64::max));
            apart / steepest
        };
        if error(&found) <= ERROR || self.angles >= ANGLES[1] {
            let rough = self
                .least_resolved_nodes(MirrorPlanes(interior.mirrors()))
                .into_iter()
                .zip(low_discrepancy_points())
                .map(|([phi, t], [a, b])| {
                    let t = t + (b - 0.5) / self.rows as f64;
                    [phi + (a - 0.5) * cell, t.clamp(0.0, 1.0 - 0.1 / self.rows as f64)]
                });
            found.push(self.apart(&reference_values(rough.collect(), interior)));
        }
        error(&found)
    }

    /// The nodes (φ, t) where differences of the eighth order let expect the largest errors of the gradient, one of each set of mirror
    /// images.
    fn least_resolved_nodes(&self, images: MirrorPlanes) -> Vec<[f64; 2]> {
        const BINOMIAL: [f64; 9] = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
        // Products of the distances of a node from the other ones, over 8!: in the middle, at the end.
        const SLOPES: [f64; 2] = [144.0 / 40320.0, 5040.0 / 40320.0];
        let stride = (self.angles + NODES) * 9;
        let difference = |node: &dyn Fn(usize) -> usize| {
            let entry = |c: usize| (0..9).map(|k| BINOMIAL[k] * self.entries[node(k) + c]).sum::<f64>().abs();
            (0..9).map(entry).fold(0.0, f64::max)
        };
        let expected = |row: usize, angle: usize| {
            let t = row as f64 / self.rows as f64;
            let half = 0.5 * (1.0 + t * t);
            let around = difference(&|k| {
                (row + N_GHOST_ROWS) * stride + (angle + self.angles + k - 4) % self.angles * 9
            });
            let slope = SLOPES[usize::from(row + 4 > self.rows)];
            let first = (row + N_GHOST_ROWS - 4).min(self.rows + N_GHOST_ROWS - 8);
            let down = difference(&|k| (first + k) * stride + angle * 9);
            let azimuthal = around * SLOPES[0] * self.angles as f64 / (2.0 * PI) * half / t;
            azimuthal.max(down * slope * self.rows as f64 * half)
        };
        let alone = |angle: &usize| {
            let node = (angle + self.angles + self.angles / 2 - N_GHOST_ROWS) % self.angles;
            images.source(node, self.angles).0 == node
        };
        let angles: Vec<usize> = (0..self.angles).filter(alone).collect();
        let nodes = (1..=self.rows).flat_map(|row| angles.iter().map(move |&angle| (row, angle)));
        let mut nodes: Vec<(f64, usize, usize)> =
            nodes.map(|(row, angle)| (expected(row, angle), row, angle)).collect();
        nodes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let cell = 2.0 * PI / self.angles as f64;
        let place = |&(_, row, angle): &(f64, usize, usize)| {
            [(angle as f64 - N_GHOST_ROWS as f64) * cell - PI, row as f64 / self.rows as f64]
        };
        nodes.iter().take(COMPARED / images.count()).map(place).collect()
    }
}

/// Directions that are mirror images of one another across the planes x = 0 and y = 0, where these are planes of symmetry.
#[derive(Debug, Clone, Copy)]
struct MirrorPlanes([bool; 2]);

impl MirrorPlanes {
    /// Number of images of a direction.
    fn count(self) -> usize {
        self.0.iter().map(|&mirror| 1 + usize::from(mirror)).product()
    }

    /// The image, in the part of the turn that is computed, of angle number `angle` of `angles`, and the signs of x, y and z under the
    /// reflections between them: G_ik at the angle is sign_i sign_k G_ik at the image.
    fn source(self, mut angle: usize, angles: usize) -> (usize, [f64; 3]) {
        debug_assert!(angles.is_multiple_of(4));
        let [across_x, across_y] = self.0;
        let mut signs = [1.0; 3];
        if across_y && angle > angles / 2 {
            (angle, signs[1]) = (angles - angle, -1.0);
        }
        if across_x && (angles / 4 + 1..angles / 4 + angles / 2).contains(&angle) {
            (angle, signs[0]) = ((angles / 2 + angles - angle) % angles, -1.0);
        }
        (angle, signs)
    }
}

/// What the gradient has to be at a place (φ, t).
struct ReferenceValue {
    place: [f64; 2],
    field: GreenTensor,
    /// Bound of the field's own error.
    error_bound: f64,
}

impl ReferenceValue {
    fn difference_from(&self, table: &PointForceTable) -> f64 {
        let [phi, t] = self.place;
        self.field.max_gradient_difference(&table.at(&direction(phi, t))) + self.error_bound
    }
}

/// Evenly spread places of the unit square: the R2 sequence of the plastic number.
fn low_discrepancy_points() -> impl Iterator<Item = [f64; 2]> {
    const STEPS: [f64; 2] = [0.754_877_666_246_692_8, 0.569_840_290_998_053_3];
    (1..=COMPARED).map(|k| STEPS.map(|step| (step * k as f64).fract()))
}

/// The direct integral at places.
fn reference_values(places: Vec<[f64; 2]>, interior: &PointForceIntegral) -> Vec<ReferenceValue> {
    let at = |place: [f64; 2]| {
        let (field, change) = interior.gradient(&mut rule_at(place[1]), place[0], MAX_INTEGRAL_CHANGE);
        ReferenceValue {
            place,
            field,
            error_bound: if change > MAX_INTEGRAL_CHANGE { change * field.max_gradient() } else { 0.0 },
        }
    };
    places.into_par_iter().map(at).collect()
}

/// Weights of the nodes about a direction.
struct StencilWeights {
    /// Of the angles, and their derivatives.
    angle_weights: [f64; NODES],
    angle_slopes: [f64; NODES],
    /// Of the rows, their derivatives, and the weights over t.
    row_weights: [f64; NODES],
    row_slopes: [f64; NODES],
    row_weights_over_t: [f64; NODES],
}

/// The weighted sums of [`PointForceTable::sums`] over nodes whose rows lie `stride` entries apart.
fn weigh(entries: &[f64], stride: usize, weights: &StencilWeights, sums: &mut [[f64; 9]; 3]) {
    wide!(weigh_inline(
        entries => entries: &[f64], stride => stride: usize, weights => weights: &StencilWeights, sums => sums: &mut [[f64; 9]; 3]
    ))
}

#[inline(always)]
fn weigh_inline(entries: &[f64], stride: usize, weights: &StencilWeights, sums: &mut [[f64; 9]; 3]) {
    let [mut values, mut steeps, mut turns] = [[0.0; 9]; 3];
    for j in 0..NODES {
        let row = &entries[j * stride..j * stride + 9 * NODES];
        let (mut value, mut turned) = ([0.0; 9], [0.0; 9]);
        for (k, node) in row.chunks_exact(9).enumerate() {
            let (along, slope) = (weights.angle_weights[k], weights.angle_slopes[k]);
            for c in 0..9 {
                value[c] += along * node[c];
                turned[c] += slope * node[c];
            }
        }
        let (across, steep, over_t) =
            (weights.row_weights[j], weights.row_slopes[j], weights.row_weights_over_t[j]);
        for c in 0..9 {
            values[c] += across * value[c];
            steeps[c] += steep * value[c];
            turns[c] += over_t * turned[c];
        }
    }
    *sums = [values, steeps, turns];
}

/// Sine and cosine of the angle from the inner axis.
fn polar(t: f64) -> [f64; 2] {
    let inverse = 1.0 / (1.0 + t * t);
    [2.0 * t * inverse, (1.0 - t * t) * inverse]
}

fn rule_at(t: f64) -> DirectionRule {
    let [sin, cos] = polar(t);
    DirectionRule::new(sin, -cos)
}

/// The unit vector of φ and t = tan(β/2).
fn direction(phi: f64, t: f64) -> Vector3<f64> {
    let [sin, cos] = polar(t);
    Vector3::new(sin * phi.cos(), sin * phi.sin(), -cos)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::half_space::green::SurfaceGreen;
    use crate::geometry::Side;
    use crate::material::Stiffness;

    /// Truth: a transversely isotropic material is its own mirror image across planes that contain the fibre or that the fibre is normal
    /// to; the direct integral in all quadrants.
    #[test]
    fn mirror_images_are_the_direct_integral() {
        let fibre = Stiffness::transversely_isotropic(14e3, 10e3, 5e3, 0.3, 0.4).unwrap();
        let turned = |axis: Vector3<f64>, angle: f64| {
            fibre.rotated(nalgebra::Rotation3::from_scaled_axis(axis * angle).matrix())
        };
        let [y, z] = [Vector3::y(), Vector3::z()];
        // The fibre lies along x, is tilted in the plane y = 0, in the plane x = 0, lies between x and y.
        let upright = turned(y, 0.5).rotated(nalgebra::Rotation3::from_scaled_axis(z * (0.5 * PI)).matrix());
        let cases = [
            (fibre.clone(), [true, true]),
            (turned(y, 0.5), [false, true]),
            (upright, [true, false]),
            (turned(z, 0.5), [false, false]),
        ];
        for (stiffness, mirrors) in cases {
            let green = SurfaceGreen::new(&stiffness, Side::Lower).unwrap();
            let interior = PointForceIntegral::new(&stiffness, &green);
            assert_eq!(interior.mirrors(), mirrors);
            let table =
                PointForceTable::sampled(ANGLES[0], &interior, &SurfacePointForce::new(&stiffness, &green));
            for k in 0..16 {
                let x = direction(0.2 + 2.0 * PI * k as f64 / 16.0, 0.3 + 0.04 * k as f64);
                let (found, wanted) = (table.at(&x), interior.at(&x).unwrap());
                let apart = (found.value - wanted.value).amax() / wanted.value.amax();
                assert!(apart < ERROR, "{mirrors:?}, {k}: {apart:e}");
            }
        }
    }
}
