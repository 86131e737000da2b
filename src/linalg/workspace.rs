//! Where what each front leaves waits for its parent: planned before any number is computed.
//!
//! Memory touched for the first time costs more than the numbers put into it, so places are used again as soon as they
//! are free, and the whole is no larger than it must be.

use std::ops::Range;

use super::fronts::{Front, FrontTree, NONE};

/// Subtrees of at most this share of all operations are worked on by one thread.
const SHARE: f64 = 1.0 / 64.0;

/// Subtrees worked on side by side before the fronts that wait for them: what all of them leave together would take
/// more memory than L.
const ROUND: usize = 16;

/// Some subtrees, which do not depend on each other, and then some fronts above them, one after the other.
pub(super) struct Round {
    /// Roots of the subtrees.
    pub subtrees: Vec<usize>,
    /// The fronts.
    pub fronts: Vec<usize>,
}

/// The order of work, and the place of what each front leaves.
pub(super) struct Workspace {
    /// All subtrees and all fronts that belong to none.
    pub rounds: Vec<Round>,
    /// Values of the memory that all threads share: for the roots of subtrees and the fronts above.
    pub shared: usize,
    /// Values of the memory that a thread needs for a subtree.
    pub own: usize,
    place: Vec<Range<usize>>,
}

impl Workspace {
    /// Plans the work on a tree.
    pub fn new(tree: &FrontTree) -> Self {
        let mut space = Self {
            rounds: rounds(tree),
            shared: 0,
            own: 0,
            place: tree.fronts.iter().map(|_| 0..0).collect(),
        };
        let mut shared = Free::default();
        for round in 0..space.rounds.len() {
            for i in 0..space.rounds[round].subtrees.len() {
                let root = space.rounds[round].subtrees[i];
                let mut own = Free::default();
                (tree.first[root]..root).for_each(|front| space.settle(tree, front, &mut own));
                space.own = space.own.max(own.end);
                space.place[root] = shared.take(tree.fronts[root].n_remainder());
            }
            for i in 0..space.rounds[round].fronts.len() {
                let front = space.rounds[round].fronts[i];
                space.settle(tree, front, &mut shared);
            }
        }
        space.shared = shared.end;
        space
    }

    /// Takes a place for a front, and frees those of its children.
    fn settle(&mut self, tree: &FrontTree, front: usize, free: &mut Free) {
        self.place[front] = free.take(tree.fronts[front].n_remainder());
        tree.children(front).for_each(|child| free.give(self.place[child].clone()));
    }

    /// Where a front's remainder lies: in a thread's memory if it is inside a subtree, in the shared memory if not.
    pub fn place(&self, front: usize) -> Range<usize> {
        self.place[front].clone()
    }
}

/// Free places in a memory that grows when none is large enough.
#[derive(Default)]
struct Free {
    /// Ascending, none touching the next.
    places: Vec<Range<usize>>,
    end: usize,
}

impl Free {
    /// The smallest free place that is large enough.
    fn take(&mut self, length: usize) -> Range<usize> {
        let fits = (0..self.places.len()).filter(|&i| self.places[i].len() >= length);
        if let Some(i) = fits.min_by_key(|&i| self.places[i].len()) {
            let start = self.places[i].start;
            self.places[i].start += length;
            if self.places[i].is_empty() {
                self.places.remove(i);
            }
            return start..start + length;
        }
        let start = match self.places.last() {
            Some(last) if last.end == self.end => self.places.pop().map_or(self.end, |last| last.start),
            _ => self.end,
        };
        self.end = start + length;
        start..self.end
    }

    fn give(&mut self, place: Range<usize>) {
        if place.is_empty() {
            return;
        }
        let i = self.places.partition_point(|free| free.start < place.start);
        self.places.insert(i, place);
        if i + 1 < self.places.len() && self.places[i].end == self.places[i + 1].start {
            self.places[i].end = self.places.remove(i + 1).end;
        }
        if i > 0 && self.places[i - 1].end == self.places[i].start {
            self.places[i - 1].end = self.places.remove(i).end;
        }
    }
}

fn rounds(tree: &FrontTree) -> Vec<Round> {
    let roots = subtrees(tree);
    let mut above = vec![true; tree.fronts.len()];
    roots.iter().for_each(|&root| above[tree.first[root]..=root].fill(false));
    let mut done = 0;
    let mut rounds = Vec::new();
    for start in (0..roots.len().max(1)).step_by(ROUND) {
        let end = (start + ROUND).min(roots.len());
        let next = roots.get(end).map_or(tree.fronts.len(), |&root| tree.first[root]);
        let fronts = (done..next).filter(|&front| above[front]).collect();
        rounds.push(Round { subtrees: roots[start..end].to_vec(), fronts });
        done = next;
    }
    rounds
}

/// Roots of the subtrees worked on by one thread each, in the order of the fronts.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: places in use do not overlap, and what is given back is used again.
    #[test]
    fn places_in_use_are_apart() {
        let mut free = Free::default();
        let (a, b, c) = (free.take(5), free.take(3), free.take(4));
        assert_eq!((a.clone(), b.clone(), c.clone()), (0..5, 5..8, 8..12));
        free.give(a);
        free.give(c);
        assert_eq!(free.take(5), 0..5);
        assert_eq!(free.take(6), 8..14);
        free.give(b);
        free.give(8..14);
        assert_eq!((free.take(9), free.end), (5..14, 14));
    }
}
