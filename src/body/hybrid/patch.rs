//! Contact patch: the rectangle under the frame, in the axes of the body's surface.

use crate::geometry::{Point, Side, Triad};

/// Rectangle on the plane surface of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPatch {
    /// Axes of the half-space: x and y along the sides, and the outward normal of the body.
    pub axes: Triad,
    /// Centre of the rectangle, global, mm.
    pub center: Point,
    /// Half of the sides, mm.
    pub half_width: [f64; 2],
}

impl ContactPatch {
    /// Rectangle with the centre `center` on the body at `side` of a frame. Its sides are parallel to x and y of the
    /// frame. For body 2, the axes of the rectangle are the axes of the frame, rotated by half a turn about x.
    pub fn on_body(frame: &Triad, side: Side, center: Point, half_width: [f64; 2]) -> Self {
        let mut axes = frame.0;
        if side == Side::Upper {
            axes.column_mut(1).neg_mut();
            axes.column_mut(2).neg_mut();
        }
        Self { axes: Triad(axes), center, half_width }
    }

    /// Returns the global z coordinate, `low` or `high`, that lies farther outside the body. `low` must not exceed
    /// `high`.
    pub fn outer_height(&self, low: f64, high: f64) -> f64 {
        if self.axes.normal().z > 0.0 { high } else { low }
    }

    /// Coordinates of a point in the axes of the patch, relative to its centre.
    pub fn local(&self, x: &Point) -> Point {
        self.axes.to_local(&(x - self.center))
    }

    /// Distance of a point from the rectangle, mm. The point has the coordinates that [`Self::local`] returns.
    pub fn distance(&self, local: &Point) -> f64 {
        let beyond = |axis: usize| (local[axis].abs() - self.half_width[axis]).max(0.0);
        (beyond(0).powi(2) + beyond(1).powi(2) + local.z * local.z).sqrt()
    }

    /// Longer half-side, mm.
    pub fn size(&self) -> f64 {
        self.half_width[0].max(self.half_width[1])
    }
}
