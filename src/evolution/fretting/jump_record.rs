//! Adds jumps to the state of the run, writes their records, and ends steps early.

use std::time::Instant;

use crate::contact::Unknowns;
use crate::contact::certificate::{self, OperatorCheck, TangentialGap};
use crate::error::warning;
use crate::evolution::checkpoint::StepProgress;
use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_state::{CycleState, CycleUnknowns};
use crate::evolution::fretting::path_correction::PathCorrection;
use crate::evolution::fretting::wear_integrator::WearJump;
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::increment_record::SolvedState;
use crate::evolution::records::{Divergence, FrameState, JumpRecord, Resultants};
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::Spin;
use crate::geometry::format_short;

/// Smallest displacement of body 2 over all cycles of a step that is reported as drift, relative to the amplitude.
const MIN_DRIFT_SHARE: f64 = 0.1;

pub(super) struct AcceptedJump {
    pub jump: WearJump,
    /// Resolved cycle at the end of the jump; `None` if no cycle was resolved.
    pub resolved: Option<PathCorrection>,
    pub rejected: usize,
    pub clock: Instant,
}

impl AcceptedJump {
    /// Record of the jump. `areas` are the areas of the cells, `[N]`, mm².
    fn record(&self, wear_step: &WearStepState, areas: &[f64]) -> JumpRecord {
        let path_volume_error = volume(&self.jump.path_error, areas).abs();
        let resolved = wear_step.path_correction.as_ref().filter(|resolved| resolved.is_new);
        JumpRecord {
            length: self.jump.length,
            solves: self.jump.solves,
            rejected: self.rejected,
            depth_error: self.jump.whole_depth_error(),
            volume_error: self.jump.volume_error + path_volume_error,
            critical_length: wear_step.critical_length,
            resolved: resolved.map(|resolved| resolved.increments),
        }
    }
}

/// Means of the resultants at the two reversal points. Tangential force and moment are not means, but values at the +
/// reversal point.
fn mean_of_reversal_points(reversals: &[Resultants; 2]) -> Resultants {
    let mean = |value: fn(&Resultants) -> f64| 0.5 * (value(&reversals[0]) + value(&reversals[1]));
    Resultants {
        shift: [0, 1].map(|k| 0.5 * (reversals[0].shift[k] + reversals[1].shift[k])),
        rotation: [0, 1].map(|k| 0.5 * (reversals[0].rotation[k] + reversals[1].rotation[k])),
        twist: mean(|e| e.twist),
        normal_force: mean(|e| e.normal_force),
        contact_area: mean(|e| e.contact_area),
        stick_area: mean(|e| e.stick_area),
        peak_pressure: mean(|e| e.peak_pressure),
        ..reversals[0]
    }
}

impl WearStepState {
    fn accept(&mut self, jump: &WearJump) {
        self.cycle = CycleUnknowns {
            contact: Unknowns::from_state(&jump.cycle.contact),
            stick_zone: jump.cycle.stick_zone.clone(),
        };
        self.wear_rate.copy_from_slice(&jump.wear_rate);
        self.dissipation_rate = jump.dissipation_rate;
        if let (Some(resolved), Some(used)) = (&mut self.path_correction, &jump.rate_correction) {
            resolved.correction.clone_from(used);
        }
    }
}

impl Run<'_> {
    pub(super) fn finish_worn_out_step(&mut self, wear_step: &mut WearStepState, clock: Instant) -> Advance {
        let length = self.cycles().count - wear_step.completed;
        self.result.warnings.push(format!(
            "step \"{}\": at this approach wear has reduced the peak pressure to a millionth of its initial value or less; wear is neglected in the remaining {length} {}",
            self.step().name,
            wear_step.length_unit()
        ));
        // In a resumed run, the path points of the cycle have not been evaluated yet.
        let worn = self.state.wear_depth.clone();
        let mut jump = WearJump::new(wear_step, length);
        let problem = self.reporting_problem(wear_step, &jump.cycle, &worn);
        jump.checks =
            certificate::check(&problem, &mut jump.cycle.contact, TangentialGap::Skip, OperatorCheck::Skip);
        drop(problem);
        // The remaining pressures are rounding errors of the gap, so the residual refers to the initial peak
        // pressure.
        jump.checks.natural_residual *= wear_step.cycle.peak_pressure() / wear_step.initial_peak_pressure;
        self.commit_jump(wear_step, AcceptedJump { jump, resolved: None, rejected: 0, clock })
    }

    pub(super) fn stop_at_frame_edge(&mut self, wear_step: &WearStepState, jump: &WearJump) -> RunEnd {
        let unit = wear_step.length_unit();
        self.result.warnings.push(format!(
            "step \"{}\" ({}): the contact reaches the edge of the frame between {} and {} {unit}; this jump is not applied, because the contact would be cut off at the edge",
            self.step().name,
            wear_step.jumps_done + 1,
            wear_step.completed,
            wear_step.completed + jump.length
        ));
        // The committed state in the checkpoint already contains a part of the uncharged work, which is subtracted.
        let kept = match &self.progress {
            StepProgress::WearStep(committed) => committed.uncharged_work,
            _ => SolveWork::default(),
        };
        let mut work = jump.work();
        work += wear_step.uncharged_work;
        RunEnd::FrameEdge(work - kept)
    }

    /// Adds a jump to the state and delivers its record. A jump whose solver did not converge is recorded without its
    /// wear, and ends the run.
    pub(super) fn commit_jump(
        &mut self,
        wear_step: &mut WearStepState,
        mut accepted: AcceptedJump,
    ) -> Advance {
        if accepted.jump.converged() {
            self.add_to_state(wear_step, &accepted.jump);
            wear_step.accept(&accepted.jump);
            if let Some(resolved) = accepted.resolved.take() {
                wear_step.take_correction(resolved);
            }
        }
        let AcceptedJump { jump, clock, .. } = &accepted;
        let number = wear_step.jumps_done + if jump.converged() { 0 } else { 1 };
        let half = match &wear_step.slip_source {
            SlipSource::ClosedPath(path) => path.reversal_index(),
            SlipSource::Sliding(_) => 0,
        };
        let it = &jump.cycle.contact;
        let worn = self.state.wear_depth.clone();
        let problem = self.reporting_problem(wear_step, &jump.cycle, &worn);
        let mut reversals = [0, half].map(|point| state::resultants(&self.prepared, &problem, it, point));
        let resolved = wear_step.path_correction.as_ref().and_then(|resolved| resolved.reversal_correction);
        if let Some(corrections) = resolved {
            reversals.iter_mut().zip(&corrections).for_each(|(values, correction)| correction.apply(values));
        }
        let approach = 0.5 * [0, half].map(|point| self.prepared.approach(it, point)).iter().sum::<f64>();
        let balance = state::energy_balance(&self.prepared, &self.state, it, half);
        let is_current =
            |resolved: &PathCorrection| resolved.at_cycle == wear_step.completed && jump.converged();
        let resolved = wear_step.path_correction.as_ref().filter(|resolved| is_current(resolved));
        // A jump may be repeated after its end was resolved. The fields get the wear depth of the repeated jump.
        let at_depth = |fields: &FrameState| FrameState { wear_depth: worn.clone(), ..fields.clone() };
        let resolved = resolved.and_then(|resolved| resolved.fields.as_ref()).map(at_depth);
        let mut fields = resolved.unwrap_or_else(|| state::frame_state(&problem, it, 0, &worn));
        // The fields belong to the + reversal point, where the phase is 1.
        fields.load_amplitudes = self.amplitudes_at_phase(1.0);
        drop(problem);
        self.state.set_from(it, half);
        let certificate = state::certificate(&jump.checks, approach, balance);
        let values = mean_of_reversal_points(&reversals);
        let solved =
            SolvedState { number, approach, values: &values, contact: it, certificate, clock: *clock };
        let mut record = self.new_record(solved);
        record.stroke_ends = matches!(wear_step.slip_source, SlipSource::ClosedPath(_)).then_some(reversals);
        record.jump = Some(accepted.record(wear_step, &self.prepared.model.frame.areas));
        if let Some(resolved) = &mut wear_step.path_correction {
            resolved.is_new = false;
        }
        let converged = self.complete_record(&mut record, &jump.report, &jump.checks, self.options.tolerance);
        self.warn_of_spin_moment(converged);
        if converged.is_ok() {
            self.warn_of_drift(wear_step, &jump.cycle);
        }
        self.deliver(record, fields)?;
        converged.map_err(Into::into)
    }

    fn add_to_state(&mut self, wear_step: &mut WearStepState, jump: &WearJump) {
        let (step, cycles) = (self.step(), self.cycles());
        wear_step.completed += jump.length;
        wear_step.jumps_done += 1;
        if cycles.count - wear_step.completed < 1e-9 * cycles.count {
            wear_step.completed = cycles.count;
        }
        match wear_step.slip_source {
            SlipSource::ClosedPath(_) => self.state.cycles_done = wear_step.cycles_at(wear_step.completed),
            SlipSource::Sliding(_) => {
                self.state.distance_slid = wear_step.totals_before.1 + wear_step.completed
            }
        }
        self.state.wear_depth.iter_mut().zip(&jump.wear_depth).for_each(|(worn, by)| *worn += by);
        self.state.dissipation += jump.dissipation;
        if self.wears() {
            self.state.add_wear_dissipation(jump.dissipation, step.friction);
        }
        let errors = self.state.depth_errors.iter_mut().zip(&jump.error_field);
        errors.for_each(|(sum, error)| *sum += error.abs());
        self.state.depth_errors.iter_mut().zip(&jump.path_error).for_each(|(sum, error)| *sum += error.abs());
        let areas = &self.prepared.model.frame.areas;
        self.state.volume_errors.jumps += jump.volume_error + volume(&jump.path_error, areas).abs();
        if let Some(resolved) = &wear_step.path_correction {
            self.add_path_error(resolved, &jump.wear_depth);
        }
    }

    /// Warns once per step if the drift of body 2 over all cycles of the step is notable relative to the amplitude.
    fn warn_of_drift(&mut self, wear_step: &WearStepState, cycle: &CycleState) {
        let (zone, at) = (&cycle.stick_zone, cycle.contact.rigid_motion[0]);
        let Some(origin) = zone.origin.filter(|_| zone.may_drift()) else { return };
        let resolved = wear_step.path_correction.as_ref().filter(|resolved| resolved.corrects);
        let drift = resolved.map_or([at[0] - origin[0], at[1] - origin[1]], |resolved| resolved.body_drift);
        if self.cycles().count * drift[0].hypot(drift[1]) > MIN_DRIFT_SHARE * cycle.amplitude(&self.prepared)
            && self.is_first_in_step(StepWarning::Drift)
        {
            self.result.warnings.push(warning(&format!(
                "step \"{}\": no cell sticks through a cycle, and each cycle moves body 2 by ({}, {}) (ratcheting). The wear assumes that the contact stays where it is",
                self.step().name,
                format_short(drift[0]),
                format_short(drift[1])
            )));
        }
    }

    /// Warns if cycles under a spin moment from an earlier step do not converge. With full slip the friction moment reverses in
    /// every stroke, so it cannot balance a constant moment.
    pub(super) fn warn_of_spin_moment(&mut self, converged: std::result::Result<(), RunEnd>) {
        let Spin::Moment(moment) = self.controls.spin else { return };
        if moment != 0.0 && converged == Err(RunEnd::Diverged(Divergence::Iterations)) {
            self.result.warnings.push(format!(
                "step \"{}\": a spin moment of {moment} acts during the cycles. If the whole contact slides, the friction moment reverses in every stroke and cannot balance a constant moment. Prescribe `twist`, or a spin_moment of zero, in an earlier step, or use a smaller amplitude",
                self.step().name
            ));
        }
    }
}
