//! Collects what a run reports, increment by increment, and writes its result files.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{Kind, Result};
use crate::history::Snapshot;
use crate::history::record::{FrameState, IncrementRecord, Moment, Observer};
use crate::linalg::course::Course;
use crate::linalg::operator::Flexibility;
use crate::results::fields::{FieldWriter, Written};
use crate::results::keeper::{self, Keeper};
use crate::results::output::{Gathered, OutputDir, write_failure};
use crate::results::summary::Summary;
use crate::results::table::history_csv;

/// Shows progress: stage, fraction done in 0..=1, natural residual.
pub type Progress<'a> = Box<dyn FnMut(&str, f64, Option<f64>) + Send + 'a>;

/// The observer of a run that keeps its records and, where it has an output directory, writes its files.
#[derive(Default)]
pub struct Recorder<'a> {
    output: Option<OutputDir>,
    records: Vec<IncrementRecord>,
    fields: Option<FieldWriter<'a>>,
    progress: Option<Progress<'a>>,
    stop: Option<&'a AtomicBool>,
    keeping: Option<Keeping<'a>>,
    /// Whether there are checkpoints already.
    resumes: bool,
}

/// What goes on with another recorder.
pub struct Parts {
    /// The files so far, where there is a directory.
    pub output: Option<OutputDir>,
    /// The entries so far.
    pub records: Vec<IncrementRecord>,
    /// What has been written of them.
    pub written: Written,
    /// Who writes the checkpoints.
    pub keeper: Option<Keeper>,
}

/// What checkpoints need besides what is recorded.
struct Keeping<'a> {
    keeper: Keeper,
    operator: &'a dyn Flexibility,
    /// What the operator held after the last finished entry.
    course: Course,
    /// What was written before an entry that was not finished.
    finished: Option<(Written, Vec<Gathered>)>,
}

impl<'a> Recorder<'a> {
    /// Keeps records, and writes files into `output` if there is one.
    pub fn writing_to(output: Option<OutputDir>) -> Self {
        Self { output, ..Self::default() }
    }

    /// Says whether there are checkpoints that the run goes on from, where it writes none itself.
    pub fn that_resumes(mut self, resumes: bool) -> Self {
        self.resumes = resumes;
        self
    }

    /// Also writes fields, where there is an output directory.
    pub fn with_fields(mut self, fields: FieldWriter<'a>) -> Self {
        self.fields = Some(fields);
        self
    }

    /// Also shows progress.
    pub fn with_progress(mut self, progress: impl FnMut(&str, f64, Option<f64>) + Send + 'a) -> Self {
        self.progress = Some(Box::new(progress));
        self
    }

    /// Also asks the run to stop once `flag` is set.
    pub fn with_stop(mut self, flag: &'a AtomicBool) -> Self {
        self.stop = Some(flag);
        self
    }

    /// Also writes checkpoints, where there is an output directory; `operator` is the run's.
    pub fn with_checkpoints(mut self, keeper: Keeper, operator: &'a dyn Flexibility) -> Self {
        self.keeping = Some(Keeping { keeper, operator, course: operator.course(), finished: None });
        self
    }

    /// The entries before those that will come.
    pub fn with_records(mut self, records: Vec<IncrementRecord>) -> Self {
        self.records = records;
        self
    }

    /// Ends it without an end of the run.
    pub fn into_parts(self) -> Parts {
        Parts {
            output: self.output,
            records: self.records,
            written: self.fields.map_or_else(Written::default, FieldWriter::into_written),
            keeper: self.keeping.map(|keeping| keeping.keeper),
        }
    }

    /// What has been written so far, and the files.
    pub fn written(&self) -> (Written, Vec<Gathered>) {
        let written = self.fields.as_ref().map_or_else(Written::default, |fields| fields.written().clone());
        (written, self.output.as_ref().map_or_else(Vec::new, |output| output.files().to_vec()))
    }

    /// Where the files will be.
    pub fn folder(&self) -> Option<&Path> {
        self.output.as_ref().map(OutputDir::path)
    }

    /// The records so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Ends it with the records in `summary`, and leaves no files.
    ///
    /// # Errors
    /// Numerical, if a number is not finite.
    pub fn discard(mut self, summary: &mut Summary) -> Result<()> {
        self.output = None;
        self.finish(summary)
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
        if self.fields.is_none() && output.continues() {
            // It ended before it went on.
            return output.suspend(summary);
        }
        let fields = self.fields.take().map_or(Ok(()), |fields| fields.finish(&mut output, summary));
        if let Err(error) = fields.and_then(|()| write_history(&mut output, summary)) {
            summary.fail(&error);
            let kept = self.keeping.is_some_and(|keeping| keeping.keeper.has_any());
            if output.continues() || self.resumes || kept {
                output.suspend(summary)?;
                return Err(error);
            }
            let target = output.path().to_owned();
            // Frees the disk of what was gathered before the summary is tried.
            drop(output);
            OutputDir::open(&target)?.finish(summary)?;
            return Err(error);
        }
        output.finish(summary)
    }
}

impl Keeping<'_> {
    /// Writes a checkpoint, if it is time for one.
    fn keep(
        &mut self,
        output: &mut OutputDir,
        records: &[IncrementRecord],
        fields: Option<&FieldWriter<'_>>,
        (moment, interrupted): (Moment, bool),
        snapshot: &dyn Fn() -> Snapshot,
    ) -> Result<()> {
        if matches!(moment, Moment::Entry | Moment::StepEnd) {
            self.course = self.operator.course();
        }
        let finished = &records[..records.len() - usize::from(self.finished.is_some())];
        let now = keeper::Progress::of(finished);
        let wanted = match moment {
            Moment::Broken => interrupted && self.keeper.is_news(now),
            Moment::HandedOn => self.keeper.is_news(now),
            Moment::Entry | Moment::StepEnd => self.keeper.is_due(now),
        };
        if !wanted {
            return Ok(());
        }
        let nothing = Written::default();
        let (written, files) = match &self.finished {
            Some((written, files)) => (written, files.clone()),
            None => (fields.map_or(&nothing, FieldWriter::written), output.files().to_vec()),
        };
        self.keeper.write(output, now, (snapshot(), &self.course), (written, &files))
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
        // May be interrupted: before anything of the entry is kept.
        let fields = self.fields.as_ref().filter(|fields| fields.writes_at(record));
        let inside = fields.map(|fields| fields.inside(state)).transpose()?.unwrap_or_default();
        if let (Some(keeping), Some(output), false) = (&mut self.keeping, &self.output, record.converged) {
            let written =
                self.fields.as_ref().map_or_else(Written::default, |fields| fields.written().clone());
            keeping.finished = Some((written, output.files().to_vec()));
        }
        self.records.push(record.clone());
        let (Some(fields), Some(output)) = (&mut self.fields, &mut self.output) else { return Ok(()) };
        let (mark, files) = (fields.mark(), output.files().len());
        let written = fields.increment(output, record, (state, inside));
        if written.as_ref().is_err_and(|error| error.kind() == Kind::Interrupted) {
            // As if it had not been computed: a run that goes on computes it again.
            fields.back_to(mark);
            output.forget_after(files);
            self.records.pop();
            self.keeping.iter_mut().for_each(|keeping| keeping.finished = None);
        }
        written
    }

    fn keep(&mut self, moment: Moment, snapshot: &dyn Fn() -> Snapshot) -> Result<()> {
        let interrupted = self.interrupted();
        match (&mut self.keeping, &mut self.output) {
            (Some(keeping), Some(output)) => {
                keeping.keep(output, &self.records, self.fields.as_ref(), (moment, interrupted), snapshot)
            }
            _ => Ok(()),
        }
    }

    fn wants_loops(&self) -> bool {
        self.fields.as_ref().is_some_and(FieldWriter::wants_loops)
    }

    fn wants_tangential_gap(&self) -> bool {
        self.fields.as_ref().is_some_and(FieldWriter::writes)
    }

    fn interrupted(&self) -> bool {
        self.stop.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
