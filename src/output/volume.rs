//! Volume of a meshed body as a grid: displacement, stress, failure indices, estimated error.

use crate::body::{BodyField, StressField};
use crate::error::{Error, Result};
use crate::fem::ErrorEstimate;
use crate::material::strength::{StressExposure, von_mises};
use crate::mesh::Mesh;
use crate::output::frame_fields::GLOBAL_COMPONENTS;
use crate::output::vtu::{DataArray, UnstructuredGrid};

/// Components of symmetric tensors in the order of VTK.
const STRESS_COMPONENTS: &[&str] = &["xx", "yy", "zz", "xy", "yz", "xz"];

/// Converts stresses from the Voigt order 11 22 33 23 13 12 to the order of VTK.
pub(crate) fn stress_array<'a>(stress: impl Iterator<Item = &'a [f64; 6]>) -> DataArray {
    let values = stress.flat_map(|s| [s[0], s[1], s[2], s[5], s[3], s[4]]).collect();
    DataArray::tuples("stress", STRESS_COMPONENTS, values)
}

/// Grid of the volume of a meshed body on undeformed points. With stress, a node at a material interface becomes one point per
/// material.
///
/// # Errors
/// If the recovered field does not fit the mesh (kind `Numerical`).
pub fn volume_grid(mesh: &Mesh, field: &BodyField) -> Result<UnstructuredGrid> {
    check_field_size(field, mesh.n_points(), "nodes of the mesh")?;
    let node = |point: usize| field.stress.as_ref().map_or(point, |stress| stress.points.mesh_nodes[point]);
    let n = field.stress.as_ref().map_or(mesh.n_points(), |stress| stress.points.n_points());
    let points = (0..n).map(|point| mesh.points[node(point)]).collect();
    let mut grid = UnstructuredGrid { points, ..Default::default() };
    for (i, cell) in mesh.volume_cells().enumerate() {
        let nodes = match &field.stress {
            Some(stress) => stress.points.points_of_cell(i),
            None => mesh.cell_nodes(cell),
        };
        let kind = mesh.kind(cell);
        grid.push_cell(kind.vtk_code(), kind.vtk_order().iter().map(|&i| nodes[i]));
    }
    let displacement = (0..n).flat_map(|point| field.displacement[node(point)]).collect();
    grid.point_data.push(DataArray::tuples("displacement", GLOBAL_COMPONENTS, displacement));
    if let Some(stress) = &field.stress {
        add_stress(&mut grid, stress);
        stress.error.iter().for_each(|error| add_error(&mut grid, error));
    }
    Ok(grid)
}

fn add_stress(grid: &mut UnstructuredGrid, field: &StressField) {
    let mises: Vec<f64> = field.stress.iter().map(von_mises).collect();
    let largest =
        |cell: usize| field.points.points_of_cell(cell).iter().map(|&p| mises[p]).fold(0.0, f64::max);
    let by_cell = (0..field.points.n_cells()).map(largest).collect();
    grid.point_data.push(stress_array(field.stress.iter()));
    grid.point_data.push(DataArray::scalar("von_mises", mises));
    grid.cell_data.push(DataArray::scalar("von_mises_max", by_cell));
    for exposure in &field.exposures {
        let name = exposure.criterion.name();
        let values = |found: &[StressExposure]| found.iter().map(|e| e.value).collect();
        let modes = |found: &[StressExposure]| found.iter().map(|e| e.mode.code()).collect();
        grid.point_data.push(DataArray::scalar(name, values(&exposure.points)));
        grid.point_data.push(DataArray::u8_scalar(&format!("{name}_mode"), modes(&exposure.points)));
        grid.cell_data.push(DataArray::scalar(&format!("{name}_max"), values(&exposure.cells)));
        grid.cell_data.push(DataArray::u8_scalar(&format!("{name}_max_mode"), modes(&exposure.cells)));
    }
}

fn add_error(grid: &mut UnstructuredGrid, error: &ErrorEstimate) {
    grid.cell_data.push(DataArray::scalar("error", error.cell_errors.clone()));
    grid.cell_data.push(DataArray::scalar("error_density", error.error_density()));
}

/// Checks that `field` has `n` displacements, and that all its stresses belong to nodes below `n`.
pub(crate) fn check_field_size(field: &BodyField, n: usize, what: &str) -> Result<()> {
    let found = field.displacement.len();
    if found != n {
        return Err(Error::numerical(format!(
            "a body has {found} recovered displacements, but there are {n} {what}"
        )));
    }
    let nodes = field.stress.iter().flat_map(|stress| &stress.points.mesh_nodes);
    match nodes.max() {
        Some(&node) if node >= n => Err(Error::numerical(format!(
            "a body has a recovered stress at node {node}, but there are only {n} {what}"
        ))),
        _ => Ok(()),
    }
}
