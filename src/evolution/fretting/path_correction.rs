//! Correction of the wear of coupled cycles (path points solved together) by resolved cycles.

use serde::{Deserialize, Serialize};

use crate::evolution::fretting::rate_correction::RateCorrection;
use crate::evolution::fretting::settings::CORRECTION;
use crate::evolution::records::{FrameState, Resultants};
use crate::evolution::step::{Correction, ResolvedCycleSettings};
use crate::frame::grid::extend_field;

/// Result of a resolved cycle: correction and error of the wear of the coupled cycle.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PathCorrection {
    /// Whether the wear is corrected. If not, all factors are 1, and the added wear is 0.
    pub corrects: bool,
    /// Correction with which the present wear rates were computed.
    pub correction: RateCorrection,
    /// Correction measured by the resolved cycle.
    pub(super) measured: RateCorrection,
    /// Change of the factors per cycle between the previous resolved cycle and this one, `[N]`.
    pub(super) factor_rate: Vec<f64>,
    /// Completed cycles of the step at the resolved cycle.
    pub(super) at_cycle: f64,
    /// Ratio of the dissipation of the resolved cycle to the dissipation of the coupled cycle; 1 without correction.
    pub dissipation_factor: f64,
    /// Increments per stroke of the resolved cycle.
    pub increments: usize,
    /// Whether no record of a jump mentions this resolved cycle yet.
    pub is_new: bool,
    /// Slip between the path points of the coupled cycle, `[E, 2, N]` for E path points, mm.
    pub(super) slip: Vec<f64>,
    /// Ratio of elastic lag to slip in the coupled cycle.
    pub(super) lag_ratio: f64,
    /// Whether the whole contact slips in the coupled cycle.
    pub(super) full_slip: bool,
    /// Mean normal force at the reversal points of the coupled cycle, N.
    pub(super) normal_force: f64,
    /// Wear depth at the resolved cycle, `[N]`, mm.
    pub(super) wear_depth: Vec<f64>,
    /// Remaining error of the wear per cycle, `[N]`. With correction, the error is divided by the wear of the cell.
    /// Without correction, the error of the wear depth is divided by the wear volume, 1/mm2.
    pub(super) remaining_error: Vec<f64>,
    /// Remaining error of the wear volume from the increments per stroke, divided by the wear volume. With correction
    /// this is 0, because `remaining_error` then gives the error of the volume.
    pub(super) remaining_volume_error: f64,
    /// Error of the wear volume from tractions that still change from cycle to cycle, divided by the wear volume.
    pub(super) settling_error: f64,
    /// Correction of the resultants at the reversal points (+, -). `None` with [`Correction::Never`].
    pub reversal_correction: Option<[ReversalCorrection; 2]>,
    /// Change of the position of body 2 per cycle along x, y, mm.
    pub(super) body_drift: [f64; 2],
    /// Fields of the resolved cycle at the + reversal point; `None` without correction.
    #[serde(skip)]
    pub(super) fields: Option<FrameState>,
}

/// Difference between the resultants of a resolved cycle and of the coupled cycle at a reversal point. Forces and
/// moments are divided by the normal force, the stick area is divided by the contact area.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct ReversalCorrection {
    shift: [f64; 2],
    normal_force: f64,
    tangential_force: [f64; 2],
    moment: [f64; 3],
    stick_area: f64,
}

impl ReversalCorrection {
    /// Subtracts the mean of the two shifts, because this mean is arbitrary if body 2 may drift.
    pub(super) fn without_common_shift(mut both: [Self; 2]) -> [Self; 2] {
        let mean = [0, 1].map(|k| 0.5 * (both[0].shift[k] + both[1].shift[k]));
        both.iter_mut().for_each(|one| (0..2).for_each(|k| one.shift[k] -= mean[k]));
        both
    }

    pub(super) fn between(resolved: &Resultants, coupled: &Resultants) -> Self {
        let share =
            |now: f64, before: f64, whole: f64| if whole > 0.0 { (now - before) / whole } else { 0.0 };
        let force = coupled.normal_force;
        Self {
            shift: [0, 1].map(|k| resolved.shift[k] - coupled.shift[k]),
            normal_force: share(resolved.normal_force, force, force),
            tangential_force: [0, 1]
                .map(|k| share(resolved.tangential_force[k], coupled.tangential_force[k], force)),
            moment: [0, 1, 2].map(|k| share(resolved.moment[k], coupled.moment[k], force)),
            stick_area: share(resolved.stick_area, coupled.stick_area, coupled.contact_area),
        }
    }

    /// Adds the difference to the resultants `values` of a coupled cycle.
    pub fn apply(&self, values: &mut Resultants) {
        let force = values.normal_force;
        (0..2).for_each(|k| values.shift[k] += self.shift[k]);
        values.normal_force += self.normal_force * force;
        (0..2).for_each(|k| values.tangential_force[k] += self.tangential_force[k] * force);
        (0..3).for_each(|k| values.moment[k] += self.moment[k] * force);
        let stick_area = values.stick_area + self.stick_area * values.contact_area;
        values.stick_area = stick_area.clamp(0.0, values.contact_area);
    }
}

/// Slip of a coupled cycle between its path points. The elastic lag of a cell is the motion of body 2 minus the slip.
#[derive(Clone, Copy)]
pub(super) struct CycleSlip {
    /// Whether each cell slips in every increment at whose end the cell carries pressure.
    pub(super) full_slip: bool,
    /// Largest ratio of the elastic lag of a cell to the displacement of body 2. It estimates the share of a stroke in
    /// which slip spreads over the contact.
    pub(super) slip_spread_share: f64,
    /// Ratio of the mean elastic lag to the mean slip. The means over the contact are weighted by the normal force.
    pub(super) lag: f64,
}

impl PathCorrection {
    /// Correction in the middle of a jump of `length` cycles that begins after `done` cycles of the step. The factors
    /// are extrapolated, but change only by a limited share. The added wear is not extrapolated.
    pub fn extrapolated_correction(&self, done: f64, length: f64) -> RateCorrection {
        let ahead = done + 0.5 * length - self.at_cycle;
        let factor = |(found, slope): (&f64, &f64)| {
            (found + slope * ahead).clamp(
                (1.0 - CORRECTION.max_factor_extrapolation) * found,
                (1.0 + CORRECTION.max_factor_extrapolation) * found,
            )
        };
        let factors = self.measured.factors.iter().zip(&self.factor_rate).map(factor).collect();
        RateCorrection { factors, added: self.measured.added.clone() }
    }

    /// Correction and dissipation factor at `cycle` (completed cycles of the step), interpolated between this resolved
    /// cycle and the later resolved cycle `end`.
    pub(super) fn correction_at(&self, end: &Self, cycle: f64) -> (RateCorrection, f64) {
        let share = (cycle - self.at_cycle) / (end.at_cycle - self.at_cycle);
        let [from, to] = [self.dissipation_factor, end.dissipation_factor];
        (self.measured.between(&end.measured, share), from + share * (to - from))
    }

    /// Transfers the correction to a larger frame of `n` cells. `places` contains the new index of each cell.
    pub fn transfer_to(self, places: &[usize], n: usize) -> Self {
        Self {
            correction: self.correction.transfer_to(places, n),
            measured: self.measured.transfer_to(places, n),
            factor_rate: extend_field(&self.factor_rate, places, n, |_| 0.0),
            slip: extend_field(&self.slip, places, n, |_| 0.0),
            wear_depth: extend_field(&self.wear_depth, places, n, |_| 0.0),
            remaining_error: extend_field(&self.remaining_error, places, n, |_| 0.0),
            ..self
        }
    }

    /// Returns whether the cycle must be resolved again. `slip` and `normal_force` belong to the present coupled cycle.
    /// `changed` returns the relative change of the slip since a given earlier slip.
    pub(super) fn is_due(
        &self,
        used: ResolvedCycleSettings,
        slip: &CycleSlip,
        normal_force: f64,
        changed: impl Fn(&[f64]) -> f64,
    ) -> bool {
        let ratio = normal_force / self.normal_force;
        let unloaded =
            !(1.0 / CORRECTION.recheck_force_ratio..=CORRECTION.recheck_force_ratio).contains(&ratio);
        match used.correction {
            Correction::Never => false,
            _ if unloaded => true,
            _ if self.corrects => changed(&self.slip) > used.tolerance,
            _ if slip.full_slip != self.full_slip => true,
            _ if slip.full_slip => slip.lag > CORRECTION.recheck_lag_growth * self.lag_ratio,
            _ => changed(&self.slip) > used.tolerance,
        }
    }
}
