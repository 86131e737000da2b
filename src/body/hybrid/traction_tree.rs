//! Displacement and its gradient in a half-space under tractions on a grid. A tree of rectangles accelerates the sums
//! over the cells.
//!
//! Rectangles of cells are halved down to single cells. For points that are far away relative to the longer side of a
//! rectangle, point forces at a few Chebyshev nodes replace its tractions. For points inside the half-space near a
//! cell, the cell is subdivided.
//!
//! For points on the surface, nearby cells are integrated exactly. The difference of these integrals between two points
//! one cell apart gives the tangential derivatives. This equals the derivative under tractions that vary linearly from
//! cell to cell. The normal derivative follows from the traction.

use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector3};

use super::chebyshev::Chebyshev;
use super::field::HalfSpaceField;
use crate::bem::green_tensor::GreenTensor;
use crate::bem::half_space::PointForceField;
use crate::geometry::Point;

const NODES_PER_SIDE: usize = 5;

static UNIT_NODES: LazyLock<Chebyshev> = LazyLock::new(|| Chebyshev::new(NODES_PER_SIDE, 1.0));

/// Largest ratio of a rectangle's longer side to its distance from a point at which point forces replace the tractions.
const MAX_SIZE_TO_DISTANCE: f64 = 0.7;

const MAX_CELL_SUBDIVISIONS: usize = 6;

struct CellCluster {
    middle: [f64; 2],
    half: [f64; 2],
    /// Point forces at the Chebyshev nodes that replace the tractions of the cluster, axes of the patch, N.
    forces: Vec<Vector3<f64>>,
    children: Vec<CellCluster>,
}

/// Tractions on the cells of a grid, stored as a tree of cell clusters, axes of the patch.
pub(super) struct TractionTree {
    root: Option<CellCluster>,
    /// Sides of a cell, mm.
    spacing: [f64; 2],
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LocalDisplacement {
    pub displacement: Vector3<f64>,
    /// Displacement gradient. Column k is the derivative along axis k.
    pub gradient: Matrix3<f64>,
}

struct Layout<'a> {
    cells: [usize; 2],
    spacing: [f64; 2],
    /// Traction of the cell (ix, iy), MPa.
    traction: &'a dyn Fn(usize, usize) -> Vector3<f64>,
}

impl TractionTree {
    /// Builds the tree of the tractions `traction(ix, iy)` (MPa) on `cells` along x and y. The cells have the sides
    /// `spacing` (mm), and the grid is centred on the patch.
    pub fn new(
        cells: [usize; 2],
        spacing: [f64; 2],
        traction: &dyn Fn(usize, usize) -> Vector3<f64>,
    ) -> Self {
        let layout = Layout { cells, spacing, traction };
        let root = layout.block([[0, cells[0]], [0, cells[1]]]);
        Self { root, spacing }
    }

    /// Displacement and gradient at the point `x` of the half-space, axes of the patch. Between the surface and a depth
    /// of half the shorter cell side, the gradient is interpolated linearly.
    pub fn at(&self, x: &Point, field: &HalfSpaceField) -> LocalDisplacement {
        let mut sum = LocalDisplacement::default();
        let Some(root) = &self.root else { return sum };
        if x.z == 0.0 {
            root.on_surface(x, field, &mut |part| match part {
                SurfaceSource::PointForce(point, force) => sum.displacement += point.value * force,
                SurfaceSource::UniformCell(cell) => {
                    let sides = cell.half.map(|half| 2.0 * half);
                    let from = [x.x - cell.middle[0], x.y - cell.middle[1]];
                    sum.displacement += field.patch_integrals.rectangle(sides, from) * cell.traction();
                }
            });
        } else {
            root.for_each_force(x, &field.point_force, &mut |point, force| {
                sum.displacement += point.value * force
            });
        }
        let shallow = 0.5 * self.spacing[0].min(self.spacing[1]);
        let share = (-x.z / shallow).min(1.0);
        if share > 0.0 {
            let inside = Point::new(x.x, x.y, x.z.min(-shallow));
            root.for_each_force(&inside, &field.point_force, &mut |point, force| {
                (0..3).for_each(|k| {
                    let mut column = sum.gradient.column_mut(k);
                    column += point.gradient[k] * force * share;
                });
            });
        }
        if share < 1.0 {
            sum.gradient += self.surface_gradient(root, &Point::new(x.x, x.y, 0.0), field) * (1.0 - share);
        }
        sum
    }

    fn surface_gradient(&self, root: &CellCluster, x: &Point, field: &HalfSpaceField) -> Matrix3<f64> {
        let mut along = [Vector3::zeros(); 2];
        let mut traction = Vector3::zeros();
        root.on_surface(x, field, &mut |part| match part {
            SurfaceSource::PointForce(point, force) => {
                (0..2).for_each(|axis| along[axis] += point.gradient[axis] * force);
            }
            SurfaceSource::UniformCell(cell) => {
                let sides = cell.half.map(|half| 2.0 * half);
                let from = [x.x - cell.middle[0], x.y - cell.middle[1]];
                let own = cell.traction();
                for axis in 0..2 {
                    let [ahead, behind] = [0.5, -0.5].map(|share| {
                        let mut at = from;
                        at[axis] += share * self.spacing[axis];
                        field.patch_integrals.rectangle(sides, at)
                    });
                    along[axis] += (ahead - behind) * own / self.spacing[axis];
                }
                let shares = [0, 1].map(|axis| (1.0 - (from[axis] / self.spacing[axis]).abs()).max(0.0));
                traction += own * (shares[0] * shares[1]);
            }
        });
        field.gradient_from_traction(along, &traction)
    }
}

enum SurfaceSource<'a> {
    PointForce(&'a GreenTensor, &'a Vector3<f64>),
    UniformCell(&'a CellCluster),
}

impl Layout<'_> {
    fn block(&self, range: [[usize; 2]; 2]) -> Option<CellCluster> {
        let size = [0, 1].map(|axis| range[axis][1] - range[axis][0]);
        let edge =
            |axis: usize, line: usize| (line as f64 - 0.5 * self.cells[axis] as f64) * self.spacing[axis];
        let middle = [0, 1].map(|axis| 0.5 * (edge(axis, range[axis][0]) + edge(axis, range[axis][1])));
        let half = [0, 1].map(|axis| 0.5 * size[axis] as f64 * self.spacing[axis]);
        if size == [1, 1] {
            let traction = (self.traction)(range[0][0], range[1][0]);
            return (traction != Vector3::zeros()).then(|| CellCluster::of_cell(middle, half, &traction));
        }
        let axis = usize::from(half[1] > half[0] && size[1] > 1 || size[0] == 1);
        let split = range[axis][0] + size[axis] / 2;
        let (mut first, mut second) = (range, range);
        first[axis][1] = split;
        second[axis][0] = split;
        let children: Vec<CellCluster> =
            [first, second].into_iter().filter_map(|range| self.block(range)).collect();
        (!children.is_empty()).then(|| CellCluster::of_children(middle, half, children))
    }
}

impl CellCluster {
    fn nodes(half: [f64; 2]) -> [Chebyshev; 2] {
        half.map(|half| Chebyshev::new(NODES_PER_SIDE, half))
    }

    fn of_cell(middle: [f64; 2], half: [f64; 2], traction: &Vector3<f64>) -> Self {
        let nodes = Self::nodes(half);
        let means = [0, 1].map(|axis| nodes[axis].means(1, 2.0 * half[axis], -half[axis], false));
        let area = 4.0 * half[0] * half[1];
        let force =
            |k: usize| traction * (area * means[0][k / NODES_PER_SIDE] * means[1][k % NODES_PER_SIDE]);
        Self {
            middle,
            half,
            forces: (0..NODES_PER_SIDE * NODES_PER_SIDE).map(force).collect(),
            children: Vec::new(),
        }
    }

    fn of_children(middle: [f64; 2], half: [f64; 2], children: Vec<Self>) -> Self {
        let nodes = Self::nodes(half);
        let mut forces = vec![Vector3::zeros(); NODES_PER_SIDE * NODES_PER_SIDE];
        for child in &children {
            let own = Self::nodes(child.half);
            let values = [0, 1].map(|axis| {
                let at = own[axis].nodes().iter().map(|x| x + child.middle[axis] - middle[axis]);
                at.map(|x| {
                    let mut values = [0.0; NODES_PER_SIDE];
                    nodes[axis].lagrange(x, &mut values);
                    values
                })
                .collect::<Vec<_>>()
            });
            for (k, force) in child.forces.iter().enumerate() {
                let (x, y) = (&values[0][k / NODES_PER_SIDE], &values[1][k % NODES_PER_SIDE]);
                for (l, sum) in forces.iter_mut().enumerate() {
                    *sum += force * (x[l / NODES_PER_SIDE] * y[l % NODES_PER_SIDE]);
                }
            }
        }
        Self { middle, half, forces, children }
    }

    /// Calls `with(G, force)` for each point force that replaces the tractions of the cluster for an evaluation at `x`.
    /// G is the Green's tensor from the position of the force to `x`.
    fn for_each_force(
        &self,
        x: &Point,
        field: &PointForceField,
        with: &mut dyn FnMut(&GreenTensor, &Vector3<f64>),
    ) {
        if self.is_far(x) {
            self.for_each_own_force(x, field, with);
            return;
        }
        match self.children.as_slice() {
            [] => self.for_each_subcell_force(x, field, MAX_CELL_SUBDIVISIONS, with),
            children => children.iter().for_each(|child| child.for_each_force(x, field, with)),
        }
    }

    /// Calls `with` for each source of the cluster for an evaluation at the surface point `x`. Far clusters are sources
    /// of point forces. Nearby cells are sources with a uniform traction.
    fn on_surface(&self, x: &Point, field: &HalfSpaceField, with: &mut dyn FnMut(SurfaceSource)) {
        if self.is_far(x) {
            self.for_each_own_force(x, &field.point_force, &mut |point, force| {
                with(SurfaceSource::PointForce(point, force))
            });
        } else if self.children.is_empty() {
            with(SurfaceSource::UniformCell(self));
        } else {
            self.children.iter().for_each(|child| child.on_surface(x, field, with));
        }
    }

    fn traction(&self) -> Vector3<f64> {
        self.forces.iter().sum::<Vector3<f64>>() / (4.0 * self.half[0] * self.half[1])
    }

    fn is_far(&self, x: &Point) -> bool {
        let beyond = |axis: usize| ((x[axis] - self.middle[axis]).abs() - self.half[axis]).max(0.0);
        let distance = (beyond(0).powi(2) + beyond(1).powi(2) + x.z * x.z).sqrt();
        2.0 * self.half[0].max(self.half[1]) <= MAX_SIZE_TO_DISTANCE * distance
    }

    fn for_each_own_force(
        &self,
        x: &Point,
        field: &PointForceField,
        with: &mut dyn FnMut(&GreenTensor, &Vector3<f64>),
    ) {
        let unit = UNIT_NODES.nodes();
        for (k, force) in self.forces.iter().enumerate() {
            let (u, v) = (self.half[0] * unit[k / NODES_PER_SIDE], self.half[1] * unit[k % NODES_PER_SIDE]);
            let from = Point::new(x.x - self.middle[0] - u, x.y - self.middle[1] - v, x.z);
            if from != Point::zeros() {
                with(&field.at(&from), force);
            }
        }
    }

    fn for_each_subcell_force(
        &self,
        x: &Point,
        field: &PointForceField,
        divisions: usize,
        with: &mut dyn FnMut(&GreenTensor, &Vector3<f64>),
    ) {
        if divisions == 0 || self.is_far(x) {
            self.for_each_own_force(x, field, with);
            return;
        }
        let half = self.half.map(|half| 0.5 * half);
        let forces: Vec<Vector3<f64>> = self.forces.iter().map(|force| force * 0.25).collect();
        for sign in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
            let middle = [0, 1].map(|axis| self.middle[axis] + sign[axis] * half[axis]);
            let quarter = Self { middle, half, forces: forces.clone(), children: Vec::new() };
            quarter.for_each_subcell_force(x, field, divisions - 1, with);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bem::half_space::{PatchIntegrator, Side, SurfaceGreen};
    use crate::material::Stiffness;

    fn half_space(stiffness: &Stiffness) -> HalfSpaceField {
        let green = SurfaceGreen::new(stiffness, Side::Lower).unwrap();
        HalfSpaceField::new(stiffness, PointForceField::new(stiffness).unwrap(), &green).unwrap()
    }

    fn stress(stiffness: &Stiffness, gradient: &Matrix3<f64>) -> [f64; 6] {
        (stiffness.voigt() * crate::material::strain_of_gradient(gradient)).into()
    }

    /// Truth: the surface stress under Hertzian pressure on an isotropic half-space (Johnson, Contact Mechanics, eqs.
    /// 3.42 and 3.43). At the edge of the contact, the error is proportional to the square root of the cell size.
    #[test]
    fn surface_under_hertz_pressure() {
        let nu = 0.3;
        let stiffness = Stiffness::isotropic(210e3, nu).unwrap();
        let field = half_space(&stiffness);
        let exact = |r: f64| -> [f64; 3] {
            let ring = (1.0 - 2.0 * nu) / 3.0;
            if r > 1.0 {
                return [ring / (r * r), -ring / (r * r), 0.0];
            }
            let p = (1.0 - r * r).sqrt();
            let inner = if r == 0.0 { 1.5 } else { (1.0 - p.powi(3)) / (r * r) };
            [ring * inner - p, -ring * inner - 2.0 * nu * p, -p]
        };
        let exact_at = |r: f64| {
            let [radial, hoop, normal] = exact(r);
            if r == 0.0 { [-0.5 - nu, -0.5 - nu, normal] } else { [radial, hoop, normal] }
        };
        let errors = |n: usize| -> Vec<f64> {
            let h = 4.0 / n as f64;
            let at = |i: usize| (i as f64 + 0.5) * h - 2.0;
            let pressure = |ix: usize, iy: usize| {
                let r = at(ix).hypot(at(iy));
                Vector3::new(0.0, 0.0, -(1.0 - r * r).max(0.0).sqrt())
            };
            let distribution = TractionTree::new([n; 2], [h; 2], &pressure);
            let found = |r: f64, angle: f64| {
                let at = distribution.at(&Point::new(r * angle.cos(), r * angle.sin(), 0.0), &field);
                let [xx, yy, zz, _, _, xy] = stress(&stiffness, &at.gradient);
                let (cos, sin) = (angle.cos(), angle.sin());
                let radial = xx * cos * cos + yy * sin * sin + 2.0 * xy * cos * sin;
                let wanted = exact_at(r);
                let off = [radial - wanted[0], xx + yy - radial - wanted[1], zz - wanted[2]];
                off.map(f64::abs).into_iter().fold(0.0, f64::max)
            };
            [0.0, 0.37, 0.8, 1.0, 1.3].iter().map(|&r| found(r, 0.0).max(found(r, 0.5))).collect()
        };
        let (coarse, fine) = (errors(24), errors(96));
        for (r, (coarse, fine)) in coarse.iter().zip(&fine).enumerate() {
            let (most, ratio) = if r == 3 { (0.12, 1.8) } else { (4e-3, 2.0) };
            assert!(*fine < most && coarse / fine > ratio, "{r}: {coarse} {fine}");
        }
    }

    /// Truth: the surface gradient equals the extrapolation of gradients at small depths. The surface stresses xz, yz
    /// and zz equal the prescribed tractions.
    #[test]
    fn surface_of_an_anisotropic_body() {
        let turn = nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), 0.5);
        let ply = Stiffness::transversely_isotropic(20_000.0, 9544.0, 5292.0, 0.272, 0.369).unwrap();
        let stiffness = ply.rotated(turn.matrix());
        let field = half_space(&stiffness);
        let n = 64;
        let h = 2.0 / n as f64;
        let bump = |x: f64| (0.5 * std::f64::consts::PI * x).cos().powi(2);
        let at = |i: usize| (i as f64 + 0.5) * h - 1.0;
        let traction = |x: f64, y: f64| Vector3::new(0.4, -0.3, -1.0) * (bump(x) * bump(y));
        let distribution = TractionTree::new([n; 2], [h; 2], &|ix, iy| traction(at(ix), at(iy)));
        for [x, y] in [[0.1, 0.2], [-0.4, 0.6], [1.2, 0.3]] {
            let gradient = |depth: f64| distribution.at(&Point::new(x, y, -depth), &field).gradient;
            let on_surface = gradient(0.0);
            let below = [1.0, 2.0, 3.0].map(|k| gradient(k * h));
            let limit = below[0] * 3.0 - below[1] * 3.0 + below[2];
            let apart = (on_surface - limit).norm() / on_surface.norm();
            assert!(apart < 1e-2, "{apart}");
            let t = if x.abs() < 1.0 { traction(x, y) } else { Vector3::zeros() };
            let [_, _, zz, yz, xz, _] = stress(&stiffness, &on_surface);
            assert!((Vector3::new(xz, yz, zz) - t).norm() < 2e-3, "{zz} {t}");
        }
    }

    /// Truth: the displacement on the surface equals the sum of exact integrals over the cells. At depth, displacement
    /// and gradient equal sums over many point forces in each cell.
    #[test]
    fn sums_of_point_forces() {
        let stiffness = Stiffness::isotropic(210e3, 0.3).unwrap();
        let field = PointForceField::new(&stiffness).unwrap();
        let traction = |ix: usize, iy: usize| Vector3::new(ix as f64 - 3.0, 10.0, 5.0 * iy as f64);
        let (cells, spacing) = ([8, 6], [0.3, 0.2]);
        let distribution = TractionTree::new(cells, spacing, &traction);
        let whole = half_space(&stiffness);
        let fine = |x: &Point, n: usize| -> (Vector3<f64>, Vector3<f64>) {
            let mut sums = (Vector3::zeros(), Vector3::zeros());
            for (ix, iy) in (0..cells[0] * n).flat_map(|ix| (0..cells[1] * n).map(move |iy| (ix, iy))) {
                let at = |i: usize, axis: usize| {
                    (i as f64 + 0.5) * spacing[axis] / n as f64 - 0.5 * cells[axis] as f64 * spacing[axis]
                };
                let from = Point::new(x.x - at(ix, 0), x.y - at(iy, 1), x.z);
                let force = traction(ix / n, iy / n) * (spacing[0] * spacing[1] / (n * n) as f64);
                let found = field.at(&from);
                sums.0 += found.value * force;
                sums.1 += found.gradient[2] * force;
            }
            sums
        };
        for x in [[0.1, 0.2, -0.6], [1.5, -0.4, -0.2], [4.0, 3.0, -5.0]].map(Point::from) {
            let (displacement, along_z) = fine(&x, 24);
            let found = distribution.at(&x, &whole);
            assert!((found.displacement - displacement).norm() < 3e-4 * displacement.norm(), "{x}");
            assert!((found.gradient.column(2) - along_z).norm() < 2e-3 * found.gradient.norm(), "{x}");
        }
        let green = SurfaceGreen::new(&stiffness, Side::Lower).unwrap();
        let integrals = PatchIntegrator::new(&green);
        let x = Point::new(0.12, -0.07, 0.0);
        let mut wanted = Vector3::zeros();
        for (ix, iy) in (0..8).flat_map(|ix| (0..6).map(move |iy| (ix, iy))) {
            let middle = [(ix as f64 - 3.5) * spacing[0], (iy as f64 - 2.5) * spacing[1]];
            wanted += integrals.rectangle(spacing, [x.x - middle[0], x.y - middle[1]]) * traction(ix, iy);
        }
        let found = distribution.at(&x, &whole).displacement;
        assert!((found - wanted).norm() < 1e-4 * wanted.norm(), "{found} {wanted}");
    }
}
