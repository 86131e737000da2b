//! Displacement and stress inside a body, from the state of its surface.
//!
//! In Somigliana's identity u(y) = ∫ U t dS - ∫ T u dS, the kernels grow up to 1/r² near the surface. In the derivative
//! of the identity, the kernels grow up to 1/r³. A linear field with the displacement and the gradient of the nearest
//! surface point is therefore subtracted before integration. The remaining displacement and traction vanish at this
//! point. For interior domains, the integrals of a linear field reproduce the field. For exterior domains, these
//! integrals are zero.

use nalgebra::Matrix3;

use super::elements::BoundaryElements;
use super::influence::NodalState;
use super::problem::Domain;
use super::solution::SurfaceState;
use super::surface_solution::SurfaceSolution;
use crate::bem::{DisplacementGradient, PointState};
use crate::geometry::Point;

const STEPS: usize = 30;

/// Distance below which a point counts as a surface point, relative to the radius of the element's bounding sphere.
const SURFACE_TOLERANCE: f64 = 1e-6;

const MIN_NORMAL_COSINE: f64 = 0.99;

/// Surface point that is nearest to a given point.
#[derive(Debug, Clone, Copy)]
pub struct NearestPoint {
    /// Element of the nearest point.
    pub element: usize,
    /// Position in the reference element.
    pub xi: [f64; 2],
    /// Position, mm.
    pub position: Point,
    /// Distance from the given point, mm.
    pub distance: f64,
}

/// Displacement and stress inside a body.
pub struct InteriorSolution<'a> {
    elements: &'a BoundaryElements,
    domain: Domain,
    surface: SurfaceSolution<'a>,
    state: &'a SurfaceState,
    positions: Vec<Point>,
    normals: Vec<Point>,
}

impl BoundaryElements {
    /// Interior solution of `state` for the body on the `domain` side of the surface.
    pub fn interior_solution<'a>(&'a self, state: &'a SurfaceState, domain: Domain) -> InteriorSolution<'a> {
        let surface = self.surface_solution(state);
        let (positions, normals) = (self.positions(), self.normals());
        InteriorSolution { elements: self, domain, surface, state, positions, normals }
    }

    /// Whether a point lies inside the closed surface or on it.
    pub fn contains(&self, y: &Point) -> bool {
        let foot = self.nearest_point(y);
        let (_, radius) = self.bounding_sphere(foot.element);
        if foot.distance <= SURFACE_TOLERANCE * radius {
            return true;
        }
        let along = (y - foot.position).dot(&self.panel(foot.element).area_vector(foot.xi).normalize());
        if along.abs() > MIN_NORMAL_COSINE * foot.distance {
            return along < 0.0;
        }
        // Next to an edge, the normal of the nearest element is not a reliable criterion. The trace of ∫ T dS over the
        // surface, for a point force at y, is used instead. The trace is -3 for y inside and 0 for y outside.
        let flux = (0..self.n_elements()).map(|i| {
            let influence = self.influence_off_element(i, y);
            influence.double_layer.iter().take(self.nodes_of(i).len()).map(|block| block.trace()).sum::<f64>()
        });
        flux.sum::<f64>() < -1.5
    }

    /// Nearest point of the surface to `y`.
    pub fn nearest_point(&self, y: &Point) -> NearestPoint {
        let mut best: Option<NearestPoint> = None;
        for i in 0..self.n_elements() {
            let (middle, radius) = self.bounding_sphere(i);
            let nearest = (y - middle).norm() - radius;
            if best.is_none_or(|best| nearest < best.distance) {
                let found = self.nearest_point_on(i, y);
                if best.is_none_or(|best| found.distance < best.distance) {
                    best = Some(found);
                }
            }
        }
        best.expect("a surface has elements")
    }

    /// Nearest point on each element that contains `y` within the tolerance. On a common side or corner, several
    /// elements contain `y`.
    fn coincident_points(&self, y: &Point) -> Vec<NearestPoint> {
        let on = |i: usize| {
            let (middle, radius) = self.bounding_sphere(i);
            let near = (y - middle).norm() <= radius * (1.0 + SURFACE_TOLERANCE);
            near.then(|| self.nearest_point_on(i, y))
                .filter(|foot| foot.distance <= SURFACE_TOLERANCE * radius)
        };
        (0..self.n_elements()).filter_map(on).collect()
    }

    fn bounding_sphere(&self, i: usize) -> (Point, f64) {
        let nodes = &self.panel(i).nodes;
        let middle = nodes.iter().sum::<Point>() / nodes.len() as f64;
        // Curved elements bulge beyond their nodes by less than half the largest distance of a node from the centre.
        (middle, 1.5 * nodes.iter().map(|node| (node - middle).norm()).fold(0.0, f64::max))
    }

    /// Nearest point on element `i`, by Gauss-Newton steps restricted to the element.
    fn nearest_point_on(&self, i: usize, y: &Point) -> NearestPoint {
        let panel = self.panel(i);
        let triangle = panel.is_triangle();
        let mut xi = if triangle { [1.0 / 3.0; 2] } else { [0.0; 2] };
        let foot = |xi: [f64; 2]| {
            let position = panel.position(xi);
            NearestPoint { element: i, xi, position, distance: (y - position).norm() }
        };
        let mut best = foot(xi);
        for _ in 0..STEPS {
            let [a, b] = panel.tangents(xi);
            let away = y - best.position;
            let (aa, ab, bb, ra, rb) = (a.dot(&a), a.dot(&b), b.dot(&b), a.dot(&away), b.dot(&away));
            let determinant = aa * bb - ab * ab;
            let free = [(bb * ra - ab * rb) / determinant, (aa * rb - ab * ra) / determinant];
            // At an edge of the element, only steps along the edge stay within the element.
            let tries = [free, [ra / aa, 0.0], [0.0, rb / bb], slide(&(a - b), &away)];
            let next = tries.into_iter().flat_map(|step| [1.0, 0.3].map(|share| step.map(|x| share * x)));
            let next = next.map(|step| foot(clamped([0, 1].map(|c| xi[c] + step[c]), triangle)));
            let next = next.min_by(|a, b| a.distance.total_cmp(&b.distance)).expect("there are tries");
            if next.distance >= best.distance * (1.0 - 1e-14) {
                break;
            }
            (xi, best) = (next.xi, next);
        }
        best
    }
}

fn slide(side: &Point, away: &Point) -> [f64; 2] {
    let step = side.dot(away) / side.norm_squared().max(f64::MIN_POSITIVE);
    [step, -step]
}

fn clamped([u, v]: [f64; 2], triangle: bool) -> [f64; 2] {
    if !triangle {
        return [u.clamp(-1.0, 1.0), v.clamp(-1.0, 1.0)];
    }
    let [u, v] = [u.max(0.0), v.max(0.0)];
    let beyond = (0.5 * (u + v - 1.0)).max(0.0);
    let [u, v] = [(u - beyond).clamp(0.0, 1.0), (v - beyond).clamp(0.0, 1.0)];
    [u.min(1.0 - v), v]
}

impl InteriorSolution<'_> {
    /// State at a point inside the body or on its surface. On common sides and corners, the state is the mean over the
    /// adjacent elements.
    pub fn at(&self, y: &Point) -> PointState {
        let stiffness = self.elements.stiffness();
        let feet = self.elements.coincident_points(y);
        if !feet.is_empty() {
            let share = 1.0 / feet.len() as f64;
            let mut mean = PointState { displacement: Point::zeros(), stress: Matrix3::zeros() };
            for foot in feet {
                mean.displacement += self.surface.displacement(foot.element, foot.xi) * share;
                mean.stress += self.surface.stress(foot.element, foot.xi) * share;
            }
            return mean;
        }
        let foot = self.elements.nearest_point(y);
        let u = self.surface.displacement(foot.element, foot.xi);
        let gradient = self.surface.gradient(foot.element, foot.xi);
        let stress = stiffness.stress(&gradient);
        let linear = |x: &Point| u + gradient * (x - foot.position);
        let mut sum = DisplacementGradient::default();
        if self.domain == Domain::Interior {
            sum = DisplacementGradient { displacement: linear(y), gradient };
        }
        let mut nodal = Vec::with_capacity(super::interpolation::MOST_NODES);
        for i in 0..self.elements.n_elements() {
            nodal.clear();
            nodal.extend(self.elements.nodes_of(i).map(|node| NodalState {
                displacement: Point::from(self.state.displacement[node]) - linear(&self.positions[node]),
                traction: Point::from(self.state.traction[node]) - stress * self.normals[node],
            }));
            self.elements.add_field(i, y, &nodal, &mut sum);
        }
        PointState { displacement: sum.displacement, stress: stiffness.stress(&sum.gradient) }
    }
}
