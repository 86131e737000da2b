use nalgebra::Matrix3;

use super::directions::{centroid, unit_vector};
use crate::error::{Error, Result};
use crate::geometry::Point;

/// Layer of a winding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WoundLayer {
    /// Inner and outer radius, mm.
    pub radii: [f64; 2],
    /// Angle from the axis to the fibre, radians: 0 for an axial fibre, positive for a right-handed helix.
    pub angle: f64,
}

/// Fibres wound around an axis. Material axis 3 points outward; material axis 2 is tangential to the cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct Winding {
    axis: Point,
    origin: Point,
    layers: Vec<WoundLayer>,
}

impl Winding {
    /// Winding around the line along `axis` through `origin` (mm), with layers from the inside to the outside.
    ///
    /// # Errors
    /// If the axis is zero or not finite, there is no layer, or the radii are negative or not ascending (kind `Input`).
    pub fn new(axis: [f64; 3], origin: [f64; 3], layers: Vec<WoundLayer>) -> Result<Self> {
        let Some(axis) = unit_vector(axis.into()) else {
            return Err(Error::input(format!("the axis {axis:?} has no direction: it must not be zero")));
        };
        if layers.is_empty() {
            return Err(Error::input("a winding needs an angle, or at least one layer"));
        }
        for layer in &layers {
            let [inner, outer] = layer.radii;
            if !(0.0 <= inner && inner < outer) {
                return Err(Error::input(format!(
                    "the layer r = [{inner}, {outer}] is empty: give the inner radius, then the outer radius, both 0 or more"
                )));
            }
        }
        for (first, second) in layers.iter().zip(&layers[1..]) {
            if second.radii[0] < first.radii[1] {
                return Err(Error::input(format!(
                    "the layer r = {:?} begins inside the previous layer r = {:?}; give layers from the inside to the outside, without overlap",
                    second.radii, first.radii
                )));
            }
        }
        Ok(Self { axis, origin: origin.into(), layers })
    }

    /// Layers, from the inside to the outside.
    pub fn layers(&self) -> &[WoundLayer] {
        &self.layers
    }

    /// Distance of a point from the axis, mm.
    pub fn radius(&self, point: &Point) -> f64 {
        self.radial(point).norm()
    }

    fn radial(&self, point: &Point) -> Point {
        let arm = point - self.origin;
        arm - self.axis * self.axis.dot(&arm)
    }

    /// Material axes of an element, as columns. Axis 3 points outward at the centroid. With hoop = winding axis x axis
    /// 3 and the angle a of the layer, axis 1 = winding axis cos a + hoop sin a. Axis 2 = axis 3 x axis 1.
    ///
    /// The element belongs to the layer that contains the mean radius of the corners. The radius of the centroid would
    /// be too small for an element along an arc.
    ///
    /// # Errors
    /// If the element is on the axis or in no layer.
    pub fn axes(&self, corners: &[Point]) -> Result<Matrix3<f64>> {
        let radius = corners.iter().map(|corner| self.radius(corner)).sum::<f64>() / corners.len() as f64;
        let radial = self.radial(&centroid(corners));
        if radial.norm() <= 1e-9 * radius.max(f64::MIN_POSITIVE) {
            return Err(Error::input(
                "the element lies on the axis of the winding, where there is no hoop direction",
            ));
        }
        let outward = radial.normalize();
        let inside = |layer: &&WoundLayer| layer.radii[0] <= radius && radius <= layer.radii[1];
        let Some(layer) = self.layers.iter().find(inside) else {
            return Err(Error::input(format!(
                "the element's radius is {radius:.6e}, which no layer of the winding contains"
            )));
        };
        let (s, c) = layer.angle.sin_cos();
        let hoop = self.axis.cross(&outward);
        let fibre = self.axis * c + hoop * s;
        Ok(Matrix3::from_columns(&[fibre, outward.cross(&fibre), outward]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(inner: f64, outer: f64, degrees: f64) -> WoundLayer {
        WoundLayer { radii: [inner, outer], angle: degrees.to_radians() }
    }

    /// Truth: a helix about the axis z with the angle a has the tangent z cos a + y sin a at the point (r, 0, 0).
    #[test]
    fn a_helix_has_its_tangent() {
        let layers = vec![layer(0.0, 1.5, 55.0), layer(1.5, 3.0, -55.0)];
        let winding = Winding::new([0.0, 0.0, 2.0], [1.0, 1.0, 7.0], layers).unwrap();
        let (s, c) = 55.0f64.to_radians().sin_cos();
        for (x, sign) in [(2.0, 1.0), (3.0, -1.0)] {
            let axes = winding.axes(&[Point::new(x, 1.0, -40.0)]).unwrap();
            let expected = [Point::new(0.0, sign * s, c), Point::new(0.0, -c, sign * s), Point::x()];
            assert!((axes - Matrix3::from_columns(&expected)).amax() < 1e-15, "{axes}");
            assert!((axes.determinant() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn impossible_windings_are_refused() {
        let winding = Winding::new([0.0, 0.0, 1.0], [0.0; 3], vec![layer(1.0, 2.0, 90.0)]).unwrap();
        let says = |point: Point, what: &str| {
            let message = winding.axes(&[point]).unwrap_err().to_string();
            assert!(message.contains(what), "{message}");
        };
        says(Point::new(0.0, 0.0, 3.0), "on the axis");
        says(Point::new(2.5, 0.0, 3.0), "radius is 2.5");
        let refused = |axis, layers| Winding::new(axis, [0.0; 3], layers).unwrap_err().to_string();
        assert!(refused([0.0; 3], vec![layer(0.0, 1.0, 0.0)]).contains("no direction"));
        assert!(refused([1.0, 0.0, 0.0], vec![]).contains("at least one layer"));
        assert!(refused([1.0, 0.0, 0.0], vec![layer(2.0, 1.0, 0.0)]).contains("empty"));
        let overlap = vec![layer(0.0, 1.0, 0.0), layer(0.9, 2.0, 0.0)];
        assert!(refused([1.0, 0.0, 0.0], overlap).contains("overlap"));
    }
}
