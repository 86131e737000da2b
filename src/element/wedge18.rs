use super::dual::{Dual, quadratic, triangle6};
use super::shape::DualShapeFunctions;

/// The 18-node wedge, the triangle (0,0), (1,0), (0,1) times the line [-1, 1]: quadratic on the triangle and on the
/// line.
pub struct Wedge18;

impl DualShapeFunctions<18> for Wedge18 {
    const NODES: [[f64; 3]; 18] = [
        [0.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [0.0, 1.0, -1.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.5, 0.0, -1.0],
        [0.0, 0.5, -1.0],
        [0.0, 0.0, 0.0],
        [0.5, 0.5, -1.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.5, 0.0, 1.0],
        [0.0, 0.5, 1.0],
        [0.5, 0.5, 1.0],
        [0.5, 0.0, 0.0],
        [0.0, 0.5, 0.0],
        [0.5, 0.5, 0.0],
    ];

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 18] {
        let t = triangle6(x, y);
        let line = [-1.0, 0.0, 1.0].map(|node| quadratic(z, node));
        // Each shape function is a product. These are the indices of its triangle function and its line function.
        const PARTS: [(usize, usize); 18] = [
            (0, 0),
            (1, 0),
            (2, 0),
            (0, 2),
            (1, 2),
            (2, 2),
            (3, 0),
            (5, 0),
            (0, 1),
            (4, 0),
            (1, 1),
            (2, 1),
            (3, 2),
            (5, 2),
            (4, 2),
            (3, 1),
            (5, 1),
            (4, 1),
        ];
        PARTS.map(|(i, j)| t[i] * line[j])
    }
}
