//! Scaling of tangential tractions by the friction coefficients, which turns the friction ellipse into a circle.

use crate::laws::friction::FrictionEllipse;

/// Transformation between physical and scaled (hatted) vectors. R turns components along the friction axes into
/// components along x, y. M = diag(μ1, μ2) contains the friction coefficients.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FrictionScaling {
    pub mu: [f64; 2],
    pub cos: f64,
    pub sin: f64,
}

impl FrictionScaling {
    pub fn new(ellipse: &FrictionEllipse) -> Self {
        let (sin, cos) = ellipse.angle.sin_cos();
        Self { mu: ellipse.mu, cos, sin }
    }

    /// Physical traction (x, y) for the scaled traction q̂: q = R M q̂.
    pub fn physical_traction(&self, hatted: [f64; 2]) -> [f64; 2] {
        let (a, b) = (self.mu[0] * hatted[0], self.mu[1] * hatted[1]);
        [self.cos * a - self.sin * b, self.sin * a + self.cos * b]
    }

    /// Scaled traction for the physical traction q: q̂ = M⁻¹ Rᵀ q.
    pub fn scaled_traction(&self, q: [f64; 2]) -> [f64; 2] {
        [(self.cos * q[0] + self.sin * q[1]) / self.mu[0], (-self.sin * q[0] + self.cos * q[1]) / self.mu[1]]
    }

    /// Physical slip (x, y) for the scaled slip v̂: v = R M⁻¹ v̂.
    pub fn physical_slip(&self, hatted: [f64; 2]) -> [f64; 2] {
        let (a, b) = (hatted[0] / self.mu[0], hatted[1] / self.mu[1]);
        [self.cos * a - self.sin * b, self.sin * a + self.cos * b]
    }

    /// Scaled slip for the physical slip v: v̂ = M Rᵀ v.
    pub fn scaled_slip(&self, v: [f64; 2]) -> [f64; 2] {
        [self.mu[0] * (self.cos * v[0] + self.sin * v[1]), self.mu[1] * (-self.sin * v[0] + self.cos * v[1])]
    }
}
