//! Content of the checkpoints of a run, and when they are written.

use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::{Context, Result};
use crate::evolution::records::IncrementRecord;
use crate::flexibility::operator_history::OperatorHistory;
use crate::frame::grid::extend_field;
use crate::output::checkpoint;
use crate::output::field_writer::WrittenFields;
use crate::output::output_dir::{OutputDir, StagedFile};
use crate::output::provenance::Provenance;

/// Content of a checkpoint; `S` is the state from which the run resumes.
#[derive(Debug, Clone, Deserialize, Serialize)]
pub struct CheckpointData<S> {
    /// State of the run, including the entries so far.
    pub snapshot: S,
    /// Changes to the flexibility operator since its construction; a resumed run repeats them.
    pub operator_history: OperatorHistory,
    /// Field output so far.
    pub written: WrittenFields,
    /// Number of enlargements of the frame.
    #[serde(default)]
    pub frame_growths: usize,
    /// Mesh updates due to wear.
    #[serde(default)]
    pub mesh_updates: MeshUpdates,
    /// Staged result files so far.
    pub files: Vec<StagedFile>,
}

/// Updates of the meshes of worn bodies.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
pub struct MeshUpdates {
    /// Wear depth at the last update, sum of both bodies, `[N]`, mm; empty before the first update.
    pub wear_depth_at_last_update: Vec<f64>,
    /// Number of updates.
    pub count: usize,
    /// Whether mesh updates have stopped, because the next update would invert or flatten an element.
    pub stopped: bool,
}

impl MeshUpdates {
    /// State after one more update, at the wear depth `worn`.
    pub fn after_update(&self, worn: &[f64]) -> Self {
        Self { wear_depth_at_last_update: worn.to_vec(), count: self.count + 1, stopped: self.stopped }
    }

    /// Transfers the state to an enlarged frame of `n` cells. `places[i]` is the new index of cell i.
    pub fn transfer_to(self, places: &[usize], n: usize) -> Self {
        let wear_depth_at_last_update = if self.wear_depth_at_last_update.is_empty() {
            Vec::new()
        } else {
            extend_field(&self.wear_depth_at_last_update, places, n, |_| 0.0)
        };
        Self { wear_depth_at_last_update, ..self }
    }
}

/// Interval between checkpoints. After this interval, the next entry is followed by a checkpoint. An interrupted run always writes
/// a checkpoint if it has new entries.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct CheckpointInterval {
    /// Seconds since the last checkpoint or the start; 0 disables this criterion.
    #[schemars(range(min = 0))]
    pub seconds: f64,
    /// Fretting cycles since the last checkpoint; 0 disables this criterion.
    pub cycles: u64,
}

impl Default for CheckpointInterval {
    fn default() -> Self {
        Self { seconds: 60.0, cycles: 0 }
    }
}

impl CompletedWork {
    /// Completed work of a run with the entries `records`.
    pub fn of(records: &[IncrementRecord]) -> Self {
        Self { entries: records.len(), cycles: records.last().map_or(0, |last| last.cycles_done) }
    }
}

/// Finished part of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CompletedWork {
    /// Number of finished entries.
    pub entries: usize,
    /// Fretting cycles since the start.
    pub cycles: u64,
}

/// Writer of the checkpoints of a run.
#[derive(Debug)]
pub struct CheckpointWriter {
    provenance: Provenance,
    interval: CheckpointInterval,
    /// Number of the last checkpoint; 0 at first.
    number: u64,
    last_saved: CompletedWork,
    last_saved_at: Instant,
    frame_growths: usize,
    mesh_updates: MeshUpdates,
}

impl CheckpointWriter {
    /// Creates the writer of a new run.
    pub fn new(provenance: Provenance, interval: CheckpointInterval) -> Self {
        let (now, last_saved) = (Instant::now(), CompletedWork { entries: 0, cycles: 0 });
        Self {
            provenance,
            interval,
            number: 0,
            last_saved,
            last_saved_at: now,
            frame_growths: 0,
            mesh_updates: MeshUpdates::default(),
        }
    }

    /// Continues after checkpoint `number`, which contains the completed work `last`.
    pub fn continuing_from(mut self, number: u64, last: CompletedWork) -> Self {
        (self.number, self.last_saved) = (number, last);
        self
    }

    /// Sets the number of enlargements of the frame and the mesh updates `moves` so far.
    pub fn with_rebuilds(mut self, growths: usize, moves: &MeshUpdates) -> Self {
        (self.frame_growths, self.mesh_updates) = (growths, moves.clone());
        self
    }

    /// Whether a checkpoint was written, or the run resumed from one.
    pub fn has_written(&self) -> bool {
        self.number > 0
    }

    /// Whether a checkpoint is due after the work `now`: there are new entries, and at least one of the intervals has
    /// passed.
    pub fn is_due(&self, now: CompletedWork) -> bool {
        let CheckpointInterval { seconds, cycles } = self.interval;
        let waited = seconds > 0.0 && self.last_saved_at.elapsed().as_secs_f64() >= seconds;
        self.has_new_entries(now) && (waited || (cycles > 0 && now.cycles >= self.last_saved.cycles + cycles))
    }

    /// Whether entries were finished since the last checkpoint.
    pub fn has_new_entries(&self, now: CompletedWork) -> bool {
        now.entries > self.last_saved.entries
    }

    /// Writes a checkpoint.
    ///
    /// # Errors
    /// If the checkpoint cannot be written, or an earlier unfinished run cannot be moved to `previous-N` (kind `Resources`).
    pub fn write<S: Serialize>(
        &mut self,
        output: &mut OutputDir,
        now: CompletedWork,
        snapshot: S,
        operator_history: &OperatorHistory,
        written: &WrittenFields,
        files: &[StagedFile],
    ) -> Result<()> {
        output.keep_staged_files()?;
        let kept = CheckpointDataRef {
            snapshot,
            operator_history,
            written,
            frame_growths: self.frame_growths,
            mesh_updates: &self.mesh_updates,
            files,
        };
        checkpoint::write(output.path(), self.number + 1, &self.provenance, &kept)
            .context(|| "writing a checkpoint".to_owned())?;
        (self.number, self.last_saved, self.last_saved_at) = (self.number + 1, now, Instant::now());
        Ok(())
    }
}

#[derive(Serialize)]
struct CheckpointDataRef<'a, S> {
    snapshot: S,
    operator_history: &'a OperatorHistory,
    written: &'a WrittenFields,
    frame_growths: usize,
    mesh_updates: &'a MeshUpdates,
    files: &'a [StagedFile],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeper(seconds: f64, cycles: u64) -> CheckpointWriter {
        CheckpointWriter::new(
            Provenance::new(serde_json::json!({}), Vec::new()),
            CheckpointInterval { seconds, cycles },
        )
    }

    fn progress(entries: usize, cycles: u64) -> CompletedWork {
        CompletedWork { entries, cycles }
    }

    /// Truth (docs/checkpoints.md): a checkpoint is due after a time or a number of cycles, if there are new entries.
    /// An interval of 0 never makes a checkpoint due.
    #[test]
    fn when_one_is_due() {
        assert!(!keeper(0.0, 0).is_due(progress(9, 900)));
        assert!(!keeper(3600.0, 0).is_due(progress(9, 900)));
        assert!(keeper(1e-9, 0).is_due(progress(1, 0)));
        assert!(!keeper(1e-9, 0).continuing_from(4, progress(3, 0)).is_due(progress(3, 0)));
        let by_cycles = keeper(0.0, 100).continuing_from(1, progress(2, 200));
        assert!(!by_cycles.is_due(progress(3, 299)));
        assert!(by_cycles.is_due(progress(3, 300)));
    }

    #[test]
    fn what_is_kept_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let mut output = OutputDir::open(dir.path()).unwrap();
        output
            .write("a.vtu", |out| {
                out.write_all(b"a").map_err(|e| crate::output::atomic_file::write_error(&e))
            })
            .unwrap();
        let course = OperatorHistory {
            formed_rows_checked: true,
            formed: vec![vec![1, 2]],
            ..OperatorHistory::default()
        };
        let files = output.files().to_vec();
        let mut keeper = keeper(0.0, 0);
        keeper
            .write(&mut output, progress(1, 0), "state", &course, &WrittenFields::default(), &files)
            .unwrap();
        let found = checkpoint::read(dir.path()).unwrap().unwrap();
        let kept: CheckpointData<String> = found.state().unwrap();
        assert_eq!((kept.snapshot.as_str(), kept.operator_history, kept.files), ("state", course, files));
        assert!(found.number == 1 && keeper.has_written());
    }
}
