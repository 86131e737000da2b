//! Selection, trial and acceptance of the next jump.

use std::time::Instant;

use crate::contact::SolverOptions;
use crate::contact::solver::StopReason;
use crate::error::{Error, Result, warning};
use crate::evolution::fretting::cycle_state::StickZone;
use crate::evolution::fretting::jump_record::AcceptedJump;
use crate::evolution::fretting::path_correction::PathCorrection;
use crate::evolution::fretting::settings::WEAR_STEP;
use crate::evolution::fretting::wear_integrator::{JumpSpec, WearJump};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::increment_solve::ProgressSpan;
use crate::evolution::run::{Advance, Run};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::step::{Integrator, JumpPolicy, Normal};
use crate::evolution::step_controller::{PlannedTrial, STEP_CONTROLLER, TrialMeasures};
use crate::geometry::format_short;

struct FoundJump {
    jump: WearJump,
    /// Resolved cycle at the end of the jump; `None` if no cycle was resolved.
    resolved: Option<PathCorrection>,
    trial: PlannedTrial,
}

impl Run<'_> {
    pub(super) fn take_jump(&mut self, wear_step: &mut WearStepState, clock: Instant) -> Advance {
        if self.is_worn_out(wear_step) {
            return self.finish_worn_out_step(wear_step, clock);
        }
        let FoundJump { mut jump, resolved, trial } = self.find_jump(wear_step)?;
        if jump.converged() && jump.reaches_frame_edge && !wear_step.touched_edge_initially {
            return Err(self.stop_at_frame_edge(wear_step, &jump).into());
        }
        // The first strokes and the rejected jumps have no records of their own, so the record of this jump includes
        // their work.
        jump.charge_work(std::mem::take(&mut wear_step.uncharged_work));
        jump.charge_work(self.discarded_work);
        self.warn_of_unstable(wear_step, jump.length);
        let rejected = wear_step.step_controller.rejected_trials;
        if let JumpPolicy::Tolerance(tolerance) = self.cycles().jumps {
            let ratio = self.error_ratio(tolerance, jump.whole_depth_error(), &jump);
            if trial.can_be_shorter && jump.converged() {
                self.warn_of_jump_error(wear_step, jump.length, ratio);
            }
            wear_step.step_controller.accept(jump.length, ratio);
        }
        self.commit_jump(wear_step, AcceptedJump { jump, resolved, rejected, clock })?;
        self.discarded_work = SolveWork::default();
        Ok(())
    }

    /// Tries shorter and shorter jumps until the step controller accepts a jump.
    fn find_jump(&mut self, wear_step: &mut WearStepState) -> Advance<FoundJump> {
        let (step, cycles) = (self.step(), self.cycles());
        let radii =
            self.contact_and_stick_radius(&wear_step.cycle.contact.scaled, &wear_step.cycle.stick_zone);
        loop {
            let trial =
                wear_step.step_controller.plan(cycles, wear_step.position(), self.options.max_iterations);
            let part = |done: f64| done / cycles.count;
            let progress = ProgressSpan {
                name: &step.name,
                from: part(wear_step.completed),
                to: part(wear_step.completed + trial.length),
            };
            let options = SolverOptions { max_iterations: trial.max_iterations, ..self.options };
            let rate_correction = wear_step.extrapolated_correction(trial.length);
            let mut spec =
                JumpSpec { integrator: cycles.integrator, length: trial.length, rate_correction, options };
            let mut jump = self.integrate(spec.clone(), wear_step, &progress)?;
            if self.is_rejected(wear_step, &trial, radii, &jump) {
                continue;
            }
            if jump.lost_contact {
                wear_step.uncharged_work += jump.work();
                spec = JumpSpec { integrator: Integrator::BackwardEuler, options: self.options, ..spec };
                jump = self.repeat_by_backward_euler(wear_step, spec.clone(), &progress)?;
            }
            if !jump.converged() || (jump.reaches_frame_edge && !wear_step.touched_edge_initially) {
                return Ok(FoundJump { jump, resolved: None, trial });
            }
            let told = self.result.warnings.len();
            let resolved = self.resolve_end(wear_step, &jump)?;
            if let Some(resolved) = &resolved {
                jump = self.correct_jump(wear_step, resolved, spec, jump, &progress)?;
                if self.is_rejected(wear_step, &trial, radii, &jump) {
                    wear_step.expect_factors(resolved);
                    self.result.warnings.truncate(told);
                    continue;
                }
            }
            return Ok(FoundJump { jump, resolved, trial });
        }
    }

    /// Returns whether the step controller rejects the trial `jump`, after which the next trial is shorter. `radii` are the contact
    /// and stick radii before the jump.
    fn is_rejected(
        &self,
        wear_step: &mut WearStepState,
        trial: &PlannedTrial,
        radii: [f64; 2],
        jump: &WearJump,
    ) -> bool {
        let JumpPolicy::Tolerance(tolerance) = self.cycles().jumps else { return false };
        if jump.report.stop == StopReason::Interrupted {
            return false;
        }
        let measures = self.trial_measures(tolerance, radii, jump);
        let Some(reason) = wear_step.step_controller.judge(trial, &measures) else { return false };
        wear_step.uncharged_work += jump.work();
        wear_step.step_controller.reject(trial.length, reason);
        true
    }

    /// Integrates a jump again by the backward Euler method, which allows cells to lose contact.
    fn repeat_by_backward_euler(
        &mut self,
        wear_step: &WearStepState,
        spec: JumpSpec,
        progress: &ProgressSpan,
    ) -> Result<WearJump> {
        let length = spec.length;
        let jump = self.integrate(spec, wear_step, progress)?;
        let whole = matches!(wear_step.slip_source, SlipSource::ClosedPath(_));
        let (what, remedy) = if whole && length <= 1.0 {
            (
                "one cycle".to_owned(),
                "a jump cannot be shorter: check the loads, the specific wear rate and its unit",
            )
        } else {
            (format!("{length} {}", wear_step.length_unit()), "use more jumps for a more accurate result")
        };
        self.result.warnings.push(format!(
            "step \"{}\" ({}): in the jump of {what} more cells lose contact than the second-order integrator allows. The less accurate Backward Euler method was used for this jump; {remedy}",
            self.step().name,
            wear_step.jumps_done + 1
        ));
        Ok(jump)
    }

    fn is_worn_out(&self, wear_step: &WearStepState) -> bool {
        let still = matches!(self.controls.normal, Normal::Approach(_)) && self.step().normal.is_none();
        still
            && wear_step.initial_peak_pressure > 0.0
            && wear_step.cycle.peak_pressure()
                <= WEAR_STEP.worn_out_pressure_ratio * wear_step.initial_peak_pressure
    }

    /// Warns once per step if a jump is accepted although its error exceeds the allowed error, because no trials are
    /// left. `ratio` is the estimated error divided by the allowed error.
    fn warn_of_jump_error(&mut self, wear_step: &WearStepState, length: f64, ratio: f64) {
        if ratio <= 1.0 || !self.is_first_in_step(StepWarning::JumpError) {
            return;
        }
        self.result.warnings.push(warning(&format!(
            "step \"{}\": after {} rejected longer trials a jump of {} {} was accepted, although its estimated wear depth error is {} times the limit set by wear.tolerance. Later jumps may exceed the limit, too; the estimated errors of the results include this. Increase wear.tolerance, or decrease solver.tolerance",
            self.step().name,
            STEP_CONTROLLER.max_trials,
            format_short(length),
            wear_step.length_unit(),
            format_short(ratio)
        )));
    }

    fn warn_of_unstable(&mut self, wear_step: &WearStepState, length: f64) {
        let Some(critical) = wear_step.critical_length else { return };
        if length <= critical * (1.0 + 1e-9) || !self.is_first_in_step(StepWarning::UnstableJump) {
            return;
        }
        self.result.warnings.push(warning(&format!(
            "step \"{}\": an explicit jump of {} {} is longer than the stability limit of {}. Pressures and wear depths oscillate from cell to cell and \
             are useless. Take an implicit integrator: wear.integrator = \"sdirk2\"",
            self.step().name,
            format_short(length),
            wear_step.length_unit(),
            format_short(critical)
        )));
    }

    pub(super) fn refuse_unstable(&self, wear_step: &WearStepState) -> Result<()> {
        let cycles = self.cycles();
        let (Some(critical), JumpPolicy::Number(jumps)) = (wear_step.critical_length, cycles.jumps) else {
            return Ok(());
        };
        // Jumps over closed paths consist of whole cycles.
        let whole = matches!(wear_step.slip_source, SlipSource::ClosedPath(_));
        let (mean, limit) = (cycles.count / jumps as f64, critical * (1.0 + 1e-9));
        let (length, longest) = if whole { (mean.ceil(), limit.floor()) } else { (mean, limit) };
        if length <= limit {
            return Ok(());
        }
        let shorter = if longest > 0.0 {
            let jumps = (cycles.count / longest).ceil();
            format!(
                "Take {jumps} jumps or more, or omit `jumps` (then they are as short as necessary), or take"
            )
        } else {
            "A jump covers at least one cycle, which is too long: take".to_owned()
        };
        let unit = wear_step.length_unit();
        Err(Error::input(format!(
            "step \"{}\": explicit jumps of {} {unit} are unstable: above {} {unit}, pressures oscillate from cell to cell. {shorter} \
             an implicit integrator: wear.integrator = \"sdirk2\"",
            self.step().name,
            format_short(length),
            format_short(critical)
        )))
    }

    /// Ratio of the error `depth_error` (mm) of a jump to the error that `tolerance` allows for this jump.
    pub(super) fn error_ratio(&self, tolerance: f64, depth_error: f64, jump: &WearJump) -> f64 {
        let cycles = self.cycles();
        if depth_error == 0.0 {
            return 0.0;
        }
        let deepest = |more: f64| {
            let depths = self.state.wear_depth.iter().zip(&jump.wear_depth);
            depths.map(|(worn, by)| worn + more * by).fold(0.0, f64::max)
        };
        let (before, after) = (deepest(0.0), deepest(1.0));
        let approach = self.prepared.approach_of(&self.state.rigid_motion, &self.state.mode_amplitudes);
        let negligible = WEAR_STEP.negligible_depth_share * approach.abs();
        let all = after + negligible;
        let share = 0.5 * ((after - before) / all + jump.length / cycles.count);
        depth_error / (tolerance * all * cycles.integrator.error_budget(share))
    }

    /// Measures by which the step controller judges the trial `jump`. `contact` and `stick` are the radii before the
    /// jump, mm.
    fn trial_measures(&self, tolerance: f64, [contact, stick]: [f64; 2], jump: &WearJump) -> TrialMeasures {
        let [new_contact, new_stick] =
            self.contact_and_stick_radius(&jump.cycle.contact.scaled, &jump.cycle.stick_zone);
        TrialMeasures {
            converged: jump.converged(),
            lost_contact: jump.lost_contact,
            error_ratio: self.error_ratio(tolerance, jump.whole_depth_error(), jump),
            contact_radius: [contact, new_contact],
            stick_radius: [stick, new_stick],
            cell_side: self.prepared.model.frame.mean_cell_side(),
        }
    }

    /// Radii of two circles, mm. The first circle has the area of the cells in contact at any path point. The second
    /// circle has the area of the cells of the stick zone that are in contact.
    fn contact_and_stick_radius(&self, scaled: &[f64], stick_zone: &StickZone) -> [f64; 2] {
        let areas = &self.prepared.model.frame.areas;
        let touching = self.cells_in_contact(scaled);
        let radius = |sum: f64| (sum / std::f64::consts::PI).sqrt();
        let sum =
            |counts: &dyn Fn(usize) -> bool| (0..areas.len()).filter(|&i| counts(i)).map(|i| areas[i]).sum();
        [radius(sum(&|i| touching[i])), radius(sum(&|i| touching[i] && stick_zone.mask[i]))]
    }
}
