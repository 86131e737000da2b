//! Which run of a study is next: those that go on from another one wait for it.

use std::collections::HashMap;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use crate::bem::half_space::KernelCache;
use crate::sweep::RunSpec;
use crate::sweep::shared_beginnings::SharedPrefix;

/// The runs that are left, and what they are made from.
pub(super) struct Queue {
    /// By run, those with which it begins, the longest beginning first: the run that is the first of them, and the number of common steps.
    prefix_sources: Vec<Vec<(usize, usize)>>,
    left: Mutex<Left>,
    changed: Condvar,
    /// What operators of half-spaces are made of, for all runs.
    pub kernels: Arc<KernelCache>,
}

struct Left {
    /// By run.
    stages: Vec<RunStage>,
    /// States, with the run that left them.
    forks: Vec<(usize, Arc<SharedPrefix>)>,
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RunStage {
    Waiting,
    Active,
    /// It has ended, or is not wanted.
    Over,
}

/// A run that is to be done; it has ended when this is dropped.
pub(super) struct ClaimedRun<'a> {
    pub queue: &'a Queue,
    pub number: usize,
    /// What it goes on from.
    pub from: Option<Arc<SharedPrefix>>,
    /// Numbers of its steps after which others go on.
    pub after: Vec<usize>,
}

impl Queue {
    pub fn new(specs: &[RunSpec], numbers: &[usize]) -> Self {
        let mut stages = vec![RunStage::Over; specs.len()];
        numbers.iter().for_each(|&number| stages[number] = RunStage::Waiting);
        let mut prefix_sources = vec![Vec::new(); specs.len()];
        // The first run with each beginning.
        let mut known: HashMap<&str, usize> = HashMap::new();
        let waiting = |number: usize| stages[number] == RunStage::Waiting;
        for (number, spec) in specs.iter().enumerate().filter(|(number, _)| waiting(*number)) {
            let first =
                |(steps, beginning): &(usize, String)| Some((*known.get(beginning.as_str())?, *steps));
            prefix_sources[number] = spec.prefix_keys.iter().rev().filter_map(first).collect();
            for (_, beginning) in &spec.prefix_keys {
                known.entry(beginning).or_insert(number);
            }
        }
        let left = Mutex::new(Left { stages, forks: Vec::new() });
        let (changed, kernels) = (Condvar::new(), Arc::default());
        Self { prefix_sources, left, changed, kernels }
    }

    fn left(&self) -> MutexGuard<'_, Left> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The runs that `number` waits for.
    fn waits_for(&self, number: usize) -> impl Iterator<Item = usize> {
        self.prefix_sources[number].iter().map(|(first, _)| *first)
    }

    /// The next run; `None` if there is none left, or at the wish to stop. Runs that go on from another wait for it, and are
    /// taken before those that do not, so that little is kept.
    pub fn claim(&self, stop: &AtomicBool) -> Option<ClaimedRun<'_>> {
        let mut left = self.left();
        loop {
            let waiting = |number: &usize| left.stages[*number] == RunStage::Waiting;
            let rank = |number: usize| {
                let ready = self.waits_for(number).all(|first| left.stages[first] == RunStage::Over);
                ready.then(|| (self.waits_for(number).next().is_none(), number))
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
            left.stages[number] = RunStage::Active;
            return Some(self.taken(&mut left, number));
        }
    }

    /// Run `number` with what is left for it; what nobody waits for any more is dropped.
    fn taken(&self, left: &mut Left, number: usize) -> ClaimedRun<'_> {
        // The longest beginning that there is: a run that failed, or whose frame has grown, left shorter ones.
        let fork = |wanted: &(usize, usize)| {
            left.forks
                .iter()
                .find(|(run, fork)| (*run, fork.n_steps) == *wanted)
                .map(|(_, fork)| fork.clone())
        };
        let from = self.prefix_sources[number].iter().find_map(fork);
        let mut after: Vec<usize> = self.followers(left, number).collect();
        after.sort_unstable();
        after.dedup();
        let used =
            |(run, fork): &(usize, Arc<SharedPrefix>)| self.followers(left, *run).any(|n| n == fork.n_steps);
        let used: Vec<bool> = left.forks.iter().map(used).collect();
        let mut used = used.into_iter();
        left.forks.retain(|_| used.next().unwrap_or_default());
        ClaimedRun { queue: self, number, from, after }
    }

    /// After how many of its steps waiting runs go on from run `first`.
    fn followers(&self, left: &Left, first: usize) -> impl Iterator<Item = usize> {
        let waiting =
            left.stages.iter().zip(&self.prefix_sources).filter(|(stage, _)| **stage == RunStage::Waiting);
        waiting.flat_map(|(_, all)| all).filter(move |(run, _)| *run == first).map(|(_, steps)| *steps)
    }
}

impl ClaimedRun<'_> {
    /// Leaves states for others.
    pub fn publish(&self, forks: Vec<SharedPrefix>) {
        let forks = forks.into_iter().map(|fork| (self.number, Arc::new(fork)));
        self.queue.left().forks.extend(forks);
    }
}

impl Drop for ClaimedRun<'_> {
    fn drop(&mut self) {
        self.queue.left().stages[self.number] = RunStage::Over;
        self.queue.changed.notify_all();
    }
}
