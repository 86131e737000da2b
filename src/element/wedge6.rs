//! The 6-node wedge on the triangle (0,0), (1,0), (0,1) times [-1, 1], linear in each.

use super::dual::{Dual, one_minus};
use super::shape::ShapeFunctions;

/// The 6-node wedge.
pub struct Wedge6;

impl Wedge6 {
    fn functions([x, y, z]: [Dual; 3]) -> [Dual; 6] {
        let corner = [one_minus(x + y), x, y];
        let end = [one_minus(z) * 0.5, (z + 1.0) * 0.5];
        std::array::from_fn(|i| corner[i % 3] * end[i / 3])
    }
}

impl ShapeFunctions<6, 3> for Wedge6 {
    const NODES: [[f64; 3]; 6] = [
        [0.0, 0.0, -1.0],
        [1.0, 0.0, -1.0],
        [0.0, 1.0, -1.0],
        [0.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
    ];

    fn values(xi: [f64; 3]) -> [f64; 6] {
        Self::functions(Dual::coordinates(xi)).map(|n| n.value)
    }

    fn gradients(xi: [f64; 3]) -> [[f64; 3]; 6] {
        Self::functions(Dual::coordinates(xi)).map(|n| n.gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: see [`super::super::shape::checks::check`].
    #[test]
    fn shape_functions() {
        super::super::shape::checks::check::<Wedge6, 6, 3>([0.2, 0.3, 0.1]);
    }
}
