//! Binary cluster tree of points in the plane or in space. A cluster is divided at the middle of the longest side of
//! the bounding box of its points.

use std::ops::Range;

use crate::geometry::bounds;

/// Axis-aligned rectangle or box: smallest and largest coordinates, mm.
pub type BoundingBox<const D: usize = 2> = [[f64; D]; 2];

/// Cluster of neighbouring points. Each point may represent an object with an extent, for example an element.
#[derive(Debug, Clone, PartialEq)]
pub struct Cluster<const D: usize = 2> {
    /// Positions of the cluster's points in the order of the tree.
    pub range: Range<usize>,
    /// Bounding box of the objects at the cluster's points.
    pub extent: BoundingBox<D>,
    /// Indices of the two child clusters; `None` for a leaf.
    pub children: Option<[usize; 2]>,
}

impl<const D: usize> Cluster<D> {
    /// Diagonal of the bounding box, mm.
    pub fn diameter(&self) -> f64 {
        let [low, high] = self.extent;
        length::<D>(|axis| high[axis] - low[axis])
    }

    /// Distance of the bounding boxes, mm; zero if they touch or overlap.
    pub fn distance(&self, other: &Self) -> f64 {
        let apart = |axis: usize| {
            let gap = self.extent[0][axis] - other.extent[1][axis];
            gap.max(other.extent[0][axis] - self.extent[1][axis]).max(0.0)
        };
        length::<D>(apart)
    }
}

fn length<const D: usize>(along: impl Fn(usize) -> f64) -> f64 {
    (0..D).fold(0.0, |length: f64, axis| length.hypot(along(axis)))
}

/// Cluster tree, and the order of the points. In this order, each cluster is a contiguous range.
#[derive(Debug, Clone, PartialEq)]
pub struct ClusterTree<const D: usize = 2> {
    /// All clusters; the root is first, and children have larger indices than their parent.
    pub clusters: Vec<Cluster<D>>,
    /// Index of the point at each position of the tree order, `[N]`.
    pub order: Vec<usize>,
}

impl<const D: usize> ClusterTree<D> {
    /// Builds the tree. Leaves have at most `leaf` points, unless the points coincide.
    ///
    /// `points`, `[N]`, determine how clusters are divided. `extents`, `[N]`, are the bounding boxes of the objects at
    /// the points.
    pub fn new(points: &[[f64; D]], extents: &[BoundingBox<D>], leaf: usize) -> Self {
        let mut order: Vec<usize> = (0..points.len()).collect();
        let mut clusters = vec![cluster(&order, extents, 0..points.len())];
        let mut next = 0;
        while next < clusters.len() {
            let range = clusters[next].range.clone();
            if range.len() > leaf
                && let Some(size) = cut(points, &mut order[range.clone()])
            {
                let middle = range.start + size;
                clusters[next].children = Some([clusters.len(), clusters.len() + 1]);
                for half in [range.start..middle, middle..range.end] {
                    clusters.push(cluster(&order, extents, half));
                }
            }
            next += 1;
        }
        Self { clusters, order }
    }

    /// Ranges of the largest clusters with at most `size` points, ascending. The ranges cover all points. A leaf may
    /// have more points.
    pub fn clusters_of_size(&self, size: usize) -> Vec<Range<usize>> {
        let (mut parts, mut waiting) = (Vec::new(), vec![0]);
        while let Some(index) = waiting.pop() {
            let cluster = &self.clusters[index];
            match cluster.children {
                Some([first, second]) if cluster.range.len() > size => waiting.extend([second, first]),
                _ => parts.push(cluster.range.clone()),
            }
        }
        parts
    }
}

fn cluster<const D: usize>(order: &[usize], extents: &[BoundingBox<D>], range: Range<usize>) -> Cluster<D> {
    let of_points = order[range.clone()].iter().map(|&point| extents[point]);
    let empty = [[f64::INFINITY; D], [f64::NEG_INFINITY; D]];
    let extent = of_points.fold(empty, |[low, high], [least, most]| {
        [std::array::from_fn(|k| low[k].min(least[k])), std::array::from_fn(|k| high[k].max(most[k]))]
    });
    Cluster { range, extent, children: None }
}

/// Reorders points so that the points on the lower side of the cut come first. Returns the number of these points.
///
/// `None` if all points coincide.
fn cut<const D: usize>(points: &[[f64; D]], order: &mut [usize]) -> Option<usize> {
    let bounds: [[f64; 2]; D] =
        std::array::from_fn(|axis| bounds(order.iter().map(|&point| points[point][axis])));
    let side = |axis: usize| bounds[axis][1] - bounds[axis][0];
    let longest = (1..D).fold(0, |longest, axis| if side(axis) > side(longest) { axis } else { longest });
    let [low, high] = bounds[longest];
    let middle = 0.5 * (low + high);
    // The partition is stable, so that the order depends only on the points.
    let (mut before, after): (Vec<usize>, Vec<usize>) =
        order.iter().partition(|&&point| points[point][longest] < middle);
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

    /// Truth: in a cluster tree, two children together contain the points of their parent. Each point has one position.
    /// Extents contain the extents of their points.
    #[test]
    fn halves_make_up_the_whole() {
        let points = spiral(500);
        let extents: Vec<BoundingBox> =
            points.iter().map(|p| [p.map(|x| x - 0.1), p.map(|x| x + 0.1)]).collect();
        let tree = ClusterTree::new(&points, &extents, 20);
        let mut places = tree.order.clone();
        places.sort_unstable();
        assert!(places.into_iter().eq(0..500));
        for cluster in &tree.clusters {
            match cluster.children {
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
        let parts = tree.clusters_of_size(60);
        assert!(parts.iter().all(|part| part.len() <= 60));
        assert!(parts.iter().cloned().flatten().eq(0..500));
    }

    /// Truth: distances of rectangles, computed by hand. Coinciding points cannot be divided.
    #[test]
    fn distances_and_points_in_one_place() {
        let of = |low: [f64; 2], high: [f64; 2]| Cluster { range: 0..1, extent: [low, high], children: None };
        let (a, b) = (of([0.0, 0.0], [1.0, 1.0]), of([4.0, 5.0], [6.0, 7.0]));
        assert_eq!(a.distance(&b), 5.0);
        assert_eq!(b.distance(&a), 5.0);
        assert_eq!(a.distance(&of([1.0, -3.0], [2.0, 0.5])), 0.0);
        assert_eq!(a.diameter(), 2f64.sqrt());
        let tree = ClusterTree::new(&[[1.0, 2.0]; 9], &[[[1.0, 2.0]; 2]; 9], 4);
        assert_eq!(tree.clusters.len(), 1);
    }
}
