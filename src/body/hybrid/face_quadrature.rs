//! Quadrature over the boundary of a body for fields of point forces on a patch. Faces are subdivided until their parts
//! are small relative to their distance from the forces.

use crate::element::{ElementKind, MAX_FACE_NODES};
use crate::geometry::Point;
use crate::mesh::Mesh;
use crate::mesh::faces::SurfaceFace;
use crate::quadrature::{RulePoint, quadrilateral, triangle};

const MAX_SUBDIVISIONS: usize = 8;

#[derive(Debug, Clone, Copy)]
pub(super) struct FacePoint {
    /// Position, global, mm.
    pub at: Point,
    /// Outward normal times the quadrature weight, mm2.
    pub area: Point,
    /// Shape functions of the face at the point.
    pub values: [f64; MAX_FACE_NODES],
}

/// Quadrature rules on the reference triangle and the reference square, in increasing order of accuracy.
pub(super) struct FaceRules {
    triangles: [Vec<RulePoint<2>>; 3],
    squares: [Vec<RulePoint<2>>; 3],
}

impl FaceRules {
    pub fn new() -> Self {
        Self { triangles: [2, 4, 6].map(triangle), squares: [2, 3, 4].map(quadrilateral) }
    }

    /// Quadrature points on `face` for a field whose length scale at a point x is `distance(x)`. The face is divided
    /// until the size of each part is at most `ratio` times this scale. [`MAX_SUBDIVISIONS`] limits the number of
    /// divisions.
    pub fn points(
        &self,
        mesh: &Mesh,
        face: &SurfaceFace,
        distance: &dyn Fn(&Point) -> f64,
        ratio: f64,
    ) -> Vec<FacePoint> {
        let corners = &face.kind.face_reference_nodes()[..face.kind.n_corners()];
        let nodes: Vec<Point> = face.nodes.iter().map(|&node| mesh.points[node].into()).collect();
        let mut points = Vec::new();
        let part = FacePart { kind: face.kind, nodes: &nodes, corners: corners.to_vec() };
        self.divide(&part, distance, ratio, 0, &mut points);
        points
    }

    fn divide(
        &self,
        part: &FacePart,
        distance: &dyn Fn(&Point) -> f64,
        ratio: f64,
        division: usize,
        points: &mut Vec<FacePoint>,
    ) {
        let size = part.size();
        let reach = ratio * distance(&part.position(part.middle())).max(1e-300);
        if size > reach && division < MAX_SUBDIVISIONS {
            let parts = part.quarters();
            parts.iter().for_each(|part| self.divide(part, distance, ratio, division + 1, points));
            return;
        }
        let quadratic = part.kind.n_nodes() > part.kind.n_corners();
        // Quadratic shape functions have degree 2, so that even far from the forces the lowest order does not suffice.
        let order = match size / reach {
            share if share > 0.5 => 2,
            share if share > 0.2 || quadratic => 1,
            _ => 0,
        };
        let rule = if part.corners.len() == 3 { &self.triangles[order] } else { &self.squares[order] };
        points.extend(rule.iter().map(|point| part.point(point)));
    }
}

struct FacePart<'a> {
    kind: ElementKind,
    nodes: &'a [Point],
    /// Corners of the part in the reference face.
    corners: Vec<[f64; 2]>,
}

impl FacePart<'_> {
    fn middle(&self) -> [f64; 2] {
        let n = self.corners.len() as f64;
        [0, 1].map(|axis| self.corners.iter().map(|corner| corner[axis]).sum::<f64>() / n)
    }

    fn position(&self, xi: [f64; 2]) -> Point {
        self.kind.face_values(xi).iter().zip(self.nodes).map(|(value, node)| node * *value).sum()
    }

    fn size(&self) -> f64 {
        let corners: Vec<Point> = self.corners.iter().map(|&xi| self.position(xi)).collect();
        let pairs =
            corners.iter().enumerate().flat_map(|(i, a)| corners[..i].iter().map(move |b| (a - b).norm()));
        pairs.fold(0.0, f64::max)
    }

    fn quarters(&self) -> Vec<Self> {
        let n = self.corners.len();
        let between = |i: usize, j: usize| [0, 1].map(|k| 0.5 * (self.corners[i][k] + self.corners[j][k]));
        let part = |corners: Vec<[f64; 2]>| Self { kind: self.kind, nodes: self.nodes, corners };
        let middle = self.middle();
        let mut parts: Vec<Self> = (0..n)
            .map(|i| {
                let (next, last) = (between(i, (i + 1) % n), between(i, (i + n - 1) % n));
                let own = self.corners[i];
                part(if n == 3 { vec![own, next, last] } else { vec![own, next, middle, last] })
            })
            .collect();
        if n == 3 {
            parts.push(part(vec![between(0, 1), between(1, 2), between(2, 0)]));
        }
        parts
    }

    /// Maps a point of a rule into the part. Each part is a triangle or a parallelogram in the reference face.
    fn point(&self, &(xi, weight): &RulePoint<2>) -> FacePoint {
        let [a, b, last] = [self.corners[0], self.corners[1], self.corners[self.corners.len() - 1]];
        let along = |axis: usize| ([b[axis] - a[axis], last[axis] - a[axis]], a[axis]);
        let share = if self.corners.len() == 3 { xi } else { xi.map(|x| 0.5 * (1.0 + x)) };
        let inside = [0, 1].map(|axis| {
            let ([u, v], first) = along(axis);
            first + u * share[0] + v * share[1]
        });
        let (ux, uy, vx, vy) = (b[0] - a[0], b[1] - a[1], last[0] - a[0], last[1] - a[1]);
        let stretch = (ux * vy - uy * vx).abs() * if self.corners.len() == 3 { 1.0 } else { 0.25 };
        let gradients = self.kind.face_gradients(inside);
        let tangent = |axis: usize| -> Point {
            self.nodes.iter().zip(&gradients).map(|(node, g)| node * g[axis]).sum()
        };
        FacePoint {
            at: self.position(inside),
            area: tangent(0).cross(&tangent(1)) * (weight * stretch),
            values: self.kind.face_values(inside),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::faces::outer_faces;
    use crate::mesh::structured::GradedBlock;

    /// Truth: the flux of x / |x|³ through a closed surface around the origin is the full solid angle 4π.
    #[test]
    fn solid_angle_of_a_block() {
        let mesh = GradedBlock::uniform([1.0, 1.5], 2.0, [2, 3, 2]).mesh().unwrap();
        let inside = Point::new(0.3, -0.2, -0.15);
        let rules = FaceRules::new();
        let distance = |x: &Point| (x - inside).norm();
        let flux = |ratio: f64| -> f64 {
            let points =
                outer_faces(&mesh).into_iter().flat_map(|f| rules.points(&mesh, &f, &distance, ratio));
            points.map(|p| p.area.dot(&(p.at - inside)) / distance(&p.at).powi(3)).sum()
        };
        let whole = 4.0 * std::f64::consts::PI;
        assert!((flux(1.0) / whole - 1.0).abs() < 1e-4);
        assert!((flux(0.25) / whole - 1.0).abs() < 1e-8);
    }
}
