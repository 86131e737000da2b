use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 10-node tetrahedron on (0,0,0), (1,0,0), (0,1,0), (0,0,1), quadratic.
pub struct Tet10;

impl DualShapeFunctions<10> for Tet10 {
    const NODES: [[f64; 3]; 10] = [
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.0, 0.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.0],
        [0.0, 0.0, 0.5],
        [0.0, 0.5, 0.5],
        [0.5, 0.0, 0.5],
    ];

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 10] {
        let o = one_minus(x + y + z);
        let corner = |l: Dual| l * (l * 2.0 - 1.0);
        let middle = |a: Dual, b: Dual| a * b * 4.0;
        [
            corner(o),
            corner(x),
            corner(y),
            corner(z),
            middle(o, x),
            middle(x, y),
            middle(o, y),
            middle(o, z),
            middle(y, z),
            middle(x, z),
        ]
    }
}
