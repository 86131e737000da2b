use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 13-node pyramid on the base [-1, 1]^2 at z = 0 with its apex at (0, 0, 1). The shape functions are rational: quadratic on
/// the triangles, serendipity on the base.
///
/// # Source
/// Bedrosian (1992), Int. J. Numer. Meth. Engng 35.
pub struct Pyramid13;

impl DualShapeFunctions<13> for Pyramid13 {
    const NODES: [[f64; 3]; 13] = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, -1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [-0.5, -0.5, 0.5],
        [1.0, 0.0, 0.0],
        [0.5, -0.5, 0.5],
        [0.0, 1.0, 0.0],
        [0.5, 0.5, 0.5],
        [-0.5, 0.5, 0.5],
    ];

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 13] {
        // Half side of the cross-section at height z, kept positive so that the shape functions take their limits at the apex.
        let side = one_minus(z).at_least(f64::MIN_POSITIVE);
        let (to_x, to_y) = (|a: f64| side + x * a, |b: f64| side + y * b);
        Self::NODES.map(|[a, b, height]| match (height > 0.0, a == 0.0, b == 0.0) {
            (true, true, true) => z * (z * 2.0 - 1.0),
            (true, ..) => z * to_x(2.0 * a) * (to_y(2.0 * b) / side),
            (false, false, false) => (x * a + y * b - 1.0) * to_x(a) * (to_y(b) / side) * 0.25,
            (false, true, _) => to_x(1.0) * to_x(-1.0) * (to_y(b) / side) * 0.5,
            (false, ..) => to_y(1.0) * to_y(-1.0) * (to_x(a) / side) * 0.5,
        })
    }
}
