//! Wear steps: fretting cycles and steady sliding, computed in jumps (docs/theory-wear.md).

use std::time::Instant;

use nalgebra::Vector3;

use crate::contact::{NormalControl, TangentialControl, Unknowns};
use crate::error::warning;
use crate::evolution::checkpoint::StepProgress;
use crate::evolution::controls::{ActiveControls, PrescribedLoads};
use crate::evolution::fretting::cycle_refinement::{max_increments, percent};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::settings::{SETTLING, WEAR_STEP};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::observer::CheckpointEvent;
use crate::evolution::records::WearErrors;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::{ClosedPath, Correction, Drive, JumpPolicy, ResolvedCycleSettings, StepKind};
use crate::evolution::step_controller::StepController;
use crate::geometry::format_short;
use crate::omitted::OmittedWork;

impl Run<'_> {
    pub(in crate::evolution) fn run_wear_step(&mut self) -> Advance {
        loop {
            // The time of a jump includes the resolved cycle at the start of the step.
            let clock = Instant::now();
            // A jump changes this copy. If the run ends in the jump, it resumes from `self.progress`, the state
            // before the jump.
            let mut wear_step = match &self.progress {
                StepProgress::WearStep(committed) => committed.clone(),
                _ => Box::new(self.begin_wear_step(clock)?),
            };
            if wear_step.completed >= self.cycles().count {
                return self.finish_wear_step(&wear_step);
            }
            if wear_step.jumps_done > 0 && self.observer.wants_rebuild(&self.state.wear_depth) {
                return Err(RunEnd::Rebuild.into());
            }
            if wear_step.rates_outdated {
                self.reevaluate_rates(&mut wear_step)?;
            }
            self.take_jump(&mut wear_step, clock)?;
            self.progress = StepProgress::WearStep(wear_step);
            self.record_rollback_point(CheckpointEvent::Entry)?;
        }
    }

    /// Records the last fretting loop if the observer requests it. If steps follow, restores the displacement or force
    /// at the centre of the cycles.
    fn finish_wear_step(&mut self, wear_step: &WearStepState) -> Advance {
        if self.observer.wants_loops() {
            self.record_fretting_loop(wear_step)?;
        }
        self.warn_of_wear_error(wear_step);
        self.record_omitted_correction(wear_step);
        self.controls.normal = wear_step.load_path.end.normal;
        let steps_follow = self.step_index + 1 < self.steps.len();
        if let (SlipSource::ClosedPath(path), true) = (&wear_step.slip_source, steps_follow) {
            self.return_to_center(path)?;
        }
        Ok(())
    }

    fn warn_of_wear_error(&mut self, wear_step: &WearStepState) {
        let Some(path) = self.step().kind.closed_path() else { return };
        let Some(used) = path.resolved_cycles else { return };
        let Some(record) = self.result.records.last().filter(|record| record.worn_volume > 0.0) else {
            return;
        };
        let error = record.worn_volume_error / record.worn_volume;
        // If the whole contact sticks, the computed wear is only a rounding error.
        if error <= used.error_warning || record.stick_area >= record.contact_area {
            return;
        }
        let errors = record.worn_volume_error_by_source;
        let percent = |error: f64| format_short(100.0 * error / record.worn_volume);
        self.result.warnings.push(warning(&format!(
            "step \"{}\": the estimated error of the wear volume is {} %, more than wear.tolerance = {:e}: {} % by jumps, {} % by the increments per stroke, {} % by tractions that still change from cycle to cycle. {}",
            self.step().name,
            percent(record.worn_volume_error),
            used.error_warning,
            percent(errors.jumps),
            percent(errors.increments),
            percent(errors.settling),
            self.wear_error_remedy(errors, path, used, wear_step)
        )));
    }

    /// Advice against the largest of the `errors` of the wear volume, for cycles along `path`.
    fn wear_error_remedy(
        &self,
        errors: WearErrors,
        path: &ClosedPath,
        used: ResolvedCycleSettings,
        wear_step: &WearStepState,
    ) -> String {
        let jumps = self.result.records.iter().filter_map(|record| record.jump);
        let longer = jumps.filter(|jump| jump.length > 1.0).map(|jump| jump.volume_error).sum::<f64>();
        if errors.jumps >= errors.increments.max(errors.settling) {
            if longer < 0.5 * errors.jumps {
                "A jump cannot be shorter than one cycle: check the specific wear rates, or use a smaller amplitude"
            } else {
                "Shorter jumps reduce the error (a smaller wear.tolerance, or more cycles.jumps)"
            }
            .to_owned()
        } else if errors.settling > errors.increments && used.correction != Correction::Never {
            format!(
                "Tractions become steady only over more cycles than a resolved cycle is repeated ({}): accept the error, or compute single strokes (history)",
                SETTLING.max_cycles
            )
        } else if used.correction == Correction::Never {
            "To correct the wear for the path between the reversal points, omit cycles.increments or use \"auto\"".to_owned()
        } else if used.increments.is_some() {
            "Increase cycles.increments, or omit it".to_owned()
        } else {
            let resolved = wear_step.path_correction.as_ref().map_or(0, |resolved| resolved.increments);
            if resolved >= max_increments(path) {
                format!(
                    "Cycles are not resolved into more than {resolved} increments per stroke: use smaller cells where the stick zone moves, or accept the error"
                )
            } else {
                "A smaller wear.tolerance resolves cycles into more increments per stroke; smaller cells help where the stick zone moves".to_owned()
            }
        }
    }

    /// Lists the correction by resolved cycles as omitted work if the last resolved cycle did not correct the wear.
    fn record_omitted_correction(&mut self, wear_step: &WearStepState) {
        let omits = |settings: &ResolvedCycleSettings| settings.correction == Correction::WhereNeeded;
        let Some(resolved) = wear_step.path_correction.as_ref().filter(|resolved| {
            !resolved.corrects && self.resolved_path().is_some_and(|(_, used)| omits(&used))
        }) else {
            return;
        };
        self.result.skipped.push(OmittedWork::new(
            None,
            format!("correction of the wear by resolved cycles in step \"{}\"", self.step().name),
            format!(
                "the whole contact slides, and the wear volumes with single, 4-fold and 16-fold increments agree within wear.tolerance; estimated effect on the wear volume: {}",
                percent(resolved.remaining_volume_error)
            ),
        ));
    }

    fn begin_wear_step(&mut self, clock: Instant) -> Advance<WearStepState> {
        self.warn_of_small_jump_tolerance();
        self.apply_loads_before_contact();
        let mut wear_step = self.new_wear_step();
        if let SlipSource::ClosedPath(path) = &wear_step.slip_source {
            let (loads, _) = self.loads_at(&wear_step, 0.0);
            let mut cycle = CycleState::from(&wear_step.cycle);
            wear_step.uncharged_work = self.find_periodic_cycle(path, loads, &mut cycle)?;
            wear_step.cycle = cycle.into();
        }
        self.evaluate_rates(&mut wear_step, clock)?;
        self.resolve_first_cycle(&mut wear_step)?;
        wear_step.touched_edge_initially =
            state::touches_edge(&self.prepared, &wear_step.cycle.contact.scaled);
        wear_step.initial_peak_pressure = wear_step.cycle.peak_pressure();
        self.refuse_unstable(&wear_step)?;
        wear_step.step_controller = self.step_controller(&wear_step);
        if self.observer.wants_loops() {
            self.record_fretting_loop(&wear_step)?;
        }
        Ok(wear_step)
    }

    /// Applies the amplitudes of the body loads in this step before the step begins. Only in a first step can these
    /// amplitudes differ from the present ones. A first step begins without contact, so the motion of the surfaces by
    /// the loads is not slip.
    fn apply_loads_before_contact(&mut self) {
        let amplitudes = self.amplitudes_after_step();
        if amplitudes != self.state.load_amplitudes {
            let n = self.prepared.n();
            let before = self.prepared.loaded_gap[..2 * n].to_vec();
            self.set_loads(amplitudes);
            let moved = self.prepared.loaded_gap.iter().zip(before).map(|(now, before)| now - before);
            self.state.slip_reference.iter_mut().zip(moved).for_each(|(reference, by)| *reference += by);
        }
    }

    fn warn_of_small_jump_tolerance(&mut self) {
        if let JumpPolicy::Tolerance(tolerance) = self.cycles().jumps
            && tolerance < WEAR_STEP.min_tolerance_ratio * self.options.tolerance
        {
            self.result.warnings.push(format!(
                "step \"{}\": wear.tolerance = {tolerance:e} is too small for the accuracy of the contact solution (solver.tolerance = {:e}): jumps become shorter, but not more accurate. Increase wear.tolerance, or decrease solver.tolerance",
                self.step().name, self.options.tolerance
            ));
        }
    }

    fn new_wear_step(&self) -> WearStepState {
        let (cycles, n, center) = (self.cycles(), self.prepared.n(), self.state.rigid_motion);
        let load_path = self.load_path();
        let (cycle, slip_source) = match &self.step().kind {
            StepKind::Fretting { path: closed, .. } => {
                let [x, y, _] = load_path.start_force();
                let path = FrettingPath::new(closed, [center[0], center[1]], [x, y]);
                let can_drift = path.drive == Drive::Force && self.prepared.model.frame.has_uniform_axes();
                let cycle = CycleState::new(n, &path, center, can_drift, self.motion_by_cyclic_loads());
                (cycle, SlipSource::ClosedPath(path))
            }
            StepKind::Sliding { angle, .. } => {
                let mut cycle = CycleState::for_sliding(n, center);
                cycle.contact.mode_amplitudes.fill(self.state.mode_amplitudes);
                (cycle, SlipSource::Sliding(self.slip_per_length(*angle)))
            }
            StepKind::Monotone | StepKind::Rolling(_) => unreachable!("a wear step has cycles"),
        };
        WearStepState {
            cycle: cycle.into(),
            uncharged_work: SolveWork::default(),
            slip_source,
            completed: 0.0,
            wear_rate: vec![0.0; n],
            dissipation_rate: 0.0,
            path_correction: None,
            load_path,
            step_controller: StepController::new(cycles.count, cycles.integrator.order()),
            jumps_done: 0,
            critical_length: None,
            initial_peak_pressure: 0.0,
            touched_edge_initially: false,
            totals_before: (self.state.cycles_done, self.state.distance_slid),
            rates_outdated: false,
        }
    }

    /// Largest tangential change of the gap at a reversal point by the loads that vary in phase with the strokes, mm.
    fn motion_by_cyclic_loads(&self) -> f64 {
        let (n, gap) = (self.prepared.n(), self.prepared.cyclic_gap.as_deref().unwrap_or_default());
        let motions = gap.iter().take(n).zip(gap.iter().skip(n)).map(|(x, y)| x.hypot(*y));
        motions.fold(0.0, f64::max)
    }

    /// Step controller with a first jump whose wear depth is a share of the approach.
    fn step_controller(&self, wear_step: &WearStepState) -> StepController {
        let cycles = self.cycles();
        let fastest = wear_step.wear_rate.iter().copied().fold(0.0, f64::max);
        let Unknowns { rigid_motion, mode_amplitudes, .. } = &wear_step.cycle.contact;
        let approach = self.prepared.approach_of(&rigid_motion[0], &mode_amplitudes[0]).abs();
        // At zero approach, no reference depth exists, so the first trial jump covers all cycles.
        let first = if fastest > 0.0 && approach > 0.0 {
            (WEAR_STEP.first_jump_depth_share * approach / fastest).min(cycles.count)
        } else {
            cycles.count
        };
        StepController::new(first, cycles.integrator.order())
    }

    /// Slip of each cell per mm of sliding of body 2 along the direction `angle`, `[2, N]`.
    fn slip_per_length(&self, angle: f64) -> Vec<f64> {
        let n = self.prepared.n();
        let along = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let mut slip = vec![0.0; 2 * n];
        for i in 0..n {
            let local = self.prepared.rigid_axes.as_ref().map_or(along, |axes| axes[i] * along);
            (slip[i], slip[n + i]) = (local.x, local.y);
        }
        slip
    }

    /// Loads at the fraction `at` of a step, without the cyclic motion or force. Also the normal position of body 2
    /// (mm) if the approach is prescribed.
    pub(in crate::evolution) fn loads_at(
        &self,
        wear_step: &WearStepState,
        at: f64,
    ) -> (PrescribedLoads, Option<f64>) {
        let turn = self.prepared.rotation(&self.state.mode_amplitudes);
        let controls = wear_step.load_path.at(at, self.state.rigid_motion, turn);
        let mut loads = self.effective_loads(controls.loads);
        loads.tangential = TangentialControl::Shift;
        if matches!(wear_step.slip_source, SlipSource::Sliding(_)) {
            loads.moment[2] = None;
        }
        (loads, (loads.normal == NormalControl::Approach).then_some(controls.rigid[2]))
    }

    fn return_to_center(&mut self, path: &FrettingPath) -> Advance {
        let rigid = [path.center[0], path.center[1], self.state.rigid_motion[2]];
        let loads = self.effective_loads(self.controls.loads_at_shift());
        let (loads, tangential) = path.return_to_center(loads);
        self.controls = ActiveControls { tangential, ..self.controls };
        self.advance_cycle_increment(loads, rigid)?;
        Ok(())
    }
}
