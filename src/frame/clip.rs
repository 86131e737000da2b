//! Polygons in a plane: area and centroid, division into convex parts, and intersection of convex polygons.

/// Corners in the plane, counter-clockwise.
pub(super) type Polygon = Vec<[f64; 2]>;

/// Twice the signed area of the triangle (a, b, c).
pub(super) fn twice_signed_area(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// Signed area and centroid of a polygon. If the area vanishes, the first corner replaces the centroid.
///
/// # Source
/// Shoelace formula about the first corner, which keeps rounding relative to the polygon's size.
pub(super) fn area_and_centroid(polygon: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let Some(&first) = polygon.first() else { return (0.0, [0.0, 0.0]) };
    let (mut area, mut moment) = (0.0, [0.0, 0.0]);
    for pair in polygon[1..].windows(2) {
        let triangle = 0.5 * twice_signed_area(first, pair[0], pair[1]);
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

/// Tolerance of a straight corner: largest doubled area of the triangle that the corner forms with its neighbours, divided by
/// the squared size of the polygon.
const STRAIGHT: f64 = 1e-12;

fn turn(polygon: &[[f64; 2]], i: usize) -> f64 {
    let n = polygon.len();
    twice_signed_area(polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n])
}

/// Divides a simple polygon into convex parts: cuts off triangles until the rest is convex.
///
/// # Source
/// Meisters (1975), Amer. Math. Monthly 82, 648-651: every simple polygon has an ear, a convex corner whose triangle holds
/// no other corner.
pub(super) fn convex_parts(mut polygon: Polygon) -> Vec<Polygon> {
    let reach = |x: &[f64; 2]| (x[0] - polygon[0][0]).hypot(x[1] - polygon[0][1]);
    let size = polygon.iter().map(reach).fold(0.0, f64::max);
    let least = STRAIGHT * size * size;
    let mut parts = Vec::new();
    while (0..polygon.len()).any(|i| turn(&polygon, i) < -least) {
        let n = polygon.len();
        // A polygon without an ear intersects itself. The corner with the largest triangle is removed instead.
        let sharpest = (0..n).max_by(|&i, &j| turn(&polygon, i).total_cmp(&turn(&polygon, j)));
        let ear = (0..n).find(|&i| turn(&polygon, i) > least && is_ear(&polygon, i)).or(sharpest);
        let Some(i) = ear else { break };
        parts.push(vec![polygon[(i + n - 1) % n], polygon[i], polygon[(i + 1) % n]]);
        polygon.remove(i);
    }
    parts.push(polygon);
    parts.retain(|part| area_and_centroid(part).0 > 0.0);
    parts
}

fn is_ear(polygon: &[[f64; 2]], i: usize) -> bool {
    let n = polygon.len();
    let (before, after) = ((i + n - 1) % n, (i + 1) % n);
    let triangle = [polygon[before], polygon[i], polygon[after]];
    let holds = |x: [f64; 2]| (0..3).all(|k| twice_signed_area(triangle[k], triangle[(k + 1) % 3], x) >= 0.0);
    (0..n).filter(|k| ![before, i, after].contains(k)).all(|k| !holds(polygon[k]))
}

/// Intersection of two convex polygons, written to `result` (empty if they do not overlap); `spare` is a work buffer.
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

fn cut(subject: &[[f64; 2]], a: [f64; 2], b: [f64; 2], result: &mut Polygon) {
    result.clear();
    for (i, &end) in subject.iter().enumerate() {
        let start = subject[(i + subject.len() - 1) % subject.len()];
        let (s, e) = (twice_signed_area(a, b, start), twice_signed_area(a, b, end));
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

    /// Truth: areas of intersections known by hand.
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

    /// Truth: each part is convex, and the areas of the parts sum to the area of the polygon, known by hand. A square with a fifth
    /// corner on one side stays whole, also if rounding moves this corner off the side.
    #[test]
    fn parts_of_a_polygon_are_convex() {
        let l = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let mirrored: Vec<[f64; 2]> = l.iter().rev().map(|x| [-x[0], x[1]]).collect();
        let dart = [[0.0, 0.0], [2.0, -1.0], [0.5, 0.0], [2.0, 1.0]];
        let side = |x: f64| vec![SQUARE[0], [0.5, x], SQUARE[1], SQUARE[2], SQUARE[3]];
        let cases = [
            (l.to_vec(), 3.0, 6),
            (mirrored, 3.0, 6),
            (dart.to_vec(), 0.5, 2),
            (side(0.0), 1.0, 1),
            (side(1e-16), 1.0, 1),
        ];
        for (polygon, area, most) in cases {
            let parts = convex_parts(polygon);
            assert!(parts.len() <= most, "{parts:?}");
            let sum: f64 = parts.iter().map(|part| area_and_centroid(part).0).sum();
            assert!((sum - area).abs() < 1e-15, "{sum}");
            assert!(parts.iter().all(|part| (0..part.len()).all(|i| turn(part, i) >= -1e-15)));
        }
    }

    /// Truth: the centroid of a triangle is the mean of its corners.
    #[test]
    fn centroid_of_a_triangle() {
        let (area, centroid) = area_and_centroid(&[[0.0, 0.0], [3.0, 0.0], [0.0, 6.0]]);
        assert_eq!((area, centroid), (9.0, [1.0, 2.0]));
    }
}
