//! The 27-node hexahedron on [-1, 1]^3, triquadratic.

use super::dual::{Dual, quadratic};
use super::shape::DualShapeFunctions;

/// The 27-node hexahedron.
pub struct Hex27;

impl DualShapeFunctions<27> for Hex27 {
    const NODES: [[f64; 3]; 27] = [
        [-1.0, -1.0, -1.0],
        [1.0, -1.0, -1.0],
        [1.0, 1.0, -1.0],
        [-1.0, 1.0, -1.0],
        [-1.0, -1.0, 1.0],
        [1.0, -1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, 1.0, 1.0],
        [0.0, -1.0, -1.0],
        [-1.0, 0.0, -1.0],
        [-1.0, -1.0, 0.0],
        [1.0, 0.0, -1.0],
        [1.0, -1.0, 0.0],
        [0.0, 1.0, -1.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
        [0.0, -1.0, 1.0],
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [0.0, 1.0, 1.0],
        [0.0, 0.0, -1.0],
        [0.0, -1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 0.0],
    ];

    fn dual_values(xi: [Dual; 3]) -> [Dual; 27] {
        Self::NODES.map(|n| quadratic(xi[0], n[0]) * quadratic(xi[1], n[1]) * quadratic(xi[2], n[2]))
    }
}
