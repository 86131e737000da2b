use super::Wedge18;
use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 15-node wedge on the triangle (0,0), (1,0), (0,1) times [-1, 1], serendipity.
pub struct Wedge15;

impl DualShapeFunctions<15> for Wedge15 {
    const NODES: [[f64; 3]; 15] = *Wedge18::NODES.first_chunk().unwrap();

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 15] {
        let l = [one_minus(x + y), x, y];
        let end = [one_minus(z), z + 1.0];
        let bubble = one_minus(z * z);
        let corner = |i: usize, e: usize| l[i] * ((l[i] * 2.0 - 1.0) * end[e] - bubble) * 0.5;
        let flat = |i: usize, j: usize, e: usize| l[i] * l[j] * end[e] * 2.0;
        let upright = |i: usize| l[i] * bubble;
        [
            corner(0, 0),
            corner(1, 0),
            corner(2, 0),
            corner(0, 1),
            corner(1, 1),
            corner(2, 1),
            flat(0, 1, 0),
            flat(0, 2, 0),
            upright(0),
            flat(1, 2, 0),
            upright(1),
            upright(2),
            flat(0, 1, 1),
            flat(0, 2, 1),
            flat(1, 2, 1),
        ]
    }
}
