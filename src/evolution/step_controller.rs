//! Lengths of wear jumps, chosen by a proportional-integral controller of the estimated error (docs/theory-wear.md).
//!
//! # Source
//! Gustafsson 1991, "Control theoretic techniques for stepsize selection in explicit Runge-Kutta methods".

use serde::{Deserialize, Serialize};

use crate::evolution::step::{Cycles, JumpPolicy};

/// Settings of [`StepController`]. An error ratio is the estimated error of a jump divided by the allowed error. No
/// recorded measurement supports the values of the settings.
pub(super) struct StepControllerSettings {
    /// Safety factor on the length of the next jump.
    error_target: f64,
    /// Exponent e of the error ratio r of the current jump: the next length is proportional to r^(-e / order).
    current_error_exponent: f64,
    /// Exponent e of the error ratio r of the last accepted jump: the next length is also proportional to r^(e /
    /// order). Without an accepted jump directly before, r is the current error ratio.
    last_error_exponent: f64,
    /// Largest ratio of the next length to the length of the jump just computed.
    max_length_growth: f64,
    min_length_growth: f64,
    /// Largest length of an explicit jump, divided by the estimated longest stable length. The estimate may be a few
    /// percent too large.
    explicit_length_share: f64,
    /// Largest growth of the contact radius during a jump, and largest change of the stick-zone radius, in cell sides.
    max_radius_growth_cells: f64,
    /// Limit of the changes of both radii, as a share of the contact radius before the jump. The larger of this limit
    /// and `max_radius_growth_cells` applies.
    max_radius_growth_share: f64,
    pub max_trials: usize,
    /// Iterations per stage after which a shorter jump is tried, if one is possible.
    max_trial_iterations: usize,
}

pub(super) const STEP_CONTROLLER: StepControllerSettings = StepControllerSettings {
    error_target: 0.9,
    current_error_exponent: 0.7,
    last_error_exponent: 0.4,
    max_length_growth: 5.0,
    min_length_growth: 0.2,
    explicit_length_share: 0.9,
    max_radius_growth_cells: 2.0,
    max_radius_growth_share: 0.05,
    max_trials: 12,
    max_trial_iterations: 2000,
};

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct StepController {
    next_length: f64,
    /// Error ratio of the last accepted jump; `None` before the first accepted jump, and after a rejected trial.
    last_error_ratio: Option<f64>,
    /// The error ratio of a jump grows as length^order.
    order: f64,
    /// Length of the last trial if it was rejected.
    rejected_length: Option<f64>,
    pub rejected_trials: usize,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct StepPosition {
    /// Completed cycles, or completed sliding distance in mm.
    pub completed: f64,
    pub jumps_done: usize,
    pub whole_cycles: bool,
    /// Longest stable jump of an explicit integrator, in cycles or in mm of sliding.
    pub critical_length: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PlannedTrial {
    pub length: f64,
    pub can_be_shorter: bool,
    /// Largest number of solver iterations per stage.
    pub max_iterations: usize,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct TrialMeasures {
    pub converged: bool,
    pub lost_contact: bool,
    pub error_ratio: f64,
    /// Radius of the contact before and after the jump, mm.
    pub contact_radius: [f64; 2],
    /// Radius of the stick zone before and after the jump, mm.
    pub stick_radius: [f64; 2],
    /// Mean side of a cell, mm.
    pub cell_side: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rejection {
    NotConverged,
    LostContact,
    /// Error ratio above 1.
    Error(f64),
    RadiusChange,
}

impl StepController {
    pub fn new(first: f64, order: f64) -> Self {
        Self { next_length: first, last_error_ratio: None, order, rejected_length: None, rejected_trials: 0 }
    }

    pub fn plan(&self, cycles: &Cycles, position: StepPosition, max_iterations: usize) -> PlannedTrial {
        let StepPosition { completed, jumps_done, whole_cycles, critical_length } = position;
        match cycles.jumps {
            JumpPolicy::Tolerance(_) => {
                let unit = if whole_cycles { 1.0 } else { 0.0 };
                let stable = critical_length.map(|critical| STEP_CONTROLLER.explicit_length_share * critical);
                let aim = stable.map_or(self.next_length, |most| self.next_length.min(most));
                let length = self.length(aim, cycles.count - completed, unit);
                let can_be_shorter = length > unit.max(1e-9 * cycles.count);
                let mut trial = PlannedTrial { length, can_be_shorter, max_iterations };
                if self.may_reject(&trial) {
                    trial.max_iterations = max_iterations.min(STEP_CONTROLLER.max_trial_iterations);
                }
                trial
            }
            JumpPolicy::Number(jumps) => {
                let part = |k: usize| cycles.count * k as f64 / jumps as f64;
                let done = |k: usize| if whole_cycles { part(k).round() } else { part(k) };
                let length = done(jumps_done + 1) - done(jumps_done);
                PlannedTrial { length, can_be_shorter: false, max_iterations }
            }
        }
    }

    fn may_reject(&self, trial: &PlannedTrial) -> bool {
        trial.can_be_shorter && self.rejected_trials < STEP_CONTROLLER.max_trials
    }

    /// Length of the next jump. Equal jumps, at most 1 % longer than `aim`, cover the remaining length `left`.
    ///
    /// If `unit` is positive, the length is rounded up to a multiple of `unit`. After a rejected trial, the rounded
    /// length is also shorter than the rejected length, but at least `unit`.
    fn length(&self, aim: f64, left: f64, unit: f64) -> f64 {
        let parts = (left / aim - 1e-2).ceil().max(1.0);
        let even = left / parts;
        if unit <= 0.0 {
            return even;
        }
        let whole = ((even / unit).ceil() * unit).min(left);
        match self.rejected_length {
            Some(rejected) if whole >= rejected => ((rejected / unit).ceil() - 1.0).max(1.0) * unit,
            _ => whole,
        }
    }

    pub fn judge(&self, trial: &PlannedTrial, measures: &TrialMeasures) -> Option<Rejection> {
        if !self.may_reject(trial) {
            return None;
        }
        let TrialMeasures { converged, lost_contact, error_ratio, contact_radius, stick_radius, cell_side } =
            *measures;
        let StepControllerSettings { max_radius_growth_cells, max_radius_growth_share, .. } = STEP_CONTROLLER;
        let most = (max_radius_growth_cells * cell_side).max(max_radius_growth_share * contact_radius[0]);
        if !converged {
            Some(Rejection::NotConverged)
        } else if lost_contact {
            Some(Rejection::LostContact)
        } else if error_ratio > 1.0 {
            Some(Rejection::Error(error_ratio))
        } else if contact_radius[1] - contact_radius[0] > most
            || (stick_radius[1] - stick_radius[0]).abs() > most
        {
            Some(Rejection::RadiusChange)
        } else {
            None
        }
    }

    pub fn accept(&mut self, length: f64, error_ratio: f64) {
        let ratio = error_ratio.max(1e-10);
        let last = self.last_error_ratio.unwrap_or(ratio);
        let factor = STEP_CONTROLLER.error_target
            * ratio.powf(-STEP_CONTROLLER.current_error_exponent / self.order)
            * last.powf(STEP_CONTROLLER.last_error_exponent / self.order);
        self.next_length =
            length * factor.clamp(STEP_CONTROLLER.min_length_growth, STEP_CONTROLLER.max_length_growth);
        (self.last_error_ratio, self.rejected_length, self.rejected_trials) = (Some(ratio), None, 0);
    }

    pub fn reject(&mut self, length: f64, reason: Rejection) {
        self.next_length = match reason {
            Rejection::Error(ratio) => {
                let factor = STEP_CONTROLLER.error_target * ratio.powf(-1.0 / self.order);
                length * factor.clamp(STEP_CONTROLLER.min_length_growth, STEP_CONTROLLER.error_target)
            }
            Rejection::NotConverged | Rejection::LostContact | Rejection::RadiusChange => 0.5 * length,
        };
        (self.last_error_ratio, self.rejected_length) = (None, Some(length));
        self.rejected_trials += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::step::Integrator;

    /// Truth: if the error is a power of the length, the lengths converge to a constant. At this constant the growth factor
    /// error_target ratio^((last_error_exponent - current_error_exponent) / order) is 1.
    #[test]
    fn lengths_settle_at_the_aim() {
        for order in [1.0, 2.0] {
            let ratio = |length: f64| (length / 7.0).powf(order);
            let mut control = StepController::new(0.5, order);
            let mut rejected = 0;
            for _ in 0..60 {
                let length = control.next_length;
                if ratio(length) <= 1.0 {
                    control.accept(length, ratio(length));
                } else {
                    control.reject(length, Rejection::Error(ratio(length)));
                    rejected += 1;
                }
            }
            let StepControllerSettings { error_target, current_error_exponent, last_error_exponent, .. } =
                STEP_CONTROLLER;
            let aim = error_target.powf(order / (current_error_exponent - last_error_exponent));
            assert!(
                (ratio(control.next_length) / aim - 1.0).abs() < 1e-3,
                "{} {aim}",
                ratio(control.next_length)
            );
            assert!(rejected <= 3, "{rejected}");
        }
    }

    /// Truth: every repetition of a rejected jump has fewer whole cycles, until one cycle is left.
    #[test]
    fn rejected_jumps_get_shorter() {
        for (left, rejected) in [(1000.0, 2.0), (1000.0, 7.0), (5.0, 4.0), (5.0, 5.0), (2.0, 2.0)] {
            for ratio in [1.0 + 1e-9, 1.2, 1e6] {
                let mut control = StepController::new(rejected, 2.0);
                let mut length = rejected;
                while length > 1.0 {
                    control.reject(length, Rejection::Error(ratio));
                    let next = control.length(control.next_length, left, 1.0);
                    assert!((1.0..length).contains(&next) && next.fract() == 0.0, "{length} {next}");
                    length = next;
                }
            }
        }
    }

    /// Truth: 1000 remaining cycles and a next length of 300 give four equal jumps of 250 cycles.
    #[test]
    fn the_rest_is_shared_out() {
        let control = StepController::new(300.0, 2.0);
        let (mut left, mut lengths) = (1000.0, Vec::new());
        while left > 0.0 {
            lengths.push(control.length(300.0, left, 1.0));
            left -= lengths[lengths.len() - 1];
        }
        assert_eq!(lengths, [250.0; 4]);
        assert_eq!(control.length(300.0, 2.5, 0.0), 2.5);
        assert_eq!(control.length(0.2, 10.0, 1.0), 1.0);
    }

    fn cycles(jumps: JumpPolicy) -> Cycles {
        Cycles { count: 10.0, jumps, integrator: Integrator::Sdirk2 }
    }

    fn position(completed: f64, jumps_done: usize) -> StepPosition {
        StepPosition { completed, jumps_done, whole_cycles: true, critical_length: None }
    }

    /// Truth: 3 jumps over 10 cycles end at the rounded multiples of 10/3: 3, 7, 10.
    #[test]
    fn prescribed_jumps_consist_of_whole_cycles() {
        let control = StepController::new(10.0, 2.0);
        let (mut completed, mut ends) = (0.0, Vec::new());
        for jump in 0..3 {
            let trial = control.plan(&cycles(JumpPolicy::Number(3)), position(completed, jump), 100);
            assert!(!trial.can_be_shorter && trial.max_iterations == 100);
            completed += trial.length;
            ends.push(completed);
        }
        assert_eq!(ends, [3.0, 7.0, 10.0]);
    }

    /// Truth: a trial is rejected for the first reason that applies, in the order of the variants of `Rejection`. The
    /// limit of the error ratio is 1. The limit of changes of radii is the larger of 2 cell sides and 5 % of the
    /// contact radius.
    #[test]
    fn reasons_of_rejection() {
        let control = StepController::new(10.0, 2.0);
        let trial = control.plan(&cycles(JumpPolicy::Tolerance(1e-2)), position(0.0, 0), 5000);
        assert!(trial.can_be_shorter && trial.max_iterations == STEP_CONTROLLER.max_trial_iterations);
        let good = TrialMeasures {
            converged: true,
            lost_contact: false,
            error_ratio: 1.0,
            contact_radius: [10.0, 12.0],
            stick_radius: [5.0, 3.0],
            cell_side: 1.0,
        };
        assert_eq!(control.judge(&trial, &good), None);
        let finer = TrialMeasures { cell_side: 0.1, ..good };
        let slight = TrialMeasures { contact_radius: [10.0, 10.4], stick_radius: [5.0, 4.6], ..finer };
        assert_eq!(control.judge(&trial, &slight), None);
        let large = TrialMeasures { error_ratio: 1.5, ..finer };
        let lost = TrialMeasures { lost_contact: true, ..large };
        let diverged = TrialMeasures { converged: false, ..lost };
        for (measures, reason) in [
            (TrialMeasures { contact_radius: [10.0, 10.6], ..slight }, Rejection::RadiusChange),
            (TrialMeasures { stick_radius: [5.0, 5.6], ..slight }, Rejection::RadiusChange),
            (large, Rejection::Error(1.5)),
            (lost, Rejection::LostContact),
            (diverged, Rejection::NotConverged),
        ] {
            assert_eq!(control.judge(&trial, &measures), Some(reason));
        }
    }

    /// Truth: after a trial without convergence, the next trial has half its length. After `max_trials` rejections, or
    /// for a jump of one cycle, a trial is always accepted. Its iteration limit is the limit of the solver. An accepted
    /// jump resets the number of rejections.
    #[test]
    fn trials_run_out() {
        let diverged = TrialMeasures {
            converged: false,
            lost_contact: false,
            error_ratio: 0.0,
            contact_radius: [1.0; 2],
            stick_radius: [0.0; 2],
            cell_side: 1.0,
        };
        let sliding = StepPosition { whole_cycles: false, ..position(0.0, 0) };
        let policy = cycles(JumpPolicy::Tolerance(1e-2));
        let mut control = StepController::new(10.0, 2.0);
        for trials in 0..STEP_CONTROLLER.max_trials {
            let trial = control.plan(&policy, sliding, 5000);
            assert!((trial.length - 10.0 * 0.5_f64.powi(trials as i32)).abs() < 1e-12, "{trial:?}");
            let reason = control.judge(&trial, &diverged).expect("trials are left");
            control.reject(trial.length, reason);
        }
        let last = control.plan(&policy, sliding, 5000);
        assert_eq!((control.judge(&last, &diverged), last.max_iterations), (None, 5000));
        control.accept(last.length, 1.0);
        assert_eq!(control.rejected_trials, 0);
        let single = StepController::new(1.0, 2.0);
        let trial = single.plan(&policy, position(9.0, 4), 5000);
        assert_eq!((trial.length, single.judge(&trial, &diverged)), (1.0, None));
    }
}
