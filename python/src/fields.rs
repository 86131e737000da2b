//! Fields on the frame as NumPy arrays.

use numpy::{PyArray1, PyArrayMethods};
use orthowear::evolution::records::FrameState;
use orthowear::frame::ContactFrame;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Frame and fields of an entry.
#[derive(Clone)]
pub struct Fields {
    pub frame: ContactFrame,
    pub state: FrameState,
}

/// Array (N, k) of values that are stored component by component, `[k, N]`.
pub fn by_cell<'py>(py: Python<'py>, planes: &[f64], k: usize) -> PyResult<Bound<'py, PyAny>> {
    let n = planes.len() / k;
    let values = (0..n).flat_map(|i| (0..k).map(move |c| planes[c * n + i])).collect();
    Ok(PyArray1::<f64>::from_vec(py, values).reshape([n, k])?.into_any())
}

fn rows<'py, const K: usize>(
    py: Python<'py>,
    rows: impl Iterator<Item = [f64; K]>,
) -> PyResult<Bound<'py, PyAny>> {
    let values: Vec<f64> = rows.flatten().collect();
    let n = values.len() / K;
    Ok(PyArray1::<f64>::from_vec(py, values).reshape([n, K])?.into_any())
}

/// Positions, areas, axes and grid indices of the cells of a frame.
pub fn cells<'py>(py: Python<'py>, frame: &ContactFrame) -> PyResult<Bound<'py, PyDict>> {
    let found = PyDict::new(py);
    let n = frame.n_cells();
    found.set_item("points", rows(py, frame.centers.iter().map(|x| [x.x, x.y, x.z]))?)?;
    found.set_item("xy", rows(py, (0..n).map(|cell| frame.plane_coordinates(cell)))?)?;
    found.set_item("areas", PyArray1::from_slice(py, &frame.areas))?;
    let triads = (0..n).flat_map(|cell| {
        let axes = frame.triads[cell].0;
        [0, 1, 2].map(|k| [axes[(0, k)], axes[(1, k)], axes[(2, k)]])
    });
    found.set_item("axes", rows(py, triads)?.call_method1("reshape", (n, 3, 3))?)?;
    found.set_item("grid", frame.grid.map(|grid| (grid.cells[0], grid.cells[1])))?;
    let places: Vec<i64> = (0..n).map(|cell| frame.grid_index(cell) as i64).collect();
    found.set_item("places", PyArray1::from_vec(py, places))?;
    Ok(found)
}

impl Fields {
    /// The cells and all fields, by name.
    pub fn to_python<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = cells(py, &self.frame)?;
        let state = &self.state;
        found.set_item("tractions", by_cell(py, &state.tractions, 3)?)?;
        found.set_item("gap", by_cell(py, &state.gap, 3)?)?;
        found.set_item("slip", by_cell(py, &state.slip, 2)?)?;
        found.set_item("contact", PyArray1::from_slice(py, &state.status))?;
        found.set_item("wear_depth", PyArray1::from_slice(py, &state.wear_depth))?;
        found.set_item("wear_depth_error", PyArray1::from_slice(py, &state.wear_depth_error))?;
        Ok(found)
    }
}
