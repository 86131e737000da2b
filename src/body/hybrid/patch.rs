//! Where the half-space touches: the rectangle under the frame, in the axes of the body's surface.

use crate::geometry::{Point, Side, Triad};

/// A rectangle on the plane surface of a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactPatch {
    /// Axes of the half-space: x and y along the sides, the third the outward normal of the body.
    pub axes: Triad,
    /// Middle of the rectangle, global, mm.
    pub center: Point,
    /// Half of its sides, mm.
    pub half_width: [f64; 2],
}

impl ContactPatch {
    /// The rectangle about `center` with sides along the x and y of a frame, on the body at `side` of it. Body 2 sees the frame
    /// turned about x.
    pub fn on_body(frame: &Triad, side: Side, center: Point, half_width: [f64; 2]) -> Self {
        let mut axes = frame.0;
        if side == Side::Upper {
            axes.column_mut(1).neg_mut();
            axes.column_mut(2).neg_mut();
        }
        Self { axes: Triad(axes), center, half_width }
    }

    /// Of two heights along the global z the one further out of the body.
    pub fn outer_height(&self, low: f64, high: f64) -> f64 {
        if self.axes.normal().z > 0.0 { high } else { low }
    }

    /// Coordinates in the axes of the patch, from its middle.
    pub fn local(&self, x: &Point) -> Point {
        self.axes.to_local(&(x - self.center))
    }

    /// Distance of a point (coordinates of [`Self::local`]) from the rectangle.
    pub fn distance(&self, local: &Point) -> f64 {
        let beyond = |axis: usize| (local[axis].abs() - self.half_width[axis]).max(0.0);
        (beyond(0).powi(2) + beyond(1).powi(2) + local.z * local.z).sqrt()
    }

    /// The longer of half its sides, mm.
    pub fn size(&self) -> f64 {
        self.half_width[0].max(self.half_width[1])
    }
}
