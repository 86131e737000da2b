//! Where what each front leaves waits for its parent: planned before any number is computed.
//!
//! Memory touched for the first time costs more than the numbers put into it, so places are used again as soon as they
//! are free, and the whole is no larger than it must be.

use std::ops::Range;

use super::fronts::{Front, FrontTree, NO_PARENT};

/// Subtrees of at most this share of all operations are worked on by one thread.
const MAX_SUBTREE_SHARE: f64 = 1.0 / 64.0;

/// Subtrees worked on side by side before the fronts that wait for them: what all of them leave together would take
/// more memory than L.
const SUBTREES_PER_ROUND: usize = 16;

/// Some subtrees, which do not depend on each other, and then some fronts above them, one after the other.
pub(super) struct Round {
    /// Roots of the subtrees.
    pub subtrees: Vec<usize>,
    /// The fronts.
    pub fronts: Vec<usize>,
}

/// The order of work, and the place of what each front leaves.
pub(super) struct FactorisationSchedule {
    /// All subtrees and all fronts that belong to none.
    pub rounds: Vec<Round>,
    /// Values of the memory that all threads share: for the roots of subtrees and the fronts above.
    pub shared_len: usize,
    /// Values of the memory that a thread needs for a subtree.
    pub thread_len: usize,
    contribution_ranges: Vec<Range<usize>>,
}

impl FactorisationSchedule {
    /// Plans the work on a tree.
    pub fn new(tree: &FrontTree) -> Self {
        let mut space = Self {
            rounds: rounds(tree),
            shared_len: 0,
            thread_len: 0,
            contribution_ranges: tree.fronts.iter().map(|_| 0..0).collect(),
        };
        let mut shared = FreeRanges::default();
        for round in 0..space.rounds.len() {
            for i in 0..space.rounds[round].subtrees.len() {
                let root = space.rounds[round].subtrees[i];
                let mut own = FreeRanges::default();
                (tree.first_in_subtree[root]..root).for_each(|front| space.allocate(tree, front, &mut own));
                space.thread_len = space.thread_len.max(own.end);
                space.contribution_ranges[root] = shared.allocate(tree.fronts[root].contribution_len());
            }
            for i in 0..space.rounds[round].fronts.len() {
                let front = space.rounds[round].fronts[i];
                space.allocate(tree, front, &mut shared);
            }
        }
        space.shared_len = shared.end;
        space
    }

    /// Takes a place for a front, and frees those of its children.
    fn allocate(&mut self, tree: &FrontTree, front: usize, free: &mut FreeRanges) {
        self.contribution_ranges[front] = free.allocate(tree.fronts[front].contribution_len());
        tree.children(front).for_each(|child| free.release(self.contribution_ranges[child].clone()));
    }

    /// Where a front's remainder lies: in a thread's memory if it is inside a subtree, in the shared memory if not.
    pub fn contribution_range(&self, front: usize) -> Range<usize> {
        self.contribution_ranges[front].clone()
    }
}

/// Free places in a memory that grows when none is large enough.
#[derive(Default)]
struct FreeRanges {
    /// Ascending, none touching the next.
    ranges: Vec<Range<usize>>,
    end: usize,
}

impl FreeRanges {
    /// The smallest free place that is large enough.
    fn allocate(&mut self, length: usize) -> Range<usize> {
        let fits = (0..self.ranges.len()).filter(|&i| self.ranges[i].len() >= length);
        if let Some(i) = fits.min_by_key(|&i| self.ranges[i].len()) {
            let start = self.ranges[i].start;
            self.ranges[i].start += length;
            if self.ranges[i].is_empty() {
                self.ranges.remove(i);
            }
            return start..start + length;
        }
        let start = match self.ranges.last() {
            Some(last) if last.end == self.end => self.ranges.pop().map_or(self.end, |last| last.start),
            _ => self.end,
        };
        self.end = start + length;
        start..self.end
    }

    fn release(&mut self, place: Range<usize>) {
        if place.is_empty() {
            return;
        }
        let i = self.ranges.partition_point(|free| free.start < place.start);
        self.ranges.insert(i, place);
        if i + 1 < self.ranges.len() && self.ranges[i].end == self.ranges[i + 1].start {
            self.ranges[i].end = self.ranges.remove(i + 1).end;
        }
        if i > 0 && self.ranges[i - 1].end == self.ranges[i].start {
            self.ranges[i - 1].end = self.ranges.remove(i).end;
        }
    }
}

fn rounds(tree: &FrontTree) -> Vec<Round> {
    let roots = independent_subtrees(tree);
    let mut above = vec![true; tree.fronts.len()];
    roots.iter().for_each(|&root| above[tree.first_in_subtree[root]..=root].fill(false));
    let mut done = 0;
    let mut rounds = Vec::new();
    for start in (0..roots.len().max(1)).step_by(SUBTREES_PER_ROUND) {
        let end = (start + SUBTREES_PER_ROUND).min(roots.len());
        let next = roots.get(end).map_or(tree.fronts.len(), |&root| tree.first_in_subtree[root]);
        let fronts = (done..next).filter(|&front| above[front]).collect();
        rounds.push(Round { subtrees: roots[start..end].to_vec(), fronts });
        done = next;
    }
    rounds
}

/// Roots of the subtrees worked on by one thread each, in the order of the fronts.
fn independent_subtrees(tree: &FrontTree) -> Vec<usize> {
    let mut flops: Vec<f64> = tree.fronts.iter().map(Front::flops).collect();
    for front in 0..tree.fronts.len() {
        if tree.fronts[front].parent != NO_PARENT {
            flops[tree.fronts[front].parent] += flops[front];
        }
    }
    let limit = MAX_SUBTREE_SHARE * tree.flops();
    let small = |front: usize| front != NO_PARENT && flops[front] <= limit;
    (0..tree.fronts.len()).filter(|&front| small(front) && !small(tree.fronts[front].parent)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: places in use do not overlap, and what is given back is used again.
    #[test]
    fn places_in_use_are_apart() {
        let mut free = FreeRanges::default();
        let (a, b, c) = (free.allocate(5), free.allocate(3), free.allocate(4));
        assert_eq!((a.clone(), b.clone(), c.clone()), (0..5, 5..8, 8..12));
        free.release(a);
        free.release(c);
        assert_eq!(free.allocate(5), 0..5);
        assert_eq!(free.allocate(6), 8..14);
        free.release(b);
        free.release(8..14);
        assert_eq!((free.allocate(9), free.end), (5..14, 14));
    }
}
