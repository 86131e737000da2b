use nalgebra::Matrix3;

use crate::geometry::Point;

/// Material axes of a fibre along `first`, as columns; axis 3 = axis 1 x axis 2. Axis 2 is along the part of `second`
/// that is normal to the fibre. Without `second`, axis 2 is horizontal (normal to z), at the azimuth of the fibre plus
/// 90 degrees. For an upright fibre without `second`, axis 2 is y.
///
/// `None` if a vector is zero or not finite, or if `second` is parallel to the fibre.
pub fn axes_from_directions(first: Point, second: Option<Point>) -> Option<Matrix3<f64>> {
    let a1 = unit_vector(first)?;
    let a2 = match second {
        Some(second) => {
            let second = unit_vector(second)?;
            let across = second - a1 * a1.dot(&second);
            (across.norm() > MIN_SINE_TO_FIBRE).then(|| across.normalize())?
        }
        None => {
            let horizontal = a1.x.hypot(a1.y);
            if horizontal > UPRIGHT_TOLERANCE {
                Point::new(-a1.y / horizontal, a1.x / horizontal, 0.0)
            } else {
                Point::y()
            }
        }
    };
    // For an upright fibre that deviates slightly from z, y is not exactly normal to the fibre.
    let a2 = (a2 - a1 * a1.dot(&a2)).normalize();
    Some(Matrix3::from_columns(&[a1, a2, a1.cross(&a2)]))
}

/// Mean of the corners.
pub fn centroid(corners: &[Point]) -> Point {
    corners.iter().sum::<Point>() / corners.len() as f64
}

/// Smallest sine of the angle between fibre and second direction.
const MIN_SINE_TO_FIBRE: f64 = 1e-6;

/// Largest horizontal part of the unit vector of an upright fibre.
const UPRIGHT_TOLERANCE: f64 = 1e-9;

/// `vector` scaled to length 1; `None` if it is zero or not finite.
pub(super) fn unit_vector(vector: Point) -> Option<Point> {
    let largest = vector.amax();
    // Scaling first avoids overflow and underflow of the squares.
    (largest.is_finite() && largest > 0.0 && vector.iter().all(|x| x.is_finite()))
        .then(|| (vector / largest).normalize())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::fibre_axes;

    /// Truth: the fibre direction of `fibre_axes`, alone or with a second direction, gives all axes of `fibre_axes`. Axis 2 of an
    /// upright fibre is y.
    #[test]
    fn a_direction_gives_the_axes_of_its_angles() {
        for (tilt, azimuth) in [(0.0, 0.0), (0.5, 1.1), (-0.7, 2.9), (1.5, -2.0)] {
            let expected = fibre_axes(tilt, azimuth);
            let first: Point = expected.column(0).into();
            let found = axes_from_directions(first * 1e-180, None).expect("a direction");
            assert!((found - expected).amax() < 1e-14, "{tilt} {azimuth}");
            let second: Point = expected.column(1) * 3.0 + expected.column(0) * 0.4;
            let found = axes_from_directions(first, Some(second)).expect("directions");
            assert!((found - expected).amax() < 1e-14, "{tilt} {azimuth}");
        }
        let upright = axes_from_directions(Point::z(), None).expect("a direction");
        assert_eq!(upright.column(1), Point::y());
    }

    #[test]
    fn no_direction_is_refused() {
        assert!(axes_from_directions(Point::zeros(), None).is_none());
        assert!(axes_from_directions(Point::new(f64::NAN, 1.0, 0.0), None).is_none());
        assert!(axes_from_directions(Point::new(f64::INFINITY, 1.0, 0.0), None).is_none());
        assert!(axes_from_directions(Point::x(), Some(Point::x() * -2.0)).is_none());
    }
}
