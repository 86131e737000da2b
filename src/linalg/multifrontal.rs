//! The numbers of a Cholesky factor, front by front: each takes its entries of the matrix and what its children left,
//! eliminates its pivots, and leaves a remainder to its parent.
//!
//! Independent subtrees are worked on side by side, the fronts above them one after the other with parallel dense
//! kernels. What a front computes does not depend on who computes it: same bits for any number of threads.
//!
//! # Source
//! Duff and Reid (1983), ACM Trans. Math. Softw. 9; Liu (1992), SIAM Review 34.

use std::sync::Mutex;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{LltError, cholesky_in_place, cholesky_in_place_scratch};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, MatMut, Par, Spec};
use rayon::prelude::*;

use super::dense::zeroed;
use super::fronts::{Front, FrontTree, NONE};
use super::sparse::SymmetricSparse;
use crate::error::{Error, Result};

/// Subtrees of at most this share of all operations are not split further.
const SHARE: f64 = 1.0 / 64.0;

/// Subtrees worked on side by side before the fronts that wait for them.
const ROUND: usize = 16;

/// Why a factor was not made.
pub(super) enum Failure {
    /// Memory does not suffice.
    Memory(Error),
    /// The pivot at this place is not positive.
    Pivot(usize),
}

impl From<Error> for Failure {
    fn from(error: Error) -> Self {
        Self::Memory(error)
    }
}

/// The lower triangle by columns in the order of the tree; rows of a column in no order.
struct Columns {
    offsets: Vec<usize>,
    rows: Vec<u32>,
    values: Vec<f64>,
}

impl Columns {
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
        let (mut sorted, mut sorted_values) = (vec![0u32; rows.len()], zeroed(rows.len())?);
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
) -> std::result::Result<Vec<f64>, Failure> {
    let columns = Columns::new(matrix, &tree.place)?;
    let mut values = zeroed(tree.n_values())?;
    let tasks = subtrees(tree);
    let (mut pieces, mut top) = split(tree, &tasks, &mut values);
    let stack = |&root: &usize| tree.peak_remainders(tree.first[root]..root + 1);
    let work = Work {
        tree,
        columns: &columns,
        stacks: Buffers::default(),
        stack_length: tasks.iter().map(stack).max().unwrap_or(0),
        remainders: Buffers::default(),
    };
    let mut left: Vec<Vec<f64>> = vec![Vec::new(); tree.fronts.len()];
    let mut local = vec![0; tree.order.len()];
    while !pieces.is_empty() || !top.is_empty() {
        // Remainders of a few subtrees at a time: those of all together would take more memory than L.
        let round: Vec<Share> = pieces.drain(..pieces.len().min(ROUND)).collect();
        let roots: Vec<usize> = round.iter().map(|(root, _)| *root).collect();
        let remainders: Vec<_> =
            round.into_par_iter().with_max_len(1).map(|(root, own)| work.subtree(root, own)).collect();
        for (root, remainder) in roots.into_iter().zip(remainders) {
            left[root] = remainder?;
        }
        let next = pieces.first().map_or(tree.fronts.len(), |(root, _)| tree.first[*root]);
        let ready = top.iter().take_while(|(front, _)| *front < next).count();
        for (front, panel) in top.drain(..ready) {
            left[front] = work.top_front(front, panel, &mut left, &mut local, par)?;
        }
    }
    Ok(values)
}

/// Most values that remainders and stacks take at one time, with `n_threads` subtrees side by side.
pub(super) fn peak_workspace(tree: &FrontTree, n_threads: usize) -> usize {
    let tasks = subtrees(tree);
    let stack = |&root: &usize| tree.peak_remainders(tree.first[root]..root + 1);
    let stacks = n_threads.min(ROUND) * tasks.iter().map(stack).max().unwrap_or(0);
    let mut above = vec![true; tree.fronts.len()];
    tasks.iter().for_each(|&root| above[tree.first[root]..=root].fill(false));
    let remainder = |front: usize| tree.fronts[front].n_remainder();
    let (mut held, mut peak, mut done) = (0, 0, 0);
    for first in (0..=tasks.len()).step_by(ROUND) {
        let round = &tasks[first..(first + ROUND).min(tasks.len())];
        held += round.iter().map(|&root| remainder(root)).sum::<usize>();
        let next = tasks.get(first + ROUND).map_or(tree.fronts.len(), |&root| tree.first[root]);
        for front in (done..next).filter(|&front| above[front]) {
            held += remainder(front);
            peak = peak.max(held);
            held -= tree.children(front).map(remainder).sum::<usize>();
        }
        (peak, done) = (peak.max(held), next);
    }
    stacks + peak
}

/// A subtree or a front with its values of L.
type Share<'v> = (usize, &'v mut [f64]);

/// Deals out the values: to the subtrees of `tasks`, and to the fronts above them.
fn split<'v>(tree: &FrontTree, tasks: &[usize], values: &'v mut [f64]) -> (Vec<Share<'v>>, Vec<Share<'v>>) {
    let (mut pieces, mut top) = (Vec::with_capacity(tasks.len()), Vec::new());
    let (mut rest, mut next) = (values, 0);
    for &root in tasks.iter().chain([&tree.fronts.len()]) {
        let subtree = tree.first.get(root).map_or(root..root, |&first| first..root + 1);
        for front in next..subtree.start {
            let (own, after) = std::mem::take(&mut rest).split_at_mut(tree.fronts[front].n_values());
            top.push((front, own));
            rest = after;
        }
        if !subtree.is_empty() {
            let length = tree.fronts[subtree.clone()].iter().map(Front::n_values).sum();
            let (own, after) = std::mem::take(&mut rest).split_at_mut(length);
            pieces.push((root, own));
            rest = after;
        }
        next = subtree.end;
    }
    (pieces, top)
}

/// Roots of the subtrees worked on side by side, in the order of the fronts.
fn subtrees(tree: &FrontTree) -> Vec<usize> {
    let mut flops: Vec<f64> = tree.fronts.iter().map(Front::flops).collect();
    for front in 0..tree.fronts.len() {
        if tree.fronts[front].parent != NONE {
            flops[tree.fronts[front].parent] += flops[front];
        }
    }
    let limit = SHARE * tree.flops();
    let small = |front: usize| front != NONE && flops[front] <= limit;
    (0..tree.fronts.len()).filter(|&front| small(front) && !small(tree.fronts[front].parent)).collect()
}

struct Work<'a> {
    tree: &'a FrontTree,
    columns: &'a Columns,
    /// Stacks of the subtrees, all of the size that the largest needs.
    stacks: Buffers,
    stack_length: usize,
    remainders: Buffers,
}

/// Memory that is used again: a page touched for the first time costs more than the numbers put on it.
#[derive(Default)]
struct Buffers(Mutex<Vec<Vec<f64>>>);

impl Buffers {
    /// At least `length` values of any content, and at most twice as many.
    fn take(&self, length: usize) -> Result<Vec<f64>> {
        let mut free = self.0.lock().expect("no panic while the buffers are held");
        let fits = (0..free.len()).filter(|&i| (length..=2 * length).contains(&free[i].len()));
        match fits.min_by_key(|&i| free[i].len()) {
            Some(i) => Ok(free.swap_remove(i)),
            None => {
                // Sizes grow towards the root: what is too small now will not be asked for often again.
                free.retain(|buffer| buffer.len() > length);
                zeroed(length)
            }
        }
    }

    fn give(&self, buffer: Vec<f64>) {
        self.0.lock().expect("no panic while the buffers are held").push(buffer);
    }
}

impl Work<'_> {
    /// A front above the subtrees: its remainder; those of its children are given back.
    fn top_front(
        &self,
        front: usize,
        panel: &mut [f64],
        left: &mut [Vec<f64>],
        local: &mut [u32],
        par: Par,
    ) -> std::result::Result<Vec<f64>, Failure> {
        let f = &self.tree.fronts[front];
        let mut remainder = self.remainders.take(f.n_remainder())?;
        let children: Vec<_> =
            self.tree.children(front).map(|child| (child, left[child].as_slice())).collect();
        self.front(f, panel, &children, &mut remainder[..f.n_remainder()], local, par)?;
        self.tree.children(front).for_each(|child| self.remainders.give(std::mem::take(&mut left[child])));
        Ok(remainder)
    }

    /// All fronts of the subtree of `root`, whose values are `values`; the remainder of the root.
    ///
    /// The remainders lie on a stack: the children of a front are on top when it comes, and it replaces them.
    fn subtree(&self, root: usize, values: &mut [f64]) -> std::result::Result<Vec<f64>, Failure> {
        let range = self.tree.first[root]..root + 1;
        let base = self.tree.fronts[range.start].offset;
        let mut local = vec![0; self.tree.order.len()];
        let mut stack = self.stacks.take(self.stack_length)?;
        let mut bottom = vec![0];
        for front in range {
            let f = &self.tree.fronts[front];
            let panel = &mut values[f.offset - base..][..f.n_values()];
            let children = self.tree.children(front);
            let n_children = children.clone().count();
            let top = bottom[bottom.len() - 1];
            let below = bottom.len() - 1 - n_children;
            let (waiting, free) = stack.split_at_mut(top);
            let of_children = children.zip(&bottom[below..]).map(|(child, &from)| (child, &waiting[from..]));
            let length = f.n_remainder();
            self.front(
                f,
                panel,
                &of_children.collect::<Vec<_>>(),
                &mut free[..length],
                &mut local,
                Par::Seq,
            )?;
            bottom.truncate(below + 1);
            stack.copy_within(top..top + length, bottom[below]);
            bottom.push(bottom[below] + length);
        }
        let mut remainder = self.remainders.take(bottom[1])?;
        remainder[..bottom[1]].copy_from_slice(&stack[..bottom[1]]);
        self.stacks.give(stack);
        Ok(remainder)
    }

    /// One front: its columns of L into `panel` (zeros before), its remainder into `remainder`, lower triangle by
    /// columns, from the remainders of its children.
    fn front(
        &self,
        front: &Front,
        panel: &mut [f64],
        children: &[(usize, &[f64])],
        remainder: &mut [f64],
        local: &mut [u32],
        par: Par,
    ) -> std::result::Result<(), Failure> {
        self.take_entries(front, panel, local);
        let children: Vec<Remainder> = children
            .iter()
            .map(|&(child, values)| Remainder::new(&self.tree.fronts[child], values, front))
            .collect();
        children.iter().for_each(|child| child.add_to_panel(front, panel));
        eliminate(front, panel, remainder, par)?;
        children.iter().for_each(|child| child.add_to_remainder(front, remainder));
        Ok(())
    }

    fn take_entries(&self, front: &Front, panel: &mut [f64], local: &mut [u32]) {
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

/// Pieces of a child's rows that are contiguous in its parent too: (place in the child, in the parent, length), none
/// of them across the end of the parent's pivots.
fn runs(child: &Front, parent: &Front) -> Vec<(usize, usize, usize)> {
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

/// What a child left, and where its rows are in its parent.
struct Remainder<'a> {
    values: &'a [f64],
    /// Number of its rows.
    n: usize,
    runs: Vec<(usize, usize, usize)>,
    /// Number of the runs that lie among the parent's pivots.
    n_pivot_runs: usize,
}

impl<'a> Remainder<'a> {
    fn new(child: &Front, values: &'a [f64], parent: &Front) -> Self {
        let runs = runs(child, parent);
        let n_pivot_runs = runs.partition_point(|&(_, to, _)| to < parent.n_pivots);
        Self { values, n: child.rows.len(), runs, n_pivot_runs }
    }

    /// Adds its columns among the parent's pivots.
    fn add_to_panel(&self, parent: &Front, panel: &mut [f64]) {
        for r in 0..self.n_pivot_runs {
            self.add_run(r, 0, parent.size(), panel);
        }
    }

    /// Adds its other columns.
    fn add_to_remainder(&self, parent: &Front, remainder: &mut [f64]) {
        for r in self.n_pivot_runs..self.runs.len() {
            self.add_run(r, parent.n_pivots, parent.rows.len(), remainder);
        }
    }

    /// Adds the columns of a run to a matrix of `height` rows whose first row and column is row `first` of the parent.
    fn add_run(&self, r: usize, first: usize, height: usize, target: &mut [f64]) {
        let (from, to, length) = self.runs[r];
        for c in 0..length {
            let source = &self.values[(from + c) * self.n..(from + c + 1) * self.n];
            let column = &mut target[(to + c - first) * height..(to + c - first + 1) * height];
            add(&source[from + c..from + length], &mut column[to + c - first..]);
            for &(from, to, length) in &self.runs[r + 1..] {
                add(&source[from..from + length], &mut column[to - first..]);
            }
        }
    }
}

fn add(source: &[f64], target: &mut [f64]) {
    target.iter_mut().zip(source).for_each(|(t, s)| *t += s);
}

/// L11 L11^T = A11, L21 = A21 L11^-T, remainder = -L21 L21^T (lower triangle).
fn eliminate(
    front: &Front,
    panel: &mut [f64],
    remainder: &mut [f64],
    par: Par,
) -> std::result::Result<(), Failure> {
    let (k, r) = (front.n_pivots, front.rows.len());
    let columns = MatMut::from_column_major_slice_mut(panel, k + r, k);
    let (mut pivots, mut below) = columns.split_at_row_mut(k);
    let request = cholesky_in_place_scratch::<f64>(k, par, Spec::default());
    let mut memory = MemBuffer::try_new(request).map_err(|_| {
        Error::resources("not enough memory to factorise the stiffness matrix; use a coarser mesh")
    })?;
    cholesky_in_place(pivots.as_mut(), Default::default(), par, MemStack::new(&mut memory), Spec::default())
        .map_err(|LltError::NonPositivePivot { index }| Failure::Pivot(front.start + index))?;
    if r > 0 {
        solve_lower_triangular_in_place(pivots.as_ref(), below.as_mut().transpose_mut(), par);
        let structure = [BlockStructure::TriangularLower, BlockStructure::Rectangular];
        matmul(
            MatMut::from_column_major_slice_mut(remainder, r, r),
            structure[0],
            Accum::Replace,
            below.as_ref(),
            structure[1],
            below.as_ref().transpose(),
            structure[1],
            -1.0,
            par,
        );
    }
    Ok(())
}
