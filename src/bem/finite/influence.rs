//! Influence of unit tractions and displacements of an element at a point: integrals of the kernels U and T over the
//! element. U and T are the displacement and the traction of a unit point force.
//!
//! For points off the element, Gauss rules apply, and elements near the point are divided. For points on the element,
//! the rules run along rays from the point to the edge. The Jacobian of the polar coordinates then cancels 1/r.

use nalgebra::Matrix3;

use super::interpolation::{ElementNodes, MOST_NODES};
use super::panel::Panel;
use crate::bem::DisplacementGradient;
use crate::bem::full_space::FullSpaceField;
use crate::bem::green_tensor::TractionOperator;
use crate::bem::quadrature_order::{Parallelogram, QuadratureOrder};
use crate::geometry::Point;
use crate::material::Stiffness;
use crate::quadrature::gauss_legendre;

/// Maximum number of Gauss points along a side of an element, or of a part of a divided element.
const MOST_POINTS: usize = 8;

/// Rules with at most this many points per side are precomputed on whole elements.
const MAX_STORED_POINTS_PER_SIDE: usize = 4;

const MOST_DIVISIONS: usize = 14;

/// Displacement (rows) at a point due to unit tractions and unit displacements of the nodes of an element.
#[derive(Debug, Clone, Copy)]
pub struct Influence {
    /// ∫ U N_a dS with the shape function N_a of node a, mm/MPa.
    pub single_layer: [Matrix3<f64>; MOST_NODES],
    /// ∫ T N_a dS, dimensionless.
    pub double_layer: [Matrix3<f64>; MOST_NODES],
}

#[derive(Debug)]
pub(super) struct InfluenceIntegrator {
    pub stiffness: Stiffness,
    field: FullSpaceField,
    /// Gauss rules on [-1, 1] with 1, 2, ... points.
    rules: Vec<Vec<(f64, f64)>>,
    quadrature_order: QuadratureOrder,
}

struct PrincipalValuePoint {
    y: Point,
    traction: TractionOperator,
    /// Unit of length for the distances from the point, mm.
    size: f64,
}

#[derive(Debug, Clone)]
struct QuadraturePoint {
    at: Point,
    /// Quadrature weight times the Jacobian, mm².
    area: f64,
    traction_operator: TractionOperator,
    shape_values: [f64; MOST_NODES],
}

#[derive(Debug)]
pub(super) struct PreparedElement {
    pub panel: Panel,
    /// Quadrature points on the whole element for 1, 2, ... points along a side; empty below `min_points`.
    samples: [Vec<QuadraturePoint>; MAX_STORED_POINTS_PER_SIDE],
    min_points: usize,
    patch: Parallelogram,
}

#[derive(Clone, Copy)]
pub(super) struct ElementView<'a> {
    pub prepared: &'a PreparedElement,
    pub nodes: &'a ElementNodes,
}

/// Displacement (mm) and traction (MPa) of a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct NodalState {
    pub displacement: Point,
    pub traction: Point,
}

/// Step of the fourth-order finite differences of the traction kernel, relative to the distance from the evaluation
/// point. The relative error of these differences is about 1e-7.
const STEP: f64 = 0.01;

/// Displacement field of a double layer: a unit area with the displacement `density`.
struct DoubleLayer<'a> {
    kernels: &'a InfluenceIntegrator,
    traction_operator: &'a TractionOperator,
    density: Point,
}

impl DoubleLayer<'_> {
    /// Displacement per area at the evaluation point y; `r` points from y to the element.
    fn at(&self, r: &Point) -> Point {
        self.traction_operator.apply(&self.kernels.field.at(r)).transpose() * self.density
    }

    /// Adds the displacement and the displacement gradient at y due to the `traction` minus the double layer, on the
    /// given `area`. The derivative of the double layer along r is exact, because the layer decays as 1/r².
    fn add(&self, r: &Point, traction: Point, area: f64, sum: &mut DisplacementGradient) {
        let field = self.kernels.field.at(r);
        let own = self.traction_operator.apply(&field).transpose() * self.density;
        sum.displacement += (field.value * traction - own) * area;
        let distance = r.norm();
        let along = r / distance;
        let across = along.cross(&Point::ith(along.iamin(), 1.0)).normalize();
        let mut slope = own * (-2.0 / distance) * along.transpose();
        for axis in [across, along.cross(&across)] {
            let step = axis * (STEP * distance);
            let near = self.at(&(r + step)) - self.at(&(r - step));
            let far = self.at(&(r + step * 2.0)) - self.at(&(r - step * 2.0));
            slope += (near * 8.0 - far) / (12.0 * STEP * distance) * axis.transpose();
        }
        // U is differentiated with respect to r = x - y. The derivative with respect to y has the opposite sign, hence
        // the minus sign.
        let single = Matrix3::from_columns(&field.gradient.map(|part| part * traction));
        sum.gradient += (slope - single) * area;
    }
}

/// Triangle or parallelogram of the reference element.
#[derive(Clone, Copy)]
struct ReferencePart {
    first: [f64; 2],
    sides: [[f64; 2]; 2],
    triangle: bool,
}

impl Influence {
    fn zero() -> Self {
        Self { single_layer: [Matrix3::zeros(); MOST_NODES], double_layer: [Matrix3::zeros(); MOST_NODES] }
    }
}

impl ReferencePart {
    fn whole(triangle: bool) -> Self {
        if triangle {
            Self { first: [0.0; 2], sides: [[1.0, 0.0], [0.0, 1.0]], triangle }
        } else {
            Self { first: [-1.0; 2], sides: [[2.0, 0.0], [0.0, 2.0]], triangle }
        }
    }

    fn at(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|c| self.first[c] + u * self.sides[0][c] + v * self.sides[1][c])
    }

    /// Parallelogram that the sides span on a panel, linearised about the centre of the parallelogram.
    fn linearised_on(&self, panel: &Panel) -> Parallelogram {
        let middle = self.at([0.5; 2]);
        let [a, b] = panel.tangents(middle);
        let half_sides = self.sides.map(|[u, v]| 0.5 * (u * a + v * b));
        Parallelogram { middle: panel.position(middle), half_sides }
    }

    fn quarters(&self) -> [Self; 4] {
        let sides = self.sides.map(|side| side.map(|x| 0.5 * x));
        let part = |place: [f64; 2]| Self { first: self.at(place), sides, ..*self };
        let last = if self.triangle {
            // The middle triangle is rotated by half a turn.
            Self { first: self.at([0.5, 0.5]), sides: sides.map(|side| side.map(|x| -x)), ..*self }
        } else {
            part([0.5, 0.5])
        };
        [part([0.0, 0.0]), part([0.5, 0.0]), part([0.0, 0.5]), last]
    }

    /// Points and weights of the tensor product of a rule with itself. For triangles, the square is collapsed to a
    /// triangle.
    fn points<'a>(&'a self, rule: &'a [(f64, f64)]) -> impl Iterator<Item = ([f64; 2], f64)> + 'a {
        let [a, b] = self.sides;
        let stretch = (a[0] * b[1] - a[1] * b[0]).abs();
        rule.iter().flat_map(move |&(u, by_u)| {
            rule.iter().map(move |&(v, by_v)| {
                let (mut place, mut weight) =
                    ([0.5 * (1.0 + u), 0.5 * (1.0 + v)], 0.25 * by_u * by_v * stretch);
                if self.triangle {
                    weight *= 1.0 - place[0];
                    place[1] *= 1.0 - place[0];
                }
                (self.at(place), weight)
            })
        })
    }
}

impl QuadraturePoint {
    fn new(
        kernels: &InfluenceIntegrator,
        panel: &Panel,
        nodes: &ElementNodes,
        xi: [f64; 2],
        weight: f64,
    ) -> Self {
        let area = panel.area_vector(xi);
        let size = area.norm();
        Self {
            at: panel.position(xi),
            area: weight * size,
            traction_operator: TractionOperator::new(&kernels.stiffness, &(area / size)),
            shape_values: nodes.values(xi),
        }
    }
}

impl PreparedElement {
    pub fn new(kernels: &InfluenceIntegrator, panel: Panel, nodes: &ElementNodes, degree: usize) -> Self {
        // One more point is necessary for triangles, because they are collapsed squares, and for elements that are not
        // affine.
        let affine = panel.is_affine() && !panel.is_triangle();
        let min_points = degree + if affine { 1 } else { 2 };
        let whole = ReferencePart::whole(panel.is_triangle());
        let samples = std::array::from_fn(|i| {
            let points =
                if i + 1 < min_points { Vec::new() } else { whole.points(&kernels.rules[i]).collect() };
            let sample = |(xi, weight)| QuadraturePoint::new(kernels, &panel, nodes, xi, weight);
            points.into_iter().map(sample).collect()
        });
        let patch = whole.linearised_on(&panel);
        Self { panel, samples, min_points, patch }
    }
}

impl InfluenceIntegrator {
    /// Kernels whose integrals over an element have an error of about `accuracy`, relative to their largest values.
    pub fn new(stiffness: Stiffness, field: FullSpaceField, accuracy: f64) -> Self {
        let rules = (1..=MOST_POINTS).map(gauss_legendre).collect();
        let quadrature_order = QuadratureOrder::new(&stiffness, accuracy, MOST_POINTS);
        Self { stiffness, field, rules, quadrature_order }
    }

    pub fn off_element(&self, element: ElementView, y: &Point) -> Influence {
        let mut influence = Influence::zero();
        self.each_sample(element, y, &mut |sample| self.add(element.nodes, y, sample, &mut influence));
        influence
    }

    /// Calls `visit` for each quadrature point of an element. The evaluation point `y` lies off the element.
    #[inline]
    fn each_sample(&self, element: ElementView, y: &Point, visit: &mut impl FnMut(&QuadraturePoint)) {
        let PreparedElement { panel, samples, min_points, patch } = element.prepared;
        match self.quadrature_order.points(patch, y).map(|n| n.max(*min_points)) {
            Some(n) if n <= MAX_STORED_POINTS_PER_SIDE => samples[n - 1].iter().for_each(visit),
            _ => self.divide(element, y, ReferencePart::whole(panel.is_triangle()), MOST_DIVISIONS, visit),
        }
    }

    /// Adds the displacement and the displacement gradient at `y`, off the element, due to the nodal states `nodal`.
    pub fn add_field(
        &self,
        element: ElementView,
        y: &Point,
        nodal: &[NodalState],
        sum: &mut DisplacementGradient,
    ) {
        self.each_sample(element, y, &mut |sample| {
            let (mut traction, mut displacement) = (Point::zeros(), Point::zeros());
            for (node, value) in nodal.iter().zip(&sample.shape_values) {
                traction += node.traction * *value;
                displacement += node.displacement * *value;
            }
            let layer = DoubleLayer {
                kernels: self,
                traction_operator: &sample.traction_operator,
                density: displacement,
            };
            layer.add(&(sample.at - y), traction, sample.area, sum);
        });
    }

    /// Influence of an element at its own node. The strongly singular block of this node is set to zero.
    pub fn on_element(&self, element: ElementView, node: usize) -> Influence {
        let mut influence = Influence::zero();
        let xi = element.nodes.reference_points()[node];
        let corners = element.prepared.panel.corners();
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            self.add_polar_triangle(element, xi, *from, to, MOST_DIVISIONS, &mut influence);
        }
        influence.double_layer[node] = Matrix3::zeros();
        influence
    }

    /// Principal value of ∫ T dS over a plane element at its own node `node`.
    ///
    /// On the plane T = f(φ) / r² with f(φ + π) = -f(φ). Therefore ∫ T dS = ∫ f(φ) ln R(φ) dφ, where R is the distance
    /// from the node to the edge. The unit of R does not matter, because ∫ f dφ = 0. Along a side dφ = d / r² dl, with
    /// the distance d from the node to the line of the side.
    pub fn principal_value(&self, element: ElementView, node: usize) -> Matrix3<f64> {
        let panel = &element.prepared.panel;
        let xi = element.nodes.reference_points()[node];
        let (y, area) = (panel.position(xi), panel.area_vector(xi));
        let seen = PrincipalValuePoint {
            y,
            traction: TractionOperator::new(&self.stiffness, &area.normalize()),
            size: area.norm().sqrt(),
        };
        let corners: Vec<Point> = panel.corners().iter().map(|corner| panel.position(*corner)).collect();
        let mut sum = Matrix3::zeros();
        for (k, from) in corners.iter().enumerate() {
            let to = corners[(k + 1) % corners.len()];
            self.add_edge_principal_value(&seen, *from, to, MOST_DIVISIONS, &mut sum);
        }
        sum
    }

    fn add_edge_principal_value(
        &self,
        seen: &PrincipalValuePoint,
        from: Point,
        to: Point,
        divisions: usize,
        sum: &mut Matrix3<f64>,
    ) {
        let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
        let n = self.quadrature_order.points_along(&middle, &half, &seen.y);
        // The logarithm is singular at the same points as the kernel, and requires two more Gauss points.
        let n = n.map(|n| (n + 2).min(MOST_POINTS));
        if n.is_none() && divisions > 0 {
            self.add_edge_principal_value(seen, from, middle, divisions - 1, sum);
            self.add_edge_principal_value(seen, middle, to, divisions - 1, sum);
            return;
        }
        let off = (middle - seen.y).cross(&half).norm();
        for &(t, by_t) in &self.rules[n.unwrap_or(MOST_POINTS) - 1] {
            let away = middle + t * half - seen.y;
            let traction = seen.traction.apply(&self.field.at(&away)).transpose();
            *sum += traction * (by_t * off * (away.norm() / seen.size).ln());
        }
    }

    fn divide(
        &self,
        element: ElementView,
        y: &Point,
        part: ReferencePart,
        divisions: usize,
        visit: &mut impl FnMut(&QuadraturePoint),
    ) {
        let panel = &element.prepared.panel;
        let n = self
            .quadrature_order
            .points(&part.linearised_on(panel), y)
            .map(|n| n.max(element.prepared.min_points));
        if n.is_none() && divisions > 0 {
            for quarter in part.quarters() {
                self.divide(element, y, quarter, divisions - 1, visit);
            }
            return;
        }
        for (xi, weight) in part.points(&self.rules[n.unwrap_or(MOST_POINTS) - 1]) {
            visit(&QuadraturePoint::new(self, panel, element.nodes, xi, weight));
        }
    }

    /// Adds the integral over the triangle between the point `xi` of the element and an edge segment.
    fn add_polar_triangle(
        &self,
        element: ElementView,
        xi: [f64; 2],
        from: [f64; 2],
        to: [f64; 2],
        divisions: usize,
        influence: &mut Influence,
    ) {
        let panel = &element.prepared.panel;
        let y = panel.position(xi);
        let middle = [0, 1].map(|c| 0.5 * (from[c] + to[c]));
        let half = 0.5 * (panel.position(to) - panel.position(from));
        let n = self.quadrature_order.points_along(&panel.position(middle), &half, &y);
        let n = n.map(|n| (n + element.prepared.min_points).min(MOST_POINTS));
        if n.is_none() && divisions > 0 {
            self.add_polar_triangle(element, xi, from, middle, divisions - 1, influence);
            self.add_polar_triangle(element, xi, middle, to, divisions - 1, influence);
            return;
        }
        let cross = (from[0] - xi[0]) * (to[1] - xi[1]) - (from[1] - xi[1]) * (to[0] - xi[0]);
        // Along a ray, the integrand is a polynomial on affine elements and smooth on other elements.
        let radial = &self.rules[MOST_POINTS - 1];
        for &(t, by_t) in &self.rules[n.unwrap_or(MOST_POINTS) - 1] {
            let end = [0, 1].map(|c| 0.5 * ((1.0 - t) * from[c] + (1.0 + t) * to[c]));
            for &(s, by_s) in radial {
                let share = 0.5 * (1.0 + s);
                let at = [0, 1].map(|c| xi[c] + share * (end[c] - xi[c]));
                let weight = 0.25 * by_s * by_t * share * cross.abs();
                let sample = QuadraturePoint::new(self, panel, element.nodes, at, weight);
                self.add(element.nodes, &y, &sample, influence);
            }
        }
    }

    #[inline]
    fn add(&self, nodes: &ElementNodes, y: &Point, sample: &QuadraturePoint, influence: &mut Influence) {
        let field = self.field.at(&(sample.at - y));
        // By reciprocity, the transpose of the traction due to a force at y gives the displacement at y due to displacements of
        // the element.
        let traction = sample.traction_operator.apply(&field).transpose();
        for (a, value) in sample.shape_values.iter().enumerate().take(nodes.reference_points().len()) {
            let factor = value * sample.area;
            influence.single_layer[a] += field.value * factor;
            influence.double_layer[a] += traction * factor;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::interpolation::Interpolation;
    use super::*;
    use crate::element::ElementKind;

    /// Truth: the tractions of a point force at y on a closed box balance the force. Without ORTHOWEAR_THOROUGH, the fibres are
    /// weakly anisotropic, so that their table is small.
    #[test]
    fn flux_through_a_box() {
        let along = if std::env::var_os("ORTHOWEAR_THOROUGH").is_some() { 140e3 } else { 14e3 };
        let fibres = Stiffness::transversely_isotropic(along, 10e3, 5e3, 0.3, 0.4).unwrap();
        let turned = fibres.rotated(&crate::geometry::fibre_axes(0.5, 0.3));
        for stiffness in [Stiffness::isotropic(210e3, 0.3).unwrap(), turned] {
            let field = FullSpaceField::new(&stiffness).unwrap();
            let kernels = InfluenceIntegrator::new(stiffness, field, 1e-9);
            half_from_a_face(&kernels);
            near_its_faces(&kernels);
        }
    }

    const FACES: [[[f64; 3]; 4]; 6] = [
        [[0., 0., 0.], [0., 1., 0.], [1., 1., 0.], [1., 0., 0.]],
        [[0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]],
        [[0., 0., 0.], [1., 0., 0.], [1., 0., 1.], [0., 0., 1.]],
        [[0., 1., 0.], [0., 1., 1.], [1., 1., 1.], [1., 1., 0.]],
        [[0., 0., 0.], [0., 0., 1.], [0., 1., 1.], [0., 1., 0.]],
        [[1., 0., 0.], [1., 1., 0.], [1., 1., 1.], [1., 0., 1.]],
    ];

    fn panels(kernels: &InfluenceIntegrator, nodes: &ElementNodes, order: usize) -> [PreparedElement; 6] {
        FACES
            .map(|nodes| Panel { kind: ElementKind::Quad4, nodes: nodes.map(Point::from).to_vec() })
            .map(|panel| PreparedElement::new(kernels, panel, nodes, order))
    }

    /// For y at a node of a face, the integrals of T over all faces sum to minus half the unit matrix. The integral
    /// over the face of the node is a principal value.
    fn half_from_a_face(kernels: &InfluenceIntegrator) {
        let nodes = ElementNodes::new(Interpolation::Linear, false);
        let panels = panels(kernels, &nodes, 1);
        let own = ElementView { prepared: &panels[1], nodes: &nodes };
        for node in 0..4 {
            let y = panels[1].panel.position(nodes.reference_points()[node]);
            let others = (0..6).filter(|i| *i != 1).map(|i| {
                let influence = kernels.off_element(ElementView { prepared: &panels[i], nodes: &nodes }, &y);
                influence.double_layer[..4].iter().sum::<Matrix3<f64>>()
            });
            let sum = others.sum::<Matrix3<f64>>() + kernels.principal_value(own, node);
            let error = (sum + Matrix3::identity() * 0.5).amax();
            assert!(error < 2e-8, "{node}: {error:e}");
        }
    }

    /// The integrals of T over all faces sum to minus the unit matrix for y inside, and to zero for y outside. The
    /// integrals have a relative accuracy of 1e-9.
    fn near_its_faces(kernels: &InfluenceIntegrator) {
        let nodes = ElementNodes::new(Interpolation::Constant, false);
        let panels = panels(kernels, &nodes, 0);
        let cases = [
            ([0.5, 0.5, 0.5], -1.0),
            ([0.3, 0.6, 0.99], -1.0),
            ([0.3, 0.6, 0.999], -1.0),
            ([0.999, 0.998, 0.997], -1.0),
            ([0.3, 0.6, 1.001], 0.0),
            ([3.0, -2.0, 0.5], 0.0),
        ];
        for (y, flux) in cases {
            let at = |prepared| {
                kernels.off_element(ElementView { prepared, nodes: &nodes }, &Point::from(y)).double_layer[0]
            };
            let sum: Matrix3<f64> = panels.iter().map(at).sum();
            let error = (sum - Matrix3::identity() * flux).amax();
            assert!(error < 2e-8, "{y:?}: {error:e}");
        }
    }
}
