use super::shape::ShapeFunctions;

/// The 3-node triangle on (0,0), (1,0), (0,1), linear.
pub struct Tri3;

impl ShapeFunctions<3, 2> for Tri3 {
    const NODES: [[f64; 2]; 3] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];

    fn values([x, y]: [f64; 2]) -> [f64; 3] {
        [1.0 - x - y, x, y]
    }

    fn gradients(_: [f64; 2]) -> [[f64; 2]; 3] {
        [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]]
    }
}
