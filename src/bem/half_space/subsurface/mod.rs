//! Displacement and stress inside a half-space under uniform tractions on the cells of its surface
//! ([`SubsurfaceField`]).
//!
//! Near cells are integrated by Gauss rules. Each cluster of distant cells is replaced by 6 × 6 equivalent forces.
//! These forces have the same moments as the tractions up to degree 5 in each direction. The field at a point is thus a
//! sum over some thousand forces. This number is almost independent of the number of cells.

mod boussinesq;
pub mod point_force;
pub mod point_force_integral;
mod surface_point_force;

use std::ops::Range;

use crate::bem::half_space::subsurface::point_force::PointForceField;
use crate::bem::quadrature_order::{Parallelogram, QuadratureOrder};
use crate::bem::{DisplacementGradient, PointState};
use crate::geometry::Point;
use crate::material::Stiffness;
use crate::quadrature::gauss_legendre;

/// Target error of the integral over a cell or a cluster, relative to the largest values.
const RELATIVE_TOLERANCE: f64 = 1e-6;

/// Number of equivalent forces along a side of a cluster. The error of these forces is about the error of a Gauss rule
/// with half as many points per side.
const EQUIVALENT_FORCES_PER_SIDE: usize = 6;

/// Maximum number of Gauss points along a side of a cell, or of a part of a divided cell.
const MOST_POINTS: usize = 8;

const MOST_DIVISIONS: usize = 32;

/// Maximum deviation of a half side from the mean of opposite half sides in a parallelogram, relative to the longer
/// half side. The deviation covers rounding errors.
const PARALLELOGRAM_TOLERANCE: f64 = 1e-9;

const MAX_LEAF_QUADS: usize = 8;

/// Quadrilateral of a cell with a uniform traction. A triangle is stored with its last corner repeated.
#[derive(Debug, Clone)]
struct LoadedQuad {
    corners: [[f64; 2]; 4],
    traction: Point,
    /// 1 if the corners run counter-clockwise, -1 otherwise.
    orientation: f64,
}

#[derive(Debug)]
struct CellCluster {
    patch: Parallelogram,
    /// Positions and vectors of the equivalent forces. Leaves with a parent store none, because leaves are always
    /// integrated cell by cell.
    forces: Vec<([f64; 2], Point)>,
    members: ClusterMembers,
}

#[derive(Debug)]
enum ClusterMembers {
    Children([usize; 2]),
    Quads(Range<usize>),
}

/// Displacement and stress field of the half-space z <= 0 with outward normal +z, under tractions on cells of its
/// surface.
pub struct SubsurfaceField<'a> {
    field: &'a PointForceField,
    stiffness: &'a Stiffness,
    quadrature_order: QuadratureOrder,
    rules: Vec<Vec<(f64, f64)>>,
    quads: Vec<LoadedQuad>,
    clusters: Vec<CellCluster>,
}

impl LoadedQuad {
    fn at(&self, s: f64, t: f64) -> ([f64; 2], f64) {
        let [a, b, c, d] = &self.corners;
        let value = |k: usize| {
            0.25 * ((1.0 - s) * ((1.0 - t) * a[k] + (1.0 + t) * d[k])
                + (1.0 + s) * ((1.0 - t) * b[k] + (1.0 + t) * c[k]))
        };
        let along_s = [0, 1].map(|k| 0.25 * ((1.0 - t) * (b[k] - a[k]) + (1.0 + t) * (c[k] - d[k])));
        let along_t = [0, 1].map(|k| 0.25 * ((1.0 - s) * (d[k] - a[k]) + (1.0 + s) * (c[k] - b[k])));
        ([value(0), value(1)], along_s[0] * along_t[1] - along_s[1] * along_t[0])
    }

    /// Number of parallelograms, and the parallelograms that decide the number of Gauss points. A parallelogram returns
    /// only itself. Any other quadrilateral returns one parallelogram for each corner. Each has the two sides that meet
    /// at the corner, and the centre of the quadrilateral.
    fn enclosing_parallelograms(&self) -> (usize, [Parallelogram; 4]) {
        let [a, b, c, d] = self.corners.map(|[x, y]| Point::new(x, y, 0.0));
        let middle = (a + b + c + d) * 0.25;
        let (u, v, bent) = ((b + c - a - d) * 0.25, (c + d - a - b) * 0.25, (a - b + c - d) * 0.25);
        let patch = |s: f64, t: f64| Parallelogram { middle, half_sides: [u + bent * s, v + bent * t] };
        if bent.norm() <= PARALLELOGRAM_TOLERANCE * u.norm().max(v.norm()) {
            return (1, [(); 4].map(|()| patch(0.0, 0.0)));
        }
        (4, [patch(1.0, 1.0), patch(1.0, -1.0), patch(-1.0, 1.0), patch(-1.0, -1.0)])
    }

    /// Halves of the quadrilateral. The cut joins the midpoint of the longest side to the midpoint of the opposite
    /// side.
    fn halves(&self) -> [Self; 2] {
        let [a, b, c, d] = self.corners;
        let length = |p: [f64; 2], q: [f64; 2]| (p[0] - q[0]).hypot(p[1] - q[1]);
        let middle = |p: [f64; 2], q: [f64; 2]| [0, 1].map(|k| 0.5 * (p[k] + q[k]));
        let corners = if length(a, b).max(length(c, d)) > length(a, d).max(length(b, c)) {
            let (e, f) = (middle(a, b), middle(c, d));
            [[a, e, f, d], [e, b, c, f]]
        } else {
            let (e, f) = (middle(b, c), middle(a, d));
            [[a, b, e, f], [f, e, c, d]]
        };
        corners.map(|corners| Self { corners, ..self.clone() })
    }
}

fn split_polygon(corners: &[[f64; 2]], traction: Point) -> Vec<LoadedQuad> {
    let n = corners.len();
    let twice_area: f64 = (0..n)
        .map(|k| corners[k][0] * corners[(k + 1) % n][1] - corners[k][1] * corners[(k + 1) % n][0])
        .sum();
    let part = |corners: [[f64; 2]; 4]| LoadedQuad { corners, traction, orientation: twice_area.signum() };
    match *corners {
        [a, b, c] => vec![part([a, b, c, c])],
        [a, b, c, d] => vec![part([a, b, c, d])],
        _ => {
            let middle = [0, 1].map(|c| corners.iter().map(|p| p[c]).sum::<f64>() / n as f64);
            (0..n).map(|k| part([middle, corners[k], corners[(k + 1) % n], corners[(k + 1) % n]])).collect()
        }
    }
}

impl<'a> SubsurfaceField<'a> {
    /// Upper bound of the memory, bytes, for cells with `n_corners` corners each.
    pub fn expected_bytes(n_corners: impl Iterator<Item = usize>) -> usize {
        let parts: usize = n_corners.map(|n| if n <= 4 { 1 } else { n }).sum();
        // Each half of a divided cluster holds at least half of `MAX_LEAF_QUADS` quadrilaterals.
        let groups = 2 * parts / MAX_LEAF_QUADS.div_ceil(2) + 1;
        parts * size_of::<LoadedQuad>()
            + groups
                * (size_of::<CellCluster>()
                    + EQUIVALENT_FORCES_PER_SIDE
                        * EQUIVALENT_FORCES_PER_SIDE
                        * size_of::<([f64; 2], Point)>())
    }

    /// Field under uniform tractions on cells. Each item of `cells` holds the corners on the surface and the traction
    /// on the body (MPa). `stiffness` is in the axes of the surface, and `field` is the point-force field for this
    /// stiffness.
    pub fn new(
        stiffness: &'a Stiffness,
        field: &'a PointForceField,
        cells: impl Iterator<Item = (Vec<[f64; 2]>, Point)>,
    ) -> Self {
        let loaded = cells.filter(|(_, traction)| *traction != Point::zeros());
        let quads = loaded.flat_map(|(corners, traction)| split_polygon(&corners, traction)).collect();
        let rules = (1..=MOST_POINTS).map(gauss_legendre).collect();
        let quadrature_order = QuadratureOrder::new(stiffness, RELATIVE_TOLERANCE, MOST_POINTS);
        let mut made = Self { field, stiffness, quadrature_order, rules, quads, clusters: Vec::new() };
        if !made.quads.is_empty() {
            made.build_cluster(0..made.quads.len());
        }
        made
    }

    /// Builds the cluster of a range of quadrilaterals and returns its index. The clusters of the two halves are built
    /// first.
    fn build_cluster(&mut self, range: Range<usize>) -> usize {
        let corners = self.quads[range.clone()].iter().flat_map(|part| part.corners);
        let [mut low, mut high] = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for corner in corners {
            (0..2).for_each(|c| (low[c], high[c]) = (low[c].min(corner[c]), high[c].max(corner[c])));
        }
        let half = [0, 1].map(|c| 0.5 * (high[c] - low[c]));
        let middle = [0, 1].map(|c| 0.5 * (high[c] + low[c]));
        let axis = usize::from(half[1] > half[0]);
        let at = |part: &LoadedQuad| part.corners.iter().map(|corner| corner[axis]).sum::<f64>();
        let mut members = ClusterMembers::Quads(range.clone());
        if range.len() > MAX_LEAF_QUADS {
            let cut = range.len() / 2;
            self.quads[range.clone()].select_nth_unstable_by(cut, |a, b| at(a).total_cmp(&at(b)));
            let first = self.build_cluster(range.start..range.start + cut);
            members = ClusterMembers::Children([first, self.build_cluster(range.start + cut..range.end)]);
        }
        let forces = self.forces(&members, middle, half);
        if let ClusterMembers::Children(halves) = &members {
            for &half in halves {
                let half = &mut self.clusters[half];
                if matches!(half.members, ClusterMembers::Quads(_)) {
                    half.forces = Vec::new();
                }
            }
        }
        let half_sides = [Point::new(half[0], 0.0, 0.0), Point::new(0.0, half[1], 0.0)];
        let patch = Parallelogram { middle: Point::new(middle[0], middle[1], 0.0), half_sides };
        self.clusters.push(CellCluster { patch, forces, members });
        self.clusters.len() - 1
    }

    /// Equivalent forces F_k at the Gauss points x_k of a rectangle. The forces satisfy Σ p(x_k) F_k = ∫ p t dA, with
    /// the tractions t, for all polynomials p of degree up to 5 in each direction.
    fn forces(&self, members: &ClusterMembers, middle: [f64; 2], half: [f64; 2]) -> Vec<([f64; 2], Point)> {
        let rule = &self.rules[EQUIVALENT_FORCES_PER_SIDE - 1];
        let mut sums = [Point::zeros(); EQUIVALENT_FORCES_PER_SIDE * EQUIVALENT_FORCES_PER_SIDE];
        let mut add = |x: [f64; 2], force: Point| {
            let [u, v] = [0, 1].map(|c| lagrange_basis(rule, (x[c] - middle[c]) / half[c]));
            for (k, sum) in sums.iter_mut().enumerate() {
                *sum += force * (u[k / EQUIVALENT_FORCES_PER_SIDE] * v[k % EQUIVALENT_FORCES_PER_SIDE]);
            }
        };
        match members {
            ClusterMembers::Children(halves) => {
                let all = halves.iter().flat_map(|&half| &self.clusters[half].forces);
                all.for_each(|(x, force)| add(*x, *force));
            }
            ClusterMembers::Quads(range) => {
                for part in &self.quads[range.clone()] {
                    for ((s, ws), (t, wt)) in rule.iter().flat_map(|p| rule.iter().map(move |q| (p, q))) {
                        let (x, area) = part.at(*s, *t);
                        add(x, part.traction * (part.orientation * area * ws * wt));
                    }
                }
            }
        }
        let place = |k: usize| {
            [
                middle[0] + half[0] * rule[k / EQUIVALENT_FORCES_PER_SIDE].0,
                middle[1] + half[1] * rule[k % EQUIVALENT_FORCES_PER_SIDE].0,
            ]
        };
        sums.into_iter().enumerate().map(|(k, sum)| (place(k), sum)).collect()
    }

    /// Displacement and stress at a point below the surface. The displacement is relative to infinity.
    pub fn at(&self, y: &Point) -> PointState {
        let mut sum = DisplacementGradient::default();
        if !self.clusters.is_empty() {
            self.add_group(self.clusters.len() - 1, y, &mut sum);
        }
        PointState { displacement: sum.displacement, stress: self.stiffness.stress(&sum.gradient) }
    }

    fn add_group(&self, number: usize, y: &Point, sum: &mut DisplacementGradient) {
        let group = &self.clusters[number];
        match &group.members {
            ClusterMembers::Children(_)
                if self
                    .quadrature_order
                    .points(&group.patch, y)
                    .is_some_and(|n| 2 * n <= EQUIVALENT_FORCES_PER_SIDE) =>
            {
                group.forces.iter().for_each(|(x, force)| self.add(*x, force, y, sum));
            }
            ClusterMembers::Children(halves) => halves.iter().for_each(|&half| self.add_group(half, y, sum)),
            ClusterMembers::Quads(range) => {
                self.quads[range.clone()].iter().for_each(|part| self.add_part(part, y, MOST_DIVISIONS, sum));
            }
        }
    }

    fn add_part(&self, part: &LoadedQuad, y: &Point, divisions: usize, sum: &mut DisplacementGradient) {
        let (count, patches) = part.enclosing_parallelograms();
        let all = patches.iter().take(count).map(|patch| self.quadrature_order.points(patch, y));
        let n = all.reduce(|a, b| Some(a?.max(b?))).flatten();
        if n.is_none() && divisions > 0 {
            part.halves().iter().for_each(|half| self.add_part(half, y, divisions - 1, sum));
            return;
        }
        // If the Jacobian varies over the quadrilateral, the rule has one more point per direction.
        let n = (n.unwrap_or(MOST_POINTS) + usize::from(count > 1)).min(MOST_POINTS);
        let rule = &self.rules[n - 1];
        for ((s, ws), (t, wt)) in rule.iter().flat_map(|p| rule.iter().map(move |q| (p, q))) {
            let (x, area) = part.at(*s, *t);
            self.add(x, &(part.traction * (part.orientation * area * ws * wt)), y, sum);
        }
    }

    #[inline]
    fn add(&self, x: [f64; 2], force: &Point, y: &Point, sum: &mut DisplacementGradient) {
        let field = self.field.at(&Point::new(y.x - x[0], y.y - x[1], y.z));
        sum.displacement += field.value * force;
        for (k, part) in field.gradient.iter().enumerate() {
            let mut column = sum.gradient.column_mut(k);
            column += part * force;
        }
    }
}

/// Values at `x` of the Lagrange polynomials through the points of a rule.
fn lagrange_basis(rule: &[(f64, f64)], x: f64) -> [f64; EQUIVALENT_FORCES_PER_SIDE] {
    std::array::from_fn(|i| {
        let others = rule.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, (other, _))| (x - other) / (rule[i].0 - other)).product()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::VOIGT;

    fn steel() -> Stiffness {
        Stiffness::isotropic(210e3, 0.3).unwrap()
    }

    fn rectangle([x, y]: [f64; 2], [a, b]: [f64; 2]) -> Vec<[f64; 2]> {
        vec![[x - a, y - b], [x + a, y - b], [x + a, y + b], [x - a, y + b]]
    }

    /// Truth: the stress on the axis of a disc under uniform pressure p, by Boussinesq and Love (Johnson 3.33): σ_z = -p (1 - ζ³),
    /// σ_r = -p ((1 + 2ν)/2 - (1 + ν) ζ + ζ³/2), ζ = z / √(a² + z²).
    #[test]
    fn below_a_disc() {
        let (stiffness, p, nu) = (steel(), 100.0, 0.3);
        let field = PointForceField::new(&stiffness).unwrap();
        let n = 256.0;
        // Circumradius of the polygon that has the area of the unit disc.
        let radius = (2.0 * std::f64::consts::PI / (n * (2.0 * std::f64::consts::PI / n).sin())).sqrt();
        let corner = |k: usize| {
            let angle = 2.0 * std::f64::consts::PI * k as f64 / n;
            [radius * angle.cos(), radius * angle.sin()]
        };
        let cell = (0..n as usize).map(corner).collect();
        let below =
            SubsurfaceField::new(&stiffness, &field, std::iter::once((cell, Point::new(0.0, 0.0, -p))));
        for depth in [0.01, 0.1, 0.5, 1.0, 3.0] {
            let found = below.at(&Point::new(0.0, 0.0, -depth)).stress;
            let zeta = depth / f64::hypot(1.0, depth);
            let normal = -p * (1.0 - zeta.powi(3));
            let radial = -p * (0.5 * (1.0 + 2.0 * nu) - (1.0 + nu) * zeta + 0.5 * zeta.powi(3));
            assert!((found[(2, 2)] - normal).abs() < 1e-3 * p * 0.1, "{depth} {found} {normal}");
            assert!((found[(0, 0)] - radial).abs() < 1e-3 * p * 0.1, "{depth} {found} {radial}");
        }
    }

    /// Truth: the sum over all cells with many Gauss points each. The evaluation points lie below, next to and far from
    /// the cells.
    #[test]
    fn groups_stand_for_their_cells() {
        // Weakly anisotropic fibres need only a small table.
        let (along, n) =
            if std::env::var_os("ORTHOWEAR_THOROUGH").is_some() { (167_230.0, 24) } else { (20_000.0, 16) };
        let fibres = Stiffness::transversely_isotropic(along, 9544.0, 5292.0, 0.272, 0.369).unwrap();
        let turn = nalgebra::Rotation3::from_axis_angle(&Point::y_axis(), -0.5);
        for stiffness in [steel(), fibres.rotated(turn.matrix())] {
            let field = PointForceField::new(&stiffness).unwrap();
            let place = |k: usize| [0.1 * (k / n) as f64, 0.1 * (k % n) as f64];
            let traction = |k: usize| {
                Point::new((k as f64).sin(), 0.3 * (2.0 * k as f64).cos(), -2.0 - (0.1 * k as f64).cos())
            };
            let cells: Vec<_> = (0..n * n).map(|k| (rectangle(place(k), [0.05; 2]), traction(k))).collect();
            let below = SubsurfaceField::new(&stiffness, &field, cells.into_iter());
            let rules = [12, 6].map(gauss_legendre);
            for y in [
                [1.15, 1.15, -0.05],
                [0.31, 1.0, -0.4],
                [1.2, 1.1, -2.0],
                [-1.0, 0.5, -0.3],
                [9.0, 2.0, -5.0],
            ] {
                let y = Point::from(y);
                let mut sum = DisplacementGradient::default();
                for k in 0..n * n {
                    let [x0, y0] = place(k);
                    let far = (x0 - y.x).hypot(y0 - y.y).hypot(y.z) > 0.3;
                    let rule = &rules[usize::from(far)];
                    for (s, ws) in rule {
                        for (t, wt) in rule {
                            let x = [x0 + 0.05 * s, y0 + 0.05 * t];
                            below.add(x, &(traction(k) * (0.0025 * ws * wt)), &y, &mut sum);
                        }
                    }
                }
                let found = below.at(&y);
                let stress = stiffness.stress(&sum.gradient);
                let apart = (found.stress - stress).amax() / stress.amax();
                let moved = (found.displacement - sum.displacement).amax() / sum.displacement.amax();
                assert!(apart < 1e-5 && moved < 1e-5, "{y} {apart:e} {moved:e}");
            }
        }
    }

    /// Truth: under a Hertzian line contact of half-width a and peak pressure p0, the largest shear stress is 0.300283
    /// p0 at the depth 0.786151 a (Johnson 4.2c). Strips of length 2 L with the line load P' cause an error (1 - 2ν) P'
    /// / (π L) of σ_x. With ν = 0.4999, this error is negligible.
    #[test]
    fn below_a_line_contact() {
        let (a, p0) = (0.2348909, 1355.14);
        let stiffness = Stiffness::isotropic(210e3, 0.4999).unwrap();
        let field = PointForceField::new(&stiffness).unwrap();
        let (n, length) = (160, 400.0 * a);
        let h = 2.0 * a / n as f64;
        // Integral of √(1 - x²). Its differences give the mean pressure over a strip.
        let integral = |x: f64| {
            let x = x.clamp(-1.0, 1.0);
            0.5 * (x * (1.0 - x * x).sqrt() + x.asin())
        };
        let strip = |k: usize| {
            let x = -a + h * (k as f64 + 0.5);
            let pressure = p0 * a / h * (integral((x + 0.5 * h) / a) - integral((x - 0.5 * h) / a));
            (rectangle([x, 0.0], [0.5 * h, length]), Point::new(0.0, 0.0, -pressure))
        };
        let below = SubsurfaceField::new(&stiffness, &field, (0..n).map(strip));
        let shear = |depth: f64| {
            let stress = below.at(&Point::new(0.0, 0.0, -depth * a)).stress;
            0.5 * (stress[(0, 0)] - stress[(2, 2)])
        };
        let largest = shear(0.786151);
        assert!((largest / 406.9255 - 1.0).abs() < 2e-4, "{largest}");
        assert!(largest > shear(0.75) && largest > shear(0.82));
        let stress = below.at(&Point::new(0.0, 0.0, -0.786151 * a)).stress;
        assert!((stress[(1, 1)] - 0.4999 * (stress[(0, 0)] + stress[(2, 2)])).abs() < 1e-3 * p0);
        assert!(VOIGT[3..].iter().all(|ij| stress[*ij].abs() < 1e-6 * p0));
    }
}
