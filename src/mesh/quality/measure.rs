use crate::geometry::bounds;

/// Difference in each coordinate, divided by the diagonal of the bounding box, up to which two points coincide.
const MERGE_TOLERANCE: f64 = 1e-9;

/// Points that coincide with an earlier point. A point is compared only with earlier points that are not listed themselves.
pub(super) fn coincident_points(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let box_: [(f64, f64); 3] = std::array::from_fn(|k| {
        let [low, high] = bounds(points.iter().map(|x| x[k]));
        (low, high - low)
    });
    let tolerance = MERGE_TOLERANCE * box_.iter().map(|(_, l)| l * l).sum::<f64>().sqrt();
    if tolerance <= 0.0 {
        return points.iter().skip(1).copied().collect();
    }
    // Bins are far larger than the tolerance, so that most points are compared only with points of their own bin. The
    // offset keeps bin boundaries away from round numbers, which are common coordinates.
    let width = 1000.0 * tolerance;
    let slot = |x: [f64; 3], side: [f64; 3]| -> [i64; 3] {
        std::array::from_fn(|k| ((x[k] - box_[k].0 + side[k] * tolerance) / width + 0.414_213).floor() as i64)
    };
    let mut last_in_slot = std::collections::HashMap::<[i64; 3], usize>::with_capacity(points.len());
    let mut previous = vec![usize::MAX; points.len()];
    let mut coincident = Vec::new();
    for (i, &x) in points.iter().enumerate() {
        let (low, high) = (slot(x, [-1.0; 3]), slot(x, [1.0; 3]));
        let close = |j: usize| (0..3).all(|k| (points[j][k] - x[k]).abs() <= tolerance);
        let mut found = false;
        for corner in 0..8 {
            let at: [i64; 3] = std::array::from_fn(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            let mut j = last_in_slot.get(&at).copied().unwrap_or(usize::MAX);
            while j != usize::MAX && !found {
                found = close(j);
                j = previous[j];
            }
            if low == high || found {
                break;
            }
        }
        if found {
            coincident.push(x);
        } else {
            previous[i] = last_in_slot.insert(slot(x, [0.0; 3]), i).unwrap_or(usize::MAX);
        }
    }
    coincident
}
