//! Friction laws. A law with friction gives one ellipse of admissible tangential tractions. All cells use this ellipse in their
//! local axes.

/// Friction ellipse of a cell, with semi-axes `mu` per unit pressure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionEllipse {
    /// Coefficients (mu1, mu2) along the principal axes.
    pub mu: [f64; 2],
    /// Angle of the first principal axis from local x, radians.
    pub angle: f64,
}

/// Coefficient of friction or specific wear rate at the fibre tilt `tilt` (radians): linear in |tilt|, from `in_plane`
/// at 0 to `normal` at π/2.
pub fn tilt_interpolation(in_plane: f64, normal: f64, tilt: f64) -> f64 {
    in_plane + (normal - in_plane) * (tilt.abs() / std::f64::consts::FRAC_PI_2)
}

/// Friction laws that a scene may name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FrictionLaw {
    /// No friction: tangential tractions are not unknowns.
    None,
    /// Isotropic, one coefficient.
    Coulomb {
        /// Coefficient.
        mu: f64,
    },
    /// Elliptic, with principal axes in any direction.
    Elliptic {
        /// Coefficients along and across the first axis.
        mu: [f64; 2],
        /// Angle of the first axis from local x, radians.
        angle: f64,
    },
    /// Fibre-reinforced plastic (docs/scene.md). The coefficients along and across the fibre change linearly with |`tilt`|, from
    /// `mu_l` and `mu_t` to `mu_n` at 90 degrees.
    Frp {
        /// Coefficient along fibres in the surface.
        mu_l: f64,
        /// Coefficient across fibres in the surface.
        mu_t: f64,
        /// Coefficient for fibres along the normal.
        mu_n: f64,
        /// Tilt of the fibre out of the surface, radians.
        tilt: f64,
        /// Azimuth of the fibre from local x, radians.
        azimuth: f64,
    },
}

impl FrictionLaw {
    /// Friction ellipse, common to all cells; `None` without friction, or if both coefficients are 0.
    pub fn ellipse(&self) -> Option<FrictionEllipse> {
        let ellipse = match *self {
            Self::None => None,
            Self::Coulomb { mu } => Some(FrictionEllipse { mu: [mu, mu], angle: 0.0 }),
            Self::Elliptic { mu, angle } => Some(FrictionEllipse { mu, angle }),
            Self::Frp { mu_l, mu_t, mu_n, tilt, azimuth } => Some(FrictionEllipse {
                mu: [tilt_interpolation(mu_l, mu_n, tilt), tilt_interpolation(mu_t, mu_n, tilt)],
                angle: azimuth,
            }),
        };
        ellipse.filter(|ellipse| ellipse.mu != [0.0; 2])
    }
}
