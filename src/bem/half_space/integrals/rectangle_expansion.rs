//! Influence of a rectangle far from it: the cell average of Γ(φ) / r as a series in the sides over the distance.
//!
//! The mean of a field over a rectangle of sides a, b is Σ (a/2)^2i (b/2)^2j / ((2i+1)! (2j+1)!) ∂x^2i ∂y^2j of its value at
//! the centre. Each derivative of a Fourier series over a power of r is again one, so that every order of the expansion
//! is a function of the direction alone, tabulated once, over an odd power of r.

use nalgebra::Complex;

use crate::bem::half_space::green::SurfaceGreen;
use crate::bem::half_space::green::angular_table::{AngularTable, evaluate_series};

/// Terms of the expansion, up to derivatives of order 2 (TERMS - 1).
const TERMS: usize = 6;

/// Relative accuracy: the first term left out is below this part of the largest entry.
const TRUNCATION_TOLERANCE: f64 = 1e-14;

/// An entry of the kernel: the part of the matrix that is even in the offset, or the odd, antisymmetric part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bem::half_space) enum KernelComponent {
    /// xx, yy, nn, xy, xn, yn of the symmetric part.
    Even(usize),
    /// xy, xn, yn of the antisymmetric part.
    Odd(usize),
}

/// All components, in the order of the tables.
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

impl KernelComponent {
    /// Its place among all.
    fn index(self) -> usize {
        match self {
            Self::Even(k) => k,
            Self::Odd(k) => 6 + k,
        }
    }
}

/// A Fourier series over a power of r: the coefficients of exp(i n φ), n = -order..=order, of a real function.
struct FourierOverPower {
    order: usize,
    coefficients: Vec<Complex<f64>>,
    /// The power s of 1 / r^s.
    power: usize,
}

/// Direction of a derivative.
#[derive(Clone, Copy)]
enum Axis {
    X,
    Y,
}

impl FourierOverPower {
    fn at(&self, n: isize) -> Complex<f64> {
        self.coefficients[(n + self.order as isize) as usize]
    }

    /// Its derivative. With z = x + i y, exp(i n φ) / r^s = z^((n-s)/2) z̄^(-(n+s)/2).
    fn derivative(&self, axis: Axis) -> Self {
        let (order, s) = (self.order + 1, self.power as f64);
        let mut coefficients = vec![Complex::new(0.0, 0.0); 2 * order + 1];
        let mut add = |n: isize, value: Complex<f64>| coefficients[(n + order as isize) as usize] += value;
        for n in -(self.order as isize)..=self.order as isize {
            let (by_z, by_conjugate) = ((n as f64 - s) / 2.0, -(n as f64 + s) / 2.0);
            let c = self.at(n);
            match axis {
                Axis::X => {
                    add(n - 1, c * by_z);
                    add(n + 1, c * by_conjugate);
                }
                Axis::Y => {
                    let turned = Complex::new(-c.im, c.re);
                    add(n - 1, turned * by_z);
                    add(n + 1, -turned * by_conjugate);
                }
            }
        }
        Self { order, coefficients, power: self.power + 1 }
    }

    fn twice(&self, axis: Axis) -> Self {
        self.derivative(axis).derivative(axis)
    }
}

/// The terms T_m(φ) of the cell average Σ T_m(φ) / r^(2m+1) of one component, m = 0..=TERMS, as coefficients of
/// n = 0, 1, ... for half of the real series.
fn terms(component: KernelComponent, green: &SurfaceGreen, sides: [f64; 2]) -> Vec<Vec<Complex<f64>>> {
    let order = green.order();
    let mut coefficients = vec![Complex::new(0.0, 0.0); 2 * order + 1];
    let mut put = |n: usize, value: Complex<f64>| {
        coefficients[order + n] = value;
        coefficients[order - n] = value.conj();
    };
    match component {
        KernelComponent::Even(c) => green.even().iter().enumerate().for_each(|(k, h)| put(2 * k, h[c])),
        KernelComponent::Odd(c) => green.odd().iter().enumerate().for_each(|(k, h)| put(2 * k + 1, h[c])),
    }
    let mut sums: Vec<Vec<Complex<f64>>> =
        (0..=TERMS).map(|m| vec![Complex::new(0.0, 0.0); order + 2 * m + 1]).collect();
    // ∂x^2i of the point source, then ∂y^2j of it.
    let mut along_x = FourierOverPower { order, coefficients, power: 1 };
    for i in 0..=TERMS {
        let mut both = FourierOverPower { coefficients: along_x.coefficients.clone(), ..along_x };
        for j in 0..=TERMS - i {
            let factor = half_power(sides[0], i) * half_power(sides[1], j) * sides[0] * sides[1];
            for (n, sum) in sums[i + j].iter_mut().enumerate() {
                *sum += both.at(n as isize) * factor;
            }
            if i + j < TERMS {
                both = both.twice(Axis::Y);
            }
        }
        if i < TERMS {
            along_x = along_x.twice(Axis::X);
        }
    }
    sums
}

/// (side / 2)^(2 i) / (2 i + 1)!
fn half_power(side: f64, i: usize) -> f64 {
    let factorial: f64 = (1..=2 * i + 1).map(|k| k as f64).product();
    (side / 2.0).powi(2 * i as i32) / factorial
}

/// The expansion for rectangles of given sides.
pub(in crate::bem::half_space) struct RectangleExpansion {
    /// `[component][term]`, at equidistant angles of a whole turn.
    planes: Vec<Vec<Vec<f64>>>,
    /// Distance from which on 1, 2, ... terms suffice, descending.
    min_distance: [f64; TERMS],
    /// Parity of each component in y; `None` without one.
    parity: Vec<Option<f64>>,
}

/// Share of the largest value below which a function misses its parity.
const PARITY: f64 = 1e-14;

/// 1 if functions at equidistant angles of a whole turn are even in the angle, -1 if they are odd.
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

    /// Distance from which on the expansion holds, mm.
    pub(in crate::bem::half_space) fn min_valid_distance(&self) -> f64 {
        self.min_distance[TERMS - 1]
    }

    /// Sign of a component at (x, -y) against (x, y), where the half-spaces are symmetric so.
    pub(in crate::bem::half_space) fn y_parity(&self, component: KernelComponent) -> Option<f64> {
        self.parity[component.index()]
    }

    /// The expansion of some components.
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

/// The expansion of some components.
pub(in crate::bem::half_space) struct RectangleExpansionTable {
    /// `[term][component]` at each angle.
    table: AngularTable,
    count: usize,
    min_distance: [f64; TERMS],
}

impl RectangleExpansionTable {
    /// The components at (x, y), at least [`RectangleExpansion::min_valid_distance`] away, into `values`.
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

    /// Truth: the integrals over the rectangle by Gauss points. Tolerance 3e-14 of the largest entry: both round.
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
