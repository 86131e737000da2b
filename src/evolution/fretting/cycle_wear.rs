//! Wear of one cycle, and comparison of the wear of two cycles.

use crate::evolution::field_measures::{root_mean_square, volume};
use crate::evolution::fretting::rate_correction::RateCorrection;
use crate::evolution::fretting::settings::{CORRECTION, REFINEMENT};
use crate::evolution::records::{FrameState, Resultants};

#[derive(Clone, Default)]
pub(super) struct CycleWear {
    /// Wear depth per cycle, `[N]`, mm.
    pub rate: Vec<f64>,
    /// Dissipation per cycle, N mm.
    pub power: f64,
    /// Estimated relative error of the wear volume from tractions that still change from cycle to cycle.
    pub settling_error: f64,
    /// Resultants at the reversal points (+, -).
    pub reversals: [Resultants; 2],
    /// Change of the position of body 2 per cycle along x, y, mm.
    pub body_drift: [f64; 2],
    /// Fields at the + reversal point of a resolved cycle.
    pub fields: Option<FrameState>,
}

impl CycleWear {
    /// Mean normal force at the reversal points, N.
    pub fn normal_force(&self) -> f64 {
        0.5 * (self.reversals[0].normal_force + self.reversals[1].normal_force)
    }

    /// Largest relative change of the tangential force from the cycle `other` at the two reversal points. The change is
    /// divided by the force, or by a share of the normal force if this share is larger.
    pub fn force_change(&self, other: &Self) -> f64 {
        let change = |(now, before): (&Resultants, &Resultants)| {
            let [[x, y], [x0, y0]] = [now.tangential_force, before.tangential_force];
            let force = f64::max(x.hypot(y), REFINEMENT.min_force_share * now.normal_force.abs());
            if force > 0.0 { (x - x0).hypot(y - y0) / force } else { 0.0 }
        };
        self.reversals.iter().zip(&other.reversals).map(change).fold(0.0, f64::max)
    }

    /// Extrapolates wear and resultants from this cycle and a `coarser` cycle. The error of this cycle is assumed to be
    /// `ratio` times smaller.
    pub fn extrapolated(&self, coarser: &Self, ratio: f64) -> Self {
        let limit = |fine: f64, coarse: f64| (ratio * fine - coarse) / (ratio - 1.0);
        let rate = self.rate.iter().zip(&coarser.rate).map(|(fine, coarse)| limit(*fine, *coarse).max(0.0));
        let reversals = [0, 1].map(|reversal| {
            let (fine, coarse) = (&self.reversals[reversal], &coarser.reversals[reversal]);
            Resultants {
                shift: [0, 1].map(|k| limit(fine.shift[k], coarse.shift[k])),
                normal_force: limit(fine.normal_force, coarse.normal_force),
                tangential_force: [0, 1].map(|k| limit(fine.tangential_force[k], coarse.tangential_force[k])),
                moment: [0, 1, 2].map(|k| limit(fine.moment[k], coarse.moment[k])),
                ..*fine
            }
        });
        Self {
            rate: rate.collect(),
            power: limit(self.power, coarser.power),
            reversals,
            settling_error: self.settling_error.max(coarser.settling_error),
            ..self.clone()
        }
    }
}

/// Root mean square of the difference between two wear rates, relative to the largest value of `rate`. The mean
/// includes the cells with positive `rate`.
pub(super) fn relative_rms_difference(rate: &[f64], other: &[f64], areas: &[f64]) -> f64 {
    let difference: Vec<f64> = rate.iter().zip(other).map(|(rate, other)| rate - other).collect();
    let largest = rate.iter().copied().fold(0.0, f64::max);
    if largest > 0.0 { root_mean_square(&difference, areas, |i| rate[i] > 0.0) / largest } else { 0.0 }
}

/// Difference of the wear volumes of two cycles, relative to the larger volume.
pub(super) fn volume_difference(wear: &CycleWear, other: &CycleWear, areas: &[f64]) -> f64 {
    let [volume, others] = [&wear.rate, &other.rate].map(|rate| volume(rate, areas));
    let larger = volume.max(others);
    if larger > 0.0 { (volume - others).abs() / larger } else { 0.0 }
}

/// Ratio of the value of a resolved cycle to the value of the coupled cycle, within limits. Without limits, factors
/// would vanish or become very large in cells that barely slip.
pub(super) fn limited_factor(resolved: f64, coupled: f64) -> f64 {
    (resolved / coupled).clamp(CORRECTION.min_wear_factor, CORRECTION.max_wear_factor)
}

/// Correction that turns the wear `coupled` of a coupled cycle into the wear `wear` of the resolved cycle, both `[N]`,
/// mm per cycle.
pub(super) fn rate_correction(wear: &[f64], coupled: &[f64], areas: &[f64]) -> RateCorrection {
    let [all, all_coupled] = [wear, coupled].map(|rate| volume(rate, areas));
    let whole = if all > 0.0 && all_coupled > 0.0 { limited_factor(all, all_coupled) } else { 1.0 };
    let least = CORRECTION.negligible_wear_share * coupled.iter().copied().fold(0.0, f64::max);
    let factor = |(wear, coupled): (&f64, &f64)| {
        if *coupled > least { limited_factor(*wear, *coupled) } else { whole }
    };
    let factors: Vec<f64> = wear.iter().zip(coupled).map(factor).collect();
    // The added wear must not be negative, because the wear of the coupled cycle may vanish later.
    let added = |((wear, coupled), factor): ((&f64, &f64), &f64)| (wear - factor * coupled).max(0.0);
    let both = wear.iter().zip(coupled).zip(&factors);
    RateCorrection { added: both.map(added).collect(), factors }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: f c + a equals the wear r of the resolved cycle, also if the wear c of the coupled cycle is zero. Where r
    /// / c is below the smallest allowed factor, f is the smallest allowed factor.
    #[test]
    fn corrected_rates_are_those_of_the_resolved_cycle() {
        let (resolved, coupled) = ([1.0, 9.0, 0.5, 2.0, 0.0, 0.0], [2.0, 1.0, 0.0, 1e-9, 0.0, 0.5]);
        for coupled in [coupled, [0.0; 6]] {
            let found = rate_correction(&resolved, &coupled, &[1.0; 6]);
            for i in 0..6 {
                let rate = found.factors[i] * coupled[i] + found.added[i];
                let wanted = resolved[i].max(CORRECTION.min_wear_factor * coupled[i]);
                assert!((rate - wanted).abs() < 1e-15, "{i}: {rate}");
                assert!(found.factors[i] <= CORRECTION.max_wear_factor);
            }
        }
    }
}
