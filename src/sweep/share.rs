//! Distribution of threads and memory over the runs of a study.

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::estimate::estimate;
use crate::scene::document::{TomlNode, TomlValue};
use crate::sweep::axes::Axis;
use crate::sweep::read::Sweep;

/// Sections of a scene whose numbers do not change the size of the problem.
const SECTIONS_WITHOUT_MEMORY: [&str; 6] = ["title", "units", "materials", "friction", "wear", "gap"];

/// Number of parallel runs, and threads of each.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Concurrency {
    /// Number of parallel runs.
    pub parallel_runs: usize,
    /// Threads of each run.
    pub threads_per_run: usize,
}

impl Sweep {
    /// Largest estimated memory of the runs with the indices `numbers`, bytes; `None` without an estimate. Runs that differ only in
    /// values without effect on memory are estimated once.
    pub fn largest_memory(&self, numbers: &[usize]) -> Option<f64> {
        let sizing: Vec<usize> =
            (0..self.axes.len()).filter(|&axis| may_change_memory(&self.axes[axis])).collect();
        let mut distinct: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
        for &number in numbers {
            let choice = &self.runs[number].choice;
            distinct.entry(sizing.iter().map(|&axis| choice[axis]).collect()).or_insert(number);
        }
        let distinct: Vec<usize> = distinct.into_values().collect();
        let memory = |&number: &usize| Some(estimate(&self.plan(number).ok()?).ok()?.memory_bytes);
        distinct.par_iter().filter_map(memory).reduce_with(f64::max)
    }
}

/// Whether the values of an axis may change the size of the problem. Strings and tables may select a law or a model.
fn may_change_memory(axis: &Axis) -> bool {
    let is_number = |node: &TomlNode| matches!(node.value, TomlValue::Integer(_) | TomlValue::Float(_));
    !axis.values.iter().flatten().all(is_number) || axis.keys.iter().any(|key| sets_size(key))
}

fn sets_size(key: &str) -> bool {
    let mut segments = key.split('.');
    let section = segments.next().unwrap_or("");
    let is_value_of_step = section == "steps" && segments.count() >= 2;
    !SECTIONS_WITHOUT_MEMORY.contains(&section) && !is_value_of_step && !key.contains(".fibre.")
}

/// Distributes `threads` over `runs` runs. Each run needs about `needed` of the `free` bytes; `None` if unknown. As
/// many runs as possible are parallel, because several threads are more effective in separate runs than in one run.
pub fn plan_concurrency(runs: usize, threads: usize, needed: Option<f64>, free: Option<u64>) -> Concurrency {
    let fit = match (needed, free) {
        (Some(needed), Some(free)) if needed > 0.0 => (free as f64 / needed) as usize,
        _ => usize::MAX,
    };
    let parallel_runs = threads.min(runs).min(fit).max(1);
    Concurrency { parallel_runs, threads_per_run: (threads / parallel_runs).max(1) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_and_memory_suffice() {
        let shares = |runs, threads, needed, free| {
            let share = plan_concurrency(runs, threads, needed, free);
            (share.parallel_runs, share.threads_per_run)
        };
        assert_eq!(shares(21, 2, None, Some(1)), (2, 1));
        assert_eq!(shares(3, 8, None, None), (3, 2));
        assert_eq!(shares(1, 4, Some(1e9), Some(1)), (1, 4));
        assert_eq!(shares(9, 8, Some(1e9), Some(2_500_000_000)), (2, 4));
        assert_eq!(shares(0, 4, None, None), (1, 4));
    }
}
