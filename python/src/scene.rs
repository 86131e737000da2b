//! Scenes.

use std::path::PathBuf;
use std::sync::Arc;

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1};
use orthowear::adaptive::AccuracySearch;
use orthowear::bem::half_space::SurfaceGreen;
use orthowear::cli::{MaxMemory, parse_max_memory};
use orthowear::error::Warning;
use orthowear::estimate::estimate;
use orthowear::fem::FlexibilityCache;
use orthowear::geometry::Side;
use orthowear::linalg::memory::MemoryLimit;
use orthowear::scene::{self, Plan};
use orthowear::simulation::SceneError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::engine::{BackgroundTask, run_in_background};
use crate::flexibility::Flexibility;
use crate::run::{Message, RunRequest, run, to_python_result};
use crate::steps::Steps;
use crate::{convert, errors};

/// A scene, parsed and validated.
#[pyclass(frozen, module = "orthowear._orthowear")]
pub struct Scene {
    path: PathBuf,
    plan: Plan,
}

/// Settings of a computation that are not part of the scene.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct Settings {
    pub threads: Option<usize>,
    max_memory: Option<String>,
    cache: bool,
}

impl Settings {
    /// Memory limit; `None` means the limit of the scene.
    pub fn limit(&self, py: Python<'_>) -> PyResult<Option<MemoryLimit>> {
        let limit = self.max_memory.as_deref().map(parse_max_memory).transpose();
        let limit = limit.map_err(|text| errors::input(py, &format!("max_memory: {text}")))?;
        Ok(limit.map(MaxMemory::limit))
    }

    /// Cache of flexibilities, if enabled.
    pub fn cache(&self, py: Python<'_>) -> PyResult<Option<FlexibilityCache>> {
        let cache = if self.cache { FlexibilityCache::of_environment() } else { Ok(None) };
        cache.map_err(|error| errors::error(py, &error))
    }
}

impl Scene {
    fn made(py: Python<'_>, path: PathBuf, plan: Result<Plan, scene::Diagnostics>) -> PyResult<Self> {
        let plan = plan.map_err(|mistakes| errors::mistakes(py, &mistakes))?;
        Ok(Self { path, plan })
    }

    /// Copy of the scene's plan with these settings.
    fn plan(&self, py: Python<'_>, settings: &Settings) -> PyResult<Arc<Plan>> {
        let mut plan = self.plan.clone();
        plan.override_memory_limit(settings.limit(py)?);
        plan.flexibility_cache = settings.cache(py)?;
        Ok(Arc::new(plan))
    }
}

#[pymethods]
impl Scene {
    /// Reads the scene file at `path`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let overrides = convert::overrides(overrides)?;
        let plan = py.detach(|| scene::read(&path, &overrides));
        Self::made(py, path, plan)
    }

    /// Makes a scene from a dict. `path` is the name of the scene in messages.
    #[staticmethod]
    fn from_dict(py: Python<'_>, scene: &Bound<'_, PyDict>, path: PathBuf) -> PyResult<Self> {
        let text = convert::scene_text(scene)?;
        let plan = py.detach(|| scene::read_text(&path, text, &[]));
        Self::made(py, path, plan)
    }

    /// Copy of the scene with further values replaced.
    fn replace(&self, py: Python<'_>, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let document = &self.plan.document;
        let mut all = document.overrides.clone();
        all.extend(convert::overrides(overrides)?);
        let text = document.text.clone();
        let plan = py.detach(|| scene::read_text(&self.path, text, &all));
        Self::made(py, self.path.clone(), plan)
    }

    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        convert::to_python(py, &self.plan.document.to_display_json())
    }

    #[getter]
    fn title(&self) -> &str {
        &self.plan.title
    }

    #[getter]
    fn sha256(&self) -> &str {
        &self.plan.document.sha256
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.plan.notes.iter().map(|note| note.text.clone()).collect()
    }

    #[getter]
    fn has_accuracy(&self) -> bool {
        self.plan.accuracy.is_some()
    }

    /// Estimates a run: its size, omitted work, memory and time.
    fn check<'py>(&self, py: Python<'py>, settings: Settings) -> PyResult<Bound<'py, PyAny>> {
        let plan = self.plan(py, &settings)?;
        let shared = plan.clone();
        let looked = run_in_background(py, settings.threads, move |_| {
            let forecast = estimate(&shared)?;
            AccuracySearch::new(&shared)?;
            Ok::<_, SceneError>(forecast)
        })?;
        let forecast = looked.map_err(|failure| errors::scene_error(py, &plan, &failure))?;
        let bodies: Vec<_> = forecast.bodies.iter().map(|body| {
            json!({ "what": body.description, "memory_bytes": body.memory_bytes, "seconds": body.seconds, "note": body.warning })
        }).collect();
        let notes: Vec<&Warning> = plan.notes.iter().chain(&forecast.warnings).collect();
        convert::to_python(
            py,
            &json!({
                "title": plan.title,
                "cells": forecast.n_cells,
                "contact_problems": forecast.n_contact_problems,
                "memory_bytes": forecast.memory_bytes,
                "memory_limit_bytes": plan.memory_limit.remaining(),
                "seconds": forecast.seconds,
                "bodies": bodies,
                "skipped": forecast.skipped,
                "notes": notes,
            }),
        )
    }

    /// Runs the scene. Returns the summary and the fields of the last entry.
    #[pyo3(signature = (settings, out, progress))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        settings: Settings,
        out: Option<PathBuf>,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, Option<Bound<'py, PyDict>>)> {
        let plan = self.plan(py, &settings)?;
        let wishes = RunRequest { plan: plan.clone(), out, progress: progress.is_some(), requests: None };
        let mut work = BackgroundTask::begin(py, settings.threads, |line| run(wishes, line))?;
        while let Some(message) = work.next_message(py)? {
            if let (Message::Progress(stage, done, residual), Some(hear)) = (message, &progress) {
                hear.call1((stage, done, residual)).inspect_err(|_| work.close(py))?;
            }
        }
        let ended = work.join(py)?.ok_or_else(|| errors::internal(py, "closed"))?;
        to_python_result(py, &plan, &ended)
    }

    /// Starts a run whose entries are requested one by one.
    fn steps(&self, py: Python<'_>, settings: Settings, out: Option<PathBuf>) -> PyResult<Steps> {
        Steps::begin(py, self.plan(py, &settings)?, settings.threads, out)
    }

    /// Flexibility of the bodies on the frame.
    fn flexibility(&self, py: Python<'_>, settings: Settings) -> PyResult<Flexibility> {
        Flexibility::new(py, self.plan(py, &settings)?, settings.threads)
    }

    /// Surface Green's function Γ(φ) of a half-space with the material of `body` (1 or 2), shape (len(angles), 3, 3).
    /// `angles` are radians from the frame's x.
    fn green<'py>(
        &self,
        py: Python<'py>,
        body: usize,
        angles: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (elastic, side) = match body {
            1 => (self.plan.bodies[0].material(), Side::Lower),
            2 => (self.plan.bodies[1].material(), Side::Upper),
            _ => return Err(errors::input(py, &format!("body is {body}, but it must be 1 or 2"))),
        };
        let elastic = elastic
            .ok_or_else(|| errors::input(py, &format!("body {body} is rigid and has no Green's function")))?;
        let stiffness = elastic.stiffness_in_frame(self.plan.frame.azimuth());
        let green = run_in_background(py, None, move |_| SurfaceGreen::new(&stiffness, side))?;
        let green = green.map_err(|error| errors::error(py, &error))?;
        let values: Vec<f64> = angles
            .as_array()
            .iter()
            .flat_map(|&phi| green.gamma(phi).transpose().as_slice().to_vec())
            .collect();
        let n = values.len() / 9;
        Ok(PyArray1::from_vec(py, values).reshape([n, 3, 3])?.into_any())
    }
}
