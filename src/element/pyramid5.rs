use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 5-node pyramid on the base [-1, 1]^2 at z = 0 with its apex at (0, 0, 1). The shape functions are rational: linear on the
/// triangles, bilinear on the base.
///
/// # Source
/// Bedrosian (1992), Int. J. Numer. Meth. Engng 35.
pub struct Pyramid5;

impl DualShapeFunctions<5> for Pyramid5 {
    const NODES: [[f64; 3]; 5] =
        [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 5] {
        // Half side of the cross-section at height z, kept positive so that the shape functions take their limits at the apex.
        let side = one_minus(z).at_least(f64::MIN_POSITIVE);
        Self::NODES.map(|[a, b, tip]| match tip == 1.0 {
            true => z,
            false => (side + x * a) * ((side + y * b) / side) * 0.25,
        })
    }
}
