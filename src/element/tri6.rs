use super::shape::ShapeFunctions;

/// The 6-node triangle on (0,0), (1,0), (0,1), quadratic.
pub struct Tri6;

impl ShapeFunctions<6, 2> for Tri6 {
    const NODES: [[f64; 2]; 6] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5]];

    fn values([x, y]: [f64; 2]) -> [f64; 6] {
        let o = 1.0 - x - y;
        [o * (2.0 * o - 1.0), x * (2.0 * x - 1.0), y * (2.0 * y - 1.0), 4.0 * o * x, 4.0 * x * y, 4.0 * y * o]
    }

    fn gradients([x, y]: [f64; 2]) -> [[f64; 2]; 6] {
        let o = 1.0 - x - y;
        let a = 1.0 - 4.0 * o;
        [
            [a, a],
            [4.0 * x - 1.0, 0.0],
            [0.0, 4.0 * y - 1.0],
            [4.0 * (o - x), -4.0 * x],
            [4.0 * y, 4.0 * x],
            [-4.0 * y, 4.0 * (o - y)],
        ]
    }
}
