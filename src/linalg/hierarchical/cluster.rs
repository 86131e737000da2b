//! A binary tree of points in the plane: each cluster is cut in the middle of the longer side of its box.

use std::ops::Range;

/// A rectangle along the axes: least and largest coordinates, mm.
pub type Extent = [[f64; 2]; 2];

/// Points that lie together.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster {
    /// Their places in the order of the tree.
    pub range: Range<usize>,
    /// The smallest rectangle around what belongs to them.
    pub extent: Extent,
    /// The two halves; `None` of a leaf.
    pub halves: Option<[usize; 2]>,
}

impl Cluster {
    /// Diagonal of the extent.
    pub fn diameter(&self) -> f64 {
        let [low, high] = self.extent;
        (high[0] - low[0]).hypot(high[1] - low[1])
    }

    /// Distance of two extents, zero where they touch.
    pub fn distance(&self, other: &Self) -> f64 {
        let apart = |axis: usize| {
            let gap = self.extent[0][axis] - other.extent[1][axis];
            gap.max(other.extent[0][axis] - self.extent[1][axis]).max(0.0)
        };
        apart(0).hypot(apart(1))
    }
}

/// The clusters, the root first and halves after their whole, and the order of the points in which each is a range.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusterTree {
    /// All clusters.
    pub clusters: Vec<Cluster>,
    /// Index of the point at each place, `[N]`.
    pub order: Vec<usize>,
}

impl ClusterTree {
    /// Leaves have `leaf` points at most, unless those lie in one place. `points` `[N]` are what is cut by, `extents`
    /// `[N]` what belongs to each.
    pub fn new(points: &[[f64; 2]], extents: &[Extent], leaf: usize) -> Self {
        let mut order: Vec<usize> = (0..points.len()).collect();
        let mut clusters = vec![cluster(&order, extents, 0..points.len())];
        let mut next = 0;
        while next < clusters.len() {
            let range = clusters[next].range.clone();
            if range.len() > leaf
                && let Some(size) = cut(points, &mut order[range.clone()])
            {
                let middle = range.start + size;
                clusters[next].halves = Some([clusters.len(), clusters.len() + 1]);
                for half in [range.start..middle, middle..range.end] {
                    clusters.push(cluster(&order, extents, half));
                }
            }
            next += 1;
        }
        Self { clusters, order }
    }

    /// Ranges of clusters with `size` points at most, as large as there are; they hold every place once, ascending.
    pub fn parts(&self, size: usize) -> Vec<Range<usize>> {
        let (mut parts, mut waiting) = (Vec::new(), vec![0]);
        while let Some(index) = waiting.pop() {
            let cluster = &self.clusters[index];
            match cluster.halves {
                Some([first, second]) if cluster.range.len() > size => waiting.extend([second, first]),
                _ => parts.push(cluster.range.clone()),
            }
        }
        parts
    }
}

fn cluster(order: &[usize], extents: &[Extent], range: Range<usize>) -> Cluster {
    let of_points = order[range.clone()].iter().map(|&point| extents[point]);
    let extent =
        of_points.fold([[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]], |[low, high], [least, most]| {
            [[0, 1].map(|k| low[k].min(least[k])), [0, 1].map(|k| high[k].max(most[k]))]
        });
    Cluster { range, extent, halves: None }
}

/// Puts the points on one side of the cut before those on the other; how many those are, `None` if all are in one
/// place.
fn cut(points: &[[f64; 2]], order: &mut [usize]) -> Option<usize> {
    let bounds = [0, 1].map(|axis| {
        let along = order.iter().map(|&point| points[point][axis]);
        along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
    });
    let longer = usize::from(bounds[1][1] - bounds[1][0] > bounds[0][1] - bounds[0][0]);
    let [low, high] = bounds[longer];
    let middle = 0.5 * (low + high);
    // Stable, so that the order depends on the points only.
    let (mut before, after): (Vec<usize>, Vec<usize>) =
        order.iter().partition(|&&point| points[point][longer] < middle);
    let size = before.len();
    before.extend(after);
    order.copy_from_slice(&before);
    (size > 0 && size < order.len()).then_some(size)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spiral(n: usize) -> Vec<[f64; 2]> {
        let at =
            |k: usize| [(k as f64).sqrt() * (k as f64).cos(), 0.3 * (k as f64).sqrt() * (k as f64).sin()];
        (0..n).map(at).collect()
    }

    /// Truth: what a tree is: halves make up their whole, every point has one place, extents hold what belongs to the
    /// points.
    #[test]
    fn halves_make_up_the_whole() {
        let points = spiral(500);
        let extents: Vec<Extent> = points.iter().map(|p| [p.map(|x| x - 0.1), p.map(|x| x + 0.1)]).collect();
        let tree = ClusterTree::new(&points, &extents, 20);
        let mut places = tree.order.clone();
        places.sort_unstable();
        assert!(places.into_iter().eq(0..500));
        for cluster in &tree.clusters {
            match cluster.halves {
                None => assert!(cluster.range.len() <= 20),
                Some([first, second]) => {
                    let [first, second] = [first, second].map(|half| &tree.clusters[half]);
                    assert!(
                        first.range.start == cluster.range.start && second.range.end == cluster.range.end
                    );
                    assert!(first.range.end == second.range.start && !first.range.is_empty());
                    assert!(first.diameter() < cluster.diameter());
                }
            }
            for &point in &tree.order[cluster.range.clone()] {
                let ([low, high], [least, most]) = (cluster.extent, extents[point]);
                assert!(low[0] <= least[0] && low[1] <= least[1] && high[0] >= most[0] && high[1] >= most[1]);
            }
        }
        let parts = tree.parts(60);
        assert!(parts.iter().all(|part| part.len() <= 60));
        assert!(parts.iter().cloned().flatten().eq(0..500));
    }

    /// Truth: distances of rectangles by hand; points in one place cannot be cut.
    #[test]
    fn distances_and_points_in_one_place() {
        let of = |low: [f64; 2], high: [f64; 2]| Cluster { range: 0..1, extent: [low, high], halves: None };
        let (a, b) = (of([0.0, 0.0], [1.0, 1.0]), of([4.0, 5.0], [6.0, 7.0]));
        assert_eq!(a.distance(&b), 5.0);
        assert_eq!(b.distance(&a), 5.0);
        assert_eq!(a.distance(&of([1.0, -3.0], [2.0, 0.5])), 0.0);
        assert_eq!(a.diameter(), 2f64.sqrt());
        let tree = ClusterTree::new(&[[1.0, 2.0]; 9], &[[[1.0, 2.0]; 2]; 9], 4);
        assert_eq!(tree.clusters.len(), 1);
    }
}
