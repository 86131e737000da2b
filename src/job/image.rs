//! Runs that are images of another one: what that one leaves for them, and what they are made of.

use crate::error::Result;
use crate::geometry::GridSymmetry;
use crate::history::RunResult;
use crate::history::image::{Recording, Tape};
use crate::history::record::Observer;
use crate::skip::{Basis, Saved, Skipped, Work};
use crate::study::Study;

/// Bytes that the entries of a run may take; of a longer one there are no images.
const MOST_BYTES: usize = 256 << 20;

/// What a run leaves for its images.
pub struct Legacy {
    /// Its entries so far; `None` if some of them are not known.
    pub(super) tape: Option<Tape>,
    /// All of it, if it has converged.
    pub made: Option<Recording>,
}

impl Default for Legacy {
    fn default() -> Self {
        Self { tape: Some(Tape::up_to(MOST_BYTES)), made: None }
    }
}

impl Legacy {
    /// Makes a whole of the tape, if it has all that the run came to.
    pub(super) fn conclude(&mut self, study: &Study<'_>, result: &Result<RunResult>) {
        let (Some(tape), Ok(result)) = (self.tape.take(), result) else { return };
        self.made = Recording::new(study.model(), result, tape);
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
        study: &Study<'_>,
        observer: &mut dyn Observer,
    ) -> Result<Option<RunResult>> {
        let result = self.recording.deliver_image(study.model(), self.symmetry, observer)?;
        Ok(result.map(|mut result| {
            let why = format!(
                "they are {} those of another run of the study, {}",
                self.symmetry.words(),
                self.folder
            );
            let saved = Some(Saved { seconds: self.recording.seconds(), basis: Basis::Measured });
            result.skipped.push(Skipped { saved, ..Skipped::new(Work::Image, "all steps", why) });
            result
        }))
    }
}
