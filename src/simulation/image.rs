//! Runs that are images of another one: what that one leaves for them, and what they are made of.

use crate::error::Result;
use crate::evolution::RunResult;
use crate::evolution::image::{Entries, Recording};
use crate::evolution::records::Observer;
use crate::geometry::GridSymmetry;
use crate::linalg::memory::MemoryLimit;
use crate::omitted::{Basis, OmissionKind, OmittedWork, Saved};
use crate::simulation::Simulation;

/// Bytes that the entries of a run may take; of a longer one there are no images.
const MOST_BYTES: u64 = 256 << 20;

/// Part of the memory of a run that they may take.
const PART: u64 = 8;

/// Bytes that the entries of a run may take where it has so much memory.
pub(crate) fn most_bytes(memory: &MemoryLimit) -> usize {
    memory.remaining().map_or(MOST_BYTES, |bytes| MOST_BYTES.min(bytes / PART)) as usize
}

/// What a run leaves for its images.
pub struct ForImages {
    /// Its entries so far; `None` if some of them are not known.
    pub(crate) entries: Option<Entries>,
    /// Whether they are all known, if there are any.
    known: bool,
    made: Option<Recording>,
}

impl ForImages {
    /// For a run that may take so much memory.
    pub fn within(memory: &MemoryLimit) -> Self {
        let bytes = most_bytes(memory);
        Self { entries: Some(Entries::up_to(bytes)), known: true, made: None }
    }

    /// The run goes on from a state that was left with these entries.
    pub(super) fn go_on(&mut self, entries: Option<Entries>) {
        (self.known, self.entries) = (entries.is_some(), entries);
    }

    /// What the run came to; `None` if that is not known, as it began before.
    pub fn made(self) -> Option<Option<Recording>> {
        self.known.then_some(self.made)
    }

    /// Makes a whole of the entries, if it has all that the run came to.
    pub(super) fn conclude(&mut self, study: &Simulation<'_>, result: &Result<RunResult>) {
        let (Some(entries), Ok(result)) = (self.entries.take(), result) else { return };
        self.made = Recording::new(study.model(), result, entries);
    }
}

/// The run that another one is an image of.
pub struct Original<'a> {
    /// What it came to.
    pub recording: &'a Recording,
    /// What makes the image.
    pub symmetry: GridSymmetry,
    /// Folder of its results.
    pub folder: &'a str,
}

impl Original<'_> {
    /// Delivers the image as the run of `study`; `None`, and nothing delivered, if it is not that.
    ///
    /// # Errors
    /// If the observer cannot write.
    pub(super) fn deliver(
        &self,
        study: &Simulation<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<RunResult>> {
        let result = self.recording.deliver_image(study.model(), self.symmetry, observer)?;
        Ok(result.map(|mut result| {
            let why = format!(
                "they are {} those of another run of the study, {}",
                self.symmetry.description(),
                self.folder
            );
            let saved = Some(Saved { seconds: self.recording.seconds(), basis: Basis::Measured });
            result
                .skipped
                .push(OmittedWork { saved, ..OmittedWork::new(OmissionKind::Image, "all steps", why) });
            result
        }))
    }
}
