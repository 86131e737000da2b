use super::Pyramid13;
use super::dual::{Dual, one_minus};
use super::shape::{DualShapeFunctions, ShapeFunctions};

/// The 13-node pyramid with a bubble function on the base: quadratic on the triangles, biquadratic on the base.
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
        // Values at the middle of the base: -1/4 for the corners of the base, 1/2 for the middle nodes of its edges, 0
        // for other nodes.
        let at_middle = Pyramid13::values([0.0; 3]);
        std::array::from_fn(|i| if i == 13 { bubble } else { thirteen[i] - bubble * at_middle[i] })
    }
}
