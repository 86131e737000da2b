//! Moves the nodes of a mesh after its contact surface has receded.
//!
//! Each displacement component along the frame axes solves Laplace's equation in the body. Contact nodes have
//! prescribed displacements. Two constraints apply to the other nodes. A node on an outer face or a material interface
//! moves along an axis only if the axis lies in the face. The body thus keeps its shape. A node of a support moves
//! along an axis only if the axis is normal to all prescribed components.

use rayon::prelude::*;

use super::element_materials::{ElementMaterials, node_graph};
use super::element_rules::{ElementVisitor, RuleSet, SolidElement, visit_element};
use super::integration_points::{ElementDefect, map_point};
use super::spec::FeSpec;
use crate::error::{Context, Error, Result};
use crate::geometry::{Point, Triad, format_point};
use crate::linalg::cholesky::{SymbolicCholesky, SymmetricSolver};
use crate::linalg::memory::MemoryLimit;
use crate::linalg::ordering::{NodeGraph, nested_dissection};
use crate::linalg::sparse::SymmetricSparse;
use crate::mesh::faces::{SolidFace, SurfaceFace, solid_faces};
use crate::mesh::quality;
use crate::mesh::{CellRef, Mesh};

/// Sine of the largest angle between a face and a direction at which the direction counts as lying in the face.
const FACE_ALIGNMENT_TOLERANCE: f64 = 1e-6;

const NEGLIGIBLE_MOTION_RATIO: f64 = 1e-12;

/// Smallest admissible projection of a moved edge on its old direction, relative to its old length.
const MIN_EDGE_RATIO: f64 = 0.1;

const ELEMENTS_PER_BATCH: usize = 512;

/// The mesh of `spec` after its contact nodes have moved by `motion`, `[n_points]`, with components along `axes`.
/// `motion` is `None` at nodes that are not contact nodes. `contact` lists the faces of the contact surface.
///
/// # Errors
/// If an element would be inverted, or an edge would become too short. If the Jacobian at a node would be zero or
/// negative in more elements than before. If a material or group of `spec` is not admissible, or memory does not
/// suffice.
pub(crate) fn move_mesh(
    spec: &FeSpec,
    contact: &[SurfaceFace],
    motion: &[Option<Point>],
    axes: &Triad,
    memory: &MemoryLimit,
) -> Result<Mesh> {
    let regions = ElementMaterials::new(spec)?;
    let graph = node_graph(&spec.mesh, &regions.cells);
    let mut points = spec.mesh.points.clone();
    let faces = solid_faces(&spec.mesh);
    let along = |component: usize| {
        motion_constraints(spec, &regions, &faces, contact, &axes.0.column(component).into())
    };
    let all_held = [along(0)?, along(1)?, along(2)?];
    let motion = project_onto_planes(motion, &all_held);
    let farthest = motion.iter().flatten().map(Point::norm).fold(0.0, f64::max);
    for (component, held) in all_held.iter().enumerate() {
        if motion.iter().flatten().all(|by| by[component].abs() <= NEGLIGIBLE_MOTION_RATIO * farthest) {
            continue;
        }
        let axis: Point = axes.0.column(component).into();
        let given: Vec<Option<f64>> = motion
            .iter()
            .zip(held)
            .map(|(by, held)| by.map(|by| by[component]).or((*held != MotionConstraint::Free).then_some(0.0)))
            .collect();
        let by = solve_laplace(&spec.mesh, &regions.cells, &graph, &given, memory)?;
        for (point, by) in points.iter_mut().zip(by) {
            (0..3).for_each(|k| point[k] += by * axis[k]);
        }
    }
    let mesh = Mesh { points, ..(*spec.mesh).clone() };
    check_moved_mesh(&spec.mesh, &mesh)?;
    Ok(mesh)
}

/// Projects the motion of contact nodes into adjoining plane faces normal to an axis, such as a symmetry plane, and keeps its
/// magnitude. A motion normal to such a plane becomes zero.
fn project_onto_planes(motion: &[Option<Point>], held: &[Vec<MotionConstraint>; 3]) -> Vec<Option<Point>> {
    let mut motion = motion.to_vec();
    for (node, by) in motion.iter_mut().enumerate() {
        let Some(by) = by else { continue };
        let far = by.norm();
        for (component, held) in held.iter().enumerate() {
            if held[node] == MotionConstraint::WithinPlane {
                by[component] = 0.0;
            }
        }
        let along = by.norm();
        if along > FACE_ALIGNMENT_TOLERANCE * far {
            *by *= far / along;
        } else {
            // The remaining motion is rounding, without a meaningful direction.
            *by = Point::zeros();
        }
    }
    motion
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum MotionConstraint {
    Free,
    /// No motion along the axis, unless the node is a contact node.
    WithinFace,
    /// No motion along the axis: the node lies on a plane outer face normal to the axis.
    WithinPlane,
}

/// Constraints on the motion of nodes along `axis`, `[n_points]`. A support constrains its nodes unless `axis` is normal to the
/// prescribed components. An outer face outside `contact`, or a material interface, constrains its nodes unless `axis` lies in the
/// face.
fn motion_constraints(
    spec: &FeSpec,
    regions: &ElementMaterials,
    faces: &[SolidFace],
    contact: &[SurfaceFace],
    axis: &Point,
) -> Result<Vec<MotionConstraint>> {
    let mesh = &spec.mesh;
    let mut held = vec![MotionConstraint::Free; mesh.n_points()];
    for support in &spec.supports {
        if (0..3).any(|c| support.components[c] && axis[c].abs() > FACE_ALIGNMENT_TOLERANCE) {
            mesh.group_nodes(&support.group)?
                .into_iter()
                .for_each(|node| held[node] = MotionConstraint::WithinFace);
        }
    }
    let mut is_contact: Vec<(CellRef, usize)> = contact.iter().map(SurfaceFace::id).collect();
    is_contact.sort_unstable();
    for face in faces {
        let inside = face.neighbour.is_some_and(|other| regions.is_continuous(face.solid, other));
        let cell = regions.cells[face.solid];
        if inside || is_contact.binary_search(&(cell, face.local_face)).is_ok() {
            continue;
        }
        let nodes = mesh.cell_nodes(cell);
        let (kind, local) = mesh.kind(cell).local_faces()[face.local_face];
        let corner = |i: usize| Point::from(mesh.points[nodes[local[i]]]);
        let area = match kind.n_corners() {
            4 => (corner(2) - corner(0)).cross(&(corner(3) - corner(1))),
            _ => (corner(1) - corner(0)).cross(&(corner(2) - corner(0))),
        };
        let across = area.dot(axis).abs();
        if across > FACE_ALIGNMENT_TOLERANCE * area.norm() {
            let plane =
                face.neighbour.is_none() && area.norm() - across < FACE_ALIGNMENT_TOLERANCE * area.norm();
            let by = if plane { MotionConstraint::WithinPlane } else { MotionConstraint::WithinFace };
            local.iter().for_each(|&i| held[nodes[i]] = held[nodes[i]].max(by));
        }
    }
    Ok(held)
}

/// Nodal values of the harmonic function with the values `given`, `[n_points]`. Points on no solid without a given value get 0.
fn solve_laplace(
    mesh: &Mesh,
    cells: &[CellRef],
    graph: &NodeGraph,
    given: &[Option<f64>],
    memory: &MemoryLimit,
) -> Result<Vec<f64>> {
    let mut row = vec![usize::MAX; mesh.n_points()];
    for &node in cells.iter().flat_map(|&cell| mesh.cell_nodes(cell)).filter(|&&node| given[node].is_none()) {
        row[node] = 0;
    }
    let nodes: Vec<usize> = (0..mesh.n_points()).filter(|&node| row[node] == 0).collect();
    nodes.iter().enumerate().for_each(|(i, &node)| row[node] = i);
    let mut values: Vec<f64> = given.iter().map(|value| value.unwrap_or(0.0)).collect();
    if nodes.is_empty() {
        return Ok(values);
    }
    let mut matrix = pattern(graph, &nodes, &row);
    let mut rhs = vec![0.0; nodes.len()];
    let rules = RuleSet::new();
    for batch in cells.chunks(ELEMENTS_PER_BATCH) {
        let of =
            |&cell: &CellRef| visit_element(mesh.kind(cell), LaplaceKernel { mesh, cell, rules: &rules });
        let elements: Vec<_> = batch.par_iter().map(of).collect();
        for (&cell, element) in batch.iter().zip(elements) {
            let (element, own) = (element.map_err(|_| degenerate(mesh, cell))?, mesh.cell_nodes(cell));
            for (k, value) in element.into_iter().enumerate() {
                let [a, b] = [k / own.len(), k % own.len()];
                let [i, j] = [a, b].map(|corner| row[own[corner]]);
                if i == usize::MAX || j != usize::MAX && i < j {
                    continue;
                }
                if j == usize::MAX {
                    rhs[i] -= value * values[own[b]];
                } else {
                    matrix.add(i, j, value);
                }
            }
        }
    }
    let order: Vec<usize> =
        nested_dissection(graph, &nodes, &[])?.into_iter().map(|node| row[node]).collect();
    let symbolic = SymbolicCholesky::new(&matrix, &order, 0)?;
    let what = format!("moving {} nodes of a mesh", nodes.len());
    memory.ensure_available(symbolic.memory_bytes() as u128, &what, "use a coarser mesh")?;
    let factor = symbolic
        .factorise(&matrix, |row| format!("the node at {}", format_point(&mesh.points[nodes[row]])))?;
    factor.solve_in_place(&mut rhs, 1)?;
    nodes.iter().zip(rhs).for_each(|(&node, value)| values[node] = value);
    Ok(values)
}

fn pattern(graph: &NodeGraph, nodes: &[usize], row: &[usize]) -> SymmetricSparse {
    let (mut offsets, mut rows) = (vec![0], Vec::new());
    for &node in nodes {
        rows.push(row[node]);
        let start = rows.len();
        let later = graph.neighbours(node).iter().map(|&other| row[other]);
        rows.extend(later.filter(|&other| other != usize::MAX && other > row[node]));
        rows[start..].sort_unstable();
        offsets.push(rows.len());
    }
    SymmetricSparse::from_pattern(offsets, rows)
}

/// Computes ∫ ∇N_a · ∇N_b dV of an element, `[n_nodes, n_nodes]`.
struct LaplaceKernel<'a> {
    mesh: &'a Mesh,
    cell: CellRef,
    rules: &'a RuleSet,
}

impl ElementVisitor for LaplaceKernel<'_> {
    type Output = std::result::Result<Vec<f64>, ElementDefect>;

    fn visit_element<S: SolidElement<N>, const N: usize>(self) -> Self::Output {
        let own = self.mesh.cell_nodes(self.cell);
        let nodes: [[f64; 3]; N] = std::array::from_fn(|a| self.mesh.points[own[a]]);
        let mut element = vec![0.0; N * N];
        for sample in &S::rules(self.rules).stiffness {
            let at = map_point(&nodes, sample)?;
            for (a, g) in at.gradients.iter().enumerate() {
                for (b, h) in at.gradients.iter().enumerate() {
                    element[a * N + b] += at.volume * (g[0] * h[0] + g[1] * h[1] + g[2] * h[2]);
                }
            }
        }
        Ok(element)
    }
}

fn degenerate(mesh: &Mesh, cell: CellRef) -> Error {
    Error::input(format!("element {} of {} is degenerate", mesh.tag(cell), mesh.source))
}

fn check_moved_mesh(before: &Mesh, after: &Mesh) -> Result<()> {
    let folded = |mesh: &Mesh| Ok(quality::check(mesh)?.folded_at_nodes);
    let is = folded(after).context(|| "after moving its surface".to_owned())?;
    if is > 0 && is > folded(before)? {
        return Err(Error::input(format!("{is} elements would be folded at their nodes")));
    }
    for cell in before.volume_cells() {
        let nodes = before.cell_nodes(cell);
        for (kind, local) in before.kind(cell).local_faces() {
            let n = kind.n_corners();
            for i in 0..n {
                let ends = [nodes[local[i]], nodes[local[(i + 1) % n]]];
                let edge = |mesh: &Mesh| {
                    let [a, b] = ends.map(|node| Point::from(mesh.points[node]));
                    b - a
                };
                let (old, new) = (edge(before), edge(after));
                if new.dot(&old) < MIN_EDGE_RATIO * old.norm_squared() {
                    return Err(Error::input(format!(
                        "an edge of element {} would lose more than nine tenths of its length",
                        before.tag(cell)
                    )));
                }
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::structured::{BlockElements, GradedBlock};

    /// Truth: a contact node on a plane moves within the plane by the prescribed distance. A motion that is normal to
    /// the plane up to rounding becomes zero.
    #[test]
    fn motions_normal_to_a_plane_end_there() {
        let mut held = [0; 3].map(|_| vec![MotionConstraint::Free; 2]);
        held[2] = vec![MotionConstraint::WithinPlane; 2];
        let motion = [Some(Point::new(1e-19, -2e-19, 1e-3)), Some(Point::new(3e-4, 0.0, 4e-4))];
        let moved = project_onto_planes(&motion, &held);
        assert_eq!(moved[0], Some(Point::zeros()));
        assert!((moved[1].unwrap() - Point::new(5e-4, 0.0, 0.0)).norm() < 1e-18, "{moved:?}");
    }

    /// Truth: a linear function is harmonic and lies in the finite-element space.
    #[test]
    fn linear_functions_are_found() {
        for solids in [BlockElements::Hex8, BlockElements::Tet4] {
            let block =
                GradedBlock { solids, distortion: 0.08, ..GradedBlock::uniform([1.0, 1.5], 2.0, [4, 4, 4]) };
            let mesh = block.mesh().unwrap();
            let linear = |x: &[f64; 3]| 0.3 + x[0] - 2.0 * x[1] + 0.7 * x[2];
            let mut given = vec![None; mesh.n_points()];
            for face in crate::mesh::faces::outer_faces(&mesh) {
                face.nodes.iter().for_each(|&node| given[node] = Some(linear(&mesh.points[node])));
            }
            assert!(given.contains(&None));
            let cells: Vec<CellRef> = mesh.volume_cells().collect();
            let found =
                solve_laplace(&mesh, &cells, &node_graph(&mesh, &cells), &given, &MemoryLimit::of_machine())
                    .unwrap();
            for (value, point) in found.iter().zip(&mesh.points) {
                assert!((value - linear(point)).abs() < 1e-12, "{value} at {point:?}");
            }
        }
    }
}
