//! Natural residual: measures how far a state is from the solution of an increment.

use super::contact_state::ContactState;
use super::control::{NormalControl, Pressures, TangentialControl};
use super::increment::Increment;
use crate::linalg::vector::nan_max;

/// Rounding error of a sum of a few numbers, relative to the largest of them.
const SUM_ROUNDING: f64 = 8.0 * f64::EPSILON;

impl Increment<'_> {
    /// Natural residual (docs/theory-contact.md): the largest change of a traction in one local projection step,
    /// relative to the largest pressure. If the relative defect of a prescribed force is larger, the residual is this
    /// defect.
    ///
    /// The step size of a pressure is 1 / (S_nn + w), where w is `implicit_passes` times `wear_per_pressure`. The step
    /// size of a tangential traction is `ContactScales::c_tangential`. The residual is 0 for an open state without
    /// penetration and NaN if any number is NaN.
    pub fn natural_residual(&self, it: &ContactState) -> f64 {
        let [normal, tangential] = self.natural_residual_parts(it);
        nan_max(normal, tangential)
    }

    /// Normal and tangential part of [`Increment::natural_residual`].
    pub fn natural_residual_parts(&self, it: &ContactState) -> [f64; 2] {
        let n = self.n();
        let mut parts = [0.0_f64; 2];
        let mut p_max: f64 = 0.0;
        for end in 0..self.path_points.len() {
            for i in 0..n {
                let change = self.traction_change(it, end, i);
                parts = [nan_max(parts[0], change[0]), nan_max(parts[1], change[1])];
                p_max = nan_max(p_max, it.scaled[end * 3 * n + 2 * n + i]);
            }
        }
        if p_max == 0.0 && self.overlap_is_rounding(it) {
            parts[0] = 0.0;
        }
        for part in &mut parts {
            // If no cell carries pressure, a change other than 0 gives an infinite residual.
            *part = if *part == 0.0 { 0.0 } else { *part / p_max };
        }
        (0..self.path_points.len()).fold(parts, |[normal, tangential], end| {
            let [force, shear] = self.force_residuals(it, end);
            [nan_max(normal, force), nan_max(tangential, shear)]
        })
    }

    /// Changes of the pressure and of the scaled tangential traction of a cell in one local projection step, MPa.
    fn traction_change(&self, it: &ContactState, end: usize, i: usize) -> [f64; 2] {
        let (n, base) = (self.n(), end * 3 * self.n());
        let p = it.scaled[base + 2 * n + i];
        let (mut rho, mut changes) = (p, [0.0; 2]);
        if self.pressures == Pressures::Unknown {
            let wear = self.implicit_passes * it.wear_per_pressure[end * n + i];
            let c = 1.0 / (1.0 / self.scales.c_normal[i] + wear);
            let star = p - c * it.gap[base + 2 * n + i];
            rho = if star > 0.0 { star } else { 0.0 * star };
            changes[0] = (p - rho).abs();
        }
        if self.friction.is_some() {
            let c = self.scales.c_tangential[i];
            let q = [it.scaled[base + i], it.scaled[base + n + i]];
            let star = [q[0] - c * it.gradient[base + i], q[1] - c * it.gradient[base + n + i]];
            let norm = (star[0] * star[0] + star[1] * star[1]).sqrt();
            let scale = if norm > rho { rho / norm } else { 1.0 };
            let change = [q[0] - scale * star[0], q[1] - scale * star[1]];
            changes[1] = (change[0] * change[0] + change[1] * change[1]).sqrt();
        }
        changes
    }

    /// Mean residual that damped Newton steps reduce: sqrt(Σ_points (Σ_cells δ² / (N p_max²) + Σ f²)).
    ///
    /// δ are the traction changes of the N cells in one local projection step. f are the relative defects of the
    /// prescribed forces.
    pub(super) fn mean_residual(&self, it: &ContactState, p_max: f64) -> f64 {
        let n = self.n();
        let squares = (0..self.path_points.len()).map(|end| {
            let changes = (0..n).flat_map(|i| self.traction_change(it, end, i)).map(|change| change / p_max);
            let mean = changes.map(|change| change * change).sum::<f64>() / n as f64;
            mean + self.force_residuals(it, end).iter().map(|defect| defect * defect).sum::<f64>()
        });
        squares.sum::<f64>().sqrt()
    }

    /// Numbers of cells that violate the contact conditions and the friction law at any path point. In one local
    /// projection step, their pressure or tangential traction changes by more than `tolerance` times the largest
    /// pressure.
    pub(super) fn violated_cells(&self, it: &ContactState, tolerance: f64) -> [usize; 2] {
        let bound = tolerance * largest_pressure(it, self.n());
        let violated = |part: usize| {
            let any = |i: &usize| {
                (0..self.path_points.len()).any(|end| self.traction_change(it, end, *i)[part] > bound)
            };
            (0..self.n()).filter(any).count()
        };
        [violated(0), violated(1)]
    }

    fn overlap_is_rounding(&self, it: &ContactState) -> bool {
        let n = self.n();
        let mut normal = it.gap.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
        let [deepest, largest] = normal
            .try_fold([0.0_f64; 2], |[deepest, largest], gap| {
                gap.is_finite().then(|| [deepest.max(-gap), largest.max(gap.abs())])
            })
            .unwrap_or([f64::INFINITY, 0.0]);
        deepest <= SUM_ROUNDING * largest
    }

    /// Relative defects of the prescribed normal and tangential forces of a path point; 0 without a prescribed force. A
    /// path point with a balance returns 0 and the residual of the balance.
    fn force_residuals(&self, it: &ContactState, end: usize) -> [f64; 2] {
        let n = self.n();
        if let Some(balance) = &self.path_points[end].balance {
            return [0.0, balance.residual(self.areas, &it.scaled[end * 3 * n..(end + 1) * 3 * n])];
        }
        let sum = |plane: usize| -> f64 {
            let start = end * 3 * n + plane * n;
            it.tractions[start..start + n].iter().zip(self.areas).map(|(t, a)| t * a).sum()
        };
        let normal = sum(2);
        let relative = |defect: f64, scale: f64| if defect == 0.0 { 0.0 } else { defect / scale };
        let mut residuals = [0.0; 2];
        if let (NormalControl::Force(wanted), Pressures::Unknown) =
            (self.path_points[end].normal, self.pressures)
        {
            residuals[0] = relative((normal - wanted).abs(), wanted.abs().max(normal.abs()));
        }
        if let TangentialControl::Force(wanted) = self.path_points[end].tangential {
            let defect = (sum(0) - wanted[0]).hypot(sum(1) - wanted[1]);
            // The scale is μ times the normal force for small tangential forces. Without the factor μ, the check would
            // be weak at very small friction.
            let mu = self.friction.map_or(1.0, |ellipse| ellipse.mu[0].min(ellipse.mu[1]).min(1.0));
            residuals[1] = relative(defect, wanted[0].hypot(wanted[1]).max(mu * normal.abs()));
        }
        residuals
    }
}

/// Largest pressure of all path points of `n` cells, MPa.
pub(super) fn largest_pressure(it: &ContactState, n: usize) -> f64 {
    let pressures = it.scaled.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
    pressures.fold(0.0, |most, p| nan_max(most, *p))
}
