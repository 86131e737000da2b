//! Integrals of a face's shape functions over a convex polygon that lies inside the face, all seen along n.

use std::sync::LazyLock;

use super::clip::{area_and_centroid, cross};
use crate::quadrature::gauss_legendre;

/// A face seen along n: three or four corners in the plane, counter-clockwise.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlaneFace {
    corners: [[f64; 2]; 4],
    n: usize,
    /// x = c0 + c1 xi + c2 eta + c3 xi eta (quadrangles).
    map: [[f64; 2]; 4],
}

/// Signs (xi, eta) of the corners of the reference square.
const SIGNS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// How a face appears along n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Facing {
    /// Convex, counter-clockwise.
    Towards,
    /// Seen from behind or edge-on.
    Away,
    /// Neither: a corner is folded over.
    Folded,
}

impl PlaneFace {
    pub(super) fn new(corners: &[[f64; 2]]) -> Self {
        let mut all = [[0.0; 2]; 4];
        all[..corners.len()].copy_from_slice(corners);
        let mut map = [[0.0; 2]; 4];
        for k in 0..2 {
            for (corner, [s, t]) in all.iter().zip(SIGNS) {
                for (coefficient, sign) in map.iter_mut().zip([1.0, s, t, s * t]) {
                    coefficient[k] += 0.25 * sign * corner[k];
                }
            }
        }
        Self { corners: all, n: corners.len(), map }
    }

    pub(super) fn corners(&self) -> &[[f64; 2]] {
        &self.corners[..self.n]
    }

    /// Which side is seen; `scale` is the square of the face's size in space.
    pub(super) fn facing(&self, scale: f64) -> Facing {
        let corners = self.corners();
        let turns = (0..self.n).map(|i| {
            let at = |k: usize| corners[(i + k) % self.n];
            cross(at(0), at(1), at(2))
        });
        let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
        turns.for_each(|turn| (least, most) = (least.min(turn), most.max(turn)));
        match () {
            () if most <= 1e-9 * scale => Facing::Away,
            () if least > 0.0 => Facing::Towards,
            () => Facing::Folded,
        }
    }

    /// Integrals of the shape functions over `polygon` (inside the face), one per corner; `scale` is the area
    /// to which the error (1e-15) is relative.
    ///
    /// On triangles the functions are linear: area times the value at the centroid. On quadrangles the integral
    /// goes to the reference square and, by Green's theorem, to the polygon's boundary: the integral of N_j J is
    /// the boundary integral of F_j d(eta), dF_j/d(xi) = N_j J. Along straight edges it is a smooth function of
    /// one variable, a cubic on parallelograms (two Gauss points are exact); inner edges of neighbouring
    /// polygons cancel, so that sums over a partition of the face are exact on any quadrangle.
    pub(super) fn integrate(&self, polygon: &[[f64; 2]], scale: f64) -> [f64; 4] {
        if self.n == 3 {
            let (area, centroid) = area_and_centroid(polygon);
            return self.barycentric(centroid).map(|value| value * area);
        }
        let bend = self.map[3][0].hypot(self.map[3][1]);
        let size = self.map[1][0].hypot(self.map[1][1]).max(self.map[2][0].hypot(self.map[2][1]));
        let mut last = self.boundary(polygon, &RULES[0]);
        if bend <= 1e-14 * size {
            return last;
        }
        for rule in &RULES[1..] {
            let next = self.boundary(polygon, rule);
            let change = last.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            last = next;
            if change <= 1e-15 * scale {
                break;
            }
        }
        last
    }

    /// Values of the shape functions of a triangle.
    fn barycentric(&self, x: [f64; 2]) -> [f64; 4] {
        let [a, b, c, _] = self.corners;
        let whole = cross(a, b, c);
        [cross(x, b, c) / whole, cross(a, x, c) / whole, cross(a, b, x) / whole, 0.0]
    }

    fn boundary(&self, polygon: &[[f64; 2]], rule: &[[f64; 2]]) -> [f64; 4] {
        let mut total = [0.0; 4];
        for (i, &start) in polygon.iter().enumerate() {
            let end = polygon[(i + 1) % polygon.len()];
            let along = [end[0] - start[0], end[1] - start[1]];
            for &[t, weight] in rule {
                let reference = self.invert([start[0] + t * along[0], start[1] + t * along[1]]);
                let [a, b] = self.tangents(reference);
                let d_eta = (a[0] * along[1] - a[1] * along[0]) / (a[0] * b[1] - a[1] * b[0]);
                let primitive = self.primitive(reference);
                total.iter_mut().zip(primitive).for_each(|(sum, f)| *sum += weight * f * d_eta);
            }
        }
        total
    }

    /// Derivatives of the map along xi and eta.
    fn tangents(&self, [xi, eta]: [f64; 2]) -> [[f64; 2]; 2] {
        let [_, p, q, r] = self.map;
        [[p[0] + r[0] * eta, p[1] + r[1] * eta], [q[0] + r[0] * xi, q[1] + r[1] * xi]]
    }

    /// Reference coordinates of a point in the face, by Newton's method (one step on parallelograms).
    fn invert(&self, x: [f64; 2]) -> [f64; 2] {
        let [o, p, q, r] = self.map;
        let mut at = [0.0, 0.0];
        for _ in 0..50 {
            let [xi, eta] = at;
            let miss: [f64; 2] =
                std::array::from_fn(|k| x[k] - (o[k] + p[k] * xi + q[k] * eta + r[k] * xi * eta));
            let [a, b] = self.tangents(at);
            let jacobian = a[0] * b[1] - a[1] * b[0];
            let step =
                [(miss[0] * b[1] - miss[1] * b[0]) / jacobian, (a[0] * miss[1] - a[1] * miss[0]) / jacobian];
            // Points of the face lie in the square; staying near it keeps the Jacobian positive.
            at = [
                (xi + step[0]).clamp(-1.0 - 1e-9, 1.0 + 1e-9),
                (eta + step[1]).clamp(-1.0 - 1e-9, 1.0 + 1e-9),
            ];
            // The error after a step is of the order of its square.
            if step[0].abs().max(step[1].abs()) < 1e-9 {
                break;
            }
        }
        at
    }

    /// F_j = integral of N_j J over xi from 0, with J = j0 + j1 xi + j2 eta.
    fn primitive(&self, [xi, eta]: [f64; 2]) -> [f64; 4] {
        let [_, p, q, r] = self.map;
        let wedge = |a: [f64; 2], b: [f64; 2]| a[0] * b[1] - a[1] * b[0];
        let j1 = wedge(p, r);
        let j = wedge(p, q) + wedge(r, q) * eta;
        SIGNS.map(|[s, t]| {
            let inner = j * xi + (j1 + s * j) * xi * xi / 2.0 + s * j1 * xi * xi * xi / 3.0;
            0.25 * (1.0 + t * eta) * inner
        })
    }
}

/// Gauss rules on [0, 1] as pairs (point, weight), of growing order.
static RULES: LazyLock<Vec<Vec<[f64; 2]>>> = LazyLock::new(|| {
    let halved = |(x, weight): (f64, f64)| [0.5 * (1.0 + x), 0.5 * weight];
    [2, 6, 12, 24, 48].map(|n| gauss_legendre(n).into_iter().map(halved).collect()).to_vec()
});

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: N_j of a parallelogram is a product of linear functions; over the whole face its integral is A / 4,
    /// over a quarter of it (1/64)(3,1)x(3,1) of A.
    #[test]
    fn parallelogram() {
        let face = PlaneFace::new(&[[0.0, 0.0], [4.0, 1.0], [5.0, 3.0], [1.0, 2.0]]);
        for value in face.integrate(face.corners(), 7.0) {
            assert!((value - 7.0 / 4.0).abs() < 1e-14);
        }
        let quarter = [[0.0, 0.0], [2.0, 0.5], [2.5, 1.5], [0.5, 1.0]];
        let expected = [9.0, 3.0, 1.0, 3.0].map(|f| 7.0 * f / 64.0);
        for (value, expected) in face.integrate(&quarter, 7.0).iter().zip(expected) {
            assert!((value - expected).abs() < 1e-14);
        }
    }

    /// Truth: on any convex quadrangle the shape functions sum to one and reproduce x: over any inner polygon
    /// sum_j int N_j = area and sum_j x_j int N_j = first moment (polygon formulas). 1e-14: rounding.
    #[test]
    fn general_quadrangle_reproduces_linear_fields() {
        let face = PlaneFace::new(&[[0.0, 0.0], [3.0, 0.4], [2.2, 1.9], [-0.3, 2.5]]);
        let polygon = [[0.2, 0.3], [1.9, 0.5], [2.0, 1.1], [0.9, 1.8], [0.1, 1.2]];
        let (area, centroid) = area_and_centroid(&polygon);
        let weights = face.integrate(&polygon, area);
        assert!((weights.iter().sum::<f64>() - area).abs() < 1e-14);
        for k in 0..2 {
            let moment: f64 = weights.iter().zip(face.corners()).map(|(w, x)| w * x[k]).sum();
            assert!((moment - area * centroid[k]).abs() < 1e-14, "{moment} {}", area * centroid[k]);
        }
    }

    /// Truth: a linear function's integral is area times its value at the centroid.
    #[test]
    fn triangle() {
        let face = PlaneFace::new(&[[0.0, 0.0], [2.0, 0.0], [0.0, 2.0]]);
        let weights = face.integrate(&[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]], 0.5);
        assert!((weights[0] - 0.5 * (1.0 - 1.0 / 3.0)).abs() < 1e-15);
        assert!((weights[1] - 0.5 / 6.0).abs() < 1e-15 && weights[3] == 0.0);
    }

    /// Truth: what faces away or is folded is told apart by the turns at its corners.
    #[test]
    fn facing() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(PlaneFace::new(&square).facing(1.0), Facing::Towards);
        let mut turned = square;
        turned.reverse();
        assert_eq!(PlaneFace::new(&turned).facing(1.0), Facing::Away);
        let dart = [[0.0, 0.0], [1.0, 0.0], [0.1, 0.1], [0.0, 1.0]];
        assert_eq!(PlaneFace::new(&dart).facing(1.0), Facing::Folded);
    }
}
