use super::Quad9;
use super::shape::ShapeFunctions;

/// The 8-node quadrilateral on [-1, 1]^2, serendipity.
pub struct Quad8;

impl ShapeFunctions<8, 2> for Quad8 {
    const NODES: [[f64; 2]; 8] = *Quad9::NODES.first_chunk().unwrap();

    fn values([x, y]: [f64; 2]) -> [f64; 8] {
        Self::NODES.map(|[a, b]| {
            if a == 0.0 {
                0.5 * (1.0 - x * x) * (1.0 + b * y)
            } else if b == 0.0 {
                0.5 * (1.0 + a * x) * (1.0 - y * y)
            } else {
                0.25 * (1.0 + a * x) * (1.0 + b * y) * (a * x + b * y - 1.0)
            }
        })
    }

    fn gradients([x, y]: [f64; 2]) -> [[f64; 2]; 8] {
        Self::NODES.map(|[a, b]| {
            if a == 0.0 {
                [-x * (1.0 + b * y), 0.5 * b * (1.0 - x * x)]
            } else if b == 0.0 {
                [0.5 * a * (1.0 - y * y), -y * (1.0 + a * x)]
            } else {
                [
                    0.25 * a * (1.0 + b * y) * (2.0 * a * x + b * y),
                    0.25 * b * (1.0 + a * x) * (a * x + 2.0 * b * y),
                ]
            }
        })
    }
}
