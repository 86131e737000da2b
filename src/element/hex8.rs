use super::Hex27;
use super::shape::ShapeFunctions;

/// The 8-node hexahedron on [-1, 1]^3, trilinear.
pub struct Hex8;

impl ShapeFunctions<8, 3> for Hex8 {
    const NODES: [[f64; 3]; 8] = *<Hex27 as ShapeFunctions<27, 3>>::NODES.first_chunk().unwrap();

    fn values(xi: [f64; 3]) -> [f64; 8] {
        Self::NODES.map(|n| 0.125 * (1.0 + n[0] * xi[0]) * (1.0 + n[1] * xi[1]) * (1.0 + n[2] * xi[2]))
    }

    fn gradients(xi: [f64; 3]) -> [[f64; 3]; 8] {
        Self::NODES.map(|n| {
            let [a, b, c] = [1.0 + n[0] * xi[0], 1.0 + n[1] * xi[1], 1.0 + n[2] * xi[2]];
            [0.125 * n[0] * b * c, 0.125 * n[1] * a * c, 0.125 * n[2] * a * b]
        })
    }
}
