//! The 14-node pyramid on the base [-1, 1]^2 at z = 0 with its apex at (0, 0, 1).
//!
//! The 13-node pyramid with a bubble function on the base: quadratic on the triangles, biquadratic on the base.

use super::Pyramid13;
use super::dual::{Dual, one_minus};
use super::shape::{DualShapeFunctions, ShapeFunctions};

/// The 14-node pyramid.
pub struct Pyramid14;

impl DualShapeFunctions<14> for Pyramid14 {
    const NODES: [[f64; 3]; 14] = {
        // The last node is the middle of the base.
        let mut nodes = [[0.0; 3]; 14];
        let (thirteen, _) = nodes.split_at_mut(13);
        thirteen.copy_from_slice(&<Pyramid13 as DualShapeFunctions<13>>::NODES);
        nodes
    };

    fn dual_values(xi: [Dual; 3]) -> [Dual; 14] {
        let [x, y, z] = xi;
        let side = one_minus(z).at_least(f64::MIN_POSITIVE);
        let bubble = ((side + x) * (side - x) / side) * ((side + y) * (side - y) / side);
        let thirteen = Pyramid13::dual_values(xi);
        // Shape functions of the 13-node pyramid at the centre of the base: -1/4 for its corners, 1/2 for middle nodes of its
        // edges, 0 for other nodes.
        let at_middle = Pyramid13::values([0.0; 3]);
        std::array::from_fn(|i| if i == 13 { bubble } else { thirteen[i] - bubble * at_middle[i] })
    }
}
