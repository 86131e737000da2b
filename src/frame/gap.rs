//! Initial gap: distance between the undeformed surfaces at first touch.

use super::ContactFrame;
use super::height_table::HeightTable;
use crate::error::{Error, Result};

/// Shape of the gap between the undeformed surfaces, with r^2 = x^2 + y^2. Lengths are in mm, angles in radians from
/// the frame's x. Formulas "if exact" apply if [`InitialGap::exact`] is set.
#[derive(Debug, Clone, PartialEq)]
pub enum GapShape {
    /// Two planes.
    Flat,
    /// Sphere: r^2 / (2 R), or R - sqrt(R^2 - r^2) if exact.
    Sphere {
        /// Radius R.
        radius: f64,
    },
    /// Surfaces with principal radii R1, R2 of relative curvature: x^2 / (2 R1) + y^2 / (2 R2) along axes turned by
    /// `angle`.
    Ellipsoid {
        /// Radii R1, R2.
        radii: [f64; 2],
        /// Angle of the first principal direction.
        angle: f64,
    },
    /// Ellipsoid with semi-axes a and b in the frame's plane, turned by `angle`, and c along n: c (x^2 / a^2 + y^2 / b^2) / 2, or
    /// c - c sqrt(1 - x^2 / a^2 - y^2 / b^2) if exact.
    SemiAxes {
        /// Semi-axes a, b, c.
        semi_axes: [f64; 3],
        /// Angle of a from the frame's x.
        angle: f64,
    },
    /// Cylinder: y^2 / (2 R) across its axis, or R - sqrt(R^2 - y^2) if exact.
    Cylinder {
        /// Radius R.
        radius: f64,
        /// Angle of the axis.
        angle: f64,
    },
    /// Cone: r tan(slope).
    Cone {
        /// Angle between the cone's flank and the plane.
        slope: f64,
    },
    /// Power profile: B r^n.
    Power {
        /// Exponent n.
        exponent: f64,
        /// Coefficient B, mm^(1 - n).
        coefficient: f64,
    },
    /// Given heights. The gap is the height minus the smallest height over the frame.
    Heights(HeightTable),
    /// Given distance for each cell, `[N]`, mm.
    PerCell(Vec<f64>),
    /// Distance between the surfaces of the bodies along the cell normals, from their meshes.
    Mesh,
}

/// Initial gap: a shape and its position.
#[derive(Debug, Clone, PartialEq)]
pub struct InitialGap {
    /// The shape.
    pub shape: GapShape,
    /// Position of the shape's origin along the frame's x and y, from the frame's origin, mm.
    pub offset: [f64; 2],
    /// Whether the exact surface replaces the osculating paraboloid.
    pub exact: bool,
    /// Whether [`GapShape::Mesh`] keeps body 2 at its meshed position. Otherwise body 2 is moved to the first touch.
    pub as_meshed: bool,
}

impl From<GapShape> for InitialGap {
    fn from(shape: GapShape) -> Self {
        Self { shape, offset: [0.0, 0.0], exact: false, as_meshed: false }
    }
}

impl InitialGap {
    /// Gap at the centre of each cell, `[N]`, mm.
    ///
    /// # Errors
    /// If a parameter is not admissible, or the frame reaches beyond an exact surface. If heights or values per cell do not match
    /// the frame. Also for [`GapShape::Mesh`], which needs the bodies.
    pub fn evaluate(&self, frame: &ContactFrame) -> Result<Vec<f64>> {
        self.check()?;
        if let GapShape::Heights(heights) = &self.shape {
            return heights.evaluate(frame, self.offset);
        }
        if let GapShape::PerCell(values) = &self.shape {
            if values.len() != frame.n_cells() {
                return Err(Error::input(format!(
                    "there are {} gap values for the {} cells of the contact frame",
                    values.len(),
                    frame.n_cells()
                )));
            }
            return Ok(values.clone());
        }
        (0..frame.n_cells())
            .map(|cell| {
                let [x, y] = frame.plane_coordinates(cell);
                let [x, y] = frame.nearest_image([x - self.offset[0], y - self.offset[1]]);
                self.at(x, y)
            })
            .collect()
    }

    fn at(&self, x: f64, y: f64) -> Result<f64> {
        let along = |angle: f64| {
            let (s, c) = angle.sin_cos();
            [c * x + s * y, c * y - s * x]
        };
        Ok(match self.shape {
            GapShape::Flat => 0.0,
            GapShape::Sphere { radius } => self.round(x * x + y * y, radius)?,
            GapShape::Ellipsoid { radii, angle } => {
                let [a, b] = along(angle);
                a * a / (2.0 * radii[0]) + b * b / (2.0 * radii[1])
            }
            GapShape::SemiAxes { semi_axes: [a, b, c], angle } => {
                let [x, y] = along(angle);
                // In coordinates divided by the semi-axes, the ellipsoid is a unit sphere.
                c * self.round((x / a).powi(2) + (y / b).powi(2), 1.0).map_err(|_| {
                    Error::input(format!(
                        "the frame extends beyond an exact ellipsoid with the semi-axes {a} and {b} in the plane of the frame: use a smaller frame, or remove gap.exact"
                    ))
                })?
            }
            GapShape::Cylinder { radius, angle } => self.round(along(angle)[1].powi(2), radius)?,
            GapShape::Cone { slope } => x.hypot(y) * slope.tan(),
            GapShape::Power { exponent, coefficient } => coefficient * x.hypot(y).powf(exponent),
            GapShape::Heights(_) | GapShape::PerCell(_) => unreachable!("they are given by cell"),
            GapShape::Mesh => {
                return Err(Error::input(
                    "gap.kind = \"mesh\" computes the gap from the meshes of the bodies, but neither body has a mesh: use a shape such as \"sphere\"",
                ));
            }
        })
    }

    fn round(&self, distance_squared: f64, radius: f64) -> Result<f64> {
        if !self.exact {
            return Ok(distance_squared / (2.0 * radius));
        }
        if distance_squared >= radius * radius {
            return Err(Error::input(format!(
                "the frame extends {:.6} from the centre of an exact surface of radius {radius}: use a frame smaller than the radius, or remove gap.exact",
                distance_squared.sqrt()
            )));
        }
        // R - sqrt(R^2 - r^2) without cancellation.
        Ok(distance_squared / (radius + (radius * radius - distance_squared).sqrt()))
    }

    fn check(&self) -> Result<()> {
        let positive = |name: &str, value: f64| {
            if value.is_finite() && value > 0.0 {
                return Ok(());
            }
            Err(Error::input(format!("gap.{name} = {value} must be positive and finite")))
        };
        let finite = |name: &str, value: f64| {
            if value.is_finite() {
                return Ok(());
            }
            Err(Error::input(format!("gap.{name} = {value} must be a finite number")))
        };
        finite("offset", self.offset[0])?;
        finite("offset", self.offset[1])?;
        match self.shape {
            GapShape::Sphere { radius } => positive("radius", radius),
            GapShape::Cylinder { radius, angle } => {
                finite("angle", angle)?;
                positive("radius", radius)
            }
            GapShape::Ellipsoid { radii, angle } => {
                if self.exact {
                    return Err(Error::input(
                        "gap.exact is not possible for an ellipsoid given by two radii of curvature, which do not define its size: give semi_axes = [a, b, c] (radii a^2 / c, b^2 / c) instead of radii, or remove exact",
                    ));
                }
                finite("angle", angle)?;
                positive("radii", radii[0])?;
                positive("radii", radii[1])
            }
            GapShape::SemiAxes { semi_axes, angle } => {
                finite("angle", angle)?;
                semi_axes.into_iter().try_for_each(|axis| positive("semi_axes", axis))
            }
            GapShape::Cone { slope } => {
                if slope.is_finite() && slope > 0.0 && slope < std::f64::consts::FRAC_PI_2 {
                    return Ok(());
                }
                Err(Error::input(format!(
                    "gap.slope = {} degrees must lie between 0 and 90",
                    slope.to_degrees()
                )))
            }
            GapShape::Power { exponent, coefficient } => {
                positive("exponent", exponent)?;
                positive("coefficient", coefficient)
            }
            GapShape::Flat | GapShape::Heights(_) | GapShape::PerCell(_) | GapShape::Mesh => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame() -> ContactFrame {
        ContactFrame::grid([1.2, 1.2], [6, 6], [3.0, 1.0], 0.4).expect("an admissible grid")
    }

    fn gap_of(shape: GapShape, offset: [f64; 2], exact: bool) -> Vec<f64> {
        InitialGap { offset, exact, ..shape.into() }.evaluate(&frame()).expect("an admissible gap")
    }

    /// Truth: the closed form of each shape at the centre (-1, -1) of cell 0.
    #[test]
    fn closed_forms() {
        let check = |gap: Vec<f64>, value: f64| {
            assert!((gap[0] - value).abs() < 1e-14 * value.max(1.0), "{} {value}", gap[0])
        };
        check(gap_of(GapShape::Sphere { radius: 50.0 }, [0.0; 2], false), 2.0 / 100.0);
        check(gap_of(GapShape::Sphere { radius: 50.0 }, [-1.0, 0.0], false), 1.0 / 100.0);
        check(gap_of(GapShape::Sphere { radius: 5.0 }, [0.0; 2], true), 5.0 - 23f64.sqrt());
        check(gap_of(GapShape::Cylinder { radius: 10.0, angle: 0.0 }, [-7.0, 0.0], false), 1.0 / 20.0);
        let quarter = std::f64::consts::FRAC_PI_2;
        check(
            gap_of(GapShape::Ellipsoid { radii: [2.0, 7.0], angle: quarter }, [0.0, -1.0], false),
            1.0 / 14.0,
        );
        let ball = GapShape::SemiAxes { semi_axes: [5.0; 3], angle: 0.3 };
        check(gap_of(ball.clone(), [0.0; 2], true), 5.0 - 23f64.sqrt());
        check(gap_of(ball, [0.0; 2], false), 2.0 / 10.0);
        let egg = GapShape::SemiAxes { semi_axes: [8.0, 4.0, 3.0], angle: quarter };
        check(gap_of(egg.clone(), [0.0, -1.0], true), 3.0 - 3.0 * (1.0 - 1.0 / 16.0_f64).sqrt());
        check(gap_of(egg, [-1.0, 0.0], false), 3.0 / 128.0);
        check(gap_of(GapShape::Cone { slope: 0.1 }, [0.0; 2], false), 2f64.sqrt() * 0.1f64.tan());
        check(gap_of(GapShape::Power { exponent: 4.0, coefficient: 0.5 }, [0.0; 2], false), 2.0);
        check(gap_of(GapShape::Flat, [0.0; 2], false), 0.0);
    }

    /// Truth: bilinear interpolation reproduces a + b x + c y + d x y.
    #[test]
    fn heights_are_interpolated() {
        let f = |x: f64, y: f64| 1.0 + 0.2 * x - 0.3 * y + 0.1 * x * y;
        let (shape, spacing) = ([5, 7], [0.7, 0.5]);
        let values =
            (0..35).map(|i| f((i / 7) as f64 * 0.7 - 1.4, (i % 7) as f64 * 0.5 - 1.5)).collect::<Vec<f64>>();
        let gap = gap_of(
            GapShape::Heights(HeightTable { values, shape, spacing: Some(spacing), angle: 0.0 }),
            [0.1, -0.2],
            false,
        );
        let frame = frame();
        let expected: Vec<f64> =
            (0..36).map(|i| frame.plane_coordinates(i)).map(|[x, y]| f(x - 0.1, y + 0.2)).collect();
        let lowest = expected.iter().copied().fold(f64::INFINITY, f64::min);
        for (g, e) in gap.iter().zip(&expected) {
            assert!((g - (e - lowest)).abs() < 1e-14);
        }
        let values: Vec<f64> = (0..63).map(|i| f64::from(i / 7)).collect();
        let plane = HeightTable { values, shape: [9, 7], spacing: Some([1.0, 1.0]), angle: 0.7 };
        let gap = gap_of(GapShape::Heights(plane), [0.1, -0.2], false);
        let rise = |cell: usize| {
            frame.plane_coordinates(cell)[0] * 0.7f64.cos() + frame.plane_coordinates(cell)[1] * 0.7f64.sin()
        };
        assert!((gap[35] - gap[0] - rise(35) + rise(0)).abs() < 1e-13);
        let table = HeightTable {
            values: (0..36).map(f64::from).collect(),
            shape: [6, 6],
            spacing: None,
            angle: 0.0,
        };
        assert_eq!(gap_of(GapShape::Heights(table), [0.0; 2], false)[7], 7.0);
    }

    /// Truth: messages name no unit, because a frame does not know the unit of the scene.
    #[test]
    fn messages_name_no_unit() {
        let ball = GapShape::Sphere { radius: 1.0 };
        let egg = GapShape::SemiAxes { semi_axes: [1.0, 2.0, 1.0], angle: 0.0 };
        let table =
            HeightTable { values: vec![0.0; 4], shape: [2, 2], spacing: Some([1.0, 1.0]), angle: 0.0 };
        for shape in [ball, egg, GapShape::Heights(table)] {
            let gap = InitialGap { exact: true, ..shape.into() };
            let error = gap.evaluate(&frame()).expect_err("a frame that is too wide");
            assert!(!error.message().contains(" mm"), "{error}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let refused = |shape: GapShape, exact: bool, word: &str| {
            let error = InitialGap { exact, ..shape.into() }.evaluate(&frame()).expect_err("refused");
            assert!(error.message().contains(word), "{error}");
        };
        refused(GapShape::Sphere { radius: -1.0 }, false, "gap.radius");
        refused(GapShape::Sphere { radius: 1.0 }, true, "smaller");
        refused(GapShape::Ellipsoid { radii: [1.0, 2.0], angle: 0.0 }, true, "semi_axes");
        refused(GapShape::SemiAxes { semi_axes: [1.0, 2.0, 1.0], angle: 0.0 }, true, "beyond");
        refused(GapShape::SemiAxes { semi_axes: [1.0, 2.0, 0.0], angle: 0.0 }, false, "gap.semi_axes");
        refused(GapShape::Cone { slope: 2.0 }, false, "gap.slope");
        refused(GapShape::Power { exponent: f64::NAN, coefficient: 1.0 }, false, "gap.exponent");
        refused(GapShape::Mesh, false, "mesh");
        let table = |n: usize, shape, spacing| {
            GapShape::Heights(HeightTable { values: vec![0.0; n], shape, spacing, angle: 0.0 })
        };
        refused(table(4, [2, 2], None), false, "gap.spacing");
        refused(table(5, [2, 2], None), false, "fill");
        refused(table(4, [2, 2], Some([1.0, 1.0])), false, "larger table");
        let mut values = vec![0.0; 36];
        values[8] = f64::NAN;
        refused(
            GapShape::Heights(HeightTable { values, shape: [6, 6], spacing: None, angle: 0.0 }),
            false,
            "row 2, column 3",
        );
    }
}
