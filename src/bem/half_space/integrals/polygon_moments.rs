//! Complex moments of polygons: integrals of ζ^a ζ̄^b, with ζ = x + i y relative to a given point.

use nalgebra::Complex;

use crate::quadrature::gauss_legendre;

/// Number of real moments of the orders 0..=`order`; order k has k + 1 moments.
pub(super) const fn n_moments(order: usize) -> usize {
    (order + 1) * (order + 2) / 2
}

/// Powers (a, b), a >= b, of the moments of order `k`.
pub(super) fn powers(k: usize) -> impl Iterator<Item = (usize, usize)> {
    (k.div_ceil(2)..=k).rev().map(move |a| (a, k - a))
}

pub(super) struct PolygonMoments {
    order: usize,
    rule: Vec<(f64, f64)>,
}

impl PolygonMoments {
    pub fn new(order: usize) -> Self {
        // On an edge the integrand is a polynomial of degree `order`.
        Self { order, rule: gauss_legendre(order / 2 + 1) }
    }

    /// Moments ∫ ζ^a ζ̄^b dA / (a! b!) about `origin`, in the order of [`powers`], `[n_moments]`. A moment m with a > b
    /// gives two values, 2 Re m and -2 Im m. They are the factors of Re c and Im c in c m + c̄ m̄, for a complex
    /// coefficient c. Corners are counter-clockwise.
    ///
    /// For order k, the triangle between the origin and an edge contributes 2 area / (k + 2) times the mean of the
    /// integrand along the edge.
    pub fn of(&self, corners: &[[f64; 2]], origin: [f64; 2]) -> Vec<f64> {
        let mut moments = vec![0.0; n_moments(self.order)];
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            let at = |p: &[f64; 2]| Complex::new(p[0] - origin[0], p[1] - origin[1]);
            let (from, to) = (at(from), at(&to));
            let twice_area = from.re * to.im - from.im * to.re;
            for &(s, weight) in &self.rule {
                let point = from + (to - from) * ((1.0 + s) / 2.0);
                self.add(point, twice_area * weight / 2.0, &mut moments);
            }
        }
        moments
    }

    fn add(&self, point: Complex<f64>, weight: f64, moments: &mut [f64]) {
        let mut scaled = vec![Complex::new(1.0, 0.0)];
        (1..=self.order).for_each(|a| scaled.push(scaled[a - 1] * point / a as f64));
        let mut place = 0;
        for k in 0..=self.order {
            let share = weight / (k + 2) as f64;
            for (a, b) in powers(k) {
                let value = scaled[a] * scaled[b].conj() * share;
                if a == b {
                    moments[place] += value.re;
                    place += 1;
                } else {
                    moments[place] += 2.0 * value.re;
                    moments[place + 1] -= 2.0 * value.im;
                    place += 2;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: closed forms of a rectangle about its centre and, by the parallel-axis theorem, about another point.
    #[test]
    fn moments_of_a_rectangle() {
        let corners = [[-0.3, -0.1], [0.3, -0.1], [0.3, 0.1], [-0.3, 0.1]];
        let (area, xx, yy) = (0.12, 0.12 * 0.36 / 12.0, 0.12 * 0.04 / 12.0);
        let close = |found: &[f64], expected: &[f64]| {
            found.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-16, "{a} {b}"));
        };
        // Integrands: 1; ζ; ζ²/2 = (x² - y²)/2 + i x y; ζ ζ̄ = x² + y².
        close(&PolygonMoments::new(2).of(&corners, [0.0, 0.0]), &[area, 0.0, 0.0, xx - yy, 0.0, xx + yy]);
        let found = PolygonMoments::new(2).of(&corners, [1.0, -2.0]);
        let (xx, yy, xy) = (xx + area, yy + 4.0 * area, -2.0 * area);
        for (a, b) in found.iter().zip([area, -2.0 * area, -4.0 * area, xx - yy, -2.0 * xy, xx + yy]) {
            assert!((a - b).abs() < 1e-14, "{a} {b}");
        }
        assert_eq!(PolygonMoments::new(7).of(&corners, [0.0, 0.0]).len(), n_moments(7));
    }
}
