//! Nodal loads and work of elements whose stiffness differs from the stiffness of the half-space.

use nalgebra::{Matrix3, Matrix6, Vector6};
use rayon::prelude::*;

use super::boundary_terms::BoundaryTerms;
use super::forces::PatchForces;
use super::patch::ContactPatch;
use crate::cancel;
use crate::element::ElementKind;
use crate::error::Result;
use crate::fem::FeModel;
use crate::geometry::Point;
use crate::linalg::dense_matrix::DenseMatrix;
use crate::material::{strain_of_gradient, voigt_to_tensor};
use crate::quadrature::gauss_legendre;

const ELEMENTS_PER_BATCH: usize = 64;

/// Numbers of Gauss points along an edge of an element part. The second number applies to short edges of hexahedral
/// parts, the first to all other edges.
const GAUSS_POINTS: [usize; 2] = [3, 2];

/// Length below which an edge of a hexahedral part counts as short, divided by the largest admissible size of a part.
const COARSE_RULE_EDGE: f64 = 0.5;

const POINTS_PER_BATCH: usize = 64;

/// Largest ratio of the size of an element part to its distance from the forces.
const MAX_SIZE_TO_DISTANCE: f64 = 0.5;

const MAX_SUBDIVISIONS: usize = 8;

/// Largest difference of two stiffnesses that count as equal, divided by the largest entry.
const STIFFNESS_TOLERANCE: f64 = 1e-9;

pub(super) fn is_same_stiffness(a: &Matrix6<f64>, b: &Matrix6<f64>) -> bool {
    (a - b).amax() <= STIFFNESS_TOLERANCE * b.amax()
}

/// Maps a point of the unit cube to the reference element. For other elements than hexahedra, faces of the cube
/// collapse to edges or points. Returns the image and the Jacobian determinant.
fn collapsed_cube(kind: ElementKind, [u, v, w]: [f64; 3]) -> ([f64; 3], f64) {
    match kind.n_corners() {
        4 => {
            let (p, q) = (1.0 - u, 1.0 - v);
            ([u, v * p, w * p * q], p * p * q)
        }
        5 => {
            let side = 1.0 - w;
            ([(2.0 * u - 1.0) * side, (2.0 * v - 1.0) * side, w], 4.0 * side * side)
        }
        6 => ([u, v * (1.0 - u), 2.0 * w - 1.0], 2.0 * (1.0 - u)),
        _ => ([2.0 * u - 1.0, 2.0 * v - 1.0, 2.0 * w - 1.0], 8.0),
    }
}

struct Inclusion<'a> {
    kind: ElementKind,
    nodes: &'a [usize],
    points: Vec<Point>,
    /// C - C0: stiffness of the element minus stiffness of the half-space, global axes, MPa.
    stiffness_difference: Matrix6<f64>,
}

struct Rule<'a> {
    distance: &'a dyn Fn(&Point) -> f64,
    /// Gauss points and weights on [0, 1], one rule for each number in [`GAUSS_POINTS`].
    lines: [Vec<(f64, f64)>; 2],
}

struct VolumePoint {
    at: Point,
    volume: f64,
    /// Derivatives of the shape functions, global axes.
    gradients: Vec<Point>,
}

impl Inclusion<'_> {
    fn position(&self, xi: [f64; 3]) -> Point {
        self.kind.shape_values(xi).iter().zip(&self.points).map(|(value, x)| x * *value).sum()
    }

    /// Quadrature points of the element for a field whose length scale at a point x is `distance(x)`.
    fn quadrature(&self, distance: &dyn Fn(&Point) -> f64) -> Vec<VolumePoint> {
        let line =
            |n| gauss_legendre(n).into_iter().map(|(x, weight)| (0.5 * (1.0 + x), 0.5 * weight)).collect();
        let mut points = Vec::new();
        let rule = Rule { distance, lines: GAUSS_POINTS.map(line) };
        self.divide([0.0; 3], [1.0; 3], &rule, MAX_SUBDIVISIONS, &mut points);
        points
    }

    /// Adds the quadrature points in a box of the unit cube to `points`. The box has the corner `first` and the given
    /// `sides`. A subdivision halves only edges that are longer than half the longest edge.
    fn divide(
        &self,
        first: [f64; 3],
        sides: [f64; 3],
        rule: &Rule,
        divisions: usize,
        points: &mut Vec<VolumePoint>,
    ) {
        let at = |share: [f64; 3]| [0, 1, 2].map(|axis| first[axis] + share[axis] * sides[axis]);
        let position = |share: [f64; 3]| self.position(collapsed_cube(self.kind, at(share)).0);
        let corner = |k: usize| position([0, 1, 2].map(|axis| (k >> axis & 1) as f64));
        let edges = [0, 1, 2].map(|axis| {
            let ends = (0..8).filter(|k| k >> axis & 1 == 0).map(|k| (corner(k), corner(k | 1 << axis)));
            ends.map(|(a, b)| (b - a).norm()).fold(0.0, f64::max)
        });
        let size = edges.iter().map(|edge| edge * edge).sum::<f64>().sqrt();
        let reach = MAX_SIZE_TO_DISTANCE * (rule.distance)(&position([0.5; 3]));
        if size > reach && divisions > 0 {
            let longest = edges.into_iter().fold(0.0, f64::max);
            let halved = edges.map(|edge| edge > 0.5 * longest);
            let half = [0, 1, 2].map(|axis| if halved[axis] { 0.5 * sides[axis] } else { sides[axis] });
            for k in (0..8).filter(|k| (0..3).all(|axis| halved[axis] || k >> axis & 1 == 0)) {
                let first = [0, 1, 2].map(|axis| first[axis] + (k >> axis & 1) as f64 * half[axis]);
                self.divide(first, half, rule, divisions - 1, points);
            }
            return;
        }
        // Other elements than hexahedra always use the finer rule, because the Jacobian determinant of the collapsed
        // cube varies.
        let lines = edges.map(|edge| {
            &rule.lines[usize::from(self.kind.n_corners() == 8 && edge < COARSE_RULE_EDGE * reach)]
        });
        for &(u, by_u) in lines[0] {
            for &(v, by_v) in lines[1] {
                for &(w, by_w) in lines[2] {
                    let (xi, stretch) = collapsed_cube(self.kind, at([u, v, w]));
                    let volume = sides.iter().product::<f64>() * stretch;
                    points.extend(self.point(xi, by_u * by_v * by_w * volume));
                }
            }
        }
    }

    fn point(&self, xi: [f64; 3], weight: f64) -> Option<VolumePoint> {
        let gradients = self.kind.shape_gradients(xi);
        let mut jacobian = Matrix3::zeros();
        for (x, g) in self.points.iter().zip(&gradients) {
            jacobian += x * Point::from(*g).transpose();
        }
        let inverse = jacobian.try_inverse()?.transpose();
        Some(VolumePoint {
            at: self.position(xi),
            volume: weight * jacobian.determinant(),
            gradients: gradients.iter().map(|g| inverse * Point::from(*g)).collect(),
        })
    }
}

struct InclusionContribution {
    /// Nodal loads of one element, `[n_columns][3 n_nodes]`.
    loads: Vec<f64>,
    work: DenseMatrix,
}

/// Adds loads and work of all elements whose stiffness C differs from the stiffness C0 under the patch. The loads are
/// -∫ ∇N : (C - C0) : ∇u dV, the work is -∫ ∇u : (C - C0) : ∇u dV. N are the shape functions, u the half-space
/// displacements.
pub(super) fn add_inclusions(model: &FeModel, forces: &PatchForces, terms: &mut BoundaryTerms) -> Result<()> {
    let own = *forces.stiffness.rotated(&forces.patch.axes.0).voigt();
    for batch in elements(model, &own).chunks(ELEMENTS_PER_BATCH) {
        cancel::check()?;
        let shares: Vec<Result<InclusionContribution>> =
            batch.par_iter().map(|element| InclusionContribution::new(element, forces)).collect();
        for (element, share) in batch.iter().zip(shares) {
            let share = share?;
            terms.add_share(element.nodes, &share.loads, &share.work);
        }
    }
    Ok(())
}

/// Number of quadrature points in elements whose stiffness differs from `own` (global axes). The forces are assumed to
/// be spread over `patch`.
pub(super) fn n_points(model: &FeModel, own: &Matrix6<f64>, patch: &ContactPatch) -> usize {
    let distance = |x: &Point| patch.distance(&patch.local(x));
    elements(model, own).par_iter().map(|element| element.quadrature(&distance).len()).sum()
}

fn elements<'a>(model: &'a FeModel, own: &Matrix6<f64>) -> Vec<Inclusion<'a>> {
    let (mesh, regions) = (model.mesh(), model.regions());
    let other = |&i: &usize| !is_same_stiffness(&regions.stiffness(i), own);
    let element = |i: usize| {
        let cell = regions.cells()[i];
        let nodes = mesh.cell_nodes(cell);
        let points = nodes.iter().map(|&node| mesh.points[node].into()).collect();
        Inclusion { kind: mesh.kind(cell), nodes, points, stiffness_difference: regions.stiffness(i) - own }
    };
    (0..regions.n_elements()).filter(other).map(element).collect()
}

impl InclusionContribution {
    fn new(element: &Inclusion, forces: &PatchForces) -> Result<Self> {
        let points = element.quadrature(&|x| forces.distance(x));
        let (n, n_nodes) = (forces.n_columns(), element.nodes.len());
        let mut loads = vec![0.0; n * 3 * n_nodes];
        let mut work = DenseMatrix::zeros(n, n)?;
        for points in points.chunks(POINTS_PER_BATCH) {
            let mut strains = DenseMatrix::zeros(6 * points.len(), n)?;
            let mut stresses = DenseMatrix::zeros(6 * points.len(), n)?;
            for (p, point) in points.iter().enumerate() {
                for (j, strain) in strains_at(forces, &point.at) {
                    let stress = element.stiffness_difference * strain * point.volume;
                    let rows = j * 6 * points.len() + 6 * p;
                    strains.values_mut()[rows..rows + 6].copy_from_slice(strain.as_slice());
                    stresses.values_mut()[rows..rows + 6].copy_from_slice(stress.as_slice());
                    let tensor = voigt_to_tensor(&stress.into());
                    let load = &mut loads[j * 3 * n_nodes..][..3 * n_nodes];
                    for (load, gradient) in load.chunks_exact_mut(3).zip(&point.gradients) {
                        let force = tensor * gradient;
                        (0..3).for_each(|c| load[c] -= force[c]);
                    }
                }
            }
            work.add_transposed_product(-1.0, &strains, &stresses);
        }
        Ok(Self { loads, work })
    }
}

/// Strain at `x` due to each unit force, global axes. Each item contains the column of the force and the strain.
fn strains_at(forces: &PatchForces, x: &Point) -> impl Iterator<Item = (usize, Vector6<f64>)> {
    let axes = forces.patch.axes.0;
    let local = forces.patch.local(x);
    (0..forces.points.len()).flat_map(move |i| {
        let field = forces.field.at(&forces.vector_from(i, &local));
        (0..3).map(move |column| {
            let own = Matrix3::from_fn(|row, k| field.gradient[k][(row, column)]);
            (3 * i + column, strain_of_gradient(&(axes * own * axes.transpose())))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the weights of the quadrature points sum to the volume of the element. The mean gradient of an
    /// interpolated linear field is the gradient of the linear field.
    #[test]
    fn volumes_of_all_kinds() {
        let volumes = [
            (ElementKind::Hex8, 8.0),
            (ElementKind::Hex27, 8.0),
            (ElementKind::Tet4, 1.0 / 6.0),
            (ElementKind::Tet10, 1.0 / 6.0),
            (ElementKind::Wedge6, 1.0),
            (ElementKind::Wedge15, 1.0),
            (ElementKind::Pyramid5, 4.0 / 3.0),
            (ElementKind::Pyramid13, 4.0 / 3.0),
        ];
        let stretch = Matrix3::new(2.0, 0.3, 0.0, 0.0, 1.5, 0.2, 0.1, 0.0, 0.7);
        for (kind, volume) in volumes {
            let points: Vec<Point> =
                kind.reference_nodes().into_iter().map(|xi| stretch * Point::from(xi)).collect();
            let volume = volume * stretch.determinant();
            let element = Inclusion { kind, nodes: &[], points, stiffness_difference: Matrix6::zeros() };
            let corner = element.points[0];
            for scale in [200.0, 1.6] {
                let found = element.quadrature(&|x| scale * (x - corner).norm());
                let sum: f64 = found.iter().map(|point| point.volume).sum();
                assert!((sum / volume - 1.0).abs() < 1e-10, "{}: {sum} {volume}", kind.name());
                let linear = |x: &Point| 3.0 * x.x - x.y + 0.5 * x.z;
                let slope = found.iter().map(|point| {
                    let nodes = element.points.iter().zip(&point.gradients);
                    nodes.map(|(x, g)| g * linear(x)).sum::<Point>() * point.volume
                });
                let slope: Point = slope.sum::<Point>() / volume;
                assert!((slope - Point::new(3.0, -1.0, 0.5)).norm() < 1e-9, "{}: {slope}", kind.name());
            }
        }
    }
}
