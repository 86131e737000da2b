//! The numbers of a Cholesky factor, front by front: each takes its entries of the matrix and what its children left,
//! eliminates its pivots, and leaves a remainder to its parent.
//!
//! Independent subtrees are worked on side by side, the fronts above them one after the other with parallel dense
//! kernels. What a front computes does not depend on who computes it: same bits for any number of threads.
//!
//! # Source
//! Duff and Reid (1983), ACM Trans. Math. Softw. 9; Liu (1992), SIAM Review 34.

use std::ops::Range;
use std::sync::Mutex;

use faer::{MatMut, Par};
use rayon::prelude::*;

use super::dense::try_zeroed;
use super::extend_add::ExtendAdd;
use super::front_elimination;
use super::fronts::{Front, FrontTree};
use super::schedule::FactorisationSchedule;
use super::sparse::SymmetricSparse;
use crate::cancel;
use crate::error::{Error, Result};

/// Why a factor was not made.
pub(super) enum FactorisationFailure {
    /// Memory does not suffice, or a stop is wished.
    Other(Error),
    /// The pivot at this place is not positive.
    NonPositivePivot(usize),
}

impl From<Error> for FactorisationFailure {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

/// The lower triangle by columns in the order of the tree; rows of a column in no order.
struct PermutedLower {
    offsets: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl PermutedLower {
    fn new(matrix: &SymmetricSparse, place: &[usize]) -> Result<Self> {
        let (starts, rows, values) = matrix.lower();
        let mut offsets = vec![0usize; matrix.n() + 1];
        for column in 0..matrix.n() {
            for &row in &rows[starts[column]..starts[column + 1]] {
                offsets[place[row].min(place[column]) + 1] += 1;
            }
        }
        (0..matrix.n()).for_each(|i| offsets[i + 1] += offsets[i]);
        let mut next = offsets.clone();
        let (mut sorted, mut sorted_values) = (vec![0u32; rows.len()], try_zeroed(rows.len())?);
        for column in 0..matrix.n() {
            for k in starts[column]..starts[column + 1] {
                let (a, b) = (place[rows[k]], place[column]);
                let at = &mut next[a.min(b)];
                sorted[*at] = a.max(b) as u32;
                sorted_values[*at] = values[k];
                *at += 1;
            }
        }
        Ok(Self { offsets, rows: sorted, values: sorted_values })
    }
}

/// Computes the stored values of L; see [`Front`] for their layout.
pub(super) fn factorise(
    tree: &FrontTree,
    matrix: &SymmetricSparse,
    par: Par,
) -> std::result::Result<Vec<f64>, FactorisationFailure> {
    let space = FactorisationSchedule::new(tree);
    let mut values = try_zeroed(tree.n_values())?;
    let mut shared = try_zeroed(space.shared_len)?;
    let work = Factorisation {
        tree,
        columns: &PermutedLower::new(matrix, &tree.place_of_row)?,
        schedule: &space,
        thread_buffers: Mutex::default(),
    };
    let (mut rest, mut taken) = (values.as_mut_slice(), 0);
    let mut local = vec![0; tree.order.len()];
    for round in &space.rounds {
        // Subtrees and fronts of a round lie side by side among the values, whoever is worked on first.
        let mut ranges: Vec<Range<usize>> = round
            .subtrees
            .iter()
            .map(|&root| tree.values_of(tree.first_in_subtree[root]..root + 1))
            .collect();
        ranges.extend(round.fronts.iter().map(|&front| tree.values_of(front..front + 1)));
        let length = ranges.iter().map(Range::len).sum();
        let (own, after) = rest.split_at_mut(length);
        ranges.iter_mut().for_each(|range| *range = range.start - taken..range.end - taken);
        (rest, taken) = (after, taken + length);
        let mut panels = disjoint(own, &ranges);
        let of_fronts = panels.split_off(round.subtrees.len());
        let places: Vec<_> = round.subtrees.iter().map(|&root| space.contribution_range(root)).collect();
        let subtrees: Vec<_> =
            round.subtrees.iter().zip(panels).zip(disjoint(&mut shared, &places)).collect();
        let subtree = |((&root, panel), left)| work.factorise_subtree(root, panel, left);
        match par {
            Par::Seq => subtrees.into_iter().try_for_each(subtree)?,
            Par::Rayon(_) => {
                let outcomes: Vec<_> = subtrees.into_par_iter().with_max_len(1).map(subtree).collect();
                outcomes.into_iter().collect::<std::result::Result<(), _>>()?;
            }
        }
        for (&front, panel) in round.fronts.iter().zip(of_fronts) {
            work.factorise_front(
                front,
                panel,
                FrontBuffers { contributions: &mut shared, own_contribution: None, row_in_front: &mut local },
                par,
            )?;
        }
    }
    Ok(values)
}

/// Most values that remainders take at one time, with `n_threads` subtrees side by side.
pub(super) fn peak_workspace(tree: &FrontTree, n_threads: usize) -> usize {
    let space = FactorisationSchedule::new(tree);
    let widest = space.rounds.iter().map(|round| round.subtrees.len()).max().unwrap_or(0);
    space.shared_len + n_threads.min(widest) * space.thread_len
}

/// The parts of `values` in `ranges`, which do not overlap; in the order of `ranges`.
fn disjoint<'v>(values: &'v mut [f64], ranges: &[Range<usize>]) -> Vec<&'v mut [f64]> {
    let mut sorted: Vec<usize> = (0..ranges.len()).collect();
    sorted.sort_by_key(|&i| (ranges[i].start, ranges[i].end));
    let mut parts: Vec<&mut [f64]> = ranges.iter().map(|_| Default::default()).collect();
    let (mut rest, mut at) = (values, 0);
    for i in sorted {
        let (_, from) = rest.split_at_mut(ranges[i].start - at);
        (parts[i], rest) = from.split_at_mut(ranges[i].len());
        at = ranges[i].end;
    }
    parts
}

struct Factorisation<'a> {
    tree: &'a FrontTree,
    columns: &'a PermutedLower,
    schedule: &'a FactorisationSchedule,
    /// What threads use for subtrees: remainders, and places of rows in a front.
    thread_buffers: Mutex<Vec<(Vec<f64>, Vec<u32>)>>,
}

/// What a front works in besides its columns of L.
struct FrontBuffers<'m> {
    /// Where the remainders of its children are, and its own unless it is in `left`.
    contributions: &'m mut [f64],
    own_contribution: Option<&'m mut [f64]>,
    /// A number per row.
    row_in_front: &'m mut [u32],
}

impl Factorisation<'_> {
    /// All fronts of the subtree of `root`, whose values are `values`; what the root leaves goes to `left`.
    fn factorise_subtree(
        &self,
        root: usize,
        values: &mut [f64],
        left: &mut [f64],
    ) -> std::result::Result<(), FactorisationFailure> {
        let used = self.thread_buffers.lock().expect("no panic while the memory is held").pop();
        let (mut waiting, mut local) = match used {
            Some(memory) => memory,
            None => (try_zeroed(self.schedule.thread_len)?, vec![0; self.tree.order.len()]),
        };
        let (base, mut left) = (self.tree.fronts[self.tree.first_in_subtree[root]].offset, Some(left));
        for front in self.tree.first_in_subtree[root]..root + 1 {
            let range = self.tree.values_of(front..front + 1);
            let own_contribution = if front == root { left.take() } else { None };
            let memory =
                FrontBuffers { contributions: &mut waiting, own_contribution, row_in_front: &mut local };
            self.factorise_front(front, &mut values[range.start - base..range.end - base], memory, Par::Seq)?;
        }
        self.thread_buffers.lock().expect("no panic while the memory is held").push((waiting, local));
        Ok(())
    }

    /// One front: its columns of L into `panel`, and what it leaves, from its entries and what its children left.
    fn factorise_front(
        &self,
        index: usize,
        panel: &mut [f64],
        memory: FrontBuffers<'_>,
        par: Par,
    ) -> std::result::Result<(), FactorisationFailure> {
        cancel::check()?;
        let FrontBuffers { contributions, mut own_contribution, row_in_front } = memory;
        let front = &self.tree.fronts[index];
        let children: Vec<(ExtendAdd, Range<usize>)> = self
            .tree
            .children(index)
            .map(|child| {
                (ExtendAdd::new(&self.tree.fronts[child], front), self.schedule.contribution_range(child))
            })
            .collect();
        // Fresh memory is written before it is read: a page read first would be mapped twice.
        panel.fill(0.0);
        self.scatter_matrix_entries(front, panel, row_in_front);
        children
            .iter()
            .for_each(|(child, place)| child.add_to_panel(&contributions[place.clone()], front, panel));
        let own = self.schedule.contribution_range(index);
        let columns = MatMut::from_column_major_slice_mut(panel, front.size(), front.n_pivots);
        let remainder = match own_contribution.as_deref_mut() {
            Some(left) => left,
            None => &mut contributions[own.clone()],
        };
        front_elimination::eliminate_pivots(columns, remainder, par)
            .map_err(|i| FactorisationFailure::NonPositivePivot(front.start + i))?;
        cancel::check()?;
        for (child, place) in children {
            match own_contribution.as_deref_mut() {
                Some(left) => child.add_to_contribution(&contributions[place], front, left),
                None => {
                    let [source, target] = contributions
                        .get_disjoint_mut([place, own.clone()])
                        .expect("places in use do not overlap");
                    child.add_to_contribution(source, front, target);
                }
            }
        }
        Ok(())
    }

    fn scatter_matrix_entries(&self, front: &Front, panel: &mut [f64], local: &mut [u32]) {
        let (size, end) = (front.size(), front.start + front.n_pivots);
        for (i, &row) in front.rows.iter().enumerate() {
            local[row] = (front.n_pivots + i) as u32;
        }
        for j in 0..front.n_pivots {
            let column = &mut panel[j * size..(j + 1) * size];
            let range = self.columns.offsets[front.start + j]..self.columns.offsets[front.start + j + 1];
            for (&row, &value) in self.columns.rows[range.clone()].iter().zip(&self.columns.values[range]) {
                let row = row as usize;
                let at = if row < end { row - front.start } else { local[row] as usize };
                column[at] += value;
            }
        }
    }
}
