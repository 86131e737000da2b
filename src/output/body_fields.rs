//! Displaced surface of a body with its fields, as a grid for output.

use rayon::prelude::*;

use crate::body::{BodyField, ElasticBody, Loading};
use crate::error::Result;
use crate::evolution::records::FrameState;
use crate::frame::ContactFrame;
use crate::geometry::{Point, Side};
use crate::material::strength::von_mises;
use crate::mesh::Mesh;
use crate::mesh::faces::{SurfaceFace, outer_faces};
use crate::output::body_peaks::BodyPeaks;
use crate::output::cell_locator::{CellLocator, SurfacePoint};
use crate::output::frame_fields::{FrameMesh, GLOBAL_COMPONENTS, to_global};
use crate::output::surface_stress::SurfaceStress;
use crate::output::volume::{check_field_size, stress_array};
use crate::output::vtu::{DataArray, UnstructuredGrid};

/// Body with field output.
#[derive(Clone, Copy)]
pub struct BodyOutput<'a> {
    /// Side of the body.
    pub side: Side,
    /// Body that recovers the fields.
    pub body: &'a dyn ElasticBody,
    /// Points at which the body recovers its fields.
    pub location: RecoveryLocation<'a>,
    /// Index of the body's first load in [`FrameState::load_amplitudes`].
    pub first_load: usize,
}

impl BodyOutput<'_> {
    /// Contact tractions and load amplitudes of the body in `state`.
    pub fn loading<'s>(&self, state: &'s FrameState) -> Loading<'s> {
        let amplitudes = state.load_amplitudes.get(self.first_load..).unwrap_or(&[]);
        Loading { tractions: &state.tractions, amplitudes }
    }

    /// Stress peaks; `None` unless the body has a mesh and `field` has stress. `tractions` act on body 2: one triple per cell, in
    /// the local axes of the cell.
    pub(crate) fn peaks(
        &self,
        frame: &ContactFrame,
        field: &BodyField,
        tractions: &[[f64; 3]],
    ) -> Option<BodyPeaks> {
        let (RecoveryLocation::MeshNodes { mesh, .. }, Some(stress)) = (self.location, &field.stress) else {
            return None;
        };
        let at_nodes = self.node_tractions(frame, mesh, &outer_faces(mesh), tractions);
        let surface = SurfaceStress::new(mesh, &[], stress, &at_nodes);
        Some(BodyPeaks::new(mesh, stress, &surface))
    }

    /// Traction on this body at every node of the mesh, in global axes. A contact node gets the area-weighted mean
    /// traction of the cells over which it lies. Other nodes get zero. `faces` are the outer faces of the mesh.
    fn node_tractions(
        &self,
        frame: &ContactFrame,
        mesh: &Mesh,
        faces: &[SurfaceFace],
        tractions: &[[f64; 3]],
    ) -> Vec<[f64; 3]> {
        let on_body = self.global_tractions_on_body(frame, tractions);
        let locator = CellLocator::new(frame, self.side);
        let mut at_nodes = vec![[0.0; 3]; mesh.n_points()];
        let RecoveryLocation::MeshNodes { contact_nodes, .. } = self.location else { return at_nodes };
        let outward = contact_normals(mesh, faces, contact_nodes);
        let cells_at = |&node: &usize| {
            locator.cells_at(&SurfacePoint { at: Point::from(mesh.points[node]), outward: outward[node] })
        };
        let cells_of_nodes: Vec<Vec<usize>> = contact_nodes.par_iter().map(cells_at).collect();
        for (&node, cells) in contact_nodes.iter().zip(cells_of_nodes) {
            let area: f64 = cells.iter().map(|&cell| frame.areas[cell]).sum();
            for &cell in &cells {
                for (sum, t) in at_nodes[node].iter_mut().zip(&on_body[cell]) {
                    *sum += t * frame.areas[cell] / area;
                }
            }
        }
        at_nodes
    }

    fn global_tractions_on_body(&self, frame: &ContactFrame, tractions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut on_body = to_global(frame, tractions);
        on_body.iter_mut().flatten().for_each(|t| *t *= self.side.gap_sign());
        on_body
    }
}

/// Points at which a body recovers its fields.
#[derive(Clone, Copy)]
pub enum RecoveryLocation<'a> {
    /// Centres of the frame's cells (half-spaces).
    FrameCells,
    /// Nodes of a mesh.
    MeshNodes {
        /// Mesh.
        mesh: &'a Mesh,
        /// Nodes of the contact surface.
        contact_nodes: &'a [usize],
    },
}

/// Surface of a body in its displaced shape, with displacement and traction in global axes. For a meshed body, recovered stress is
/// added. `tractions` act on body 2: one triple per cell, in the local axes of the cell.
///
/// The displacement excludes the rigid motion of body 2.
///
/// # Errors
/// If the recovered displacements or stresses do not fit the cells or nodes (kind `Numerical`).
pub fn surface_grid(
    output: &BodyOutput<'_>,
    frame: &ContactFrame,
    frame_mesh: &FrameMesh,
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    match output.location {
        RecoveryLocation::FrameCells => {
            frame_surface(frame, frame_mesh, field, &output.global_tractions_on_body(frame, tractions))
        }
        RecoveryLocation::MeshNodes { mesh, .. } => mesh_surface(output, frame, mesh, field, tractions),
    }
}

fn frame_surface(
    frame: &ContactFrame,
    frame_mesh: &FrameMesh,
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    check_field_size(field, frame.n_cells(), "cells of the frame")?;
    let displacement = frame_mesh.average_at_points(&frame.areas, &field.displacement);
    let mut grid = frame_mesh.grid();
    displace(&mut grid.points, &displacement);
    grid.point_data = surface_arrays(&displacement, &frame_mesh.average_at_points(&frame.areas, tractions));
    grid.cell_data = surface_arrays(&field.displacement, tractions);
    Ok(grid)
}

fn surface_arrays(displacement: &[[f64; 3]], traction: &[[f64; 3]]) -> Vec<DataArray> {
    vec![
        DataArray::tuples("displacement", GLOBAL_COMPONENTS, displacement.concat()),
        DataArray::tuples("traction", GLOBAL_COMPONENTS, traction.concat()),
    ]
}

fn mesh_surface(
    output: &BodyOutput<'_>,
    frame: &ContactFrame,
    mesh: &Mesh,
    field: &BodyField,
    tractions: &[[f64; 3]],
) -> Result<UnstructuredGrid> {
    check_field_size(field, mesh.n_points(), "nodes of the mesh")?;
    let faces = outer_faces(mesh);
    let mut grid = UnstructuredGrid::default();
    let points = push_faces(&mut grid, mesh, &faces, field);
    let at_nodes = output.node_tractions(frame, mesh, &faces, tractions);
    let displacement: Vec<[f64; 3]> = points.iter().map(|point| field.displacement[point.node]).collect();
    grid.points = points.iter().map(|point| mesh.points[point.node]).collect();
    displace(&mut grid.points, &displacement);
    let traction: Vec<[f64; 3]> = points.iter().map(|point| at_nodes[point.node]).collect();
    grid.point_data = surface_arrays(&displacement, &traction);
    if let Some(stress) = &field.stress {
        let surface = SurfaceStress::new(mesh, &faces, stress, &at_nodes);
        let (on_surface, tangential): (Vec<[f64; 6]>, Vec<f64>) =
            points.iter().map(|point| surface.at(point.recovery_point)).unzip();
        let mises = on_surface.iter().map(von_mises).collect();
        grid.point_data.push(stress_array(on_surface.iter()));
        grid.point_data.push(DataArray::scalar("von_mises", mises));
        grid.point_data.push(DataArray::scalar("sigma_tangential", tangential));
    }
    Ok(grid)
}

/// Vertex of the surface grid: its mesh node, and the index of the point with its recovered stress. Without stress,
/// both indices are equal.
struct SurfaceVertex {
    node: usize,
    recovery_point: usize,
}

/// Adds the faces to the grid. Returns the vertices of the faces in order of first use. With recovered stress, a node at a material
/// interface has one vertex per material.
fn push_faces(
    grid: &mut UnstructuredGrid,
    mesh: &Mesh,
    faces: &[SurfaceFace],
    field: &BodyField,
) -> Vec<SurfaceVertex> {
    let n = field.stress.as_ref().map_or(mesh.n_points(), |stress| stress.points.n_points());
    let mut index = vec![usize::MAX; n];
    let mut points = Vec::new();
    let solids = mesh.volume_cells().next().is_some();
    for (i, face) in faces.iter().enumerate() {
        let recovered: Vec<usize> = match &field.stress {
            Some(stress) if !solids => stress.points.points_of_cell(i).to_vec(),
            Some(stress) => {
                let local = mesh.kind(face.owner).local_faces()[face.local_face].1;
                let of_cell = stress.points.points_of_cell(mesh.volume_index(face.owner));
                local.iter().map(|&i| of_cell[i]).collect()
            }
            None => face.nodes.clone(),
        };
        for (&node, &point) in face.nodes.iter().zip(&recovered) {
            if index[point] == usize::MAX {
                index[point] = points.len();
                points.push(SurfaceVertex { node, recovery_point: point });
            }
        }
        grid.push_cell(face.kind.vtk_code(), face.kind.vtk_order().iter().map(|&i| index[recovered[i]]));
    }
    points
}

/// Sum of the area vectors of the adjacent contact faces at each mesh node, `[n_points]`. A contact face is a face whose nodes are
/// all in `contact_nodes`.
fn contact_normals(mesh: &Mesh, faces: &[SurfaceFace], contact_nodes: &[usize]) -> Vec<Point> {
    let mut in_contact = vec![false; mesh.n_points()];
    contact_nodes.iter().for_each(|&node| in_contact[node] = true);
    let mut outward = vec![Point::zeros(); mesh.n_points()];
    for face in faces.iter().filter(|face| face.nodes.iter().all(|&node| in_contact[node])) {
        let area = face.area_vector(mesh);
        face.nodes.iter().for_each(|&node| outward[node] += area);
    }
    outward
}

fn displace(points: &mut [[f64; 3]], displacement: &[[f64; 3]]) {
    for (point, u) in points.iter_mut().zip(displacement) {
        point.iter_mut().zip(u).for_each(|(x, u)| *x += u);
    }
}
