//! Displacement and stress off the surface of a body, from the state of its surface.

use nalgebra::Matrix3;

use super::elements::BoundaryElements;
use super::system::SurfaceState;
use crate::geometry::Point;
use crate::material::VOIGT;

/// Step of the differences over the distance from the surface.
const STEP: f64 = 0.06;

/// Weights of central differences of order 6 at 1, 2, 3 steps.
const DIFFERENCES: [f64; 3] = [0.75, -0.15, 1.0 / 60.0];

impl BoundaryElements {
    /// Displacement at a point off the surface, mm: that of the body inside, zero on the other side.
    ///
    /// # Source
    /// Somigliana's identity, u(y) = ∫ U t dS - ∫ T u dS.
    pub fn displacement_at(&self, state: &SurfaceState, y: &Point) -> Point {
        let mut sum = Point::zeros();
        for i in 0..self.n_elements() {
            let influence = self.away(i, y);
            for (a, node) in self.nodes_of(i).enumerate() {
                sum += influence.single[a] * Point::from(state.traction[node])
                    - influence.double[a] * Point::from(state.displacement[node]);
            }
        }
        sum
    }

    /// Stress at a point inside, Voigt 11 22 33 23 13 12, MPa, from differences of the displacement over a part of its `distance` from
    /// the surface.
    pub fn stress_at(&self, state: &SurfaceState, y: &Point, distance: f64) -> [f64; 6] {
        let step = STEP * distance;
        let mut gradient = Matrix3::zeros();
        for axis in 0..3 {
            for (k, weight) in DIFFERENCES.iter().enumerate() {
                let mut away = Point::zeros();
                away[axis] = step * (k + 1) as f64;
                let change =
                    self.displacement_at(state, &(y + away)) - self.displacement_at(state, &(y - away));
                gradient.column_mut(axis).axpy(weight / step, &change, 1.0);
            }
        }
        stress(self, &gradient)
    }
}

/// Stress of a gradient of displacement.
fn stress(elements: &BoundaryElements, gradient: &Matrix3<f64>) -> [f64; 6] {
    let strain =
        VOIGT.map(|(i, j)| if i == j { gradient[(i, i)] } else { gradient[(i, j)] + gradient[(j, i)] });
    (elements.stiffness().voigt() * nalgebra::Vector6::from(strain)).into()
}
