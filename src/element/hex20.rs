use super::Hex27;
use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 20-node hexahedron on [-1, 1]^3, serendipity.
pub struct Hex20;

impl DualShapeFunctions<20> for Hex20 {
    const NODES: [[f64; 3]; 20] = *Hex27::NODES.first_chunk().unwrap();

    fn dual_values(xi: [Dual; 3]) -> [Dual; 20] {
        Self::NODES.map(|node| {
            let side: [Dual; 3] = std::array::from_fn(|i| xi[i] * node[i] + 1.0);
            match node.iter().position(|&x| x == 0.0) {
                Some(k) => {
                    let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                    one_minus(xi[k] * xi[k]) * side[i] * side[j] * 0.25
                }
                None => side[0] * side[1] * side[2] * (side[0] + side[1] + side[2] - 5.0) * 0.125,
            }
        })
    }
}
