//! Integrals of face shape functions over a polygon inside one facet, in the projection along n.

use std::sync::LazyLock;

use super::clip::twice_signed_area;
use crate::element::ElementKind;
use crate::element::MAX_FACE_NODES;
use crate::geometry::bounds;
use crate::quadrature::gauss_legendre;

/// Projection of a facet along n. Facet coordinates (xi, eta) run over the triangle (0,0), (1,0), (0,1) or the square [-1, 1]^2.
#[derive(Debug, Clone, Copy)]
pub(super) struct ProjectedFacet {
    kind: ElementKind,
    corners: [[f64; 2]; 4],
    n: usize,
    /// Coefficients c0 to c3 of x = c0 + c1 xi + c2 eta + c3 xi eta.
    map: [[f64; 2]; 4],
    /// Coefficients of the face's reference coordinates, for the terms of `map`.
    reference: [[f64; 2]; 4],
}

const SQUARE_CORNERS: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

/// Orientation of a facet seen along n.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Facing {
    /// Convex, counter-clockwise.
    Towards,
    /// Seen from the back or edge-on.
    Away,
    /// Folded, or not convex at a corner.
    Folded,
}

fn coefficients(values: &[[f64; 2]]) -> [[f64; 2]; 4] {
    let mut map = [[0.0; 2]; 4];
    for k in 0..2 {
        if let [a, b, c] = values {
            (map[0][k], map[1][k], map[2][k]) = (a[k], b[k] - a[k], c[k] - a[k]);
        } else {
            for (value, [s, t]) in values.iter().zip(SQUARE_CORNERS) {
                for (coefficient, sign) in map.iter_mut().zip([1.0, s, t, s * t]) {
                    coefficient[k] += 0.25 * sign * value[k];
                }
            }
        }
    }
    map
}

fn at(map: &[[f64; 2]; 4], [xi, eta]: [f64; 2]) -> [f64; 2] {
    let [o, p, q, r] = map;
    std::array::from_fn(|k| o[k] + p[k] * xi + q[k] * eta + r[k] * xi * eta)
}

fn cross_2d(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

impl ProjectedFacet {
    /// Facet of a face of the given kind, with `corners` in the plane and `reference` coordinates in the face.
    pub(super) fn new(kind: ElementKind, corners: &[[f64; 2]], reference: &[[f64; 2]]) -> Self {
        let mut all = [[0.0; 2]; 4];
        all[..corners.len()].copy_from_slice(corners);
        let (map, reference) = (coefficients(corners), coefficients(reference));
        Self { kind, corners: all, n: corners.len(), map, reference }
    }

    pub(super) fn of_kind(self, kind: ElementKind) -> Self {
        Self { kind, ..self }
    }

    pub(super) fn corners(&self) -> &[[f64; 2]] {
        &self.corners[..self.n]
    }

    pub(super) fn reference_at(&self, x: [f64; 2]) -> [f64; 2] {
        at(&self.reference, self.invert(x))
    }

    /// Orientation of the facet; `scale` is the square of its size in space.
    pub(super) fn facing(&self, scale: f64) -> Facing {
        let corners = self.corners();
        let turns = (0..self.n).map(|i| {
            let at = |k: usize| corners[(i + k) % self.n];
            twice_signed_area(at(0), at(1), at(2))
        });
        let [least, most] = bounds(turns);
        match () {
            () if most <= 1e-9 * scale => Facing::Away,
            () if least > 0.0 => Facing::Towards,
            () => Facing::Folded,
        }
    }

    /// Integrals of the shape functions N_j of the face over `polygon` (inside the facet), one per node. `scale` is the
    /// area to which the error (1e-15) is relative.
    ///
    /// J is the Jacobian of `map`. By Green's theorem the integral of N_j J is the boundary integral of F_j d(eta),
    /// with dF_j/d(xi) = N_j J. N_j J has at most degree 3 in xi, so that two Gauss points give F_j.
    ///
    /// On triangles and parallelograms, F_j along a straight edge has at most degree 5, so that three Gauss points are
    /// exact. On other quadrangles, rules of increasing order are used. Inner edges of neighbouring polygons cancel, so
    /// that sums over a partition of the face are exact.
    pub(super) fn integrate(&self, polygon: &[[f64; 2]], scale: f64) -> [f64; MAX_FACE_NODES] {
        let bend = self.map[3][0].hypot(self.map[3][1]);
        let size = self.map[1][0].hypot(self.map[1][1]).max(self.map[2][0].hypot(self.map[2][1]));
        let mut last = self.boundary(polygon, &GAUSS_RULES[0]);
        if bend <= 1e-14 * size {
            return last;
        }
        for rule in &GAUSS_RULES[1..] {
            let next = self.boundary(polygon, rule);
            let change = last.iter().zip(&next).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            last = next;
            if change <= 1e-15 * scale {
                break;
            }
        }
        last
    }

    fn boundary(&self, polygon: &[[f64; 2]], rule: &[[f64; 2]]) -> [f64; MAX_FACE_NODES] {
        let mut total = [0.0; MAX_FACE_NODES];
        for (i, &start) in polygon.iter().enumerate() {
            let end = polygon[(i + 1) % polygon.len()];
            let along = [end[0] - start[0], end[1] - start[1]];
            for &[t, weight] in rule {
                let own = self.invert([start[0] + t * along[0], start[1] + t * along[1]]);
                let [a, b] = self.tangents(own);
                let d_eta = cross_2d(a, along) / cross_2d(a, b);
                let primitive = self.primitive(own);
                total.iter_mut().zip(primitive).for_each(|(sum, f)| *sum += weight * f * d_eta);
            }
        }
        total
    }

    fn tangents(&self, [xi, eta]: [f64; 2]) -> [[f64; 2]; 2] {
        let [_, p, q, r] = self.map;
        [[p[0] + r[0] * eta, p[1] + r[1] * eta], [q[0] + r[0] * xi, q[1] + r[1] * xi]]
    }

    /// Facet coordinates of a point in the facet, by Newton's method.
    fn invert(&self, x: [f64; 2]) -> [f64; 2] {
        let mut own = [0.0, 0.0];
        for _ in 0..50 {
            let here = at(&self.map, own);
            let miss = [x[0] - here[0], x[1] - here[1]];
            let [a, b] = self.tangents(own);
            let jacobian = cross_2d(a, b);
            let step = [cross_2d(miss, b) / jacobian, cross_2d(a, miss) / jacobian];
            // Keeps the Jacobian positive.
            own = [
                (own[0] + step[0]).clamp(-1.0 - 1e-9, 1.0 + 1e-9),
                (own[1] + step[1]).clamp(-1.0 - 1e-9, 1.0 + 1e-9),
            ];
            // The error after a step is of the order of the squared step.
            if step[0].abs().max(step[1].abs()) < 1e-9 {
                break;
            }
        }
        own
    }

    /// Primitives F_j of N_j J with respect to xi, with F_j = 0 at xi = 0.
    fn primitive(&self, [xi, eta]: [f64; 2]) -> [f64; MAX_FACE_NODES] {
        let mut total = [0.0; MAX_FACE_NODES];
        for side in [-1.0, 1.0] {
            let own = [0.5 * xi * (1.0 + side / 3f64.sqrt()), eta];
            let [a, b] = self.tangents(own);
            let weight = 0.5 * xi * cross_2d(a, b);
            let values = self.kind.face_values(at(&self.reference, own));
            total.iter_mut().zip(values).for_each(|(sum, n)| *sum += weight * n);
        }
        total
    }
}

/// Gauss rules on [0, 1] of increasing order, as pairs (point, weight).
static GAUSS_RULES: LazyLock<Vec<Vec<[f64; 2]>>> = LazyLock::new(|| {
    let halved = |(x, weight): (f64, f64)| [0.5 * (1.0 + x), 0.5 * weight];
    [3, 6, 12, 24, 48].map(|n| gauss_legendre(n).into_iter().map(halved).collect()).to_vec()
});

#[cfg(test)]
mod tests {
    use super::super::clip::area_and_centroid;
    use super::*;
    use crate::element::ElementKind::{Quad4, Quad8, Quad9, Tri3, Tri6};

    const TRIANGLE: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    const ALL: [ElementKind; 5] = [Tri3, Tri6, Quad4, Quad8, Quad9];

    fn whole(kind: ElementKind, corners: &[[f64; 2]]) -> ProjectedFacet {
        let reference: &[[f64; 2]] = if corners.len() == 3 { &TRIANGLE } else { &SQUARE_CORNERS };
        ProjectedFacet::new(kind, corners, reference)
    }

    /// Truth: N_j of a parallelogram of area A has the integral A / 4 over the face. Over the quarter at node 0, the integrals of
    /// the four N_j are A / 64 times 9, 3, 1, 3.
    #[test]
    fn parallelogram() {
        let face = whole(Quad4, &[[0.0, 0.0], [4.0, 1.0], [5.0, 3.0], [1.0, 2.0]]);
        for value in &face.integrate(face.corners(), 7.0)[..4] {
            assert!((value - 7.0 / 4.0).abs() < 1e-14);
        }
        let quarter = [[0.0, 0.0], [2.0, 0.5], [2.5, 1.5], [0.5, 1.0]];
        let expected = [9.0, 3.0, 1.0, 3.0].map(|f| 7.0 * f / 64.0);
        for (value, expected) in face.integrate(&quarter, 7.0).iter().zip(expected) {
            assert!((value - expected).abs() < 1e-14);
        }
    }

    /// Truth: the consistent loads of a uniform pressure (docs/theory-coupling.md), divided by the force on the face. At corner,
    /// middle and centre nodes they are 1/3 (tri3); 0 and 1/3 (tri6); -1/12 and 1/3 (quad8); 1/36, 1/9 and 4/9 (quad9). Tolerance
    /// 1e-14: rounding.
    #[test]
    fn consistent_loads() {
        let (triangle, quadrangle) =
            ([[0.0, 0.0], [2.0, 0.3], [0.5, 2.0]], [[0.0, 0.0], [4.0, 1.0], [5.0, 3.0], [1.0, 2.0]]);
        let check = |kind: ElementKind, corners: &[[f64; 2]], [corner, edge, middle]: [f64; 3]| {
            let face = whole(kind, corners);
            let area = area_and_centroid(corners).0;
            let n = corners.len();
            for (j, value) in face.integrate(corners, area)[..kind.n_nodes()].iter().enumerate() {
                let expected = if j < n {
                    corner
                } else if j < 2 * n {
                    edge
                } else {
                    middle
                };
                assert!((value / area - expected).abs() < 1e-14, "{kind:?} {j} {value} {expected}");
            }
        };
        check(Tri3, &triangle, [1.0 / 3.0, 0.0, 0.0]);
        check(Tri6, &triangle, [0.0, 1.0 / 3.0, 0.0]);
        check(Quad8, &quadrangle, [-1.0 / 12.0, 1.0 / 3.0, 0.0]);
        check(Quad9, &quadrangle, [1.0 / 36.0, 1.0 / 9.0, 4.0 / 9.0]);
    }

    /// Truth: with middle nodes at the midpoints, the shape functions sum to one and reproduce x. Over any inner polygon, sum_j int
    /// N_j = area and sum_j x_j int N_j = first moment (polygon formulas). Tolerance 1e-14: rounding.
    #[test]
    fn linear_fields_are_reproduced() {
        let polygon = [[0.3, 0.3], [1.4, 0.5], [1.3, 0.7], [0.9, 1.0], [0.35, 0.9]];
        let (area, centroid) = area_and_centroid(&polygon);
        for kind in ALL {
            let corners = [[0.0, 0.0], [3.0, 0.4], [2.2, 1.9], [-0.3, 2.5]];
            let corners = if kind.n_corners() == 3 {
                vec![corners[0], corners[1], corners[3]]
            } else {
                corners.to_vec()
            };
            let n = corners.len();
            let mut nodes = corners.clone();
            nodes.extend((0..n).map(|i| [0, 1].map(|k| 0.5 * (corners[i][k] + corners[(i + 1) % n][k]))));
            nodes.push([0, 1].map(|k| corners.iter().map(|x| x[k]).sum::<f64>() / 4.0));
            let weights = whole(kind, &corners).integrate(&polygon, area);
            assert!((weights.iter().sum::<f64>() - area).abs() < 1e-14);
            for k in 0..2 {
                let moment: f64 = weights.iter().zip(&nodes).map(|(w, x)| w * x[k]).sum();
                assert!(
                    (moment - area * centroid[k]).abs() < 1e-14,
                    "{kind:?} {moment} {}",
                    area * centroid[k]
                );
            }
        }
    }

    /// Truth: the integral over a face is the sum over its parts. Tolerance 1e-14: rounding.
    #[test]
    fn parts_sum_to_the_whole() {
        for kind in [Quad8, Quad9] {
            let x = |[s, t]: [f64; 2]| [2.0 * s + 0.5 * t, 0.3 * s + t];
            let mut sums = [0.0; MAX_FACE_NODES];
            for [s, t] in SQUARE_CORNERS {
                let reference = SQUARE_CORNERS.map(|[a, b]| [0.5 * (s + a), 0.5 * (t + b)]);
                let facet = ProjectedFacet::new(kind, &reference.map(x), &reference);
                let part = facet.integrate(&reference.map(x), 7.4);
                sums.iter_mut().zip(part).for_each(|(sum, value)| *sum += value);
            }
            let all = whole(kind, &SQUARE_CORNERS.map(x)).integrate(&SQUARE_CORNERS.map(x), 7.4);
            for (sum, value) in sums.iter().zip(all) {
                assert!((sum - value).abs() < 1e-14, "{kind:?} {sum} {value}");
            }
        }
    }

    #[test]
    fn facing() {
        let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        assert_eq!(whole(Quad4, &square).facing(1.0), Facing::Towards);
        let mut turned = square;
        turned.reverse();
        assert_eq!(whole(Quad4, &turned).facing(1.0), Facing::Away);
        let dart = [[0.0, 0.0], [1.0, 0.0], [0.1, 0.1], [0.0, 1.0]];
        assert_eq!(whole(Quad4, &dart).facing(1.0), Facing::Folded);
    }
}
