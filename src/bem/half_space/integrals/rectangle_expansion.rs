//! Influence of a distant rectangle: integral of Γ(φ) / r as a series in the ratio of the sides to the distance.
//!
//! As in [`super::polygon_multipole`], each order is a function of the direction, divided by a power of r. All
//! rectangles of a grid have the same sides and thus the same moments. The table therefore contains, for each order,
//! the sum over all moments of this order.

use nalgebra::Complex;

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::{AngularTable, evaluate_series};
use crate::bem::half_space::green::kernel_component::KernelComponent;
use crate::bem::half_space::integrals::polygon_moments::{PolygonMoments, n_moments, powers};
use crate::bem::half_space::integrals::polygon_multipole::derivative_harmonics;

/// Number of terms of the expansion. Term m has derivatives of order 2 m.
const TERMS: usize = 6;

/// Bound on the first omitted term, relative to the largest leading term.
const TRUNCATION_TOLERANCE: f64 = 1e-14;

const COMPONENTS: [KernelComponent; 9] = [
    KernelComponent::Even(0),
    KernelComponent::Even(1),
    KernelComponent::Even(2),
    KernelComponent::Even(3),
    KernelComponent::Even(4),
    KernelComponent::Even(5),
    KernelComponent::Odd(0),
    KernelComponent::Odd(1),
    KernelComponent::Odd(2),
];

/// Fourier coefficients of the terms T_m(φ) of one component. The integral over the rectangle is Σ T_m(φ) / r^(2m+1).
/// Moments of odd order vanish, and moments of even order are real.
fn terms(component: KernelComponent, green: &SurfaceGreen, sides: [f64; 2]) -> Vec<Vec<Complex<f64>>> {
    let [a, b] = sides.map(|side| side / 2.0);
    let corners = [[-a, -b], [a, -b], [a, b], [-a, b]];
    let moments = PolygonMoments::new(2 * TERMS).of(&corners, [0.0; 2]);
    let term = |m: usize| {
        let order = 2 * m;
        let mut place = n_moments(order) - (order + 1);
        let mut sum = vec![Complex::new(0.0, 0.0); green.order() + order + 1];
        for (a, b) in powers(order) {
            let [derivative, _] = derivative_harmonics(component, green, [a, b]);
            sum.iter_mut().zip(derivative).for_each(|(sum, harmonic)| *sum += harmonic * moments[place]);
            place += if a == b { 1 } else { 2 };
        }
        sum
    };
    (0..=TERMS).map(term).collect()
}

pub(in crate::bem::half_space) struct RectangleExpansion {
    /// Values of each term at equidistant angles of a full turn, `[component][term][angle]`.
    planes: Vec<Vec<Vec<f64>>>,
    /// Minimum distances for which 1, 2, ... terms suffice.
    min_distance: [f64; TERMS],
    /// Parity of each component in y: 1 if even, -1 if odd, `None` if neither.
    parity: Vec<Option<f64>>,
}

const PARITY: f64 = 1e-14;

/// Parity of functions of the angle: 1 if all are even, -1 if all are odd, `None` otherwise.
fn parity(terms: &[Vec<f64>], largest: &[f64]) -> Option<f64> {
    let holds = |sign: f64| {
        terms.iter().zip(largest).all(|(values, size)| {
            let opposite = values[1..].iter().rev();
            let pairs = values[1..].iter().zip(opposite);
            let first = if sign < 0.0 { values[0].abs() } else { 0.0 };
            first <= PARITY * size && pairs.into_iter().all(|(a, b)| (a - sign * b).abs() <= PARITY * size)
        })
    };
    [1.0, -1.0].into_iter().find(|sign| holds(*sign))
}

impl RectangleExpansion {
    pub(in crate::bem::half_space) fn new(green: &SurfaceGreen, sides: [f64; 2]) -> Self {
        let count = AngularTable::count(green.order() + 2 * TERMS);
        let mut largest = [0.0_f64; TERMS + 1];
        let of_component = |component: &KernelComponent| -> Vec<Vec<f64>> {
            let terms = terms(*component, green, sides).into_iter();
            terms.map(|coefficients| evaluate_series(count, coefficients.into_iter().enumerate())).collect()
        };
        let mut planes: Vec<Vec<Vec<f64>>> = COMPONENTS.iter().map(of_component).collect();
        for plane in &mut planes {
            for (largest, values) in largest.iter_mut().zip(&*plane) {
                *largest = values.iter().fold(*largest, |largest, value| largest.max(value.abs()));
            }
            plane.truncate(TERMS);
        }
        let parity = planes.iter().map(|terms| parity(terms, &largest)).collect();
        let min_distance = std::array::from_fn(|m| {
            let next = m + 1;
            (largest[next] / (TRUNCATION_TOLERANCE * largest[0])).powf(0.5 / next as f64)
        });
        Self { planes, min_distance, parity }
    }

    pub(in crate::bem::half_space) fn min_valid_distance(&self) -> f64 {
        self.min_distance[TERMS - 1]
    }

    /// Ratio of a component's value at (x, -y) to its value at (x, y); `None` if the component is neither even nor odd in y.
    pub(in crate::bem::half_space) fn y_parity(&self, component: KernelComponent) -> Option<f64> {
        self.parity[component.index()]
    }

    pub(in crate::bem::half_space) fn of(&self, components: &[KernelComponent]) -> RectangleExpansionTable {
        let term =
            |m: usize| components.iter().map(move |component| self.planes[component.index()][m].clone());
        let functions: Vec<Vec<f64>> = (0..TERMS).flat_map(term).collect();
        RectangleExpansionTable {
            table: AngularTable::new(&functions),
            count: components.len(),
            min_distance: self.min_distance,
        }
    }
}

pub(in crate::bem::half_space) struct RectangleExpansionTable {
    /// `[term][component]` at each angle.
    table: AngularTable,
    count: usize,
    min_distance: [f64; TERMS],
}

impl RectangleExpansionTable {
    /// Computes the components at (x, y). The distance must be at least [`RectangleExpansion::min_valid_distance`].
    pub(in crate::bem::half_space) fn evaluate(&self, [x, y]: [f64; 2], values: &mut [f64]) {
        let r = (x * x + y * y).sqrt();
        let terms = self.min_distance.iter().position(|&from| r >= from).map_or(TERMS, |m| m + 1);
        let (weights, rows) = self.table.stencil(x, y);
        let (stride, used) = (TERMS * self.count, terms * self.count);
        let mut sums = [0.0; TERMS * COMPONENTS.len()];
        let sums = &mut sums[..used];
        for (weight, row) in weights.iter().zip(rows.chunks_exact(stride)) {
            sums.iter_mut().zip(row).for_each(|(sum, entry)| *sum += weight * entry);
        }
        values.fill(0.0);
        let (mut factor, shrink) = (1.0 / r, 1.0 / (r * r));
        for term in sums.chunks_exact(self.count) {
            values.iter_mut().zip(term).for_each(|(value, sum)| *value += factor * sum);
            factor *= shrink;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::bem::half_space::PatchIntegrator;
    use crate::geometry::Side;
    use crate::material::Stiffness;

    /// Truth: integrals over the rectangle by Gauss rules. Tolerance: rounding.
    #[test]
    fn expansion_equals_gauss_points() {
        let steel = Stiffness::isotropic(210e3, 0.3).expect("admissible");
        let green = SurfaceGreen::new(&steel, Side::Lower).expect("converges");
        let integrator = PatchIntegrator::new(&green);
        for sides in [[0.1, 0.1], [0.1, 0.02]] {
            let far = RectangleExpansion::new(&green, sides);
            for (distance, angle) in [(1.0, 0.3), (1.01, 2.0), (3.0, -1.2), (40.0, 4.0), (1e6, PI)] {
                let r = distance * far.min_valid_distance();
                let at = [r * f64::cos(angle), r * f64::sin(angle)];
                let mut values = [0.0; 9];
                far.of(&COMPONENTS).evaluate(at, &mut values);
                let expected = integrator.rectangle(sides, at);
                let half = |i: usize, j: usize, sign: f64| (expected[(i, j)] + sign * expected[(j, i)]) / 2.0;
                let pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];
                let even = pairs.map(|(i, j)| half(i, j, 1.0));
                let odd = [(0, 1), (0, 2), (1, 2)].map(|(i, j)| half(i, j, -1.0));
                for (value, expected) in values.iter().zip(even.iter().chain(&odd)) {
                    assert!((value - expected).abs() < 3e-14 * even[2], "{sides:?} {r}: {value} {expected}");
                }
            }
        }
    }
}
