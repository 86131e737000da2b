//! Results of a study: `study.json`, `study.csv` and `study.npz` (docs/results.md).

use serde::Serialize;
use serde_json::{Map, Value};

use crate::error::{Error, Result, Warning};
use crate::evolution::records::Divergence;
use crate::npy::NpzWriter;
use crate::output::summary::{Status, Summary, Units};
use crate::sweep::axes::Axis;
use crate::sweep::read::Sweep;

/// Results of a study; the fields of `study.json`.
#[derive(Debug, Clone, Serialize)]
pub struct StudyResult {
    /// Name of the program.
    pub program: &'static str,
    /// Version of the program.
    pub version: &'static str,
    /// Title of the study.
    pub title: String,
    /// SHA-256 of the study file.
    pub study_sha256: String,
    /// Units of all numbers.
    pub units: Units,
    /// The axes.
    pub axes: Vec<AxisResult>,
    /// Paths of the quantities collected at the end of a step of each run.
    pub collect: Vec<String>,
    /// Paths of the quantities collected from all entries of a step.
    pub curves: Vec<String>,
    /// Number of combinations of values that `require` omits.
    pub left_out: usize,
    /// The runs: all combinations that `require` does not omit, with the last axis varying fastest.
    pub runs: Vec<StudyRun>,
}

/// An axis in `study.json`.
#[derive(Debug, Clone, Serialize)]
pub struct AxisResult {
    /// Name of the axis.
    pub name: String,
    /// Keys of the scene that the axis sets.
    pub keys: Vec<String>,
    /// Values of the axis; with several keys, each value is a list with one element per key.
    pub values: Vec<Value>,
}

/// A run in `study.json`.
#[derive(Debug, Clone, Serialize)]
pub struct StudyRun {
    /// Folder of the results, relative to the folder of `study.json`.
    pub folder: String,
    /// Values of the scene's keys that define the run.
    pub values: Map<String, Value>,
    /// Final status; `None` if the run was not computed.
    pub status: Option<Status>,
    /// Reason why the run did not converge or failed.
    pub reason: Option<String>,
    /// Reason as a value of [`Divergence`], unless the run ended with an error.
    #[serde(skip)]
    pub divergence: Option<Divergence>,
    /// SHA-256 of the scene file and its overrides.
    pub scene_sha256: String,
    /// Run time, s.
    pub seconds: f64,
    /// Largest natural residual of all entries.
    pub natural_residual: Option<f64>,
    /// Collected numbers at the ends of steps, by path; null if the run has no such number.
    pub results: Map<String, Value>,
    /// Points `[abscissa, value]` of curves, by path. The abscissa is the number of cycles, the sliding distance or the increment.
    #[serde(rename = "curves")]
    pub curve_points: Map<String, Value>,
    /// Warnings for the user.
    pub warnings: Vec<Warning>,
}

fn number(value: Option<f64>) -> Value {
    value.map_or(Value::Null, Value::from)
}

impl AxisResult {
    fn new(axis: &Axis) -> Self {
        let json = |value: &Vec<crate::scene::document::TomlNode>| match value.as_slice() {
            [one] => one.to_serde_json(),
            several => several.iter().map(|node| node.to_serde_json()).collect(),
        };
        Self {
            name: axis.name.clone(),
            keys: axis.keys.clone(),
            values: axis.values.iter().map(json).collect(),
        }
    }
}

impl StudyRun {
    /// Run `number` of a study, without results.
    pub fn new(sweep: &Sweep, number: usize) -> Self {
        let run = &sweep.runs[number];
        let pairs = sweep.axes.iter().zip(&run.choice).flat_map(|(axis, &value)| {
            axis.keys.iter().cloned().zip(axis.values[value].iter().map(|node| node.to_serde_json()))
        });
        Self {
            folder: run.folder.clone(),
            values: pairs.collect(),
            status: None,
            reason: None,
            divergence: None,
            scene_sha256: String::new(),
            seconds: 0.0,
            natural_residual: None,
            results: Map::new(),
            curve_points: Map::new(),
            warnings: Vec::new(),
        }
    }

    /// Takes the results from the summary of the run.
    pub fn fill_from(&mut self, sweep: &Sweep, summary: &Summary, seconds: f64) {
        self.status = Some(summary.status);
        self.divergence = summary.reason.filter(|_| summary.error.is_none());
        self.reason = summary.error.clone().or(summary.reason.map(|reason| reason.to_string()));
        self.scene_sha256.clone_from(&summary.scene_sha256);
        self.seconds = seconds;
        let residuals = summary.steps.iter().map(|record| record.certificate.natural_residual);
        self.natural_residual = residuals.reduce(f64::max);
        let collected = sweep.collect.iter().map(|q| (q.path.clone(), number(q.final_value(&summary.steps))));
        self.results = collected.collect();
        let curve = |points: Vec<[f64; 2]>| Value::from_iter(points.into_iter().map(Value::from_iter));
        let curves = sweep.curves.iter().map(|q| (q.path.clone(), curve(q.curve(&summary.steps))));
        self.curve_points = curves.collect();
        self.warnings.clone_from(&summary.warnings);
    }

    /// The collected number of a path.
    pub fn result(&self, path: &str) -> Option<f64> {
        self.results.get(path)?.as_f64()
    }

    /// Points of a curve.
    pub fn curve(&self, path: &str) -> Vec<[f64; 2]> {
        let points = self.curve_points.get(path).and_then(Value::as_array).into_iter().flatten();
        points.filter_map(|point| Some([point.get(0)?.as_f64()?, point.get(1)?.as_f64()?])).collect()
    }
}

impl StudyResult {
    /// The results of `runs`, given in the order of the study.
    pub fn new(sweep: &Sweep, runs: Vec<StudyRun>) -> Self {
        let paths =
            |list: &[crate::sweep::collect::CollectedQuantity]| list.iter().map(|q| q.path.clone()).collect();
        Self {
            program: env!("CARGO_PKG_NAME"),
            version: env!("CARGO_PKG_VERSION"),
            title: sweep.title.clone(),
            study_sha256: sweep.document.sha256.clone(),
            units: sweep.units.clone(),
            axes: sweep.axes.iter().map(AxisResult::new).collect(),
            collect: paths(&sweep.collect),
            curves: paths(&sweep.curves),
            left_out: sweep.left_out,
            runs,
        }
    }

    /// The results as JSON text; numbers that are not finite become null.
    ///
    /// # Errors
    /// If serialisation fails.
    pub fn to_json(&self) -> Result<String> {
        let text = serde_json::to_string_pretty(self).map_err(|error| {
            Error::numerical(format!("the results of the study cannot be written as JSON: {error}"))
        })?;
        Ok(text + "\n")
    }

    /// The numbers as NumPy arrays (.npz), one number (or NaN) per run: axis values by key, `converged`, `natural_residual`, and
    /// collected quantities by path. Curves are `[runs, points, 2]`, padded with NaN.
    ///
    /// # Errors
    /// If an array cannot be written.
    pub fn to_npz(&self) -> Result<Vec<u8>> {
        let mut archive = NpzWriter::new();
        let mut add_column = |name: &str, of: &dyn Fn(&StudyRun) -> Option<f64>| {
            let values: Vec<f64> = self.runs.iter().map(|run| of(run).unwrap_or(f64::NAN)).collect();
            archive.add(name, &[values.len()], &values)
        };
        for key in self.axes.iter().flat_map(|axis| &axis.keys) {
            add_column(key, &|run| run.values.get(key)?.as_f64())?;
        }
        let is_converged = |run: &StudyRun| f64::from(u8::from(run.status == Some(Status::Converged)));
        add_column("converged", &|run| Some(is_converged(run)))?;
        add_column("natural_residual", &|run| run.natural_residual)?;
        for path in &self.collect {
            add_column(path, &|run| run.result(path))?;
        }
        for path in &self.curves {
            let curves: Vec<Vec<[f64; 2]>> = self.runs.iter().map(|run| run.curve(path)).collect();
            let longest = curves.iter().map(Vec::len).max().unwrap_or(0);
            let padded = curves.iter().flat_map(|curve| {
                (0..longest).flat_map(move |point| curve.get(point).copied().unwrap_or([f64::NAN; 2]))
            });
            archive.add(
                &format!("curves/{path}"),
                &[curves.len(), longest, 2],
                &padded.collect::<Vec<_>>(),
            )?;
        }
        archive.finish()
    }

    /// CSV table with one row per run. It contains no times, so that it does not depend on the number of threads.
    pub fn to_csv(&self) -> String {
        let keys: Vec<&String> = self.axes.iter().flat_map(|axis| &axis.keys).collect();
        let fixed = ["status", "reason", "folder", "natural_residual"].map(str::to_owned);
        let heads = keys.iter().map(|key| (*key).clone()).chain(fixed).chain(self.collect.iter().cloned());
        let mut text = heads.map(|head| cell(&head)).collect::<Vec<_>>().join(",") + "\n";
        for run in &self.runs {
            let mut cells: Vec<String> =
                keys.iter().map(|key| run.values.get(*key).map_or(String::new(), plain)).collect();
            let status = run.status.and_then(|status| serde_json::to_value(status).ok());
            cells.push(status.as_ref().map_or("not-run".to_owned(), plain));
            cells.push(run.reason.clone().unwrap_or_default());
            cells.push(run.folder.clone());
            cells.push(run.natural_residual.map_or(String::new(), |r| format!("{r:?}")));
            let results = self.collect.iter().map(|path| run.result(path));
            cells.extend(results.map(|value| value.map_or(String::new(), |v| format!("{v:?}"))));
            text += &(cells.iter().map(|text| cell(text)).collect::<Vec<_>>().join(",") + "\n");
        }
        text
    }
}

fn plain(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

/// A cell of a CSV table (RFC 4180).
fn cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
