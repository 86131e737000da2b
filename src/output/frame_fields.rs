//! Fields on the contact frame as a grid, and their values at the corners of the cells.

use std::collections::HashMap;

use nalgebra::Vector3;

use crate::error::{Error, Result};
use crate::evolution::records::FrameState;
use crate::frame::ContactFrame;
use crate::geometry::Point;
use crate::output::surface_properties::SurfaceProperties;
use crate::output::vtu::{DataArray, UnstructuredGrid};

/// Components in the local axes of a cell.
pub(crate) const FRAME_COMPONENTS: &[&str] = &["x", "y", "n"];
/// Components in global axes.
pub(crate) const GLOBAL_COMPONENTS: &[&str] = &["x", "y", "z"];

/// Cells of the frame as a mesh with shared corners.
#[derive(Debug, Clone)]
pub struct FrameMesh {
    /// Distinct corners.
    pub points: Vec<[f64; 3]>,
    /// Corners of each cell, indices into `points`.
    pub cells: Vec<Vec<usize>>,
}

impl FrameMesh {
    /// Creates the mesh of the frame's cells. Corners that agree to 1e-9 × the diagonal of the bounding box become one
    /// point.
    pub fn new(frame: &ContactFrame) -> Self {
        let quantum = 1e-9 * extent(frame).max(f64::MIN_POSITIVE);
        let mut known: HashMap<[i64; 3], usize> = HashMap::new();
        let mut points = Vec::new();
        let mut index = |corner: &Point| {
            let key = [0, 1, 2].map(|axis| (corner[axis] / quantum).round() as i64);
            *known.entry(key).or_insert_with(|| {
                points.push([corner.x, corner.y, corner.z]);
                points.len() - 1
            })
        };
        let cells = frame.all_corners().map(|corners| corners.iter().map(&mut index).collect()).collect();
        Self { points, cells }
    }

    /// Grid of the cells without fields: triangles, quadrilaterals, or polygons for more corners.
    pub fn grid(&self) -> UnstructuredGrid {
        let mut grid = UnstructuredGrid { points: self.points.clone(), ..Default::default() };
        for corners in &self.cells {
            let code = match corners.len() {
                3 => 5,
                4 => 9,
                _ => 7,
            };
            grid.push_cell(code, corners.iter().copied());
        }
        grid
    }

    /// Area-weighted mean of the values of the cells that meet at each point.
    pub fn average_at_points(&self, areas: &[f64], cell_values: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut sums = vec![(0.0, Vector3::zeros()); self.points.len()];
        for ((corners, &area), value) in self.cells.iter().zip(areas).zip(cell_values) {
            for &corner in corners {
                sums[corner].0 += area;
                sums[corner].1 += Vector3::from(*value) * area;
            }
        }
        sums.into_iter().map(|(area, sum)| if area > 0.0 { (sum / area).into() } else { [0.0; 3] }).collect()
    }
}

fn extent(frame: &ContactFrame) -> f64 {
    let mut low = Point::repeat(f64::INFINITY);
    let mut high = Point::repeat(f64::NEG_INFINITY);
    for corners in frame.all_corners() {
        corners.iter().for_each(|corner| (low, high) = (low.inf(corner), high.sup(corner)));
    }
    let diagonal = (high - low).norm();
    if diagonal.is_finite() { diagonal } else { 0.0 }
}

/// Grid of the frame with the cell fields of `state` (docs/results.md).
///
/// # Errors
/// If traction, gap or slip has the wrong length (kind `Numerical`).
pub fn frame_grid(
    frame: &ContactFrame,
    frame_mesh: &FrameMesh,
    surface: &SurfaceProperties,
    state: &FrameState,
) -> Result<UnstructuredGrid> {
    let n = frame.n_cells();
    let mut grid = frame_mesh.grid();
    let traction = planes_to_triples(&state.tractions, n, "traction")?;
    let [worn1, worn2] = surface.wear_depth_by_body(&state.wear_depth);
    grid.cell_data = vec![
        DataArray::tuples("gap", FRAME_COMPONENTS, planes_to_triples(&state.gap, n, "gap")?.concat()),
        DataArray::tuples("traction", FRAME_COMPONENTS, traction.concat()),
        DataArray::scalar("pressure", traction.iter().map(|t| t[2]).collect()),
        DataArray::tuples(
            "slip",
            FRAME_COMPONENTS,
            planes_to_triples(&with_zero_normal(&state.slip, n), n, "slip")?.concat(),
        ),
        DataArray::u8_scalar("status", state.status.clone()),
        DataArray::scalar("wear_depth", state.wear_depth.clone()),
        DataArray::scalar("wear_depth_body1", worn1),
        DataArray::scalar("wear_depth_body2", worn2),
        DataArray::scalar("wear_depth_error", state.wear_depth_error.clone()),
        DataArray::scalar("area", frame.areas.clone()),
    ];
    if !axes_are_global(frame) {
        grid.cell_data.push(DataArray::tuples(
            "traction_global",
            GLOBAL_COMPONENTS,
            to_global(frame, &traction).concat(),
        ));
    }
    Ok(grid)
}

fn axes_are_global(frame: &ContactFrame) -> bool {
    frame.triads.distinct().iter().all(|triad| triad.0 == nalgebra::Matrix3::identity())
}

/// Adds a zero normal component to slip with two components, so that viewers can draw slip as a vector.
fn with_zero_normal(slip: &[f64], n: usize) -> Vec<f64> {
    if slip.len() == 2 * n { [slip, &vec![0.0; n]].concat() } else { slip.to_vec() }
}

/// Converts values `[3, N]` into one triple per cell.
pub(crate) fn planes_to_triples(planes: &[f64], n: usize, name: &str) -> Result<Vec<[f64; 3]>> {
    if planes.len() != 3 * n {
        return Err(Error::numerical(format!(
            "the field `{name}` has {} numbers instead of {}",
            planes.len(),
            3 * n
        )));
    }
    Ok((0..n).map(|i| [planes[i], planes[n + i], planes[2 * n + i]]).collect())
}

/// Converts vectors from the local axes of each cell to global axes.
pub(crate) fn to_global(frame: &ContactFrame, local: &[[f64; 3]]) -> Vec<[f64; 3]> {
    frame.triads.iter().zip(local).map(|(triad, v)| triad.to_global(&Point::from(*v)).into()).collect()
}
