//! Closed form of the field of a point force on an isotropic half-space.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::bem::green_tensor::GreenTensor;
use crate::material::Stiffness;

/// Solutions of Boussinesq and Cerruti for the body z <= 0 under a force at the origin of its surface.
///
/// # Source
/// K.L. Johnson, Contact Mechanics (1985), eqs. 3.18 and 3.75, here with the depth −z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Boussinesq {
    /// 1 / (4π μ), 1/MPa.
    factor: f64,
    nu: f64,
}

impl Boussinesq {
    /// Closed form for `stiffness`; `None` unless the material is isotropic.
    pub(super) fn from_stiffness(stiffness: &Stiffness) -> Option<Self> {
        let [mu, nu] = stiffness.isotropic_constants()?;
        Some(Self { factor: 1.0 / (4.0 * PI * mu), nu })
    }

    #[expect(clippy::too_many_lines, reason = "closed form whose terms share their factors")]
    pub(in crate::bem::half_space) fn at(&self, point: &Vector3<f64>) -> GreenTensor {
        // With ρ = |x|: s = 1/ρ and e = 1/(ρ + d). Derivatives along x_a: s' = −x_a s³, e' = −x_a s e². Derivatives
        // along the depth d: s' = −d s³, e' = −s e.
        let (x, y, d) = (point.x, point.y, -point.z);
        let s = 1.0 / point.norm();
        let e = 1.0 / (1.0 / s + d);
        let (k, s2, e2) = (1.0 - 2.0 * self.nu, s * s, e * e);
        let (s3, s5) = (s * s2, s * s2 * s2);
        let (once, twice) = (k * s * e, k * s * e2);
        let g = 2.0 * (1.0 - self.nu);

        let same = s + k * e;
        let cross = s3 - twice;
        let [down, up] = [d * s3 + once, d * s3 - once];
        let value = Matrix3::new(
            same + x * x * cross,
            x * y * cross,
            -x * up,
            x * y * cross,
            same + y * y * cross,
            -y * up,
            -x * down,
            -y * down,
            d * d * s3 + g * s,
        );

        // Suffix `_a`: derivative of a factor along x_a, divided by −x_a. Suffix `_d`: derivative of a factor along the
        // depth.
        let same_a = s3 + k * s * e2;
        let cross_a = 3.0 * s5 - k * (s3 * e2 + 2.0 * s2 * e2 * e);
        let once_a = k * (s3 * e + s2 * e2);
        let [down_a, up_a] = [3.0 * d * s5 + once_a, 3.0 * d * s5 - once_a];
        let normal_a = 3.0 * d * d * s5 + g * s3;
        let along = |a: usize| {
            let h = [x, y][a];
            let [dx, dy] = [[1.0, 0.0], [0.0, 1.0]][a];
            let xy = (dx * y + x * dy) * cross - h * x * y * cross_a;
            Matrix3::new(
                -h * same_a + 2.0 * dx * x * cross - h * x * x * cross_a,
                xy,
                -dx * up + h * x * up_a,
                xy,
                -h * same_a + 2.0 * dy * y * cross - h * y * y * cross_a,
                -dy * up + h * y * up_a,
                -dx * down + h * x * down_a,
                -dy * down + h * y * down_a,
                -h * normal_a,
            )
        };
        let same_d = -d * s3 - k * s * e;
        let cross_d = -3.0 * d * s5 + k * (d * s3 * e2 + 2.0 * s2 * e2);
        let once_d = -k * e * (d * s3 + s2);
        let product_d = s3 - 3.0 * d * d * s5;
        let [down_d, up_d] = [product_d + once_d, product_d - once_d];
        let depth = Matrix3::new(
            same_d + x * x * cross_d,
            x * y * cross_d,
            -x * up_d,
            x * y * cross_d,
            same_d + y * y * cross_d,
            -y * up_d,
            -x * down_d,
            -y * down_d,
            2.0 * d * s3 - 3.0 * d * d * d * s5 - g * d * s3,
        );
        GreenTensor {
            value: value * self.factor,
            gradient: [along(0) * self.factor, along(1) * self.factor, depth * -self.factor],
        }
    }
}
