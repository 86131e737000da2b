//! Which run of a study is next: those that go on from another one, or are its image, wait for it.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::fork::Fork;
use crate::bem::half_space::Kernels;
use crate::history::image::Recording;
use crate::study::sweep::RunSpec;

/// The runs that are left, and the states that they go on from.
pub(super) struct Queue {
    /// By run, that which it is an image of.
    image_of: Vec<Option<usize>>,
    /// By run, whether images are made of it, or of runs that go on from it.
    recorded: Vec<bool>,
    /// By run, those with which it begins, the longest beginning first: the run that is the first of them, and the number of common steps.
    begins_as: Vec<Vec<(usize, usize)>>,
    left: Mutex<Left>,
    changed: Condvar,
    /// What operators of half-spaces are made of, for all runs.
    pub kernels: Arc<Kernels>,
}

struct Left {
    /// By run.
    stages: Vec<Stage>,
    /// States, with the run that left them.
    forks: Vec<(usize, Arc<Fork>)>,
    /// What runs came to that others are images of; `None` of those that have no images.
    recordings: Vec<(usize, Option<Arc<Recording>>)>,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    Waiting,
    Active,
    /// It has ended, or is not wanted.
    Over,
}

/// A run that is to be done; it has ended when this is dropped.
pub(super) struct Taken<'a> {
    pub queue: &'a Queue,
    pub number: usize,
    /// What it goes on from.
    pub from: Option<Arc<Fork>>,
    /// Numbers of its steps after which others go on.
    pub after: Vec<usize>,
    /// What it is an image of, as far as that is known.
    pub recording: Option<Option<Arc<Recording>>>,
    /// Whether images are made of it, or of runs that go on from it.
    pub records: bool,
}

impl Queue {
    pub fn new(specs: &[RunSpec], numbers: &[usize]) -> Self {
        let mut stages = vec![Stage::Over; specs.len()];
        numbers.iter().for_each(|&number| stages[number] = Stage::Waiting);
        let image_of = |(spec, stage): (&RunSpec, &Stage)| {
            spec.image_of.filter(|_| *stage == Stage::Waiting).map(|image| image.run)
        };
        let image_of: Vec<_> = specs.iter().zip(&stages).map(image_of).collect();
        let mut begins_as = vec![Vec::new(); specs.len()];
        let mut known: HashMap<&str, usize> = HashMap::new();
        let computed = |number: usize| stages[number] == Stage::Waiting && image_of[number].is_none();
        for (number, spec) in specs.iter().enumerate().filter(|(number, _)| computed(*number)) {
            let first =
                |(steps, beginning): &(usize, String)| Some((*known.get(beginning.as_str())?, *steps));
            begins_as[number] = spec.beginnings.iter().rev().filter_map(first).collect();
            for (_, beginning) in &spec.beginnings {
                known.entry(beginning).or_insert(number);
            }
        }
        let mut recorded = vec![false; specs.len()];
        for &original in image_of.iter().flatten() {
            recorded[original] = true;
            begins_as[original].iter().for_each(|(first, _)| recorded[*first] = true);
        }
        let left = Mutex::new(Left { stages, forks: Vec::new(), recordings: Vec::new() });
        let (changed, kernels) = (Condvar::new(), Arc::default());
        Self { image_of, recorded, begins_as, left, changed, kernels }
    }

    fn left(&self) -> MutexGuard<'_, Left> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next run; `None` if there is none left, or at the wish to stop. Runs that go on from another wait for it, and are taken before those
    /// that do not, so that few states are kept.
    pub fn take(&self, stop: &AtomicBool) -> Option<Taken<'_>> {
        let mut left = self.left();
        loop {
            let waiting = |number: &usize| left.stages[*number] == Stage::Waiting;
            let rank = |number: usize| match self.begins_as[number].as_slice() {
                _ if self.image_of[number].is_some() => {
                    let is_over = |original: usize| left.stages[original] == Stage::Over;
                    self.image_of[number].is_some_and(is_over).then_some((0, number))
                }
                [] => Some((1, number)),
                all if all.iter().all(|(first, _)| left.stages[*first] == Stage::Over) => Some((0, number)),
                _ => None,
            };
            let mut numbers = (0..left.stages.len()).filter(waiting).peekable();
            if numbers.peek().is_none() || stop.load(Ordering::Relaxed) {
                return None;
            }
            let Some((_, number)) = numbers.filter_map(rank).min() else {
                // What they wait for is being done.
                left = self.changed.wait(left).unwrap_or_else(PoisonError::into_inner);
                continue;
            };
            left.stages[number] = Stage::Active;
            // The longest beginning that there is: a run that failed, or whose frame has grown, left shorter ones.
            let fork = |wanted: &(usize, usize)| {
                left.forks
                    .iter()
                    .find(|(run, fork)| (*run, fork.n_steps) == *wanted)
                    .map(|(_, fork)| fork.clone())
            };
            let from = self.begins_as[number].iter().find_map(fork);
            let mut after: Vec<usize> = self.followers(&left, number).collect();
            after.sort_unstable();
            after.dedup();
            let used =
                |(run, fork): &(usize, Arc<Fork>)| self.followers(&left, *run).any(|n| n == fork.n_steps);
            let used: Vec<bool> = left.forks.iter().map(used).collect();
            let mut used = used.into_iter();
            left.forks.retain(|_| used.next().unwrap_or_default());
            let recording = self.image_of[number].and_then(|original| left.recording(original).cloned());
            let Left { stages, recordings, .. } = &mut *left;
            let waits = |of: usize| {
                let mut images = stages.iter().zip(&self.image_of);
                images.any(|(stage, image)| *stage == Stage::Waiting && *image == Some(of))
            };
            recordings.retain(|(of, _)| waits(*of));
            let records = self.recorded[number];
            return Some(Taken { queue: self, number, from, after, recording, records });
        }
    }

    /// Keeps what a run came to for its images.
    pub fn keep(&self, number: usize, made: Option<Recording>) -> Option<Arc<Recording>> {
        let made = made.map(Arc::new);
        let mut left = self.left();
        if left.recording(number).is_none() {
            left.recordings.push((number, made.clone()));
        }
        made
    }

    /// After how many of its steps waiting runs go on from run `first`.
    fn followers(&self, left: &Left, first: usize) -> impl Iterator<Item = usize> {
        let waiting = left.stages.iter().zip(&self.begins_as).filter(|(stage, _)| **stage == Stage::Waiting);
        waiting.flat_map(|(_, all)| all).filter(move |(run, _)| *run == first).map(|(_, steps)| *steps)
    }
}

impl Left {
    fn recording(&self, number: usize) -> Option<&Option<Arc<Recording>>> {
        self.recordings.iter().find(|(of, _)| *of == number).map(|(_, recording)| recording)
    }
}

impl Taken<'_> {
    /// Leaves states for others.
    pub fn leave(&self, forks: Vec<Fork>) {
        let mut left = self.queue.left();
        left.forks.extend(forks.into_iter().map(|fork| (self.number, Arc::new(fork))));
    }
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        self.queue.left().stages[self.number] = Stage::Over;
        self.queue.changed.notify_all();
    }
}
