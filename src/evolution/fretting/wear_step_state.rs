//! State of a wear step in progress.

use serde::{Deserialize, Serialize};

use crate::contact::{NormalControl, PathPoint, SlipReference, TangentialControl};
use crate::evolution::controls::LoadPath;
use crate::evolution::fretting::cycle_state::{CycleUnknowns, StickZone};
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::path_correction::PathCorrection;
use crate::evolution::fretting::rate_correction::RateCorrection;
use crate::evolution::solve_work::SolveWork;
use crate::evolution::step_controller::{StepController, StepPosition};

#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct WearStepState {
    /// Cycle at the end of the last jump.
    pub cycle: CycleUnknowns,
    pub slip_source: SlipSource,
    /// Completed cycles, or sliding distance in mm, of this step.
    pub completed: f64,
    /// Wear depth per cycle (mm), or per mm of sliding, at the current wear depth, `[N]`.
    pub wear_rate: Vec<f64>,
    /// Dissipation per cycle (N mm), or per mm of sliding (N), at the current wear depth.
    pub dissipation_rate: f64,
    pub path_correction: Option<PathCorrection>,
    /// Path of the loads from the start of the step to its end, without the cyclic motion or force.
    pub load_path: LoadPath,
    pub step_controller: StepController,
    /// Solver work that no record contains yet.
    pub uncharged_work: SolveWork,
    pub jumps_done: usize,
    /// Longest stable jump of an explicit integrator, cycles or mm of sliding.
    pub critical_length: Option<f64>,
    /// Largest pressure at the start of the step, MPa.
    pub initial_peak_pressure: f64,
    pub touched_edge_initially: bool,
    /// Number of cycles and sliding distance (mm) before the step.
    pub totals_before: (u64, f64),
    /// Whether the operators have been rebuilt since rates and path points were computed.
    pub rates_outdated: bool,
}

#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SlipSource {
    ClosedPath(FrettingPath),
    /// Slip per mm of steady sliding, `[2, N]`, dimensionless.
    Sliding(Vec<f64>),
}

impl WearStepState {
    pub fn length_unit(&self) -> &'static str {
        if matches!(self.slip_source, SlipSource::ClosedPath(_)) {
            "cycles"
        } else {
            "length units of sliding"
        }
    }

    /// Total cycles of the run after `completed` cycles of the step.
    pub fn cycles_at(&self, completed: f64) -> u64 {
        self.totals_before.0 + completed.round() as u64
    }

    pub fn position(&self) -> StepPosition {
        StepPosition {
            completed: self.completed,
            jumps_done: self.jumps_done,
            whole_cycles: matches!(self.slip_source, SlipSource::ClosedPath(_)),
            critical_length: self.critical_length,
        }
    }

    /// Factor by which a resolved cycle corrects the dissipation of the coupled cycle; 1 without a resolved cycle.
    pub fn dissipation_factor(&self) -> f64 {
        self.path_correction.as_ref().map_or(1.0, |resolved| resolved.dissipation_factor)
    }

    /// Replaces the correction by `resolved`, and applies the new correction to the rates.
    pub(super) fn take_correction(&mut self, resolved: PathCorrection) {
        let before = self.path_correction.take();
        let new = &resolved.correction;
        for (i, rate) in self.wear_rate.iter_mut().enumerate() {
            let (factor, added) = before
                .as_ref()
                .map_or((1.0, 0.0), |before| (before.correction.factors[i], before.correction.added[i]));
            *rate = new.factors[i] * ((*rate - added) / factor) + new.added[i];
        }
        self.dissipation_rate *=
            resolved.dissipation_factor / before.map_or(1.0, |before| before.dissipation_factor);
        self.path_correction = Some(resolved);
    }

    /// Correction for the wear of the next jump, whose length is `length` cycles; `None` without correction.
    pub(super) fn extrapolated_correction(&self, length: f64) -> Option<RateCorrection> {
        let corrected = self.path_correction.as_ref().filter(|resolved| resolved.corrects);
        corrected.map(|resolved| resolved.extrapolated_correction(self.completed, length))
    }

    /// Extrapolates the factors of the next trial from the resolved cycle `end` at the end of a rejected jump.
    pub(super) fn expect_factors(&mut self, end: &PathCorrection) {
        if let Some(before) = self.path_correction.as_mut().filter(|before| before.corrects) {
            let change = end.measured.factors.iter().zip(&before.measured.factors);
            before.factor_rate =
                change.map(|(then, now)| (then - now) / (end.at_cycle - before.at_cycle)).collect();
        }
    }

    /// Path point for reports. The motions are fixed, and slip has the same reference as in the solution.
    pub fn reported_path_point(&self, point: usize, stick_zone: &StickZone) -> PathPoint {
        PathPoint {
            load_phase: match &self.slip_source {
                SlipSource::ClosedPath(path) => path.phase(point),
                SlipSource::Sliding(_) => 0.0,
            },
            normal: NormalControl::Approach,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: match &self.slip_source {
                SlipSource::ClosedPath(_) => stick_zone.slip_reference(),
                SlipSource::Sliding(slip) => SlipReference::Prescribed(slip.clone()),
            },
        }
    }
}
