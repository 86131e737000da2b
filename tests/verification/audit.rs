//! Checks the laws of contact and friction in every cell, from the fields of a state alone.

use orthowear::evolution::records::FrameState;
use orthowear::laws::friction::FrictionEllipse;

/// Largest violations of the contact and friction laws over all cells.
#[derive(Debug)]
pub struct Audit {
    /// Violation of g >= 0 for the normal gap g, divided by the largest pressure and the flexibility scale `unit` (mm/MPa).
    pub gap: f64,
    /// Violation of p >= 0 for the pressure p, divided by the largest pressure.
    pub tension: f64,
    /// Violation of p g = 0, divided by the squared largest pressure and `unit`.
    pub complementarity: f64,
    /// Violation of |q|_mu <= p for the tangential traction q, divided by the largest pressure. |q|_mu is the norm of (q1 / mu1,
    /// q2 / mu2) in the axes of the friction ellipse.
    pub cone: f64,
    /// Slip of cells whose tangential traction is below the friction limit, divided by the largest pressure and `unit`. Only
    /// cells with more than 1e-3 of the largest pressure count.
    pub stick: f64,
    /// Largest angle between the slip and the inward normal of the friction ellipse, degrees. Only cells whose pressure and slip
    /// exceed 1e-3 of their scales count.
    pub angle: f64,
    /// Smallest dissipation of a cell (minus tangential traction times slip), divided by the squared largest pressure and `unit`.
    pub dissipation: f64,
}

impl Audit {
    pub fn passes(&self, tolerance: f64) -> bool {
        let violations = [self.gap, self.tension, self.complementarity, self.cone, self.stick];
        violations.iter().all(|v| *v <= tolerance) && self.angle < 0.1 && self.dissipation >= -tolerance
    }
}

/// Largest violations in `state`. `unit` is the normal displacement of a cell under unit pressure (mm/MPa). Without a friction
/// `ellipse`, only the normal laws are checked.
pub fn audit(state: &FrameState, ellipse: Option<FrictionEllipse>, unit: f64) -> Audit {
    let n = state.gap.len() / 3;
    let p_max = state.tractions[2 * n..].iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let displacement = p_max * unit;
    let mut worst = Audit {
        gap: 0.0,
        tension: 0.0,
        complementarity: 0.0,
        cone: 0.0,
        stick: 0.0,
        angle: 0.0,
        dissipation: f64::INFINITY,
    };
    let raise =
        |worst: &mut f64, value: f64| *worst = if value.is_nan() { f64::NAN } else { worst.max(value) };
    for i in 0..n {
        let (p, g) = (state.tractions[2 * n + i], state.gap[2 * n + i]);
        raise(&mut worst.gap, -g / displacement);
        raise(&mut worst.tension, -p / p_max);
        raise(&mut worst.complementarity, (p * g).abs() / (p_max * displacement));
        let Some(ellipse) = ellipse else { continue };
        let (sin, cos) = ellipse.angle.sin_cos();
        let turned = |x: f64, y: f64| [cos * x + sin * y, cos * y - sin * x];
        let q = turned(state.tractions[i], state.tractions[n + i]);
        let s = turned(state.slip[i], state.slip[n + i]);
        let size = (q[0] / ellipse.mu[0]).hypot(q[1] / ellipse.mu[1]);
        let slip = s[0].hypot(s[1]);
        raise(&mut worst.cone, (size - p) / p_max);
        worst.dissipation = worst.dissipation.min(-(q[0] * s[0] + q[1] * s[1]) / (p_max * displacement));
        if p > 0.0 && size < p * (1.0 - 1e-5) && p > 1e-3 * p_max {
            raise(&mut worst.stick, slip / displacement);
        }
        if p > 1e-3 * p_max && slip > 1e-3 * displacement {
            let normal = [q[0] / ellipse.mu[0].powi(2), q[1] / ellipse.mu[1].powi(2)];
            let [cross, dot] = [normal[0] * s[1] - normal[1] * s[0], -(normal[0] * s[0] + normal[1] * s[1])];
            raise(&mut worst.angle, cross.abs().atan2(dot).to_degrees());
        }
    }
    worst
}
