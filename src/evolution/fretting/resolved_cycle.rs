//! Resolved cycles: strokes solved one increment after the other (docs/theory-wear.md). A resolved cycle gives factors on the wear
//! that follows from the slip between the coupled path points. A cycle is resolved again only when this slip or the normal force
//! has changed. It does not change the stick zone of the coupled cycle.

use crate::error::Result;
use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_refinement::{RefinedCycle, Refinement};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::cycle_wear::{
    CycleWear, relative_rms_difference, volume_difference, wear_factors,
};
use crate::evolution::fretting::path_correction::{CycleSlip, ResolvedCycle, ReversalCorrection};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::run::Run;
use crate::evolution::state;
use crate::evolution::step::{Correction, CycleMotion};

/// Estimated change of the wear volume until the tractions are steady, relative to its change from one cycle to the next.
const DRIFT_ERROR_FACTOR: f64 = 4.0;

/// Relative difference between the tangential forces of prescribed increments and of the resolved cycle, above which a warning is
/// given.
const MIN_REPORTED_FORCE_DIFFERENCE: f64 = 0.02;

impl Run<'_> {
    /// Resolves the cycle at the current wear depth if that is due, and updates the error estimates. With correction, it also
    /// updates factors and rates of `wear_step`. If increments do not converge, rates and factors stay as they are.
    ///
    /// # Errors
    /// As [`Self::solve_cycle_increment`].
    pub(super) fn update_resolved_cycle(&mut self, wear_step: &mut WearStepState) -> Result<()> {
        let (SlipSource::ClosedPath(path), CycleMotion::ClosedPath(closed)) =
            (&wear_step.slip_source, &self.cycles().motion)
        else {
            return Ok(());
        };
        let (Some(used), true) =
            (closed.resolved_cycles, self.step().wear && self.prepared.specific_wear_rate.is_some())
        else {
            return Ok(());
        };
        if used.correction != Correction::Always && !self.has_friction() {
            return Ok(());
        }
        // A restored run has not evaluated its path points yet.
        let worn = self.state.wear_depth.clone();
        let mut cycle = CycleState::from(&wear_step.cycle);
        let problem = self.reporting_problem(wear_step, &cycle, &worn);
        problem.evaluate(&mut cycle.contact);
        let slip = self.cycle_slip(&problem, &cycle);
        let half = path.reversal_index();
        let reversals =
            [0, half].map(|point| state::resultants(&self.prepared, &problem, &cycle.contact, point));
        drop(problem);
        let coupled = CycleWear {
            rate: cycle.contact.wear_rate.clone(),
            power: wear_step.dissipation_rate / wear_step.dissipation_factor(),
            drift: 0.0,
            reversals,
        };
        let changed = |before: &[f64]| self.slip_change(&cycle.contact, before);
        let is_due = |before: &ResolvedCycle| before.is_due(used, (&slip, coupled.normal_force()), changed);
        if wear_step.resolved_cycle.as_ref().is_some_and(|before| !is_due(before)) {
            return Ok(());
        }
        let path = path.clone();
        let areas = self.prepared.model.frame.areas.as_slice();
        let refinement = Refinement { path: &path, closed, settings: used, slip, coupled: &coupled, areas };
        let Some(refined) = self.refine_cycle(&refinement, wear_step, &cycle)? else {
            if used.correction == Correction::Never {
                // The error stays unknown, and the cycle is not resolved again.
                let unknown = RefinedCycle {
                    wear: coupled.clone(),
                    change: vec![0.0; worn.len()],
                    increments: 0,
                    agrees_with_coupled: false,
                };
                wear_step.resolved_cycle =
                    Some(self.error_measurement((wear_step, &cycle), (&unknown, &coupled), slip));
            }
            return Ok(());
        };
        let difference = volume_difference(&coupled, &refined.wear, areas);
        let (factors, unresolved_wear_fraction) = wear_factors(&refined.wear.rate, &coupled.rate, areas);
        let corrects = match used.correction {
            Correction::Always => true,
            // A correction that misses more wear than it corrects is worse than none.
            Correction::WhereNeeded if unresolved_wear_fraction.abs() > difference.max(used.tolerance) => {
                false
            }
            Correction::WhereNeeded => !refined.agrees_with_coupled,
            Correction::Never => false,
        };
        if used.correction != Correction::Never {
            self.warn_of_unresolved_wear(wear_step, (unresolved_wear_fraction, used.tolerance));
        } else if difference.max(relative_rms_difference(&coupled.rate, &refined.wear.rate, areas))
            > used.tolerance
            || coupled.force_change(&refined.wear) > MIN_REPORTED_FORCE_DIFFERENCE
        {
            self.warn_of_increments((closed.increments, used.tolerance), (&refined, &coupled));
        }
        let at = |point: usize| {
            ReversalCorrection::between(&refined.wear.reversals[point], &coupled.reversals[point])
        };
        let reversal_correction = (used.correction != Correction::Never).then(|| [0, 1].map(at));
        let before = wear_step.resolved_cycle.take().filter(|before| before.corrects);
        let measurement = ResolvedCycle {
            unresolved_wear_fraction,
            reversal_correction,
            ..self.error_measurement((wear_step, &cycle), (&refined, &coupled), slip)
        };
        if corrects {
            self.apply_correction((wear_step, &coupled), refined, factors, (before, measurement));
            return Ok(());
        }
        if let Some(before) = before {
            self.add_factor_drift_error(&vec![1.0; worn.len()], &before);
        }
        wear_step.wear_rate.copy_from_slice(&coupled.rate);
        wear_step.dissipation_rate = coupled.power;
        wear_step.resolved_cycle = Some(measurement);
        Ok(())
    }

    /// Sets the factors and rates of `wear_step` by a resolved cycle. `measurement` contains the errors without correction.
    fn apply_correction(
        &mut self,
        (wear_step, coupled): (&mut WearStepState, &CycleWear),
        RefinedCycle { wear, change, .. }: RefinedCycle,
        factors: Vec<f64>,
        (before, measurement): (Option<ResolvedCycle>, ResolvedCycle),
    ) {
        let areas = &self.prepared.model.frame.areas;
        let volume = volume(&wear.rate, areas);
        let drift = if volume > 0.0 { DRIFT_ERROR_FACTOR * wear.drift.abs() / volume } else { 0.0 };
        let at_cycle = wear_step.completed;
        let factor_rate = match &before {
            Some(before) if at_cycle > before.at_cycle => {
                self.add_factor_drift_error(&factors, before);
                let change = factors.iter().zip(&before.measured_factors);
                change.map(|(now, found)| (now - found) / (at_cycle - before.at_cycle)).collect()
            }
            _ => vec![0.0; factors.len()],
        };
        let rates = coupled.rate.iter().zip(&factors).map(|(rate, factor)| rate * factor);
        wear_step.wear_rate.iter_mut().zip(rates).for_each(|(to, rate)| *to = rate);
        let dissipation_factor = if coupled.power > 0.0 { wear.power / coupled.power } else { 1.0 };
        wear_step.dissipation_rate = coupled.power * dissipation_factor;
        let unresolved = measurement.unresolved_wear_fraction;
        wear_step.resolved_cycle = Some(ResolvedCycle {
            corrects: true,
            measured_factors: factors.clone(),
            factors,
            factor_rate,
            dissipation_factor,
            remaining_error: change,
            // The error is relative to the wear that the factors represent.
            remaining_volume_error: (unresolved.abs() + drift) / (1.0 - unresolved).max(f64::EPSILON),
            ..measurement
        });
    }

    /// Creates a resolved cycle without correction. Its remaining errors are the difference from the coupled cycle plus the change
    /// by the last refinement. The error of the wear volume also includes the drift of the tractions.
    fn error_measurement(
        &self,
        (wear_step, cycle): (&WearStepState, &CycleState),
        (RefinedCycle { wear, change, increments, .. }, coupled): (&RefinedCycle, &CycleWear),
        slip: CycleSlip,
    ) -> ResolvedCycle {
        let areas = &self.prepared.model.frame.areas;
        let n = coupled.rate.len();
        let last: Vec<f64> = wear.rate.iter().zip(change).map(|(rate, change)| rate * change).collect();
        let [all, resolved, last_volume] = [&coupled.rate, &wear.rate, &last].map(|rate| volume(rate, areas));
        let over_all = |error: f64| if all > 0.0 { error / all } else { 0.0 };
        let remaining = (0..n).map(|i| over_all((coupled.rate[i] - wear.rate[i]).abs() + last[i].abs()));
        let volume =
            over_all((all - resolved).abs() + last_volume.abs() + DRIFT_ERROR_FACTOR * wear.drift.abs());
        ResolvedCycle {
            corrects: false,
            factors: vec![1.0; n],
            measured_factors: vec![1.0; n],
            factor_rate: vec![0.0; n],
            at_cycle: wear_step.completed,
            dissipation_factor: 1.0,
            increments: *increments,
            is_new: true,
            slip: cycle.contact.slip.clone(),
            lag_ratio: slip.lag,
            wear_depth: self.state.wear_depth.clone(),
            full_slip: slip.full_slip,
            normal_force: coupled.normal_force(),
            remaining_error: remaining.collect(),
            remaining_volume_error: volume,
            unresolved_wear_fraction: 0.0,
            reversal_correction: None,
        }
    }

    /// Adds the remaining path error of a jump to the estimated errors. `by` is the wear depth of the jump, `[N]`, mm.
    pub(super) fn add_path_error(&mut self, resolved: &ResolvedCycle, by: &[f64]) {
        let areas = &self.prepared.model.frame.areas;
        let wear_volume = volume(by, areas).abs();
        let error = |(error, by): (&f64, &f64)| error * if resolved.corrects { *by } else { wear_volume };
        let errors: Vec<f64> = resolved.remaining_error.iter().zip(by).map(error).collect();
        self.state.depth_errors.iter_mut().zip(&errors).for_each(|(sum, error)| *sum += error.abs());
        let of_cells = if resolved.corrects { volume(&errors, areas).abs() } else { 0.0 };
        self.state.volume_error += of_cells + resolved.remaining_volume_error * wear_volume;
    }

    /// Adds the error from outdated factors: the wear since the last resolved cycle, times the relative error of the factors used.
    /// Their true value is taken as the mean of old and new factors.
    fn add_factor_drift_error(&mut self, factors: &[f64], before: &ResolvedCycle) {
        let areas = &self.prepared.model.frame.areas;
        let mut volume = 0.0;
        for i in 0..factors.len() {
            let by = self.state.wear_depth[i] - before.wear_depth[i];
            if before.factors[i] > 0.0 {
                let mean = 0.5 * (factors[i] + before.measured_factors[i]);
                let error = (mean / before.factors[i] - 1.0) * by;
                self.state.depth_errors[i] += error.abs();
                volume += areas[i] * error;
            }
        }
        self.state.volume_error += volume.abs();
    }
}
