use super::shape::ShapeFunctions;

/// The 9-node quadrilateral on [-1, 1]^2, biquadratic.
pub struct Quad9;

fn line(node: f64, x: f64) -> f64 {
    if node == 0.0 { 1.0 - x * x } else { 0.5 * x * (x + node) }
}

fn slope(node: f64, x: f64) -> f64 {
    if node == 0.0 { -2.0 * x } else { x + 0.5 * node }
}

impl ShapeFunctions<9, 2> for Quad9 {
    const NODES: [[f64; 2]; 9] = [
        [-1.0, -1.0],
        [1.0, -1.0],
        [1.0, 1.0],
        [-1.0, 1.0],
        [0.0, -1.0],
        [1.0, 0.0],
        [0.0, 1.0],
        [-1.0, 0.0],
        [0.0, 0.0],
    ];

    fn values([x, y]: [f64; 2]) -> [f64; 9] {
        Self::NODES.map(|[a, b]| line(a, x) * line(b, y))
    }

    fn gradients([x, y]: [f64; 2]) -> [[f64; 2]; 9] {
        Self::NODES.map(|[a, b]| [slope(a, x) * line(b, y), line(a, x) * slope(b, y)])
    }
}
