//! Writes the checkpoints of a run: when, and what they hold.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use crate::error::{Context, Result};
use crate::frame::grid::spread;
use crate::history::record::IncrementRecord;
use crate::linalg::course::Course;
use crate::results::checkpoint;
use crate::results::fields::Written;
use crate::results::origin::Origin;
use crate::results::output::{Gathered, OutputDir};

/// What a checkpoint of a run holds; `S` is the state that the run goes on from.
#[derive(Debug, Clone, Deserialize, Serialize)]
pub struct Kept<S> {
    /// The state, with the entries so far.
    pub snapshot: S,
    /// What the operators have come to hold.
    pub course: Course,
    /// What has been written of the entries, and is kept of them for the end.
    pub written: Written,
    /// How often the frame was enlarged.
    #[serde(default)]
    pub growths: usize,
    /// How the meshes moved with wear.
    #[serde(default)]
    pub moves: Moves,
    /// The files that were written.
    pub files: Vec<Gathered>,
}

/// How the meshes of worn bodies have moved.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize)]
pub struct Moves {
    /// Worn depth of both bodies at the last move, `[N]`, mm; empty before the first.
    pub worn: Vec<f64>,
    /// How often they moved.
    pub count: usize,
    /// They do not move any more, for an element would turn over or get too flat.
    pub over: bool,
}

impl Moves {
    /// After one more move, with the bodies worn by `worn`.
    pub fn to(&self, worn: &[f64]) -> Self {
        Self { worn: worn.to_vec(), count: self.count + 1, over: self.over }
    }

    /// On a frame of `n` cells of which the ones so far are a part; `places`: their numbers there.
    pub fn onto(self, places: &[usize], n: usize) -> Self {
        let worn = if self.worn.is_empty() { Vec::new() } else { spread(&self.worn, places, n, |_| 0.0) };
        Self { worn, ..self }
    }
}

/// How often checkpoints are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// After so many seconds; never, if 0.
    pub seconds: f64,
    /// After so many cycles; never, if 0.
    pub cycles: u64,
}

impl Progress {
    /// That of these entries.
    pub fn of(records: &[IncrementRecord]) -> Self {
        Self { entries: records.len(), cycles: records.last().map_or(0, |last| last.cycles_done) }
    }
}

/// What has been finished when a checkpoint may be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of finished entries.
    pub entries: usize,
    /// Cycles since the start.
    pub cycles: u64,
}

/// Writes the checkpoints of one run.
#[derive(Debug)]
pub struct Keeper {
    origin: Origin,
    interval: Interval,
    /// Number of the last checkpoint; 0 before the first.
    number: u64,
    /// What it holds.
    last: Progress,
    at: Instant,
    growths: usize,
    moves: Moves,
}

impl Keeper {
    /// Of a run that begins at the start.
    pub fn new(origin: Origin, interval: Interval) -> Self {
        let (now, last) = (Instant::now(), Progress { entries: 0, cycles: 0 });
        Self { origin, interval, number: 0, last, at: now, growths: 0, moves: Moves::default() }
    }

    /// Of a run that goes on from checkpoint `number`, which holds `last`.
    pub fn after(mut self, number: u64, last: Progress) -> Self {
        (self.number, self.last) = (number, last);
        self
    }

    /// Of a run on a frame that was enlarged so often, with meshes that have moved like this.
    pub fn on_frame(mut self, growths: usize, moves: &Moves) -> Self {
        (self.growths, self.moves) = (growths, moves.clone());
        self
    }

    /// Whether there is a checkpoint.
    pub fn has_any(&self) -> bool {
        self.number > 0
    }

    /// Whether the time for one has come.
    pub fn is_due(&self, now: Progress) -> bool {
        let Interval { seconds, cycles } = self.interval;
        let waited = seconds > 0.0 && self.at.elapsed().as_secs_f64() >= seconds;
        self.is_news(now) && (waited || (cycles > 0 && now.cycles >= self.last.cycles + cycles))
    }

    /// Whether more is finished than the last one holds.
    pub fn is_news(&self, now: Progress) -> bool {
        now.entries > self.last.entries
    }

    /// Writes one.
    ///
    /// # Errors
    /// Resources, if it cannot be written.
    pub fn write<S: Serialize>(
        &mut self,
        output: &mut OutputDir,
        now: Progress,
        (snapshot, course): (S, &Course),
        (written, files): (&Written, &[Gathered]),
    ) -> Result<()> {
        output.last()?;
        let kept = KeptNow { snapshot, course, written, growths: self.growths, moves: &self.moves, files };
        checkpoint::write(output.path(), self.number + 1, &self.origin, &kept)
            .context(|| "writing a checkpoint".to_owned())?;
        (self.number, self.last, self.at) = (self.number + 1, now, Instant::now());
        Ok(())
    }
}

/// [`Kept`] before it is.
#[derive(Serialize)]
struct KeptNow<'a, S> {
    snapshot: S,
    course: &'a Course,
    written: &'a Written,
    growths: usize,
    moves: &'a Moves,
    files: &'a [Gathered],
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keeper(seconds: f64, cycles: u64) -> Keeper {
        Keeper::new(Origin::new(serde_json::json!({}), Vec::new()), Interval { seconds, cycles })
    }

    fn progress(entries: usize, cycles: u64) -> Progress {
        Progress { entries, cycles }
    }

    /// Truth: docs/checkpoints.md: by time, by cycles, 0 for neither, and only where there is something new.
    #[test]
    fn when_one_is_due() {
        assert!(!keeper(0.0, 0).is_due(progress(9, 900)));
        assert!(!keeper(3600.0, 0).is_due(progress(9, 900)));
        assert!(keeper(1e-9, 0).is_due(progress(1, 0)));
        assert!(!keeper(1e-9, 0).after(4, progress(3, 0)).is_due(progress(3, 0)));
        let by_cycles = keeper(0.0, 100).after(1, progress(2, 200));
        assert!(!by_cycles.is_due(progress(3, 299)));
        assert!(by_cycles.is_due(progress(3, 300)));
    }

    /// Truth: what is read has the fields of what is written.
    #[test]
    fn what_is_kept_comes_back() {
        let dir = tempfile::tempdir().unwrap();
        let mut output = OutputDir::open(dir.path()).unwrap();
        output
            .write("a.vtu", |out| out.write_all(b"a").map_err(|e| crate::results::file::write_failure(&e)))
            .unwrap();
        let course = Course { compared: true, formed: vec![vec![1, 2]], ..Course::default() };
        let files = output.files().to_vec();
        let mut keeper = keeper(0.0, 0);
        keeper.write(&mut output, progress(1, 0), ("state", &course), (&Written::default(), &files)).unwrap();
        let found = checkpoint::read(dir.path()).unwrap().unwrap();
        let kept: Kept<String> = found.state().unwrap();
        assert_eq!((kept.snapshot.as_str(), kept.course, kept.files), ("state", course, files));
        assert!(found.number == 1 && keeper.has_any());
    }
}
