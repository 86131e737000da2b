use super::Wedge18;
use super::dual::{Dual, one_minus};
use super::shape::DualShapeFunctions;

/// The 6-node wedge, the triangle (0,0), (1,0), (0,1) times the line [-1, 1]: linear on the triangle and on the line.
pub struct Wedge6;

impl DualShapeFunctions<6> for Wedge6 {
    const NODES: [[f64; 3]; 6] = *Wedge18::NODES.first_chunk().unwrap();

    fn dual_values([x, y, z]: [Dual; 3]) -> [Dual; 6] {
        let corner = [one_minus(x + y), x, y];
        let end = [one_minus(z) * 0.5, (z + 1.0) * 0.5];
        std::array::from_fn(|i| corner[i % 3] * end[i / 3])
    }
}
