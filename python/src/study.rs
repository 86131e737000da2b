//! Studies.

use std::path::PathBuf;
use std::sync::Arc;

use orthowear::error::Error;
use orthowear::sweep::run::{StudyOutcome, StudyRunner};
use orthowear::sweep::table::{StudyResult, StudyRun};
use orthowear::sweep::{self, Sweep};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::json;

use crate::engine::BackgroundTask;
use crate::scene::Settings;
use crate::{convert, errors};

/// A study, parsed and validated with all its scenes.
#[pyclass(frozen, module = "orthowear._orthowear")]
pub struct Study {
    sweep: Sweep,
}

#[pymethods]
impl Study {
    /// Reads the study file at `path`.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, overrides: &Bound<'_, PyDict>) -> PyResult<Self> {
        let overrides = convert::overrides(overrides)?;
        let sweep = py.detach(|| sweep::read(&path, &overrides));
        Ok(Self { sweep: sweep.map_err(|files| errors::study_diagnostics(py, &files))? })
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.sweep.notes.clone()
    }

    /// Content of study.json before the runs.
    fn plan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let runs = (0..self.sweep.runs.len()).map(|number| StudyRun::new(&self.sweep, number)).collect();
        convert::to_python(py, &json!(StudyResult::new(&self.sweep, runs)))
    }

    /// Computes the runs `numbers` (`None`: all) into the folder `out`. If `numbers` is `None`, also writes the table.
    /// Returns the content of study.json, the exit code, and the number of reused earlier runs.
    fn run<'py>(
        &self,
        py: Python<'py>,
        settings: Settings,
        out: PathBuf,
        numbers: Option<Vec<usize>>,
        resume: bool,
        progress: Option<Bound<'py, PyAny>>,
    ) -> PyResult<(Bound<'py, PyAny>, u8, usize)> {
        let mut sweep = self.sweep.clone();
        sweep.set_memory_limit(settings.limit(py)?);
        let n = sweep.runs.len();
        self.check(py, numbers.as_deref().unwrap_or_default())?;
        let cache = settings.cache(py)?;
        let sweep = Arc::new(sweep);
        let own = sweep.clone();
        let mut work = BackgroundTask::begin(py, settings.threads, move |line| {
            let stop = &*line.stop;
            let job = StudyRunner { sweep: &own, directory: &out, cache: cache.as_ref(), stop, resume };
            job.make_directory()?;
            let wanted = numbers.clone().unwrap_or_else(|| (0..n).collect());
            let share = job.plan_concurrency(&wanted, rayon::current_num_threads());
            let ended = job.run(&wanted, share, &mut |done| {
                line.send((done, wanted.len()));
            });
            concluded(&job, ended, numbers.is_none())
        })?;
        while let Some(done) = work.next_message(py)? {
            if let Some(hear) = &progress {
                hear.call1(done).inspect_err(|_| work.close(py))?;
            }
        }
        let ended = work.join(py)?.ok_or_else(|| errors::internal(py, "closed"))?;
        let (result, code, kept) = ended.map_err(|error| errors::error(py, &error))?;
        Ok((convert::to_python(py, &json!(result))?, code, kept))
    }

    /// Collects the runs from their folders in `out`, and writes the table if `write` is true. Returns the content of
    /// study.json, the exit code, and the number of completed runs.
    fn collect<'py>(
        &self,
        py: Python<'py>,
        out: PathBuf,
        write: bool,
    ) -> PyResult<(Bound<'py, PyAny>, u8, usize)> {
        let ended = py.detach(|| {
            let stop = orthowear::cancel::flag();
            let job = StudyRunner { sweep: &self.sweep, directory: &out, cache: None, stop, resume: false };
            job.find_directory()?;
            concluded(&job, job.collect(), write)
        });
        let (result, code, kept) = ended.map_err(|error| errors::error(py, &error))?;
        Ok((convert::to_python(py, &json!(result))?, code, kept))
    }
}

impl Study {
    /// Refuses numbers of runs that do not exist.
    fn check(&self, py: Python<'_>, numbers: &[usize]) -> PyResult<()> {
        let n = self.sweep.runs.len();
        match numbers.iter().find(|number| **number >= n) {
            Some(wrong) => Err(errors::input(
                py,
                &format!("run {wrong} does not exist; the study has runs 0 to {}", n - 1),
            )),
            None => Ok(()),
        }
    }
}

/// Results of the study, exit code, and number of reused runs. Writes the results if `write` is true.
///
/// # Errors
/// If the runs had problems (the error names the first problem), or the results cannot be written.
fn concluded(
    job: &StudyRunner<'_>,
    ended: StudyOutcome,
    write: bool,
) -> Result<(StudyResult, u8, usize), Error> {
    let StudyOutcome { runs, code, reused, problems } = ended;
    if let Some(problem) = problems.first() {
        return Err(Error::resources(problem));
    }
    let result = StudyResult::new(job.sweep, runs);
    if write {
        job.write(&result)?;
    }
    Ok((result, code, reused))
}
