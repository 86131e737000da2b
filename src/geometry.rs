//! Points, orthonormal triads and rotations.
//!
//! Global axes are x, y, z. A [`Triad`] holds the local axes (x, y, n) of a cell, with n the outward normal of body 1. Components
//! of local vectors are always in this order.

pub(crate) mod ball_tree;

use nalgebra::{Matrix3, Vector3};

/// A point or vector in global coordinates.
pub type Point = Vector3<f64>;

/// Names of the global axes.
pub const AXIS_NAMES: [&str; 3] = ["x", "y", "z"];

/// Right-handed orthonormal local axes: two tangents and the normal, as columns of a rotation matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Triad(pub Matrix3<f64>);

impl Triad {
    /// Triad with the normal +z and tangents rotated by `azimuth` (radians) from global x towards y.
    pub fn horizontal(azimuth: f64) -> Self {
        let (s, c) = azimuth.sin_cos();
        Self(Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0))
    }

    /// Triad with normal `normal`. Its first tangent is the projection of `toward` on the plane normal to `normal`. If
    /// `toward` is almost parallel to `normal`, a global axis replaces `toward`.
    pub fn from_normal(normal: Point, toward: Point) -> Self {
        let n = normal.normalize();
        let mut t = toward - n * n.dot(&toward);
        if t.norm() < 1e-8 * toward.norm() {
            let axis = if n.z.abs() < 0.9 { Point::z() } else { Point::x() };
            t = axis - n * n.dot(&axis);
        }
        let e1 = t.normalize();
        Self(Matrix3::from_columns(&[e1, n.cross(&e1), n]))
    }

    /// Unit normal n.
    pub fn normal(&self) -> Point {
        self.0.column(2).into()
    }

    /// Local components of a global vector.
    pub fn to_local(&self, global: &Point) -> Point {
        self.0.transpose() * global
    }

    /// Global vector from local components.
    pub fn to_global(&self, local: &Point) -> Point {
        self.0 * local
    }
}

/// Material axes of a fibre as columns: axis 1 along the fibre, axis 2 in the surface at `azimuth` + 90 degrees, axis 3 = 1 x 2.
/// With `tilt` t and `azimuth` a in radians, the fibre is (cos t cos a, cos t sin a, sin t).
///
/// # Source
/// docs/conventions.md: 1 = cos t e1 + sin t n, 3 = -sin t e1 + cos t n, with the unit vector e1 at the azimuth and the normal n.
pub fn fibre_axes(tilt: f64, azimuth: f64) -> Matrix3<f64> {
    let (st, ct) = tilt.sin_cos();
    let (sa, ca) = azimuth.sin_cos();
    let a1 = Point::new(ct * ca, ct * sa, st);
    let a2 = Point::new(-sa, ca, 0.0);
    Matrix3::from_columns(&[a1, a2, a1.cross(&a2)])
}

/// Body 1 or body 2. Body 1 lies below the frame (outward normal n), body 2 above it (outward normal -n).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Body 1, below.
    Lower,
    /// Body 2, above, on which the tractions P act.
    Upper,
}

impl Side {
    /// n-component of the outward normal.
    pub fn outward(self) -> f64 {
        -self.gap_sign()
    }

    /// Sign of the body's displacement in the gap, and of the traction P on the body: -1 for body 1, +1 for body 2.
    pub fn gap_sign(self) -> f64 {
        match self {
            Self::Lower => -1.0,
            Self::Upper => 1.0,
        }
    }

    /// "body 1" or "body 2".
    pub fn name(self) -> &'static str {
        match self {
            Self::Lower => "body 1",
            Self::Upper => "body 2",
        }
    }

    /// Name of the body in scenes and in the names of result files.
    pub fn key(self) -> &'static str {
        match self {
            Self::Lower => "body1",
            Self::Upper => "body2",
        }
    }
}

/// Smallest and largest value; [∞, -∞] if there are none.
pub fn bounds(values: impl Iterator<Item = f64>) -> [f64; 2] {
    values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}

/// Area vectors of the triangles into which a polygon with `n` corners is divided. All triangles share the first
/// corner.
pub fn fan_area_vectors(n: usize, corner: impl Fn(usize) -> Point) -> impl Iterator<Item = Point> {
    let first = corner(0);
    (1..n - 1).map(move |i| 0.5 * (corner(i) - first).cross(&(corner(i + 1) - first)))
}

/// Number with six significant digits, for messages.
pub fn format_number(x: f64) -> String {
    let rounded: f64 = format!("{x:.5e}").parse().unwrap_or(x);
    if rounded == 0.0 || (1e-4..1e6).contains(&rounded.abs()) {
        format!("{rounded}")
    } else {
        format!("{rounded:e}")
    }
}

/// Number with three significant digits, for messages.
pub fn format_short(x: f64) -> String {
    format_number(format!("{x:.2e}").parse().unwrap_or(x))
}

/// Position (x, y, z), for messages.
pub fn format_point(x: &[f64; 3]) -> String {
    format!("({}, {}, {})", format_number(x[0]), format_number(x[1]), format_number(x[2]))
}

/// Direction (x, y, z), for messages: components of a unit vector, rounded to three decimals.
pub fn format_direction(unit: &Point) -> String {
    format_point(&[0, 1, 2].map(|k| (1e3 * unit[k]).round() / 1e3 + 0.0))
}
