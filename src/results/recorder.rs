//! Collects what a run reports, increment by increment, and writes its result files.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::Result;
use crate::history::step::{FrameState, IncrementRecord, Observer};
use crate::results::fields::FieldWriter;
use crate::results::output::{OutputDir, write_failure};
use crate::results::summary::Summary;
use crate::results::table::history_csv;

/// Shows progress: stage, fraction done in 0..=1, natural residual.
pub type Progress<'a> = Box<dyn FnMut(&str, f64, Option<f64>) + 'a>;

/// The observer of a run that keeps its records and, where it has an output directory, writes its files.
#[derive(Default)]
pub struct Recorder<'a> {
    output: Option<OutputDir>,
    records: Vec<IncrementRecord>,
    fields: Option<FieldWriter<'a>>,
    progress: Option<Progress<'a>>,
    stop: Option<&'a AtomicBool>,
}

impl<'a> Recorder<'a> {
    /// Keeps records and writes files into `output`.
    pub fn into_directory(output: OutputDir) -> Self {
        Self { output: Some(output), ..Self::default() }
    }

    /// Also writes fields, where there is an output directory.
    pub fn with_fields(mut self, fields: FieldWriter<'a>) -> Self {
        self.fields = Some(fields);
        self
    }

    /// Also shows progress.
    pub fn with_progress(mut self, progress: impl FnMut(&str, f64, Option<f64>) + 'a) -> Self {
        self.progress = Some(Box::new(progress));
        self
    }

    /// Also asks the run to stop once `flag` is set.
    pub fn with_stop(mut self, flag: &'a AtomicBool) -> Self {
        self.stop = Some(flag);
        self
    }

    /// The records so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Hands the records to `summary` and, with an output directory, writes `history.csv` and `summary.json`.
    ///
    /// Whatever fails here is put into the summary first, which is written in any case where the disk allows.
    ///
    /// # Errors
    /// The first failure to write, or a number that is not finite.
    pub fn finish(mut self, summary: &mut Summary) -> Result<()> {
        summary.steps = std::mem::take(&mut self.records);
        summary.peak_memory_bytes = crate::results::memory::peak_bytes();
        let Some(mut output) = self.output.take() else { return summary.to_json().0 };
        let fields = self.fields.take().map_or(Ok(()), |fields| fields.finish(&mut output, summary));
        if let Err(error) = fields.and_then(|()| write_history(&mut output, summary)) {
            summary.fail(&error);
            let target = output.path().to_owned();
            // Frees the disk of what was gathered before the summary is tried.
            drop(output);
            OutputDir::open(&target)?.finish(summary)?;
            return Err(error);
        }
        output.finish(summary)
    }
}

fn write_history(output: &mut OutputDir, summary: &Summary) -> Result<()> {
    if summary.steps.is_empty() {
        return Ok(());
    }
    let text = history_csv(&summary.steps)?;
    output.write("history.csv", |file| file.write_all(text.as_bytes()).map_err(|e| write_failure(&e)))
}

impl Observer for Recorder<'_> {
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>) {
        if let Some(show) = &mut self.progress {
            show(stage, fraction, residual);
        }
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        self.records.push(record.clone());
        match (&mut self.fields, &mut self.output) {
            (Some(fields), Some(output)) => fields.increment(output, record, state),
            _ => Ok(()),
        }
    }

    fn wants_tangential_gap(&self) -> bool {
        self.fields.as_ref().is_some_and(FieldWriter::writes)
    }

    fn interrupted(&self) -> bool {
        self.stop.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
