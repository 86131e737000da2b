//! Monotone steps: load increments from the state before the step to the prescribed loads.

use std::time::Instant;

use crate::contact::certificate::{self, OperatorCheck, StateChecks, TangentialGap};
use crate::contact::solver::{self, SolveReport, SolverOptions, StopReason};
use crate::contact::{ContactState, Increment, PathPoint, Pressures, SlipReference, TangentialControl};
use crate::error::{Error, Result, warning};
use crate::evolution::checkpoint::{MonotoneProgress, StepProgress};
use crate::evolution::controls::{IncrementControls, LoadPath, LoadPathStart, PrescribedLoads};
use crate::evolution::given_warnings::StepWarning;
use crate::evolution::large_sliding::large_sliding_warning;
use crate::evolution::model::PreparedModel;
use crate::evolution::observer::{CheckpointEvent, Observer};
use crate::evolution::predictor::Predictor;
use crate::evolution::records::{Certificate, Divergence, IncrementRecord, Resultants};
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::state;
use crate::evolution::step::{HistoryRow, Spin, Step, Tangential};
use crate::omitted::OmittableWork;

/// Laws that act in an increment, and the ratio of the gap opened by wear to the wear depth (`slip_repeats`).
#[derive(Debug, Clone, Copy)]
pub(super) struct ActiveLaws<'f> {
    pub friction: bool,
    pub wear: bool,
    pub slip_repeats: f64,
    /// Factors on the wear path of each cell, `[N]`; `None` stands for 1.
    pub wear_path_factors: Option<&'f [f64]>,
}

impl ActiveLaws<'_> {
    /// Laws of a step for an increment whose wear does not change the gap.
    pub fn of(step: &Step) -> Self {
        Self { friction: step.friction, wear: step.wear, slip_repeats: 0.0, wear_path_factors: None }
    }
}

/// Equations of an increment that starts with the wear depth `wear_depth`.
pub(super) fn increment_problem<'b>(
    prepared: &'b PreparedModel,
    options: &SolverOptions,
    wear_depth: &'b [f64],
    laws: ActiveLaws<'b>,
    path_points: Vec<PathPoint>,
) -> Increment<'b> {
    let model = prepared.model;
    Increment {
        flexibility: model.flexibility.as_ref(),
        areas: &model.frame.areas,
        initial_gap: &prepared.initial_gap,
        rigid_axes: prepared.rigid_axes.as_deref(),
        mode_gaps: &prepared.mode_gaps,
        friction: if laws.friction { prepared.ellipse } else { None },
        wear: if laws.wear { prepared.specific_wear_rate } else { None },
        wear_path_factors: laws.wear_path_factors,
        scales: prepared.scales(),
        wear_depth,
        slip_repeats: laws.slip_repeats,
        pressures: Pressures::Unknown,
        skip: options.skip,
        path_points,
    }
}

/// Part of a stage of the run that one solve covers, for the observer: name of the stage, fractions done before and after.
pub(super) struct ProgressSpan<'s> {
    pub name: &'s str,
    pub from: f64,
    pub to: f64,
}

/// Solves an increment and reports the progress of the residual to the observer, on a logarithmic scale.
///
/// # Errors
/// If a number becomes non-finite, or pressures are so small that their squares underflow.
fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    observer: &mut dyn Observer,
    stage: &ProgressSpan,
) -> Result<SolveReport> {
    let mut first = None;
    let report = solver::solve(problem, it, options, &mut |_, residual| {
        let start: f64 = *first.get_or_insert(residual.max(options.tolerance * 10.0));
        let done = (start / residual).ln() / (start / options.tolerance).ln();
        let done = if done.is_finite() { done.clamp(0.0, 1.0) } else { 0.0 };
        observer.progress(stage.name, stage.from + (stage.to - stage.from) * done, Some(residual));
        observer.cancelled()
    });
    if report.stop == StopReason::NotFinite {
        return Err(Error::numerical(format!(
            "step \"{}\": a traction or a gap is not a finite number",
            stage.name
        )));
    }
    reject_underflowing_pressure(problem, it, stage.name)?;
    Ok(report)
}

/// Grids with fewer cells across may be too coarse to show the gap between the contact and the edge of the frame.
const MIN_CELLS_ACROSS: usize = 12;

/// Smallest allowed peak pressure. Below it the squares of smaller pressures underflow, and the friction law fails.
const MIN_PEAK_PRESSURE_MPA: f64 = 1e-140;

/// Refuses nonzero pressures so small that their squares underflow.
///
/// # Errors
/// If the largest pressure is positive and below [`MIN_PEAK_PRESSURE_MPA`].
fn reject_underflowing_pressure(problem: &Increment, it: &ContactState, step: &str) -> Result<()> {
    let n = problem.n();
    let pressures = it.tractions.chunks_exact(3 * n).flat_map(|planes| &planes[2 * n..]);
    let largest = pressures.fold(0.0_f64, |largest, p| largest.max(*p));
    if largest > 0.0 && largest < MIN_PEAK_PRESSURE_MPA {
        return Err(Error::input(format!(
            "step \"{step}\": the largest pressure is {largest:e}, and its square underflows to 0 (smallest allowed pressure: {MIN_PEAK_PRESSURE_MPA:e}): choose units in which the numbers of the scene have usual magnitudes, or increase the load"
        )));
    }
    Ok(())
}

/// Solves and checks the increment `problem`. If the bodies overlap in cells whose flexibility is not formed, it forms the
/// flexibility of these cells and continues.
///
/// # Errors
/// As [`solve`], and if a body cannot be solved or memory does not suffice.
pub(super) fn solve_and_check(
    (prepared, problem): (&PreparedModel, &mut Increment),
    it: &mut ContactState,
    options: &SolverOptions,
    observer: &mut dyn Observer,
    stage: &ProgressSpan,
) -> Result<(SolveReport, StateChecks)> {
    let mut spent = [0; 2];
    let mut cells = problem.closed_by_motion(it);
    loop {
        if !cells.is_empty() {
            problem.scales = prepared.form_flexibility(&cells)?;
        }
        let max_iterations = options.max_iterations.saturating_sub(spent[0]);
        let options = SolverOptions { max_iterations, ..*options };
        let mut report = solve(problem, it, &options, observer, stage)?;
        spent = [spent[0] + report.iterations, spent[1] + report.applications];
        [report.iterations, report.applications] = spent;
        let looked_at = prepared.ellipse.is_some() || observer.wants_tangential_gap();
        let looked_at = looked_at || !options.skip.allows(OmittableWork::TangentialGap);
        let gap = if looked_at { TangentialGap::Complete } else { TangentialGap::Skip };
        // The operator is the same in all increments of a step: only the last increment checks it.
        let sums = if stage.to == 1.0 { OperatorCheck::SampleCells } else { OperatorCheck::Skip };
        let checks = certificate::check(problem, it, gap, sums);
        let overlapping = problem.complete_unformed_cells(it)?;
        if overlapping.is_empty() || report.stop == StopReason::Interrupted {
            return Ok((report, checks));
        }
        // Also form the cells whose initial gap is at most the largest initial gap of the overlapping cells.
        let normal = &problem.initial_gap[2 * problem.n()..];
        let reach = overlapping.iter().map(|&cell| normal[cell]).fold(0.0, f64::max);
        cells = problem.flexibility.unformed_cells();
        cells.retain(|&cell| normal[cell] <= reach);
    }
}

/// Area-weighted root mean square of a field over the cells for which `counts` is true; 0 if there are none.
pub(super) fn root_mean_square(field: &[f64], areas: &[f64], counts: impl Fn(usize) -> bool) -> f64 {
    let (mut squares, mut sum) = (0.0, 0.0);
    for (_, (value, area)) in field.iter().zip(areas).enumerate().filter(|(i, _)| counts(*i)) {
        squares += area * value * value;
        sum += area;
    }
    if sum > 0.0 { (squares / sum).sqrt() } else { 0.0 }
}

impl Run<'_> {
    /// Load path of the current step from the present state.
    pub(super) fn load_path(&self) -> LoadPath {
        let (force, moment) = self.prepared.resultants(&self.state.tractions);
        let turn = self.prepared.rotation(&self.state.mode_amplitudes);
        let start = LoadPathStart { rigid: self.state.rigid_motion, turn, force, moment };
        LoadPath::new(self.step(), self.controls, start, &self.prepared)
    }

    /// Runs the remaining increments of a monotone step.
    pub(super) fn run_monotone_step(&mut self) -> Advance {
        let step = self.step();
        let mut ramp = match &self.progress {
            StepProgress::Monotone(ramp) => ramp.clone(),
            _ => Box::new(MonotoneProgress {
                load_path: self.load_path(),
                increments_done: 0,
                predictor: Predictor::default(),
            }),
        };
        self.controls = ramp.load_path.end;
        while ramp.increments_done < step.increments {
            // The solver polls for cancellation between iterations only, and an increment may need none.
            if self.observer.cancelled() {
                return Err(RunEnd::Interrupted.into());
            }
            let number = ramp.increments_done + 1;
            let (rigid, floating) = ramp.predictor.motions(&self.state);
            let now = (rigid, self.prepared.rotation(&floating));
            let controls = ramp.load_path.at(number as f64 / step.increments as f64, now);
            self.run_increment(number, (&controls, &mut ramp.predictor))?;
            ramp.increments_done = number;
            self.progress = StepProgress::Monotone(ramp.clone());
            self.record_rollback_point(CheckpointEvent::Entry)?;
        }
        if step.rolling.is_some() {
            self.controls.tangential =
                Tangential::Shift([self.state.rigid_motion[0], self.state.rigid_motion[1]]);
        }
        Ok(())
    }

    fn run_increment(
        &mut self,
        number: usize,
        (controls, predictor): (&IncrementControls, &mut Predictor),
    ) -> Advance {
        let step = self.step();
        let clock = Instant::now();
        self.check_controls()?;
        let loads = self.effective_loads(controls.loads);
        let reference = match &step.rolling {
            None => SlipReference::Previous(self.state.slip_reference.clone()),
            Some(rolling) => SlipReference::Upstream(self.upstream(rolling, number)?),
        };
        let end = self.path_point(&loads, reference)?;
        let worn = self.state.wear_depth.clone();
        let slip_repeats = if step.rolling.is_some() { 0.0 } else { 1.0 };
        let laws = ActiveLaws { slip_repeats, ..ActiveLaws::of(step) };
        let mut problem = increment_problem(&self.prepared, &self.options, &worn, laws, vec![end]);
        let mut it = ContactState::new(self.prepared.n(), vec![controls.rigid]);
        let (_, floating) = predictor.motions(&self.state);
        it.mode_amplitudes = vec![self.prepared.with_rotation(floating, controls.turn)];
        if self.options.skip.allows(OmittableWork::ColdStarts) {
            predictor.extrapolate_tractions(&self.state, &problem, &mut it);
            if step.rolling.is_none() {
                predictor.note(&self.state);
            }
        }
        let HistoryRow { index, count } = step.history_row.unwrap_or(HistoryRow { index: 0, count: 1 });
        let (number, count) = (index * step.increments + number, (count * step.increments) as f64);
        let stage =
            ProgressSpan { name: &step.name, from: (number - 1) as f64 / count, to: number as f64 / count };
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, &self.options, self.observer, &stage)?;
        let balance = state::energy_balance(&self.prepared, &self.state, &it, 0);
        self.state.wear_depth.iter_mut().zip(&it.wear_rate).for_each(|(w, rate)| *w += slip_repeats * rate);
        let values = state::resultants(&self.prepared, &problem, &it, 0);
        let mut fields = state::frame_state(&problem, &it, 0, &self.state.wear_depth);
        self.state.set_from(&it, 0);
        let approach = self.prepared.approach(&it, 0);
        let certificate = state::certificate(&checks, approach, balance);
        let mut record = self.new_record((number, approach), &values, (&it, certificate), clock);
        if let Some(rolling) = &step.rolling {
            self.per_distance(rolling, &mut fields.slip);
            record.rolling = Some(self.add_rolling_wear(rolling, number, &it)?);
        } else {
            self.state.dissipation += checks.dissipation;
            if step.wear {
                self.state.add_wear_dissipation(checks.dissipation, step.friction);
            }
        }
        let converged = self.complete_record(&mut record, &report, (&checks, self.options.tolerance));
        self.deliver(record, fields)?;
        Ok(converged?)
    }

    /// Refuses a tangential force or a spin moment that nothing can balance: without friction, or in rolling.
    fn check_controls(&self) -> Result<()> {
        let step = self.step();
        let rolls = step.rolling.is_some();
        if self.has_friction() && !rolls {
            return Ok(());
        }
        // A prescribed force of zero is allowed, because the tangential force is zero without friction.
        let pulled = matches!(self.controls.tangential, Tangential::Force(force) if force != [0.0; 2]);
        // Inclined cells carry a spin moment by their pressures.
        let level = self.prepared.model.frame.has_uniform_axes();
        let spun = level && matches!(self.controls.spin, Spin::Moment(moment) if moment != 0.0);
        let (what, instead) = match (pulled, spun) {
            (true, _) => ("a tangential force", "shift"),
            (_, true) => ("a spin moment", "twist"),
            _ => return Ok(()),
        };
        if rolls {
            return Err(Error::input(format!(
                "step \"{}\" rolls, but {what} is still prescribed; in rolling the tangential forces follow from the creepages: prescribe {instead} in a step before",
                step.name
            )));
        }
        Err(Error::input(format!(
            "step \"{}\" prescribes {what}, but this step has no friction to transmit it: add a [friction] law, or prescribe {instead}",
            step.name
        )))
    }

    /// Returns whether friction acts in the current step.
    pub(super) fn has_friction(&self) -> bool {
        self.step().friction && self.prepared.ellipse.is_some()
    }

    /// Replaces tangential force and spin moment by fixed motions if friction does not act or the step rolls. Without friction the
    /// prescribed values are zero, and any position satisfies them. A spin moment on inclined cells stays prescribed without
    /// friction, because their pressures carry it.
    pub(super) fn effective_loads(&self, mut loads: PrescribedLoads) -> PrescribedLoads {
        if !self.has_friction() {
            loads.tangential = TangentialControl::Shift;
            if self.prepared.model.frame.has_uniform_axes() {
                loads.moment[2] = None;
            }
        }
        if self.step().rolling.is_some() {
            // The creepages prescribe slip and spin of body 2.
            (loads.tangential, loads.moment[2]) = (TangentialControl::Shift, None);
        }
        loads
    }

    /// Record of a solved state, without the values that [`Run::complete_record`] fills.
    pub(super) fn new_record(
        &self,
        (number, approach): (usize, f64),
        values: &Resultants,
        (it, certificate): (&ContactState, Certificate),
        clock: Instant,
    ) -> IncrementRecord {
        let record = IncrementRecord {
            name: self.step().name.clone(),
            increment: number,
            approach,
            contact_touches_edge: state::touches_edge(&self.prepared, &it.scaled),
            certificate,
            seconds: clock.elapsed().as_secs_f64(),
            ..IncrementRecord::default()
        };
        record.with_resultants(values)
    }

    /// Fills wear, work and convergence of a record, and adds warnings. `Err` if the run ends with this record.
    pub(super) fn complete_record(
        &mut self,
        record: &mut IncrementRecord,
        report: &SolveReport,
        (checks, tolerance): (&StateChecks, f64),
    ) -> std::result::Result<(), RunEnd> {
        let areas = &self.prepared.model.frame.areas;
        let volume = self.volume(&self.state.wear_depth) + self.state.rolling_wear_volume;
        let share = self.prepared.model.wear_share;
        record.worn_volume = volume;
        record.worn_volume_by_body = [share * volume, (1.0 - share) * volume];
        record.max_wear_depth = self.state.wear_depth.iter().copied().fold(0.0, f64::max);
        record.worn_volume_by_energy =
            self.prepared.volume_per_energy.zip(self.state.wear_dissipation).map(|(k, energy)| k * energy);
        record.wear_depth_error =
            root_mean_square(&self.state.depth_errors, areas, |i| self.state.wear_depth[i] > 0.0);
        record.worn_volume_error = self.state.volume_error;
        record.cycles_done = self.state.cycles_done;
        record.distance_slid = self.state.distance_slid;
        record.dissipation = self.state.dissipation;
        record.method.clone_from(&report.method);
        record.iterations = report.iterations;
        record.operator_applications = report.applications;
        record.converged = report.stop == StopReason::Converged && checks.natural_residual <= tolerance;
        if let Some(sliding) = &report.loss_of_equilibrium {
            let note = self.prepared.loss_of_equilibrium_message(&record.name, record.increment, sliding);
            self.result.warnings.push(note);
        }
        let no_contact = (record.contact_area == 0.0 && record.converged)
            .then(|| self.prepared.no_contact_message(record, self.controls.normal, checks.min_gap))
            .flatten();
        if let Some((kind, note)) = no_contact {
            self.warn_once(kind, |_| note);
        }
        if record.contact_touches_edge {
            self.warn_once(StepWarning::FrameEdge, |run| run.frame_edge_warning(record));
        }
        match report.stop {
            StopReason::Interrupted => Err(RunEnd::Interrupted),
            StopReason::GrossSliding => Err(RunEnd::Diverged(Divergence::GrossSliding)),
            StopReason::ContactLost => Err(RunEnd::Diverged(Divergence::ContactLost)),
            StopReason::StickZoneNotConverged => Err(RunEnd::Diverged(Divergence::StickZone)),
            _ if record.converged => Ok(()),
            _ => Err(RunEnd::Diverged(Divergence::Iterations)),
        }
    }

    /// Warning that the contact of `record` reaches an edge of the frame beyond which the bodies continue.
    fn frame_edge_warning(&self, record: &IncrementRecord) -> String {
        let frame = &self.prepared.model.frame;
        let fewest = frame.grid.and_then(|grid| grid.cells.into_iter().filter(|n| *n > 1).min());
        let coarse = fewest.filter(|n| *n < MIN_CELLS_ACROSS && frame.grid_indices.is_none());
        let finer = coarse.map(|n| {
            format!("enlarge frame.half_width, or increase frame.cells ({n} cells across the frame)")
        });
        let larger = if frame.grid.is_none() && frame.n_excluded > 0 {
            "take the frame from the body whose surface ends there (frame.body), or use smaller faces"
        } else if frame.grid_indices.is_some() {
            "enlarge frame.half_width beyond frame.outline"
        } else if frame.grid.is_some() {
            "enlarge frame.half_width, or give the edge of a flat punch as frame.outline"
        } else {
            "add more faces to the contact groups"
        };
        let larger = finer.as_deref().unwrap_or(larger);
        warning(&format!(
            "step \"{}\" ({}): the contact reaches the edge of the frame, although the bodies continue beyond it. Contact outside the frame is not computed, so that loads and pressures may be wrong; {larger}",
            record.name, record.increment
        ))
    }

    /// Passes a record to the observer and stores it.
    pub(super) fn deliver(
        &mut self,
        record: IncrementRecord,
        fields: crate::evolution::FrameState,
    ) -> Result<()> {
        self.observer.increment_done(&record, &fields)?;
        if let Some(note) = large_sliding_warning(&self.prepared.model.frame, &record, &fields) {
            self.warn_once(StepWarning::LargeSliding, |_| note);
        }
        self.result.records.push(record);
        self.result.state = fields;
        Ok(())
    }
}
