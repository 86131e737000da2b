//! Rigid-body modes that supports and foundations leave free. Along these modes the contact must balance the loads of the body.

use nalgebra::{DMatrix, Matrix6, SymmetricEigen, Vector3, Vector6};

use super::dof_map::DofMap;
use super::element_materials::{ElementMaterials, node_graph};
use super::foundation::{RestrainedDirection, restrained_directions};
use super::spec::FeSpec;
use crate::error::{Error, Result};
use crate::geometry::{AXIS_NAMES, format_point};
use crate::linalg::ordering::NodeGraph;

/// An eigenvalue of the Gram matrix of the supports counts as zero up to this fraction of the largest eigenvalue. Supports closer
/// than a millionth of the body size then do not prevent a rotation.
const ZERO_EIGENVALUE_RATIO: f64 = 1e-12;

/// Tolerance for a vector to lie in a subspace.
pub(crate) const SUBSPACE_TOLERANCE: f64 = 1e-9;

/// Rigid-body modes that the supports and foundations of a body leave free.
#[derive(Debug, Clone, PartialEq)]
pub struct RigidBodyModes {
    /// Names of translations and rotations that span the modes, in global axes: "translation x", "rotation about z".
    pub names: Vec<String>,
    centre: Vector3<f64>,
    size: f64,
    /// For each mode: translation of the centre, then the rotation vector times the body size.
    basis: Vec<Vector6<f64>>,
}

impl RigidBodyModes {
    /// Rigid-body modes of the points `part` that the constraints `held` allow. Each constraint is a node and a
    /// direction along which this node has no displacement. As vectors of translation and scaled rotation, the modes
    /// are orthonormal.
    pub(crate) fn unconstrained(
        points: &[[f64; 3]],
        part: &[usize],
        held: impl Iterator<Item = (usize, Vector3<f64>)>,
    ) -> Self {
        let centre = centre(points, part);
        let size = part
            .iter()
            .map(|&node| (Vector3::from(points[node]) - centre).norm())
            .fold(f64::MIN_POSITIVE, f64::max);
        let mut gram = Matrix6::zeros();
        for (node, direction) in held {
            let x = (Vector3::from(points[node]) - centre) / size;
            let row: Vector6<f64> = (0..3).map(|c| motion_row(&x, c) * direction[c]).sum();
            gram += row * row.transpose();
        }
        let eigen = SymmetricEigen::new(gram);
        let limit = ZERO_EIGENVALUE_RATIO * eigen.eigenvalues.amax();
        let basis: Vec<Vector6<f64>> = (0..6)
            .filter(|&i| eigen.eigenvalues[i] <= limit)
            .map(|i| eigen.eigenvectors.column(i).into_owned())
            .collect();
        let rotations: Vec<Vector3<f64>> =
            basis.iter().map(|motion| motion.fixed_view::<3, 1>(3, 0).into_owned()).collect();
        let projector = basis.iter().fold(Matrix6::zeros(), |sum, motion| sum + motion * motion.transpose());
        let translations =
            direction_names(&translations_in(&projector), ["translation", "translation along"]);
        let names =
            translations.into_iter().chain(direction_names(&rotations, ["rotation about"; 2])).collect();
        Self { names, centre, size, basis }
    }

    /// Number of modes.
    pub fn n_modes(&self) -> usize {
        self.basis.len()
    }

    /// Displacement at the point `x` for unit amplitude of mode `j`.
    pub fn displacement(&self, x: &Vector3<f64>, j: usize) -> Vector3<f64> {
        let [shift, turn] = self.translation_and_rotation(j);
        shift + turn.cross(&((x - self.centre) / self.size))
    }

    /// Translation at the point `origin` and rotation (radians) for unit amplitude of mode `j`, global axes.
    pub fn motion_about(&self, origin: &Vector3<f64>, j: usize) -> [Vector3<f64>; 2] {
        [self.displacement(origin, j), self.translation_and_rotation(j)[1] / self.size]
    }

    fn translation_and_rotation(&self, j: usize) -> [Vector3<f64>; 2] {
        [0, 3].map(|row| self.basis[j].fixed_view::<3, 1>(row, 0).into_owned())
    }

    /// Orthonormalises the modes u_i: Σ_k weight(k) u_i(x_k) · u_j(x_k) = δ_ij for the `points` x_k. `None` if the modes are
    /// linearly dependent at these points.
    pub(crate) fn orthonormal(mut self, points: &[[f64; 3]], weight: impl Fn(usize) -> f64) -> Option<Self> {
        let n = self.n_modes();
        let mut gram = DMatrix::<f64>::zeros(n, n);
        for (node, point) in points.iter().enumerate() {
            let share = weight(node);
            if share == 0.0 {
                continue;
            }
            let moved: Vec<Vector3<f64>> = (0..n).map(|j| self.displacement(&(*point).into(), j)).collect();
            for i in 0..n {
                (0..n).for_each(|j| gram[(i, j)] += share * moved[i].dot(&moved[j]));
            }
        }
        let inverse = gram.cholesky()?.l().try_inverse()?;
        let combine = |i: usize| (0..=i).map(|j| self.basis[j] * inverse[(i, j)]).sum::<Vector6<f64>>();
        let basis = (0..n).map(combine).collect();
        self.basis = basis;
        Some(self)
    }
}

/// Rigid-body modes that the supports and foundations of a body leave free, found without assembly. `None` if there are none, or if
/// [`ElementMaterials::new`] fails.
///
/// # Errors
/// If a support or a foundation is not admissible, or supports contradict one another or fix all nodes. If a body of several parts
/// without shared nodes is not fixed in all of them.
pub fn find_rigid_body_modes(spec: &FeSpec) -> Result<Option<RigidBodyModes>> {
    let Ok(regions) = ElementMaterials::new(spec) else { return Ok(None) };
    let dofs = DofMap::new(spec, &regions)?;
    rigid_body_modes_of_dofs(spec, &dofs, &node_graph(&spec.mesh, &regions.cells))
}

/// Rigid-body modes as [`find_rigid_body_modes`], for known `dofs` and the `graph` of the nodes.
pub(super) fn rigid_body_modes_of_dofs(
    spec: &FeSpec,
    dofs: &DofMap,
    graph: &NodeGraph,
) -> Result<Option<RigidBodyModes>> {
    let parts = connected_parts(graph, &dofs.solid_nodes);
    let resistances = restrained_directions(spec)?;
    for part in &parts {
        let free = modes_of_part(&spec.mesh.points, part, dofs, &resistances);
        if free.n_modes() == 0 {
            continue;
        }
        if parts.len() == 1 {
            return Ok(Some(free));
        }
        return Err(Error::input(format!(
            "the body is not fixed: the part with {} nodes around {} (one of {} parts that share no node) can move freely: {}. Fix more components of its supports, or join the parts; only a body of one connected part may be unconstrained",
            part.len(),
            format_point(&free.centre.into()),
            parts.len(),
            free.names.join(", ")
        )));
    }
    Ok(None)
}

fn connected_parts(graph: &NodeGraph, nodes: &[usize]) -> Vec<Vec<usize>> {
    let mut seen = vec![false; graph.n_nodes()];
    let mut parts = Vec::new();
    for &start in nodes {
        if std::mem::replace(&mut seen[start], true) {
            continue;
        }
        let mut part = vec![start];
        let mut next = 0;
        while next < part.len() {
            for &other in graph.neighbours(part[next]) {
                if !std::mem::replace(&mut seen[other], true) {
                    part.push(other);
                }
            }
            next += 1;
        }
        part.sort_unstable();
        parts.push(part);
    }
    parts
}

fn centre(points: &[[f64; 3]], part: &[usize]) -> Vector3<f64> {
    part.iter().fold(Vector3::zeros(), |sum, &node| sum + Vector3::from(points[node])) / part.len() as f64
}

/// Displacement along `component` at `x` (from the centre, in body sizes) due to each of the six unit modes.
fn motion_row(x: &Vector3<f64>, component: usize) -> Vector6<f64> {
    let mut row = Vector6::zeros();
    row[component] = 1.0;
    for axis in 0..3 {
        let mut turn = Vector3::zeros();
        turn[axis] = 1.0;
        row[3 + axis] = turn.cross(x)[component];
    }
    row
}

/// Rigid-body modes of `part` with zero displacement at prescribed dofs and no work against foundations.
fn modes_of_part(
    points: &[[f64; 3]],
    part: &[usize],
    dofs: &DofMap,
    resistances: &[RestrainedDirection],
) -> RigidBodyModes {
    let held = part.iter().flat_map(|&node| (0..3).map(move |c| (node, c)));
    let held = held.filter(|(node, c)| dofs.prescribed(3 * node + c).is_some());
    let held = held.map(|(node, c)| (node, Vector3::ith(c, 1.0)));
    let bedded = resistances.iter().filter(|(node, _)| part.binary_search(node).is_ok());
    RigidBodyModes::unconstrained(points, part, held.chain(bedded.copied()))
}

/// Orthonormal basis of the pure translations in a space of rigid-body motions, given by its orthogonal projector.
pub(crate) fn translations_in(projector: &Matrix6<f64>) -> Vec<Vector3<f64>> {
    let eigen = SymmetricEigen::new(projector.fixed_view::<3, 3>(0, 0).into_owned());
    (0..3)
        .filter(|&i| eigen.eigenvalues[i] > 1.0 - SUBSPACE_TOLERANCE)
        .map(|i| eigen.eigenvectors.column(i).into_owned())
        .collect()
}

/// Names of a basis of the span of `directions`, with coordinate axes where possible. `what` holds the prefixes for coordinate axes
/// and other directions.
fn direction_names(directions: &[Vector3<f64>], what: [&str; 2]) -> Vec<String> {
    let mut rows = DMatrix::from_fn(directions.len(), 3, |i, j| directions[i][j]);
    let mut rank = 0;
    for column in 0..3 {
        let pivot =
            (rank..rows.nrows()).max_by(|&a, &b| rows[(a, column)].abs().total_cmp(&rows[(b, column)].abs()));
        let Some(pivot) = pivot.filter(|&i| rows[(i, column)].abs() > 1e-6) else { continue };
        rows.swap_rows(rank, pivot);
        let scaled = rows.row(rank) / rows[(rank, column)];
        rows.set_row(rank, &scaled);
        for i in (0..rows.nrows()).filter(|&i| i != rank) {
            let reduced = rows.row(i) - &scaled * rows[(i, column)];
            rows.set_row(i, &reduced);
        }
        rank += 1;
    }
    (0..rank).map(|i| axis_name(&Vector3::new(rows[(i, 0)], rows[(i, 1)], rows[(i, 2)]), what)).collect()
}

fn axis_name(axis: &Vector3<f64>, what: [&str; 2]) -> String {
    // Rounding is set to zero, so that no minus sign is printed.
    let axis = axis.normalize().map(|c| if c.abs() < 1e-9 { 0.0 } else { c });
    match (0..3).find(|&c| axis[c].abs() > 1.0 - 1e-9) {
        Some(c) => format!("{} {}", what[0], AXIS_NAMES[c]),
        None => format!("{} the direction ({:.3}, {:.3}, {:.3})", what[1], axis.x, axis.y, axis.z),
    }
}
