use super::shape::ShapeFunctions;

/// The 4-node tetrahedron on (0,0,0), (1,0,0), (0,1,0), (0,0,1), linear.
pub struct Tet4;

impl ShapeFunctions<4, 3> for Tet4 {
    const NODES: [[f64; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

    fn values([x, y, z]: [f64; 3]) -> [f64; 4] {
        [1.0 - x - y - z, x, y, z]
    }

    fn gradients(_: [f64; 3]) -> [[f64; 3]; 4] {
        [[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    }
}
