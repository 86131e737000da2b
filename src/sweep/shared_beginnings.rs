//! What runs share: those that begin alike go the common steps once, others go on from the state of the first.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::evolution::RunCheckpoint;
use crate::evolution::records::CheckpointEvent;
use crate::flexibility::operator_history::OperatorHistory;
use crate::frame::ContactFrame;
use crate::omitted::OmittedWork;
use crate::output::field_writer::WrittenFields;
use crate::output::near_field::NearFieldRecord;
use crate::output::output_dir::{OutputDir, StagedFile};
use crate::simulation::Simulation;

/// Where a run stood after the steps that others have in common with it.
pub struct SharedPrefix {
    /// Number of these steps.
    pub n_steps: usize,
    snapshot: RunCheckpoint,
    course: OperatorHistory,
    written: WrittenFields,
    files: Vec<StagedFile>,
    /// Where its files are when the run has ended.
    folder: Option<PathBuf>,
    frame: ContactFrame,
    initial_gap: Vec<f64>,
    near_fields: Vec<NearFieldRecord>,
}

/// What a run shares with others.
#[derive(Default)]
pub struct SharedWork<'a> {
    /// What it goes on from.
    pub from: Option<&'a SharedPrefix>,
    /// What others go on from.
    pub recorder: Option<&'a mut PrefixRecorder>,
}

/// What others go on from when a run has ended.
#[derive(Default)]
pub struct PrefixRecorder {
    /// Numbers of steps after which they do.
    pub after_steps: Vec<usize>,
    /// Their states.
    pub recorded: Vec<SharedPrefix>,
}

impl PrefixRecorder {
    pub(crate) fn are_due(&self, moment: CheckpointEvent) -> bool {
        matches!(moment, CheckpointEvent::StepEnd) && !self.after_steps.is_empty()
    }
}

/// A fork as a run takes it up.
pub(crate) struct RestoredPrefix {
    pub snapshot: RunCheckpoint,
    pub course: OperatorHistory,
    pub written: WrittenFields,
    /// Its entry in the ledger.
    pub skipped: OmittedWork,
}

impl SharedPrefix {
    /// That of a run of `study` into `folder`, with what has been written so far.
    pub(crate) fn new(
        (study, snapshot): (&Simulation<'_>, RunCheckpoint),
        (written, files): (WrittenFields, Vec<StagedFile>),
        folder: Option<&Path>,
    ) -> Self {
        let model = study.model();
        Self {
            n_steps: snapshot.n_steps(),
            course: model.flexibility.history(),
            snapshot,
            written,
            files,
            folder: folder.map(Path::to_owned),
            frame: model.frame.clone(),
            initial_gap: model.initial_gap.clone(),
            near_fields: study.near_fields.clone(),
        }
    }

    /// Takes it up for `study`, with copies of its files in `output`; `None` if frame, gap or files are not those it needs.
    ///
    /// # Errors
    /// Resources, if files cannot be copied.
    pub(crate) fn restore(
        &self,
        study: &Simulation<'_>,
        output: Option<&mut OutputDir>,
    ) -> Result<Option<RestoredPrefix>> {
        let model = study.model();
        let fits = self.frame == model.frame
            && self.initial_gap == model.initial_gap
            && self.near_fields == study.near_fields;
        if !fits {
            return Ok(None);
        }
        if let Some(output) = output {
            // A run without files leaves none to others.
            let Some(folder) = &self.folder else { return Ok(None) };
            if !self.files.is_empty() && !output.copy_from(folder, &self.files)? {
                return Ok(None);
            }
        }
        let names: Vec<&str> = self.snapshot.step_names();
        let (what, why) = match names.as_slice() {
            [one] => (format!("step {one}"), "it is that of another run of the study, which begins alike"),
            _ => (
                format!("steps {}", names.join(", ")),
                "they are those of another run of the study, which begins alike",
            ),
        };
        let skipped = OmittedWork::new(None, what, why);
        let snapshot = self.snapshot.clone().without_timings();
        let (course, written) = (self.course.clone(), self.written.clone());
        Ok(Some(RestoredPrefix { snapshot, course, written, skipped }))
    }
}
