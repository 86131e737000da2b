//! Observer of a run that records its entries and writes its result files.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::error::{ErrorKind, Result};
use crate::evolution::RunCheckpoint;
use crate::evolution::observer::{CheckpointEvent, Observer};
use crate::evolution::records::{FrameState, IncrementRecord};
use crate::flexibility::Flexibility;
use crate::flexibility::operator_history::OperatorHistory;
use crate::output::checkpoint_writer::{self, CheckpointWriter};
use crate::output::field_writer::{FieldWriter, WrittenFields};
use crate::output::history_table::history_csv;
use crate::output::output_dir::{OutputDir, StagedFile};
use crate::output::summary::Summary;

/// Progress report of a running computation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProgressEvent<'e> {
    /// Progress of a stage: name, fraction done in 0..=1, natural residual.
    Stage(&'e str, f64, Option<f64>),
    /// Message that the user should see before the run ends.
    Message(&'e str),
}

/// Callback that displays progress.
pub type ProgressCallback<'a> = Box<dyn FnMut(ProgressEvent) + Send + 'a>;

/// Keeps the records of a run and, with an output directory, writes the result files.
#[derive(Default)]
pub struct Recorder<'a> {
    output: Option<OutputDir>,
    records: Vec<IncrementRecord>,
    fields: Option<FieldWriter<'a>>,
    /// Callback that displays progress.
    pub progress: Option<ProgressCallback<'a>>,
    /// Cancellation flag.
    pub cancel_flag: Option<&'a AtomicBool>,
    checkpoints: Option<CheckpointState<'a>>,
    /// Whether checkpoint files of the run exist although this recorder writes none.
    pub has_checkpoint_files: bool,
}

/// State that a recorder passes to the recorder of the next segment of the run. A new segment starts when the frame is
/// enlarged or the meshes move with wear.
pub struct RecorderParts {
    /// Output directory with the files so far.
    pub output: Option<OutputDir>,
    /// Entries so far.
    pub records: Vec<IncrementRecord>,
    /// Field output so far.
    pub written: WrittenFields,
    /// Writer of the checkpoints.
    pub checkpoint_writer: Option<CheckpointWriter>,
}

struct CheckpointState<'a> {
    writer: CheckpointWriter,
    operator: &'a dyn Flexibility,
    /// Operator history after the last finished entry.
    operator_history: OperatorHistory,
    /// Fields and files before an entry that did not converge.
    before_unconverged: Option<(WrittenFields, Vec<StagedFile>)>,
}

impl<'a> Recorder<'a> {
    /// Creates a recorder that writes files into `output`, if given.
    pub fn writing_to(output: Option<OutputDir>) -> Self {
        Self { output, ..Self::default() }
    }

    /// Enables field output, if there is an output directory.
    pub fn with_fields(mut self, fields: FieldWriter<'a>) -> Self {
        self.fields = Some(fields);
        self
    }

    /// Enables checkpoints for the run with `operator`, if there is an output directory.
    pub fn with_checkpoints(mut self, writer: CheckpointWriter, operator: &'a dyn Flexibility) -> Self {
        self.checkpoints = Some(CheckpointState {
            writer,
            operator,
            operator_history: operator.history(),
            before_unconverged: None,
        });
        self
    }

    /// Sets the records of the entries so far.
    pub fn with_records(mut self, records: Vec<IncrementRecord>) -> Self {
        self.records = records;
        self
    }

    /// Ends this recorder, and returns its state for the recorder of the next segment of the run.
    pub fn into_parts(self) -> RecorderParts {
        RecorderParts {
            output: self.output,
            records: self.records,
            written: self.fields.map_or_else(WrittenFields::default, |fields| fields.written),
            checkpoint_writer: self.checkpoints.map(|keeping| keeping.writer),
        }
    }

    /// Records so far.
    pub fn records(&self) -> &[IncrementRecord] {
        &self.records
    }

    /// Moves the records to `summary` without writing files.
    ///
    /// # Errors
    /// If a number is not finite (kind `Numerical`).
    pub fn discard(mut self, summary: &mut Summary) -> Result<()> {
        self.output = None;
        self.finish(summary)
    }

    /// Moves the records to `summary` and, with an output directory, writes the remaining files, `history.csv` and
    /// `summary.json`. If a file cannot be written, the summary records the error and is still written, unless this
    /// fails, too.
    ///
    /// # Errors
    /// If a file cannot be written (kind `Resources`), or a number is not finite (kind `Numerical`).
    pub fn finish(mut self, summary: &mut Summary) -> Result<()> {
        summary.steps = std::mem::take(&mut self.records);
        summary.peak_memory_bytes = crate::output::peak_memory::peak_bytes();
        let Some(mut output) = self.output.take() else { return summary.to_json().0 };
        if self.fields.is_none() && output.is_resumed() {
            // The run ended before it could resume.
            return output.suspend(summary);
        }
        let fields = self.fields.take().map_or(Ok(()), |fields| fields.finish(&mut output, summary));
        if let Err(error) = fields.and_then(|()| write_history(&mut output, summary)) {
            summary.set_failure(&error);
            let kept = self.checkpoints.is_some_and(|keeping| keeping.writer.has_written());
            if output.is_resumed() || self.has_checkpoint_files || kept {
                return match output.suspend(summary) {
                    Ok(()) => Err(error),
                    Err(second) => Err(error.followed_by(&second)),
                };
            }
            let target = output.path().to_owned();
            // Removes the staged files, so that the disk has space for the summary.
            drop(output);
            let second = OutputDir::open(&target).and_then(|output| output.finish(summary));
            return match second {
                Ok(()) => Err(error),
                Err(second) => Err(error.followed_by(&second)),
            };
        }
        output.finish(summary)
    }
}

impl CheckpointState<'_> {
    /// Writes a checkpoint if it is due, or if an interrupted or suspended run has new entries.
    fn write_if_due(
        &mut self,
        output: &mut OutputDir,
        records: &[IncrementRecord],
        fields: Option<&FieldWriter<'_>>,
        moment: CheckpointEvent,
        interrupted: bool,
        snapshot: &dyn Fn() -> RunCheckpoint,
    ) -> Result<()> {
        if matches!(moment, CheckpointEvent::Entry | CheckpointEvent::StepEnd) {
            self.operator_history = self.operator.history();
        }
        let finished = &records[..records.len() - usize::from(self.before_unconverged.is_some())];
        let now = checkpoint_writer::CompletedWork::of(finished);
        let wanted = match moment {
            CheckpointEvent::Aborted => interrupted && self.writer.has_new_entries(now),
            CheckpointEvent::Suspended => self.writer.has_new_entries(now),
            CheckpointEvent::Entry | CheckpointEvent::StepEnd => self.writer.is_due(now),
        };
        if !wanted {
            return Ok(());
        }
        let nothing = WrittenFields::default();
        let (written, files) = match &self.before_unconverged {
            Some((written, files)) => (written, files.clone()),
            None => (fields.map_or(&nothing, |fields| &fields.written), output.files().to_vec()),
        };
        self.writer.write(output, now, snapshot(), &self.operator_history, written, &files)
    }
}

fn write_history(output: &mut OutputDir, summary: &Summary) -> Result<()> {
    if summary.steps.is_empty() {
        return Ok(());
    }
    output.write_text("history.csv", &history_csv(&summary.steps)?)
}

impl Observer for Recorder<'_> {
    fn progress(&mut self, stage: &str, fraction: f64, residual: Option<f64>) {
        if let Some(show) = &mut self.progress {
            show(ProgressEvent::Stage(stage, fraction, residual));
        }
    }

    fn increment_done(&mut self, record: &IncrementRecord, state: &FrameState) -> Result<()> {
        // Recovery at interior points can be cancelled, so it precedes any storing of the entry.
        let fields = self.fields.as_ref().filter(|fields| fields.selects(record));
        let inside =
            fields.map(|fields| fields.recover_interior_points(state)).transpose()?.unwrap_or_default();
        if let (Some(keeping), Some(output), false) = (&mut self.checkpoints, &self.output, record.converged)
        {
            let written =
                self.fields.as_ref().map_or_else(WrittenFields::default, |fields| fields.written.clone());
            keeping.before_unconverged = Some((written, output.files().to_vec()));
        }
        self.records.push(record.clone());
        let (Some(fields), Some(output)) = (&mut self.fields, &mut self.output) else { return Ok(()) };
        let (mark, files) = (fields.rollback_mark(), output.files().len());
        let written = fields.write_entry(output, self.records.len(), record, state, inside);
        if written.as_ref().is_err_and(|error| error.kind() == ErrorKind::Interrupted) {
            // The entry is discarded, because a resumed run computes it again.
            fields.roll_back(mark);
            output.truncate_staged(files);
            self.records.pop();
            self.checkpoints.iter_mut().for_each(|keeping| keeping.before_unconverged = None);
        }
        written
    }

    fn on_checkpoint(&mut self, moment: CheckpointEvent, snapshot: &dyn Fn() -> RunCheckpoint) -> Result<()> {
        let interrupted = self.cancelled();
        match (&mut self.checkpoints, &mut self.output) {
            (Some(keeping), Some(output)) => keeping.write_if_due(
                output,
                &self.records,
                self.fields.as_ref(),
                moment,
                interrupted,
                snapshot,
            ),
            _ => Ok(()),
        }
    }

    fn wants_loops(&self) -> bool {
        self.fields.as_ref().is_some_and(FieldWriter::wants_loops)
    }

    fn wants_tangential_gap(&self) -> bool {
        self.fields.as_ref().is_some_and(FieldWriter::has_output)
    }

    fn cancelled(&self) -> bool {
        self.cancel_flag.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
