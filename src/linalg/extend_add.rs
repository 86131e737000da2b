//! How what a front leaves is added to its parent.

use std::ops::Range;

use super::fronts::Front;
use super::lower_blocks;

/// Pieces of a child's rows that are contiguous in its parent too: (place in the child, in the parent, length), none
/// of them across the end of the parent's pivots.
fn contiguous_runs(child: &Front, parent: &Front) -> Vec<(usize, usize, usize)> {
    let mut runs: Vec<(usize, usize, usize)> = Vec::new();
    let mut below = 0;
    for (i, &row) in child.rows.iter().enumerate() {
        let place = if row < parent.start + parent.n_pivots {
            row - parent.start
        } else {
            while parent.rows[below] != row {
                below += 1;
            }
            parent.n_pivots + below
        };
        match runs.last_mut() {
            Some((_, at, length)) if *at + *length == place && place != parent.n_pivots => *length += 1,
            _ => runs.push((i, place, 1)),
        }
    }
    runs
}

/// Where the rows of a child are in its parent.
pub(super) struct ExtendAdd {
    /// Number of rows that the child leaves.
    n: usize,
    runs: Vec<(usize, usize, usize)>,
    /// Number of the runs that lie among the parent's pivots.
    n_pivot_runs: usize,
}

impl ExtendAdd {
    /// Finds the rows of `child` in `parent`.
    pub fn new(child: &Front, parent: &Front) -> Self {
        let runs = contiguous_runs(child, parent);
        let n_pivot_runs = runs.partition_point(|&(_, to, _)| to < parent.n_pivots);
        Self { n: child.rows.len(), runs, n_pivot_runs }
    }

    /// Adds the columns of `source`, what the child left, that are pivots of the parent to its `panel`.
    pub fn add_to_panel(&self, source: &[f64], parent: &Front, panel: &mut [f64]) {
        let size = parent.size();
        for r in 0..self.n_pivot_runs {
            self.add_run(r, source, panel, |column| column * size + column..(column + 1) * size);
        }
    }

    /// Adds the other columns of `source` to what the parent leaves, `remainder`.
    pub fn add_to_contribution(&self, source: &[f64], parent: &Front, remainder: &mut [f64]) {
        let (n, first) = (parent.rows.len(), parent.n_pivots);
        for r in self.n_pivot_runs..self.runs.len() {
            self.add_run(r, source, remainder, |column| lower_blocks::column(n, column - first));
        }
    }

    /// Adds the columns of run `r` to `target`; `column` says where those of the parent are from the diagonal down.
    fn add_run(&self, r: usize, source: &[f64], target: &mut [f64], column: impl Fn(usize) -> Range<usize>) {
        let (from, to, length) = self.runs[r];
        for c in 0..length {
            let source = &source[lower_blocks::column(self.n, from + c)];
            let target = &mut target[column(to + c)];
            add(&source[..length - c], target);
            for &(later, place, length) in &self.runs[r + 1..] {
                add(&source[later - from - c..][..length], &mut target[place - to - c..]);
            }
        }
    }
}

fn add(source: &[f64], target: &mut [f64]) {
    target.iter_mut().zip(source).for_each(|(t, s)| *t += s);
}
