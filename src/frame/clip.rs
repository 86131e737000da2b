//! Convex polygons in a plane: intersection, area and first moments.

/// Corners in the plane, counter-clockwise.
pub(super) type Polygon = Vec<[f64; 2]>;

/// Twice the signed area of the triangle (a, b, c).
pub(super) fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Signed area and centroid; the first corner where the area vanishes.
///
/// # Source
/// Shoelace formula, taken about the first corner to keep rounding relative to the polygon's size.
pub(super) fn area_and_centroid(polygon: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let Some(&first) = polygon.first() else { return (0.0, [0.0, 0.0]) };
    let (mut area, mut moment) = (0.0, [0.0, 0.0]);
    for pair in polygon[1..].windows(2) {
        let triangle = 0.5 * cross(first, pair[0], pair[1]);
        area += triangle;
        for k in 0..2 {
            moment[k] += triangle * (pair[0][k] - first[k] + pair[1][k] - first[k]) / 3.0;
        }
    }
    if area == 0.0 {
        return (0.0, first);
    }
    (area, [first[0] + moment[0] / area, first[1] + moment[1] / area])
}

/// Intersection of two convex polygons, left in `result` (empty if they do not overlap); `spare` is scratch.
///
/// # Source
/// Sutherland and Hodgman (1974): the subject is cut by one half-plane per edge of `window`.
pub(super) fn intersect(
    subject: &[[f64; 2]],
    window: &[[f64; 2]],
    result: &mut Polygon,
    spare: &mut Polygon,
) {
    result.clear();
    result.extend_from_slice(subject);
    for (i, &a) in window.iter().enumerate() {
        let b = window[(i + 1) % window.len()];
        std::mem::swap(result, spare);
        cut(spare, a, b, result);
        if result.is_empty() {
            return;
        }
    }
}

/// The part of `subject` left of the line from `a` to `b`.
fn cut(subject: &[[f64; 2]], a: [f64; 2], b: [f64; 2], result: &mut Polygon) {
    result.clear();
    for (i, &end) in subject.iter().enumerate() {
        let start = subject[(i + subject.len() - 1) % subject.len()];
        let (s, e) = (cross(a, b, start), cross(a, b, end));
        if (s > 0.0 && e < 0.0) || (s < 0.0 && e > 0.0) {
            let share = s / (s - e);
            result.push([start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])]);
        }
        if e >= 0.0 {
            result.push(end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    fn overlap(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
        let (mut result, mut spare) = (Vec::new(), Vec::new());
        intersect(a, b, &mut result, &mut spare);
        area_and_centroid(&result).0
    }

    /// Truth: areas by hand: half-shifted squares, the inscribed diamond, touching and separate squares.
    #[test]
    fn overlaps_of_known_area() {
        let shifted = |dx: f64, dy: f64| SQUARE.map(|[x, y]| [x + dx, y + dy]);
        assert!((overlap(&SQUARE, &shifted(0.5, 0.25)) - 0.375).abs() < 1e-15);
        assert_eq!(overlap(&SQUARE, &shifted(1.0, 0.0)), 0.0);
        assert_eq!(overlap(&SQUARE, &shifted(3.0, 0.0)), 0.0);
        assert_eq!(overlap(&SQUARE, &SQUARE), 1.0);
        let diamond = [[0.5, 0.0], [1.0, 0.5], [0.5, 1.0], [0.0, 0.5]];
        assert!((overlap(&SQUARE, &diamond) - 0.5).abs() < 1e-15);
        let triangle = [[-1.0, 0.0], [2.0, 0.0], [0.5, 1.5]];
        assert!((overlap(&triangle, &SQUARE) - 1.0).abs() < 1e-15);
    }

    /// Truth: centroid of a triangle is the mean of its corners.
    #[test]
    fn centroid_of_a_triangle() {
        let (area, centroid) = area_and_centroid(&[[0.0, 0.0], [3.0, 0.0], [0.0, 6.0]]);
        assert_eq!((area, centroid), (9.0, [1.0, 2.0]));
    }
}
