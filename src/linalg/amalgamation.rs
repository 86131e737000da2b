//! Which groups of unknowns are eliminated in one front: those of nested patterns, and small fronts with their parents.

use super::fronts::NO_PARENT;

/// When a front is merged into its parent: with at most so many pivots together, if at most this share of the merged
/// columns is zeros. Small fronts cost more by their handling than by their zeros.
const RELAXATION_LIMITS: [(usize, f64); 4] = [(12, 0.8), (36, 0.25), (144, 0.05), (usize::MAX, 0.01)];

/// Fronts while they are being merged; groups stand for rows.
pub(super) struct Amalgamation {
    /// Parent of each front.
    pub parent: Vec<usize>,
    /// Pivot groups.
    pub pivots: Vec<Vec<usize>>,
    /// Number of pivot rows.
    n_pivots: Vec<usize>,
    /// Rows of the dense matrix.
    size: Vec<usize>,
    /// Zeros among the columns stored.
    zeros: Vec<f64>,
    /// The front of the trailing rows, which takes no others.
    root: usize,
}

/// Entries of the trapezoid of `k` columns in `size` rows.
pub(super) fn trapezoid(k: usize, size: usize) -> f64 {
    (k * size) as f64 - (k * k.saturating_sub(1)) as f64 / 2.0
}

impl Amalgamation {
    /// Maximal sets of groups with nested patterns, children before parents; the trailing groups (all from
    /// `parent.len()` on) are the last front.
    pub fn new(parent: &[usize], counts: &[usize], weights: &[usize]) -> Self {
        let mut front_of: Vec<usize> = Vec::with_capacity(weights.len());
        let mut merging = Self {
            parent: vec![],
            pivots: vec![],
            n_pivots: vec![],
            size: vec![],
            zeros: vec![],
            root: NO_PARENT,
        };
        for group in 0..parent.len() {
            let before = group.wrapping_sub(1);
            if group == 0 || parent[before] != group || counts[before] != counts[group] + weights[before] {
                merging.add(counts[group]);
            }
            front_of.push(merging.pivots.len() - 1);
            merging.push(group, weights[group]);
        }
        if parent.len() < weights.len() {
            merging.root = merging.pivots.len();
            merging.add(weights[parent.len()..].iter().sum());
            (parent.len()..weights.len()).for_each(|group| merging.push(group, weights[group]));
            front_of.push(merging.root);
        }
        let last = |pivots: &Vec<usize>| *pivots.last().expect("a front has pivots");
        let above = |pivots| parent.get(last(pivots)).map_or(NO_PARENT, |&group| group);
        merging.parent = merging
            .pivots
            .iter()
            .map(above)
            .map(|g| if g == NO_PARENT { NO_PARENT } else { front_of[g] })
            .collect();
        merging
    }

    fn add(&mut self, size: usize) {
        self.pivots.push(Vec::new());
        self.n_pivots.push(0);
        self.size.push(size);
        self.zeros.push(0.0);
    }

    fn push(&mut self, group: usize, weight: usize) {
        let front = self.pivots.len() - 1;
        self.pivots[front].push(group);
        self.n_pivots[front] += weight;
    }

    /// Merges fronts into their parents where that adds few zeros, the parent's best children first.
    pub fn amalgamate(&mut self) {
        let n = self.parent.len();
        let mut children = vec![Vec::new(); n];
        (0..n).filter(|&f| self.parent[f] != NO_PARENT).for_each(|f| children[self.parent[f]].push(f));
        let root = self.root;
        for front in (0..n).filter(|&front| front != root) {
            let mut own = std::mem::take(&mut children[front]);
            own.sort_by_key(|&child| (self.size[front] + self.n_pivots[child] - self.size[child], child));
            let mut kept = Vec::new();
            for child in own {
                if self.should_merge(child, front) {
                    self.merge(child, front);
                    let grandchildren = std::mem::take(&mut children[child]);
                    grandchildren.iter().for_each(|&f| self.parent[f] = front);
                    kept.extend(grandchildren);
                } else {
                    kept.push(child);
                }
            }
            children[front] = kept;
        }
    }

    fn zeros_of(&self, child: usize, front: usize) -> f64 {
        let (k, size) = (self.n_pivots[child], self.size[child]);
        let added = trapezoid(k, k + self.size[front]) - trapezoid(k, size);
        added + self.zeros[child] + self.zeros[front]
    }

    fn should_merge(&self, child: usize, front: usize) -> bool {
        let k = self.n_pivots[child] + self.n_pivots[front];
        let stored = trapezoid(k, self.n_pivots[child] + self.size[front]);
        let share = self.zeros_of(child, front) / stored;
        let limit =
            RELAXATION_LIMITS.iter().find(|(most, _)| k <= *most).expect("the last limit has no end").1;
        share <= limit
    }

    fn merge(&mut self, child: usize, front: usize) {
        self.zeros[front] = self.zeros_of(child, front);
        self.size[front] += self.n_pivots[child];
        self.n_pivots[front] += self.n_pivots[child];
        let mut pivots = std::mem::take(&mut self.pivots[child]);
        pivots.append(&mut self.pivots[front]);
        self.pivots[front] = pivots;
    }

    /// The fronts left, every subtree contiguous and before its root; children in the order that keeps the memory of
    /// their remainders small (Liu 1986).
    pub fn memory_saving_postorder(&self) -> Vec<usize> {
        let n = self.parent.len();
        let mut children = vec![Vec::new(); n];
        let mut peak = vec![0.0f64; n];
        let mut roots = Vec::new();
        for front in (0..n).filter(|&f| !self.pivots[f].is_empty()) {
            let remainder = |f: usize| ((self.size[f] - self.n_pivots[f]) as f64).powi(2);
            let own: &mut Vec<usize> = &mut children[front];
            own.sort_by(|&a, &b| {
                (peak[b] - remainder(b)).total_cmp(&(peak[a] - remainder(a))).then(a.cmp(&b))
            });
            let mut held = 0.0;
            for &child in own.iter() {
                peak[front] = f64::max(peak[front], held + peak[child]);
                held += remainder(child);
            }
            peak[front] = peak[front].max(held + (self.size[front] as f64).powi(2));
            match self.parent[front] {
                NO_PARENT => roots.push(front),
                parent => children[parent].push(front),
            }
        }
        let mut sequence = Vec::with_capacity(n);
        let mut path: Vec<(usize, usize)> = Vec::new();
        for root in roots {
            path.push((root, 0));
            while let Some((front, next)) = path.last_mut() {
                if let Some(&child) = children[*front].get(*next) {
                    *next += 1;
                    path.push((child, 0));
                } else {
                    sequence.push(*front);
                    path.pop();
                }
            }
        }
        sequence
    }
}
