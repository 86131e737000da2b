//! Fields of a body as grids for output: its displaced surface, and its volume with stresses.

use crate::body::{BodyField, ElasticBody};
use crate::error::{Error, Result};
use crate::frame::ContactFrame;
use crate::geometry::{Point, Side};
use crate::mesh::Mesh;
use crate::mesh::faces::outer_faces;
use crate::results::frame_fields::{FrameMesh, GLOBAL, to_global};
use crate::results::locate::Locator;
use crate::results::vtu::{DataArray, UnstructuredGrid};

/// Components of a stress, in VTK's order of symmetric tensors.
const STRESS: &[&str] = &["xx", "yy", "zz", "xy", "yz", "xz"];

/// A body whose fields are written.
#[derive(Clone, Copy)]
pub struct BodyOutput<'a> {
    /// Which body it is.
    pub side: Side,
    /// Gives its fields.
    pub body: &'a dyn ElasticBody,
    /// The points of its fields.
    pub shape: BodyShape<'a>,
}

/// Where the fields that a body recovers live.
#[derive(Clone, Copy)]
pub enum BodyShape<'a> {
    /// At the centres of the frame's cells (half-spaces).
    Frame,
    /// At the nodes of a mesh.
    Mesh {
        /// The mesh.
        mesh: &'a Mesh,
        /// Nodes of its contact surface.
        contact_nodes: &'a [usize],
    },
}

/// The displaced surface of a body with displacement and the traction on it, in global axes; `tractions` on
/// body 2, one triple per cell of the frame in its local axes.
///
/// The rigid motion of body 2 is not part of its displacement.
///
/// # Errors
/// Numerical, if the recovered field does not fit the shape.
pub fn surface_grid(
    output: &BodyOutput<'_>,
    frame: (&ContactFrame, &FrameMesh),
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    let mut on_body = to_global(frame.0, tractions);
    on_body.iter_mut().flatten().for_each(|t| *t *= output.side.gap_sign());
    match output.shape {
        BodyShape::Frame => frame_surface(frame, field, &on_body),
        BodyShape::Mesh { mesh, contact_nodes } => {
            mesh_surface(frame.0, mesh, contact_nodes, field, &on_body)
        }
    }
}

fn frame_surface(
    (frame, cells): (&ContactFrame, &FrameMesh),
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    fits(field, frame.n_cells(), "cells of the frame")?;
    let displacement = cells.at_points(&frame.areas, &field.displacement);
    let mut grid = cells.grid();
    displace(&mut grid.points, &displacement);
    grid.point_data = vec![
        DataArray::tuples("displacement", GLOBAL, displacement.concat()),
        DataArray::tuples("traction", GLOBAL, cells.at_points(&frame.areas, tractions).concat()),
    ];
    grid.cell_data = vec![
        DataArray::tuples("displacement", GLOBAL, field.displacement.concat()),
        DataArray::tuples("traction", GLOBAL, tractions.concat()),
    ];
    Ok(grid)
}

fn mesh_surface(
    frame: &ContactFrame,
    mesh: &Mesh,
    contact_nodes: &[usize],
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    fits(field, mesh.n_points(), "nodes of the mesh")?;
    let mut grid = UnstructuredGrid::default();
    let mut nodes = Vec::new();
    let mut index = vec![usize::MAX; mesh.n_points()];
    for face in outer_faces(mesh) {
        for &node in &face.nodes {
            if index[node] == usize::MAX {
                index[node] = nodes.len();
                nodes.push(node);
            }
        }
        grid.push_cell(face.kind.vtk_code(), face.kind.vtk_order().iter().map(|&i| index[face.nodes[i]]));
    }
    let at_nodes = node_tractions(frame, mesh, contact_nodes, tractions);
    let displacement: Vec<[f64; 3]> = nodes.iter().map(|&node| field.displacement[node]).collect();
    grid.points = nodes.iter().map(|&node| mesh.points[node]).collect();
    displace(&mut grid.points, &displacement);
    grid.point_data = vec![
        DataArray::tuples("displacement", GLOBAL, displacement.concat()),
        DataArray::tuples("traction", GLOBAL, nodes.iter().flat_map(|&node| at_nodes[node]).collect()),
    ];
    Ok(grid)
}

/// Traction at every node of a mesh: the mean over the frame's cells it lies in, 0 off the contact surface.
fn node_tractions(
    frame: &ContactFrame,
    mesh: &Mesh,
    contact_nodes: &[usize],
    tractions: &[[f64; 3]],
) -> Vec<[f64; 3]> {
    let locator = Locator::new(frame);
    let mut at_nodes = vec![[0.0; 3]; mesh.n_points()];
    for &node in contact_nodes {
        let cells = locator.cells_at(&Point::from(mesh.points[node]));
        let area: f64 = cells.iter().map(|&cell| frame.areas[cell]).sum();
        for &cell in &cells {
            for (sum, t) in at_nodes[node].iter_mut().zip(&tractions[cell]) {
                *sum += t * frame.areas[cell] / area;
            }
        }
    }
    at_nodes
}

/// A meshed body's volume with displacement and, where recovered, stress at its nodes; undisplaced points.
///
/// # Errors
/// Numerical, if the recovered field does not fit the mesh.
pub fn volume_grid(mesh: &Mesh, field: &BodyField) -> Result<UnstructuredGrid> {
    fits(field, mesh.n_points(), "nodes of the mesh")?;
    let mut grid = UnstructuredGrid { points: mesh.points.clone(), ..Default::default() };
    for cell in mesh.volume_cells() {
        let (kind, nodes) = (mesh.kind(cell), mesh.cell_nodes(cell));
        grid.push_cell(kind.vtk_code(), kind.vtk_order().iter().map(|&i| nodes[i]));
    }
    grid.point_data.push(DataArray::tuples("displacement", GLOBAL, field.displacement.concat()));
    if !field.stress.is_empty() {
        // From Voigt order 11 22 33 23 13 12.
        let stress = field.stress.iter().flat_map(|s| [s[0], s[1], s[2], s[5], s[3], s[4]]).collect();
        grid.point_data.push(DataArray::tuples("stress", STRESS, stress));
    }
    Ok(grid)
}

fn displace(points: &mut [[f64; 3]], displacement: &[[f64; 3]]) {
    for (point, u) in points.iter_mut().zip(displacement) {
        point.iter_mut().zip(u).for_each(|(x, u)| *x += u);
    }
}

fn fits(field: &BodyField, n: usize, what: &str) -> Result<()> {
    let (found, stresses) = (field.displacement.len(), field.stress.len());
    if found != n || (stresses != 0 && stresses != n) {
        return Err(Error::numerical(format!(
            "a body recovered {found} displacements and {stresses} stresses for {n} {what}"
        )));
    }
    Ok(())
}
