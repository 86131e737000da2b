//! Plot axes, fibres and distribution of wear of the contact surface, for plots and field files.

use crate::geometry::Side;
use crate::laws::friction::FrictionLaw;
use crate::laws::wear::WearLaw;

/// Fibre direction of a body at the contact surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfaceFibre {
    /// Side of the body.
    pub side: Side,
    /// Angle out of the surface, radians. The fibre is (cos tilt cos azimuth, cos tilt sin azimuth, sin tilt).
    pub tilt: f64,
    /// Angle from x towards y of the frame, radians.
    pub azimuth: f64,
}

/// Plot axes e1 and e2, fibres and wear distribution of the contact surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceProperties {
    /// Angle of the plot axis e1 from x of the frame, radians. The plot axis e2 is 90 degrees to the left of e1.
    pub e1_angle: f64,
    /// Fibres, for bodies that have fibres.
    pub fibres: Vec<SurfaceFibre>,
    /// Fraction of the wear depth removed from body 1.
    pub wear_share: f64,
}

impl Default for SurfaceProperties {
    fn default() -> Self {
        Self { e1_angle: 0.0, fibres: Vec::new(), wear_share: 1.0 }
    }
}

impl SurfaceProperties {
    /// Creates the properties. e1 is the first axis of the wear law or, if its coefficients are equal, of the friction
    /// law. If the coefficients of both laws are equal, e1 is along the first fibre. Without fibres, e1 is along x.
    pub fn new(friction: &FrictionLaw, wear: &WearLaw, wear_share: f64, fibres: Vec<SurfaceFibre>) -> Self {
        let ellipse = friction.ellipse();
        let unequal = |[a, b]: [f64; 2]| a != b;
        let of_wear = wear.specific_rate(ellipse).filter(|wear| unequal(wear.i)).map(|wear| wear.angle);
        let of_friction = ellipse.filter(|ellipse| unequal(ellipse.mu)).map(|ellipse| ellipse.angle);
        let of_fibre = fibres.first().map(|fibre| fibre.azimuth);
        Self { e1_angle: of_wear.or(of_friction).or(of_fibre).unwrap_or(0.0), fibres, wear_share }
    }

    /// Splits the wear depth between the bodies.
    pub fn wear_depth_by_body(&self, depth: &[f64]) -> [Vec<f64>; 2] {
        [self.wear_share, 1.0 - self.wear_share].map(|share| depth.iter().map(|w| share * w).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth (definition): e1 follows the wear law, the friction law or the fibre, in this order. Only laws with
    /// unequal coefficients count. The wear depths of the two bodies add up to the total wear depth.
    #[test]
    fn axes_are_those_of_the_laws() {
        let fibre = SurfaceFibre { side: Side::Lower, tilt: 0.5, azimuth: 0.3 };
        let elliptic = FrictionLaw::Elliptic { mu: [0.2, 0.3], angle: 0.7 };
        let wear = WearLaw::Orthotropic { i: [1e-9, 2e-9], angle: -0.2 };
        let e1 = |friction: &FrictionLaw, wear: &WearLaw| {
            SurfaceProperties::new(friction, wear, 1.0, vec![fibre]).e1_angle
        };
        assert_eq!(e1(&elliptic, &wear), -0.2);
        assert_eq!(e1(&elliptic, &WearLaw::Archard { i: 1e-9 }), 0.7);
        assert_eq!(e1(&FrictionLaw::Coulomb { mu: 0.3 }, &WearLaw::None), 0.3);
        assert_eq!(SurfaceProperties::new(&FrictionLaw::None, &WearLaw::None, 1.0, Vec::new()).e1_angle, 0.0);
        let surface = SurfaceProperties { wear_share: 0.75, ..SurfaceProperties::default() };
        assert_eq!(surface.wear_depth_by_body(&[4.0, 8.0]), [vec![3.0, 6.0], vec![1.0, 2.0]]);
    }
}
