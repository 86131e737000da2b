//! Flexibility operator of the bodies of a scene.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use orthowear::evolution::Model;
use orthowear::frame::ContactFrame;
use orthowear::scene::Plan;
use orthowear::simulation::{self, SceneError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::engine::run_in_background;
use crate::{errors, fields};

/// Linear map from tractions on body 2 to the change of the gap.
#[pyclass(frozen, module = "orthowear._orthowear")]
pub struct Flexibility {
    model: Arc<Model>,
}

/// Builds the model of a plan, and forms the flexibility rows of all cells.
fn made(plan: &Plan, stop: &AtomicBool) -> Result<Model, SceneError> {
    let model = simulation::build(plan, &mut |_| {}, stop)?.into_model();
    let cells = model.flexibility.unformed_cells();
    if !cells.is_empty() {
        let formed = model.flexibility.form_rows(&cells);
        formed.map_err(|error| SceneError { error, key: "frame".to_owned() })?;
    }
    Ok(model)
}

impl Flexibility {
    pub fn new(py: Python<'_>, plan: Arc<Plan>, threads: Option<usize>) -> PyResult<Self> {
        let shared = plan.clone();
        let model = run_in_background(py, threads, move |stop| made(&shared, stop))?;
        let model = model.map_err(|failure| errors::scene_error(py, &plan, &failure))?;
        Ok(Self { model: Arc::new(model) })
    }

    fn frame(&self) -> &ContactFrame {
        &self.model.frame
    }
}

#[pymethods]
impl Flexibility {
    /// Number of cells.
    #[getter]
    fn cells(&self) -> usize {
        self.frame().n_cells()
    }

    /// Positions, areas, axes and grid indices of the cells.
    fn places<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        fields::cells(py, self.frame())
    }

    /// Change of the gap due to `tractions`. Both arrays have the shape (N, 3).
    fn apply<'py>(
        &self,
        py: Python<'py>,
        tractions: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let n = self.cells();
        if tractions.shape() != [n, 3] {
            let text = format!(
                "the tractions have the shape {:?}; it must be ({n}, 3), one row for each cell",
                tractions.shape()
            );
            return Err(errors::input(py, &text));
        }
        let given = tractions.as_array();
        let planes: Vec<f64> = (0..3).flat_map(|c| (0..n).map(move |i| (i, c))).map(|at| given[at]).collect();
        let mut gap = vec![0.0; 3 * n];
        py.detach(|| self.model.flexibility.apply(&planes, &mut gap));
        fields::by_cell(py, &gap, 3)
    }
}
