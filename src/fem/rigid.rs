//! Rigid motions that the supports leave free: a body that can move without deforming has a singular stiffness.

use nalgebra::{DMatrix, Matrix6, SymmetricEigen, Vector3, Vector6};

use super::dofs::{COMPONENTS, Dofs};
use super::regions::Regions;
use super::spec::FeSpec;
use crate::error::{Error, Result};
use crate::linalg::ordering::NodeGraph;

/// Eigenvalues of the supports' Gram matrix below this share of its largest are zero: supports that are nearer to
/// one another than a millionth of the body do not hold a rotation.
const ZERO: f64 = 1e-12;

/// Refuses supports that contradict one another or leave a body free to move, before anything is assembled.
///
/// # Errors
/// Names the groups, or the free motions of the first part that has some. Cells that are no finite elements here
/// are left to [`super::FeModel::new`].
pub fn check_supports(spec: &FeSpec) -> Result<()> {
    let Ok(regions) = Regions::new(spec) else { return Ok(()) };
    let dofs = Dofs::new(spec, &regions)?;
    let cells = regions.cells.iter().map(|&cell| spec.mesh.cell_nodes(cell));
    refuse_free_motions(spec, &dofs, &NodeGraph::from_elements(spec.mesh.n_points(), cells))
}

/// Refuses a body of which some connected part can move rigidly.
///
/// # Errors
/// Names the free motions of the first such part.
pub(super) fn refuse_free_motions(spec: &FeSpec, dofs: &Dofs, graph: &NodeGraph) -> Result<()> {
    let parts = connected_parts(graph, &dofs.nodes);
    for part in &parts {
        let free = free_motions(&spec.mesh.points, part, dofs);
        if !free.is_empty() {
            let which = if parts.len() == 1 {
                "it".to_string()
            } else {
                format!(
                    "its part of {} nodes around {:.4?} (of {} parts that share no node)",
                    part.len(),
                    <[f64; 3]>::from(centre(&spec.mesh.points, part)),
                    parts.len()
                )
            };
            return Err(Error::input(format!(
                "the body is not held: {which} can move without force by {}; fix more components of its supports",
                free.join(", ")
            )));
        }
    }
    Ok(())
}

/// Nodes of each connected part, ascending.
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

/// The displacement along `component` at `x` (from the centre, in body sizes) by each of the six unit motions.
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

/// Names of the rigid motions of `part` that move no prescribed dof.
fn free_motions(points: &[[f64; 3]], part: &[usize], dofs: &Dofs) -> Vec<String> {
    let centre = centre(points, part);
    let size = part
        .iter()
        .map(|&node| (Vector3::from(points[node]) - centre).norm())
        .fold(f64::MIN_POSITIVE, f64::max);
    let mut gram = Matrix6::zeros();
    for &node in part {
        let x = (Vector3::from(points[node]) - centre) / size;
        for component in (0..3).filter(|&c| dofs.prescribed(3 * node + c).is_some()) {
            let row = motion_row(&x, component);
            gram += row * row.transpose();
        }
    }
    let eigen = SymmetricEigen::new(gram);
    let limit = ZERO * eigen.eigenvalues.amax();
    let rotations: Vec<Vector3<f64>> = (0..6)
        .filter(|&i| eigen.eigenvalues[i] <= limit)
        .map(|i| eigen.eigenvectors.fixed_view::<3, 1>(3, i).into_owned())
        .collect();
    // Supports act along the axes: a translation is free exactly where no dof of its component is prescribed.
    let translations =
        (0..3).filter(|&c| gram[(c, c)] == 0.0).map(|c| format!("translation {}", COMPONENTS[c]));
    translations.chain(rotation_names(&rotations)).collect()
}

/// Names the space spanned by `rotations`: along the axes where it holds them, else by direction.
fn rotation_names(rotations: &[Vector3<f64>]) -> Vec<String> {
    let mut rows = DMatrix::from_fn(rotations.len(), 3, |i, j| rotations[i][j]);
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
    (0..rank).map(|i| axis_name(&Vector3::new(rows[(i, 0)], rows[(i, 1)], rows[(i, 2)]))).collect()
}

fn axis_name(axis: &Vector3<f64>) -> String {
    // Rounding of a zero must not show as a sign.
    let axis = axis.normalize().map(|c| if c.abs() < 1e-9 { 0.0 } else { c });
    match (0..3).find(|&c| axis[c].abs() > 1.0 - 1e-9) {
        Some(c) => format!("rotation about {}", COMPONENTS[c]),
        None => format!("rotation about the direction ({:.3}, {:.3}, {:.3})", axis.x, axis.y, axis.z),
    }
}
