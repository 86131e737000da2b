//! Stick zone of a cycle: the cells that stick through the whole cycle, and the tangential gap at which they stick
//! (stick gap).
//!
//! * [`CycleState::decide_by_stroke`] decides the zone while the increments of a stroke are solved one after the other.
//! * [`Run::solve_path_points`] solves the path points together with a given zone, and
//!   [`CycleState::has_consistent_stick_zone`] tests whether the zone agrees with the solution. If not, or if the
//!   solution stalls, the zone is changed. The iteration also ends when the responses (forces, or displacements under
//!   prescribed forces) no longer change.
//!
//! A cycle whose zone still changes after the last pass ends with `StickZoneNotConverged`.

use crate::contact::solver::{SolveReport, SolverOptions, StopReason};
use crate::contact::{ContactState, Increment, SlipReference, Unknowns};
use crate::error::Result;
use crate::evolution::fretting::cycle_increment::{IncrementStart, Strokes, stroke_options};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::settings::STICK_ZONE;
use crate::evolution::fretting::strokes::Responses;
use crate::evolution::fretting::wear_integrator::add;
use crate::evolution::fretting::wear_integrator::{StageSpec, WearJump};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::run::Run;

/// Outcome of a coupled solution of the path points with a given stick zone.
enum ZoneOutcome {
    /// The zone agrees with the solution. Also returned if the solver stopped for a reason that another zone cannot
    /// remove.
    Accepted,
    /// The zone disagrees with the converged solution.
    Inconsistent,
    /// Not converged. Cells of the zone that slip have been removed from the zone.
    CellsReleased,
    /// Not converged, and no cell of the zone slips.
    Stalled,
}

impl CycleState {
    /// Decides which cells stick, from the solution `it` of an increment of a stroke. Cells that slip by up to
    /// `slip_limit` stick.
    ///
    /// If `starts` is true, the zone starts with all cells. Usually this happens at point 1, after the + reversal
    /// point. At the - reversal point, the zone then describes the stroke from + to -. The other stroke of a periodic
    /// cycle only reverses the slip of this stroke.
    ///
    /// With loads that vary in phase, body 2 may drift from cycle to cycle. The zone then starts with the cycle and
    /// describes both strokes.
    pub(super) fn decide_by_stroke(&mut self, it: &ContactState, slip_limit: f64, starts: bool) {
        let n = self.stick_zone.mask.len();
        if starts {
            self.stick_zone.mask.fill(true);
        }
        for (i, stuck) in self.stick_zone.mask.iter_mut().enumerate() {
            *stuck &= it.scaled[2 * n + i] > 0.0 && it.slip[i].hypot(it.slip[n + i]) <= slip_limit;
        }
    }

    /// Removes cells that slip at a path point from the stick zone. Returns whether any cell was removed.
    pub fn release_slipping_cells(&mut self, problem: &Increment, slip_limit: f64) -> bool {
        let (n, points) = (problem.n(), problem.path_points.len());
        let mut any = false;
        for i in 0..n {
            let slips = |point: usize| {
                let slip =
                    self.contact.slip[point * 2 * n + i].hypot(self.contact.slip[point * 2 * n + n + i]);
                slip > slip_limit && !problem.sticks(&self.contact, point, i)
            };
            if self.stick_zone.mask[i] && (0..points).any(slips) {
                self.stick_zone.mask[i] = false;
                any = true;
            }
        }
        if any {
            let position = self.contact.rigid_motion[0];
            self.stick_zone.origin = self.stick_zone.origin.map(|_| [position[0], position[1]]);
        }
        any
    }

    /// Returns whether the stick zone agrees with the solution. Cells of the zone must stick or slip little at all path
    /// points, and every other cell must slip at some path point.
    ///
    /// A cell that starts to stick requires new strokes, because its stick gap depends on the history.
    pub fn has_consistent_stick_zone(&self, problem: &Increment, slip_limit: f64) -> bool {
        let (n, points) = (problem.n(), problem.path_points.len());
        (0..n).all(|i| {
            let mut sticks = (0..points).map(|point| problem.sticks(&self.contact, point, i));
            let slips_little = |point: usize| {
                self.contact.slip[point * 2 * n + i].hypot(self.contact.slip[point * 2 * n + n + i])
                    <= slip_limit
            };
            if self.stick_zone.mask[i] {
                sticks.enumerate().all(|(point, sticks)| sticks || slips_little(point))
            } else {
                !sticks.all(|sticks| sticks)
            }
        })
    }
}

/// Whether the drift of body 2 in a cycle agrees within `max_drift_change` with the drift in the cycle before.
fn is_steady(now: [f64; 2], before: [f64; 2]) -> bool {
    let change = (now[0] - before[0]).hypot(now[1] - before[1]);
    change <= STICK_ZONE.max_drift_change * now[0].hypot(now[1])
}

impl Run<'_> {
    /// Solves the path points of a cycle together and decides the stick zone of the cycle. Also solves steady sliding,
    /// which has no stick zone.
    pub(super) fn solve_path_points(
        &mut self,
        stage: StageSpec,
        wear_step: &WearStepState,
        jump: &mut WearJump,
        progress: &ProgressSpan,
    ) -> Result<()> {
        let StageSpec { wear_depth: worn, implicit_passes, options, .. } = stage;
        let before = jump.checks;
        let (loads, height) = self.loads_at(wear_step, stage.step_fraction);
        if let Some(height) = height {
            jump.cycle.contact.rigid_motion.iter_mut().for_each(|rigid| rigid[2] = height);
        }
        let mut last: Option<Responses> = None;
        // A wrong stick zone can prevent convergence, so the iterations are limited until a stalled zone has been
        // recomputed.
        let mut max_iterations = options.max_iterations.min(STICK_ZONE.max_iterations_before_recomputation);
        for pass in 1..=STICK_ZONE.max_passes {
            if pass == STICK_ZONE.max_passes || !jump.cycle.stick_zone.mask.contains(&true) {
                max_iterations = options.max_iterations;
            }
            let limited = SolverOptions { max_iterations, ..*options };
            let stage = StageSpec { options: &limited, ..stage };
            let outcome = self.solve_with_stick_zone(&stage, wear_step, jump, progress)?;
            jump.checks = before.worst(&jump.checks);
            let SlipSource::ClosedPath(path) = &wear_step.slip_source else { return Ok(()) };
            let stalled = matches!(outcome, ZoneOutcome::Stalled);
            match outcome {
                ZoneOutcome::Accepted => return Ok(()),
                ZoneOutcome::CellsReleased => continue,
                ZoneOutcome::Stalled if max_iterations == options.max_iterations => return Ok(()),
                ZoneOutcome::Stalled => max_iterations = options.max_iterations,
                ZoneOutcome::Inconsistent => {
                    let now = self.responses_at_path_points(&jump.cycle, path);
                    // The responses of the cycle no longer change, although cells at the edge of the zone alternate
                    // between stick and slip.
                    if last.is_some_and(|last| now.are_periodic(&last)) {
                        return Ok(());
                    }
                    last = Some(now);
                }
            }
            let mut depth = worn.to_vec();
            add(&mut depth, implicit_passes, &jump.cycle.contact.wear_per_pass);
            let strokes = Strokes { path, loads, wear_depth: &depth, options };
            let (report, solves) = self.recompute_stick_zone(&strokes, &mut jump.cycle, progress)?;
            jump.report = report.clone().with_work_of(&jump.report);
            jump.solves += solves;
            // Strokes that start from a stalled solution may fail although the coupled cycle converges.
            let may_continue = stalled && report.stop != StopReason::Interrupted;
            if report.stop != StopReason::Converged && !may_continue {
                return Ok(());
            }
        }
        jump.report.stop = StopReason::StickZoneNotConverged;
        Ok(())
    }

    /// Solves the path points with the stick zone of `jump` and compares the zone with the solution.
    fn solve_with_stick_zone(
        &mut self,
        &StageSpec { step_fraction, wear_depth, implicit_passes, options }: &StageSpec,
        wear_step: &WearStepState,
        jump: &mut WearJump,
        progress: &ProgressSpan,
    ) -> Result<ZoneOutcome> {
        let (loads, _) = self.loads_at(wear_step, step_fraction);
        let points = match &wear_step.slip_source {
            SlipSource::ClosedPath(path) => self.path_points(path, loads, &jump.cycle)?,
            SlipSource::Sliding(slip) => {
                vec![self.path_point(&loads, SlipReference::Prescribed(slip.clone()))?]
            }
        };
        let wear_path_factors = jump.rate_correction.as_ref().map(|correction| &correction.factors[..]);
        let laws = ActiveLaws { implicit_passes, wear_path_factors, ..ActiveLaws::of(self.step()) };
        let mut problem = increment_problem(&self.prepared, options, wear_depth, laws, points);
        let (report, checks) = solve_and_check(
            &self.prepared,
            &mut problem,
            &mut jump.cycle.contact,
            options,
            self.observer,
            progress,
        )?;
        let slip_limit = jump.cycle.slip_limit(&self.prepared);
        let outcome = match report.stop {
            StopReason::Converged if !jump.cycle.has_consistent_stick_zone(&problem, slip_limit) => {
                ZoneOutcome::Inconsistent
            }
            StopReason::Iterations if jump.cycle.release_slipping_cells(&problem, slip_limit) => {
                ZoneOutcome::CellsReleased
            }
            StopReason::Iterations => ZoneOutcome::Stalled,
            _ => ZoneOutcome::Accepted,
        };
        jump.report = report.with_work_of(&jump.report);
        jump.solves += 1;
        jump.checks = checks;
        Ok(outcome)
    }

    /// Solves strokes until the cycle is periodic, and updates stick zone and stick gap. If the tenth cycle only
    /// moves body 2, by nearly the same distance as the cycle before, no cell sticks. If a stroke does not converge, the path points keep
    /// the solution in which they were solved together.
    fn recompute_stick_zone(
        &mut self,
        strokes: &Strokes,
        cycle: &mut CycleState,
        progress: &ProgressSpan,
    ) -> Result<(SolveReport, usize)> {
        let half = strokes.path.reversal_index();
        let options = stroke_options(strokes.options);
        let strokes = &Strokes { options: &options, ..*strokes };
        let (path, loads, worn) = (strokes.path, strokes.loads, strokes.wear_depth);
        // The span ends below the fraction 1, so the solver skips the check of the operator. Otherwise every stroke
        // would repeat this check.
        let progress = &ProgressSpan { name: progress.name, from: progress.from, to: progress.from };
        let coupled = (Unknowns::from_state(&cycle.contact), cycle.stick_zone.clone());
        let mut reference = IncrementStart::at_path_point(&cycle.contact, half).reference;
        let mut solves = 0;
        let mut sum = SolveReport { stop: StopReason::Converged, ..SolveReport::default() };
        let mut before: Option<Responses> = None;
        let (mut drift, mut is_steady_drift): (Option<[f64; 2]>, bool) = (None, false);
        for _ in 0..STICK_ZONE.max_settling_cycles {
            let up = half + 1..path.len() + 1;
            for (k, point) in up.map(|point| point % path.len()).chain(1..half + 1).enumerate() {
                let start =
                    IncrementStart { reference, ..IncrementStart::at_path_point(&cycle.contact, point) };
                let solved = self.solve_cycle_increment(strokes, point, start, progress)?;
                solves += 1;
                sum = solved.report.with_work_of(&sum);
                if sum.stop != StopReason::Converged {
                    // Restores the last solution of the coupled path points, because the record contains this
                    // solution.
                    coupled.0.restore_into(&mut cycle.contact);
                    cycle.stick_zone = coupled.1;
                    let laws = ActiveLaws::of(self.step());
                    let points = self.path_points(path, loads, cycle)?;
                    increment_problem(&self.prepared, &options, worn, laws, points)
                        .evaluate(&mut cycle.contact);
                    return Ok((sum, solves));
                }
                let starts = if self.prepared.cyclic_gap.is_some() { k == 0 } else { point == 1 };
                let slip_limit = cycle.slip_limit(&self.prepared);
                cycle.decide_by_stroke(&solved.next.contact, slip_limit, starts);
                cycle.record_increment(&solved.next.contact, point);
                reference = solved.next.reference;
            }
            let found = self.responses_at_path_points(cycle, path);
            if before.as_ref().is_some_and(|before| found.are_periodic(before)) {
                return Ok((sum, solves));
            }
            let now = before.as_ref().and_then(|before| found.drift_since(before));
            is_steady_drift = now.zip(drift).is_some_and(|(now, before)| is_steady(now, before));
            (drift, before) = (now, Some(found));
        }
        // The cycle is not periodic. If body 2 drifts steadily, the cells of the zone do not stick, but slip by less
        // than the limit. Otherwise the zone is used.
        if is_steady_drift && cycle.stick_zone.origin.is_some() && !path.is_held() {
            cycle.stick_zone.mask.fill(false);
        }
        Ok((sum, solves))
    }
}
