//! Resolved cycles: strokes solved one increment after the other (docs/theory-wear.md).
//!
//! A resolved cycle corrects the wear of the coupled cycle, whose path points are solved together. A cycle is resolved
//! again when slip, elastic lag or normal force has changed. If the number of increments is given, a cycle is resolved
//! after each jump. Resolved cycles do not change the stick zone of the coupled cycle.

use crate::contact::Unknowns;
use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_refinement::{CoupledCycle, RefinedCycle, Refinement};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::cycle_wear::{
    CycleWear, limited_factor, rate_correction, relative_rms_difference, volume_difference,
};
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::path_correction::{PathCorrection, ReversalCorrection};
use crate::evolution::fretting::rate_correction::RateCorrection;
use crate::evolution::fretting::settings::CORRECTION;
use crate::evolution::fretting::wear_integrator::{WearJump, add};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::run::{Advance, Run};
use crate::evolution::state;
use crate::evolution::step::{ClosedPath, Correction, ResolvedCycleSettings};

/// Coupled cycle before the first jump or at the end of a jump. Its contact state has not been evaluated.
struct WornCycle {
    cycle: CycleState,
    /// Wear depth, `[N]`, mm.
    wear_depth: Vec<f64>,
    /// Completed cycles of the step.
    completed: f64,
    /// Dissipation per cycle, including the present dissipation factor, N mm.
    dissipation_rate: f64,
}

impl<'a> Run<'a> {
    /// Closed path and settings of the resolved cycles of the current step. `None` if the step has no resolved cycles.
    pub(super) fn resolved_path(&self) -> Option<(&'a ClosedPath, ResolvedCycleSettings)> {
        let closed = self.step().kind.closed_path()?;
        let wears = self.wears();
        // Resolved cycles with a given number of increments also correct forces and dissipation, so they do not
        // require wear. Without friction they have no effect.
        let settings = closed.resolved_cycles.filter(|used| wears || used.increments.is_some())?;
        let always = settings.correction == Correction::Always && settings.increments.is_none();
        (always || self.has_friction()).then_some((closed, settings))
    }

    /// Resolves the cycle before the first jump, and corrects the rates of `wear_step`.
    pub(super) fn resolve_first_cycle(&mut self, wear_step: &mut WearStepState) -> Advance {
        let worn = WornCycle {
            cycle: CycleState::from(&wear_step.cycle),
            wear_depth: self.state.wear_depth.clone(),
            completed: wear_step.completed,
            dissipation_rate: wear_step.dissipation_rate,
        };
        if let Some(resolved) = self.resolve_cycle(wear_step, worn)? {
            wear_step.take_correction(resolved);
        }
        Ok(())
    }

    /// Resolves the cycle at the end of the trial `jump`, if necessary.
    pub(super) fn resolve_end(
        &mut self,
        wear_step: &mut WearStepState,
        jump: &WearJump,
    ) -> Advance<Option<PathCorrection>> {
        let mut wear_depth = self.state.wear_depth.clone();
        add(&mut wear_depth, 1.0, &jump.wear_depth);
        let worn = WornCycle {
            cycle: CycleState {
                contact: (&Unknowns::from_state(&jump.cycle.contact)).into(),
                stick_zone: jump.cycle.stick_zone.clone(),
            },
            wear_depth,
            completed: wear_step.completed + jump.length,
            dissipation_rate: jump.dissipation_rate,
        };
        self.resolve_cycle(wear_step, worn)
    }

    fn coupled_cycle(&self, wear_step: &WearStepState, path: &FrettingPath, worn: WornCycle) -> CoupledCycle {
        let WornCycle { mut cycle, wear_depth, completed, dissipation_rate } = worn;
        let problem = self.reporting_problem(wear_step, &cycle, &wear_depth);
        problem.evaluate(&mut cycle.contact);
        let reversals = [0, path.reversal_index()]
            .map(|point| state::resultants(&self.prepared, &problem, &cycle.contact, point));
        let wear = CycleWear {
            rate: self.worn_per_pass(&cycle.contact),
            power: dissipation_rate / wear_step.dissipation_factor(),
            reversals,
            ..CycleWear::default()
        };
        let slip = self.cycle_slip(&problem, &cycle);
        drop(problem);
        CoupledCycle { slip, wear, cycle, wear_depth, completed }
    }

    /// Resolves the coupled cycle `worn` if necessary. `None` if this is not necessary, or if a resolved cycle does not
    /// converge.
    fn resolve_cycle(
        &mut self,
        wear_step: &mut WearStepState,
        worn: WornCycle,
    ) -> Advance<Option<PathCorrection>> {
        let (SlipSource::ClosedPath(path), Some((closed, settings))) =
            (&wear_step.slip_source, self.resolved_path())
        else {
            return Ok(None);
        };
        let path = path.clone();
        let coupled = self.coupled_cycle(wear_step, &path, worn);
        let changed = |before: &[f64]| self.slip_change(&coupled.cycle.contact, before);
        let is_due = |before: &PathCorrection| {
            settings.increments.is_some()
                || before.is_due(settings, &coupled.slip, coupled.wear.normal_force(), changed)
        };
        if wear_step.path_correction.as_ref().is_some_and(|before| !is_due(before)) {
            return Ok(None);
        }
        let areas = self.prepared.model.frame.areas.as_slice();
        let refinement = Refinement { path: &path, closed, settings, coupled: &coupled, areas };
        let refined = self.refine_cycle(&refinement, wear_step)?;
        if let Some(refined) = refined {
            return Ok(Some(self.correction_by(wear_step, &refinement, &refined)));
        }
        // If the first resolved cycle does not converge and the wear is not corrected, an error of 0 is stored. The
        // cycle is then not resolved again.
        let unknown = || RefinedCycle {
            wear: coupled.wear.clone(),
            change: vec![0.0; areas.len()],
            increments: 0,
            agrees_with_coupled: false,
        };
        Ok((settings.correction == Correction::Never).then(|| self.error_measurement(&coupled, &unknown())))
    }

    fn correction_by(
        &mut self,
        wear_step: &WearStepState,
        refinement: &Refinement,
        refined: &RefinedCycle,
    ) -> PathCorrection {
        let &Refinement { settings, coupled, areas, .. } = refinement;
        let difference = volume_difference(&coupled.wear, &refined.wear, areas);
        let corrects = match settings.correction {
            Correction::Always => true,
            Correction::WhereNeeded => !refined.agrees_with_coupled,
            Correction::Never => false,
        };
        let of_cells = relative_rms_difference(&coupled.wear.rate, &refined.wear.rate, areas);
        let of_forces = coupled.wear.force_change(&refined.wear);
        if settings.correction == Correction::Never
            && (difference.max(of_cells) > settings.tolerance
                || of_forces > CORRECTION.min_reported_force_difference)
        {
            self.warn_of_increments(refinement, refined);
        }
        let at = |point: usize| {
            ReversalCorrection::between(&refined.wear.reversals[point], &coupled.wear.reversals[point])
        };
        let drifts = coupled.cycle.stick_zone.may_drift();
        let both =
            || if drifts { ReversalCorrection::without_common_shift([0, 1].map(at)) } else { [0, 1].map(at) };
        let measured = PathCorrection {
            fields: refined.wear.fields.clone().filter(|_| corrects),
            reversal_correction: (settings.correction != Correction::Never).then(both),
            ..self.error_measurement(coupled, refined)
        };
        let before = wear_step.path_correction.as_ref().filter(|before| before.corrects);
        if corrects { measured.with_correction(refined, coupled, before, areas) } else { measured }
    }

    /// Error of the coupled cycle: the difference from the resolved cycle plus the change by the last refinement.
    fn error_measurement(
        &self,
        coupled: &CoupledCycle,
        RefinedCycle { wear, change, increments, .. }: &RefinedCycle,
    ) -> PathCorrection {
        let areas = &self.prepared.model.frame.areas;
        let (rate, n) = (&coupled.wear.rate, areas.len());
        let last: Vec<f64> = wear.rate.iter().zip(change).map(|(rate, change)| rate * change).collect();
        let [all, resolved, last_volume] = [rate, &wear.rate, &last].map(|rate| volume(rate, areas));
        let over_all = |error: f64| if all > 0.0 { error / all } else { 0.0 };
        let remaining = (0..n).map(|i| over_all((rate[i] - wear.rate[i]).abs() + last[i].abs()));
        PathCorrection {
            corrects: false,
            correction: RateCorrection::none(n),
            measured: RateCorrection::none(n),
            factor_rate: vec![0.0; n],
            at_cycle: coupled.completed,
            dissipation_factor: 1.0,
            increments: *increments,
            is_new: true,
            slip: coupled.cycle.contact.slip.clone(),
            lag_ratio: coupled.slip.lag,
            wear_depth: coupled.wear_depth.clone(),
            full_slip: coupled.slip.full_slip,
            normal_force: coupled.wear.normal_force(),
            remaining_error: remaining.collect(),
            remaining_volume_error: over_all((all - resolved).abs() + last_volume.abs()),
            settling_error: wear.settling_error,
            reversal_correction: None,
            body_drift: wear.body_drift,
            fields: None,
        }
    }

    /// Adds the remaining errors of the resolved cycle to the estimated errors of the run. `by` is the wear depth of
    /// the jump, `[N]`, mm.
    pub(super) fn add_path_error(&mut self, resolved: &PathCorrection, by: &[f64]) {
        let areas = &self.prepared.model.frame.areas;
        let wear_volume = volume(by, areas).abs();
        let error = |(error, by): (&f64, &f64)| error * if resolved.corrects { *by } else { wear_volume };
        let errors: Vec<f64> = resolved.remaining_error.iter().zip(by).map(error).collect();
        self.state.depth_errors.iter_mut().zip(&errors).for_each(|(sum, error)| *sum += error.abs());
        let of_cells = if resolved.corrects { volume(&errors, areas).abs() } else { 0.0 };
        let sum = &mut self.state.volume_errors;
        sum.increments += of_cells + resolved.remaining_volume_error * wear_volume;
        sum.settling += resolved.settling_error * wear_volume;
    }
}

impl PathCorrection {
    /// Adds the correction from the coupled cycle to the resolved cycle. `before` is the previous correction, from
    /// which the change of the factors per cycle follows.
    fn with_correction(
        self,
        RefinedCycle { wear, change, .. }: &RefinedCycle,
        coupled: &CoupledCycle,
        before: Option<&Self>,
        areas: &[f64],
    ) -> Self {
        let correction = rate_correction(&wear.rate, &coupled.wear.rate, areas);
        let factor_rate = match before {
            Some(before) if self.at_cycle > before.at_cycle => {
                let change = correction.factors.iter().zip(&before.measured.factors);
                change.map(|(now, found)| (now - found) / (self.at_cycle - before.at_cycle)).collect()
            }
            _ => vec![0.0; areas.len()],
        };
        let power = coupled.wear.power;
        Self {
            corrects: true,
            measured: correction.clone(),
            correction,
            factor_rate,
            dissipation_factor: if power > 0.0 { limited_factor(wear.power, power) } else { 1.0 },
            remaining_error: change.clone(),
            remaining_volume_error: 0.0,
            ..self
        }
    }
}
