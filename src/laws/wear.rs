//! Wear laws (docs/theory-wear.md): a slip dg_t under the pressure p causes the wear depth dw = p |dg_t|_i.
//!
//! For a slip v, |v|_i = sqrt((i1 v1)^2 + (i2 v2)^2). Here i1, i2 are the specific wear rates along the principal axes,
//! and v1, v2 are the components of v along these axes.

use crate::laws::friction::{FrictionEllipse, tilt_interpolation};

/// Orthotropic specific wear rate of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpecificWearRate {
    /// Specific wear rates (i1, i2) along the principal axes, 1/MPa.
    pub i: [f64; 2],
    /// Angle of the first principal axis from local x, radians.
    pub angle: f64,
}

impl SpecificWearRate {
    /// Returns the function |v|_i: the wear depth that a slip v causes, divided by the pressure, mm/MPa.
    pub fn path_per_slip(&self) -> impl Fn([f64; 2]) -> f64 {
        let (sin, cos) = self.angle.sin_cos();
        let [along, across] = self.i;
        move |v| (along * (cos * v[0] + sin * v[1])).hypot(across * (-sin * v[0] + cos * v[1]))
    }

    /// Wear volume divided by friction energy, k = i1 / mu1 = i2 / mu2, 1/MPa. `None` if the two ratios differ. Also
    /// `None` if the principal axes of the two laws differ, unless these laws are isotropic.
    pub fn volume_per_energy(&self, friction: &FrictionEllipse) -> Option<f64> {
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-12 * a.abs().max(b.abs());
        let k = [self.i[0] / friction.mu[0], self.i[1] / friction.mu[1]];
        let turned = (self.angle - friction.angle).sin().abs() > 1e-12;
        let same_axes = !turned || (near(self.i[0], self.i[1]) && near(friction.mu[0], friction.mu[1]));
        (same_axes && near(k[0], k[1])).then_some(k[0])
    }
}

/// Wear laws that a scene may name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WearLaw {
    /// No wear.
    None,
    /// Archard's law: the wear volume is the specific wear rate i times load times sliding distance.
    Archard {
        /// Specific wear rate, 1/MPa.
        i: f64,
    },
    /// Orthotropic, with principal axes in any direction.
    Orthotropic {
        /// Specific wear rates along and across the first axis, 1/MPa.
        i: [f64; 2],
        /// Angle of the first axis from local x, radians.
        angle: f64,
    },
    /// Fibre-reinforced plastic (docs/scene.md).
    Frp {
        /// Specific wear rate along fibres in the surface, 1/MPa.
        i_l: f64,
        /// Specific wear rate across fibres in the surface, 1/MPa.
        i_t: f64,
        /// Specific wear rate for fibres along the normal, 1/MPa.
        i_n: f64,
        /// Tilt of the fibre out of the surface, radians.
        tilt: f64,
        /// Azimuth of the fibre from local x, radians.
        azimuth: f64,
    },
    /// Energy law: the wear volume is k times the friction energy, so that i = k mu along the friction axes.
    Energy {
        /// Wear volume divided by friction energy, 1/MPa.
        k: f64,
    },
}

impl WearLaw {
    /// Specific wear rate, common to all cells. `None` without wear, or for the energy law without friction.
    pub fn specific_rate(&self, friction: Option<FrictionEllipse>) -> Option<SpecificWearRate> {
        match *self {
            Self::None => None,
            Self::Archard { i } => Some(SpecificWearRate { i: [i, i], angle: 0.0 }),
            Self::Orthotropic { i, angle } => Some(SpecificWearRate { i, angle }),
            Self::Frp { i_l, i_t, i_n, tilt, azimuth } => Some(SpecificWearRate {
                i: [tilt_interpolation(i_l, i_n, tilt), tilt_interpolation(i_t, i_n, tilt)],
                angle: azimuth,
            }),
            Self::Energy { k } => {
                friction.map(|f| SpecificWearRate { i: [k * f.mu[0], k * f.mu[1]], angle: f.angle })
            }
        }
    }
}
