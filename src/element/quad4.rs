use super::shape::ShapeFunctions;

/// The 4-node quadrilateral on [-1, 1]^2, bilinear.
pub struct Quad4;

impl ShapeFunctions<4, 2> for Quad4 {
    const NODES: [[f64; 2]; 4] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];

    fn values(xi: [f64; 2]) -> [f64; 4] {
        Self::NODES.map(|n| 0.25 * (1.0 + n[0] * xi[0]) * (1.0 + n[1] * xi[1]))
    }

    fn gradients(xi: [f64; 2]) -> [[f64; 2]; 4] {
        Self::NODES.map(|n| [0.25 * n[0] * (1.0 + n[1] * xi[1]), 0.25 * n[1] * (1.0 + n[0] * xi[0])])
    }
}
