//! The equations of one cell.

/// Pressures (>= 0) of one or two ends on a cell that complement its gaps: at the pressures `old` the gaps are `gaps` (wear
/// aside), a pressure adds `stiffness` times itself to the gap of its own end, and its `path` to those of all.
pub(super) fn solve_pressures<const E: usize>(
    old: [f64; E],
    gaps: [f64; E],
    stiffness: [f64; E],
    path: [f64; E],
) -> [f64; E] {
    let free = |end: usize| stiffness[end] * old[end] - gaps[end];
    let alone = |end: usize| (free(end) / (stiffness[end] + path[end])).max(0.0);
    let mut new = [0.0; E];
    if E == 1 {
        new[0] = alone(0);
        return new;
    }
    let [a, b] = [stiffness[0] + path[0], stiffness[1] + path[1]];
    let determinant = a * b - path[0] * path[1];
    let both =
        [(b * free(0) - path[1] * free(1)) / determinant, (a * free(1) - path[0] * free(0)) / determinant];
    if both[0] >= 0.0 && both[1] >= 0.0 {
        new.copy_from_slice(&both);
        return new;
    }
    // One of them alone, if it keeps the other end open.
    for (one, other) in [(0, 1), (1, 0)] {
        let p = alone(one);
        if path[one] * p >= free(other) {
            new[one] = p;
            return new;
        }
    }
    new
}

/// The larger eigenvalue of a symmetric 2 x 2 matrix.
pub(super) fn largest([[a, b], [c, d]]: [[f64; 2]; 2]) -> f64 {
    let off = 0.5 * (b + c);
    0.5 * (a + d) + (0.5 * (a - d)).hypot(off)
}

/// `q` cut to the disc of radius `p`.
pub(super) fn clipped(q: [f64; 2], p: f64) -> [f64; 2] {
    let norm = q[0].hypot(q[1]);
    if norm > p { q.map(|x| x * p / norm) } else { q }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: complementarity of pressures and gaps, whichever ends touch.
    #[test]
    fn pressures_complement_gaps() {
        let (stiffness, path) = ([2.0, 3.0], [5.0, 1.0]);
        for old in [[0.0, 0.0], [0.3, 1.2], [4.0, 0.0]] {
            for gaps in [[-1.0, -2.0], [-4.0, 0.5], [0.2, -0.3], [-9.0, -1.0], [1.0, 1.0]] {
                let new = solve_pressures(old, gaps, stiffness, path);
                for end in 0..2 {
                    let worn = path[0] * new[0] + path[1] * new[1];
                    let gap = gaps[end] + stiffness[end] * (new[end] - old[end]) + worn;
                    assert!(new[end] >= 0.0 && gap > -1e-14, "{old:?} {gaps:?}: {new:?}");
                    assert!((new[end] * gap).abs() < 1e-13, "{old:?} {gaps:?}: {new:?}");
                }
                let alone = solve_pressures([old[0]], [gaps[0]], [2.0], [0.0])[0];
                assert_eq!(alone, (old[0] - gaps[0] / 2.0).max(0.0));
            }
        }
    }

    /// Truth: eigenvalues of diagonal and of singular matrices, and the disc.
    #[test]
    fn small_formulas() {
        assert_eq!(largest([[3.0, 0.0], [0.0, -5.0]]), 3.0);
        assert!((largest([[1.0, 2.0], [2.0, 4.0]]) - 5.0).abs() < 1e-15);
        assert_eq!(clipped([3.0, 4.0], 1.0), [0.6, 0.8]);
        assert_eq!(clipped([3.0, 4.0], 0.0), [0.0, 0.0]);
        assert_eq!(clipped([0.3, 0.4], 1.0), [0.3, 0.4]);
    }
}
