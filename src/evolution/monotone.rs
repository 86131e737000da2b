//! Monotone and rolling steps: load increments from the state before the step to the prescribed loads.

use std::time::Instant;

use crate::body::BodyLoad;
use crate::contact::{ContactState, SlipReference, TangentialControl};
use crate::error::{Error, Result, warning};
use crate::evolution::checkpoint::{MonotoneProgress, StepProgress};
use crate::evolution::controls::{IncrementControls, LoadPath, LoadPathStart, PrescribedLoads};
use crate::evolution::increment_record::SolvedState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::observer::CheckpointEvent;
use crate::evolution::predictor::Predictor;
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::state;
use crate::evolution::step::{HistoryRow, Spin, Tangential};
use crate::omitted::OmittableWork;

/// Smallest number of increments with which loads of the bodies may change while the contact grows. Fewer increments
/// cause a warning.
const MANY_INCREMENTS: usize = 40;

impl Run<'_> {
    pub(super) fn load_path(&self) -> LoadPath {
        let (force, moment) = self.prepared.resultants(&self.state.tractions);
        let turn = self.prepared.rotation(&self.state.mode_amplitudes);
        let start = LoadPathStart { rigid: self.state.rigid_motion, turn, force, moment };
        LoadPath::new(self.step(), self.controls, start, &self.prepared)
    }

    pub(super) fn run_increments(&mut self) -> Advance {
        let step = self.step();
        let mut ramp = match &self.progress {
            StepProgress::Monotone(ramp) => ramp.clone(),
            _ => Box::new(MonotoneProgress {
                load_path: self.load_path(),
                load_amplitudes: [self.state.load_amplitudes.clone(), self.amplitudes_after_step()],
                increments_done: 0,
                predictor: Predictor::default(),
            }),
        };
        self.controls = ramp.load_path.end;
        self.warn_of_loads_before_contact(&ramp);
        while ramp.increments_done < step.increments {
            // The solver polls for cancellation only between iterations, and an increment may need no iteration.
            if self.observer.cancelled() {
                return Err(RunEnd::Interrupted.into());
            }
            let number = ramp.increments_done + 1;
            let (rigid, floating) = ramp.predictor.motions(&self.state);
            let turn = self.prepared.rotation(&floating);
            let fraction = number as f64 / step.increments as f64;
            self.set_loads(ramp.amplitudes_at(fraction));
            let controls = ramp.load_path.at(fraction, rigid, turn);
            self.run_increment(number, &controls, &mut ramp.predictor)?;
            ramp.increments_done = number;
            self.progress = StepProgress::Monotone(ramp.clone());
            self.record_rollback_point(CheckpointEvent::Entry)?;
        }
        Ok(())
    }

    /// Warns if loads of the bodies change in a step with friction that begins without contact.
    ///
    /// Cells that close during an increment then slip by the whole motion of the increment. Parallel surfaces close in
    /// all cells at once, so they cause no warning. With 40 increments the error of the dissipation is about 0.1 % of
    /// usual values (docs/task-loads.md).
    fn warn_of_loads_before_contact(&mut self, ramp: &MonotoneProgress) {
        let [from, to] = &ramp.load_amplitudes;
        let grow = ramp.increments_done == 0 && from != to && self.step().increments < MANY_INCREMENTS;
        let opened = || self.state.tractions.iter().all(|traction| *traction == 0.0);
        if grow && self.has_friction() && opened() && !self.prepared.starts_level() {
            self.result.warnings.push(warning(&format!(
                "step \"{}\": loads of the bodies change while the contact grows from nothing (increments: {}). With few increments, cells slip that stick on the true path, and the dissipation is too large. Press first (`loads = {{ NAME = 0.0 }}`), then load; or use {MANY_INCREMENTS} increments",
                self.step().name,
                self.step().increments
            )));
        }
    }

    pub(super) fn amplitudes_after_step(&self) -> Vec<f64> {
        let after = |(load, before): (&BodyLoad, &f64)| {
            self.step().load_amplitude(load.case.name.as_deref(), *before, self.step_index == 0)
        };
        self.prepared.model.loads.iter().zip(&self.state.load_amplitudes).map(after).collect()
    }

    pub(super) fn set_loads(&mut self, amplitudes: Vec<f64>) {
        self.prepared.apply_loads(&amplitudes);
        self.state.load_amplitudes = amplitudes;
    }

    fn run_increment(
        &mut self,
        number: usize,
        controls: &IncrementControls,
        predictor: &mut Predictor,
    ) -> Advance {
        let step = self.step();
        let clock = Instant::now();
        self.check_controls()?;
        let loads = self.effective_loads(controls.loads);
        let reference = match step.kind.rolling() {
            None => self.previous_increment(),
            Some(rolling) => SlipReference::Upstream(self.upstream(rolling, number)?),
        };
        let end = self.path_point(&loads, reference)?;
        let worn = self.state.wear_depth.clone();
        let implicit_passes = if step.kind.rolling().is_some() { 0.0 } else { 1.0 };
        let laws = ActiveLaws { implicit_passes, ..ActiveLaws::of(step) };
        let mut problem = increment_problem(&self.prepared, &self.options, &worn, laws, vec![end]);
        let mut it = ContactState::new(self.prepared.n(), vec![controls.rigid]);
        let (_, floating) = predictor.motions(&self.state);
        it.mode_amplitudes = vec![self.prepared.with_rotation(floating, controls.turn)];
        if self.options.skip.allows(OmittableWork::ColdStarts) {
            predictor.extrapolate_tractions(&self.state, &problem, &mut it);
            if step.kind.rolling().is_none() {
                predictor.note(&self.state);
            }
        }
        let HistoryRow { index, count } = step.history_row.unwrap_or(HistoryRow { index: 0, count: 1 });
        let (number, count) = (index * step.increments + number, (count * step.increments) as f64);
        let stage =
            ProgressSpan { name: &step.name, from: (number - 1) as f64 / count, to: number as f64 / count };
        let (report, checks) =
            solve_and_check(&self.prepared, &mut problem, &mut it, &self.options, self.observer, &stage)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        let depth = self.worn_per_pass(&it);
        self.state.wear_depth.iter_mut().zip(&depth).for_each(|(w, rate)| *w += implicit_passes * rate);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let mut fields = state::frame_state(&problem, &it, 0, &self.state.wear_depth);
        self.state.set_from(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let certificate = state::certificate(&checks, approach, balance);
        let solved = SolvedState { number, approach, values: &values, contact: &it, certificate, clock };
        let mut record = self.new_record(solved);
        if let Some(rolling) = step.kind.rolling() {
            self.per_distance(rolling, &mut fields.slip);
            record.rolling = Some(self.add_rolling_wear(rolling, number, &it)?);
        } else {
            self.state.dissipation += checks.dissipation;
            if self.wears() {
                self.state.add_wear_dissipation(checks.dissipation, step.friction);
            }
        }
        let converged = self.complete_record(&mut record, &report, &checks, self.options.tolerance);
        self.deliver(record, fields)?;
        Ok(converged?)
    }

    /// Returns the reference for slip that starts at the present state of the run.
    pub(super) fn previous_increment(&self) -> SlipReference {
        SlipReference::Previous {
            gap: self.state.slip_reference.clone(),
            pressures: self.state.tractions[2 * self.prepared.n()..].to_vec(),
        }
    }

    /// Refuses a nonzero tangential force in steps without friction and in rolling steps. If all cells have the same
    /// axes, also refuses a nonzero spin moment in these steps.
    fn check_controls(&self) -> Result<()> {
        let step = self.step();
        let rolls = step.kind.rolling().is_some();
        if self.has_friction() && !rolls {
            return Ok(());
        }
        // A prescribed force of zero is allowed, because the tangential force is zero without friction.
        let pulled = matches!(self.controls.tangential, Tangential::Force(force) if force != [0.0; 2]);
        // On cells with different axes, pressures can carry a spin moment.
        let level = self.prepared.model.frame.has_uniform_axes();
        let spun = level && matches!(self.controls.spin, Spin::Moment(moment) if moment != 0.0);
        let (what, instead) = match (pulled, spun) {
            (true, _) => ("a tangential force", "shift"),
            (_, true) => ("a spin moment", "twist"),
            _ => return Ok(()),
        };
        if rolls {
            return Err(Error::input(format!(
                "step \"{}\" rolls, but {what} is still prescribed; in rolling the tangential forces follow from the creepages: prescribe {instead} in an earlier step",
                step.name
            )));
        }
        Err(Error::input(format!(
            "step \"{}\" prescribes {what}, but this step has no friction to transmit it: add a [friction] law, or prescribe {instead}",
            step.name
        )))
    }

    pub(super) fn has_friction(&self) -> bool {
        self.step().friction && self.prepared.ellipse.is_some()
    }

    /// Whether cell `i` wears in a pass through the path points. Sticking cells do not wear, because their computed
    /// slip is an error of the solver.
    pub(super) fn cell_wears(&self, it: &ContactState, i: usize) -> bool {
        !self.has_friction() || it.slips(i)
    }

    /// Wear depth of one pass through the path points, `[N]`, mm; exactly 0 in cells that stick.
    pub(super) fn worn_per_pass(&self, it: &ContactState) -> Vec<f64> {
        let depth = |(i, depth): (usize, &f64)| if self.cell_wears(it, i) { *depth } else { 0.0 };
        it.wear_per_pass.iter().enumerate().map(depth).collect()
    }

    pub(super) fn wears(&self) -> bool {
        self.prepared.specific_wear_rate(self.step().wear, self.step().friction).is_some()
    }

    /// Prescribes motions instead of a tangential force and a spin moment if friction does not act or the step rolls.
    /// On a frame with inclined cells, pressures carry a spin moment without friction, so this moment stays prescribed.
    pub(super) fn effective_loads(&self, mut loads: PrescribedLoads) -> PrescribedLoads {
        if !self.has_friction() {
            loads.tangential = TangentialControl::Shift;
            if self.prepared.model.frame.has_uniform_axes() {
                loads.moment[2] = None;
            }
        }
        if self.step().kind.rolling().is_some() {
            // The creepages and the spin of rolling prescribe the tangential motion of body 2.
            (loads.tangential, loads.moment[2]) = (TangentialControl::Shift, None);
        }
        loads
    }
}
