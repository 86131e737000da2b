//! Resolved cycles: strokes solved one increment after the other (docs/theory-wear.md). A resolved cycle gives factors on the wear
//! that follows from the slip between the coupled path points. A cycle is resolved again only when this slip or the normal force
//! has changed. It does not change the stick zone of the coupled cycle.

use crate::contact::solver::StopReason;
use crate::contact::{ContactState, Increment};
use crate::error::Result;
use crate::evolution::field_measures::{root_mean_square, volume};
use crate::evolution::fretting::cycle_increment::IncrementStart;
use crate::evolution::fretting::cycle_increment::stroke_options;
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::path_correction::{CycleSlip, ResolvedCycle, ReversalCorrection};
use crate::evolution::fretting::wear_step_state::{SlipSource, WearStepState};
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem};
use crate::evolution::records::Resultants;
use crate::evolution::run::Run;
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
use crate::evolution::step::{ClosedPath, Correction, CycleMotion, ResolvedCycleSettings};

/// Largest number of increments per stroke, unless four times the coupled increments are more.
const MAX_STROKE_INCREMENTS: usize = 64;

/// Estimated change of the wear volume until the tractions are steady, relative to its change from one cycle to the next.
const DRIFT_ERROR_FACTOR: f64 = 4.0;

/// Least number of increments of a resolved cycle, as a multiple of the increments of the coupled cycle.
const MIN_REFINEMENT: usize = 4;

/// Ratio of the increments of a second resolved cycle to the increments of the first. The coupled cycle stays uncorrected only if
/// its wear volume agrees with both resolved cycles.
const CONFIRMING_REFINEMENT: usize = 4;

/// Largest relative change of the tangential force at a reversal point by the last refinement. Measured with a pin that slides at
/// 15 to 75 degrees to the fibre. With 8 increments the wear was right to 1e-3, but the force across the stroke was 15 % too small.
const MAX_FORCE_CHANGE: f64 = 0.01;

/// Relative difference between the tangential forces of prescribed increments and of the resolved cycle, above which a warning is
/// given.
const MIN_REPORTED_FORCE_DIFFERENCE: f64 = 0.02;

/// Smallest wear of a cell, relative to the largest, for which the cell has an individual factor. Both wear depths follow from the
/// coupled path points.
const NEGLIGIBLE_WEAR_SHARE: f64 = 1e-6;

/// Largest factor on the wear of a cell.
const MAX_WEAR_FACTOR: f64 = 4.0;

/// Lower bound on the share of a stroke in which slip spreads over the contact.
const MIN_FIRST_INCREMENT_SHARE: f64 = 0.02;

/// Relative accuracy with which a resolved cycle measures the error of the coupled cycle if it does not correct this error.
const MEASUREMENT_TOLERANCE_SHARE: f64 = 0.1;

/// Wear of one cycle.
#[derive(Clone)]
struct CycleWear {
    /// Wear depth per cycle, `[N]`, mm.
    rate: Vec<f64>,
    /// Dissipation per cycle, N mm.
    power: f64,
    /// Wear volume of the second stroke minus the wear volume of the same stroke one cycle before, mm3; 0 for steady tractions.
    drift: f64,
    /// Resultants at the reversal points (+, -).
    reversals: [Resultants; 2],
}

impl CycleWear {
    /// Relative change of the tangential force from `other`; the larger change at the two reversal points.
    fn force_change(&self, other: &Self) -> f64 {
        let change = |(now, before): (&Resultants, &Resultants)| {
            let [[x, y], [x0, y0]] = [now.tangential_force, before.tangential_force];
            let force = x.hypot(y);
            if force > 0.0 { (x - x0).hypot(y - y0) / force } else { 0.0 }
        };
        self.reversals.iter().zip(&other.reversals).map(change).fold(0.0, f64::max)
    }

    /// First-order extrapolation of wear and dissipation from a coarser cycle and this one. `ratio` is the number of increments of
    /// this cycle divided by the number of increments of the coarser cycle.
    fn extrapolated(&self, coarser: &Self, ratio: f64) -> Self {
        let limit = |fine: f64, coupled_path: f64| (ratio * fine - coupled_path) / (ratio - 1.0);
        let rate = self.rate.iter().zip(&coarser.rate).map(|(fine, coarse)| limit(*fine, *coarse).max(0.0));
        Self { rate: rate.collect(), power: limit(self.power, coarser.power), ..*self }
    }
}

/// Resolved cycle whose wear changes little with more increments.
struct RefinedCycle {
    wear: CycleWear,
    /// Relative change of the wear by the last refinement, `[N]`.
    change: Vec<f64>,
    /// Increments per stroke.
    increments: usize,
    /// Whether the wear volumes of three cycles agree within the tolerance: the coupled cycle, this cycle and a coarser resolved
    /// cycle.
    agrees_with_coupled: bool,
}

/// Mean normal force at the reversal points, N.
fn mean_normal_force(reversals: &[Resultants; 2]) -> f64 {
    0.5 * (reversals[0].normal_force + reversals[1].normal_force)
}

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
        let normal_force = mean_normal_force(&reversals);
        let changed = |before: &[f64]| self.slip_change(&cycle.contact, before);
        let is_due = |before: &ResolvedCycle| before.is_due(used, (&slip, normal_force), changed);
        if wear_step.resolved_cycle.as_ref().is_some_and(|before| !is_due(before)) {
            return Ok(());
        }
        let path = path.clone();
        let coupled = CycleWear {
            rate: cycle.contact.wear_rate.clone(),
            power: wear_step.dissipation_rate / wear_step.dissipation_factor(),
            drift: 0.0,
            reversals,
        };
        let way = (&path, closed, slip);
        let Some(refined) = self.refine_cycle((way, used), (wear_step, &cycle, &coupled))? else {
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
        let difference = self.volume_difference(&coupled, &refined.wear);
        let (factors, unresolved_wear_fraction) = self.wear_factors(&refined.wear.rate, &coupled.rate);
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
        } else if difference.max(self.relative_rms_difference(&coupled.rate, &refined.wear.rate))
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
            normal_force: mean_normal_force(&coupled.reversals),
            remaining_error: remaining.collect(),
            remaining_volume_error: volume,
            unresolved_wear_fraction: 0.0,
            reversal_correction: None,
        }
    }

    /// Warns if the factors miss more wear than the tolerance, unless they did at the previous resolved cycle.
    fn warn_of_unresolved_wear(&mut self, wear_step: &WearStepState, (missed, tolerance): (f64, f64)) {
        if missed <= tolerance
            || wear_step
                .resolved_cycle
                .as_ref()
                .is_some_and(|before| before.unresolved_wear_fraction > tolerance)
        {
            return;
        }
        self.result.warnings.push(format!(
            "step \"{}\": after {} cycles, {} of the wear occurs in cells that slip within a stroke but not between its reversal points. The computed wear omits it; the estimated errors include it. Use smaller cells, or cycles.increments = 8",
            self.step().name,
            self.state.cycles_done,
            percent(missed)
        ));
    }

    /// Warns that the prescribed number of increments per stroke misses the tolerance.
    fn warn_of_increments(
        &mut self,
        (increments, tolerance): (usize, f64),
        (refined, coupled): (&RefinedCycle, &CycleWear),
    ) {
        let areas = &self.prepared.model.frame.areas;
        let [all, resolved] = [&coupled.rate, &refined.wear.rate].map(|rate| volume(rate, areas));
        let of_strokes = if increments == 1 { "increment" } else { "increments" };
        let by = if resolved > 0.0 {
            let depth = 100.0 * self.relative_rms_difference(&refined.wear.rate, &coupled.rate);
            format!(
                "{:+.2} % of the wear volume and {depth:.2} % of the largest wear depth (root mean square)",
                100.0 * (all / resolved - 1.0)
            )
        } else {
            "the whole wear".to_owned()
        };
        self.result.warnings.push(format!(
            "step \"{}\": cycles with {increments} {of_strokes} and with {} per stroke differ by {by}, and by {:.1} % of the tangential force at a reversal point (wear.tolerance = {tolerance:e}). The estimated errors include the wear difference. To correct both, omit cycles.increments or use \"auto\"",
            self.step().name,
            refined.increments,
            100.0 * coupled.force_change(&refined.wear)
        ));
    }

    /// Computes slip and elastic lag between the path points of `cycle`, which must be evaluated with `problem`.
    fn cycle_slip(&self, problem: &Increment, cycle: &CycleState) -> CycleSlip {
        let (it, n, areas) = (&cycle.contact, self.prepared.n(), &self.prepared.model.frame.areas);
        let points = it.rigid_motion.len();
        let mut found = CycleSlip { full_slip: true, slip_spread_share: 0.0, lag: 0.0 };
        let (mut lags, mut slips) = (0.0, 0.0);
        for point in 0..points {
            let before = (point + points - 1) % points;
            let moved = [0, 1, 2].map(|k| it.rigid_motion[point][k] - it.rigid_motion[before][k]);
            let turned =
                std::array::from_fn(|k| it.mode_amplitudes[point][k] - it.mode_amplitudes[before][k]);
            let stroke = moved[0].hypot(moved[1]);
            for i in (0..n).filter(|i| it.tractions[point * 3 * n + 2 * n + i] > 0.0) {
                let motion = problem.rigid_gap(i, moved, &turned);
                let slip = [it.slip[point * 2 * n + i], it.slip[point * 2 * n + n + i]];
                let lag = (motion[0] - slip[0]).hypot(motion[1] - slip[1]);
                let force = areas[i] * it.tractions[point * 3 * n + 2 * n + i];
                lags += force * lag;
                slips += force * slip[0].hypot(slip[1]);
                found.full_slip &= !cycle.stick_zone.mask[i] && !problem.sticks(it, point, i);
                found.slip_spread_share =
                    f64::max(found.slip_spread_share, if stroke > 0.0 { lag / stroke } else { 1.0 });
            }
        }
        found.slip_spread_share = found.slip_spread_share.clamp(MIN_FIRST_INCREMENT_SHARE, 1.0);
        found.lag = if slips > 0.0 { lags / slips } else { f64::INFINITY };
        found
    }

    /// Refines the increments of a cycle until the wear changes less than the tolerance, or their largest number is reached. `None`
    /// if a cycle does not converge.
    fn refine_cycle(
        &mut self,
        ((path, closed, CycleSlip { full_slip, slip_spread_share, .. }), used): (
            (&FrettingPath, &ClosedPath, CycleSlip),
            ResolvedCycleSettings,
        ),
        (wear_step, cycle, coupled): (&mut WearStepState, &CycleState, &CycleWear),
    ) -> Result<Option<RefinedCycle>> {
        let corrects = used.correction != Correction::Never;
        let may_agree = full_slip && used.correction == Correction::WhereNeeded;
        // On an ellipse, chords are a first-order approximation along the whole path.
        let extrapolates = closed.amplitude[1] != 0.0;
        let begin = wear_step
            .resolved_cycle
            .as_ref()
            .map_or(1, |before| before.increments / if extrapolates { 8 } else { 4 });
        let mut increments = begin.max(closed.increments);
        // Each cycle starts from the coarser one before it, so the tractions approach the steady state meanwhile.
        let mut place = IncrementStart::at_path_point(&cycle.contact, path.reversal_index());
        let mut coarser = if increments == closed.increments && !extrapolates {
            coupled.clone()
        } else {
            let way = (path, closed, (increments, slip_spread_share));
            let Some(wear) = self.resolved_cycle(way, (wear_step, &mut place))? else {
                return Ok(None);
            };
            wear
        };
        let mut last: Option<CycleWear> = (!extrapolates).then(|| coarser.clone());
        let most = MAX_STROKE_INCREMENTS.max(4 * closed.increments);
        // First cycle with at least `MIN_REFINEMENT` times the coupled increments, and its increments.
        let is_refined = increments >= MIN_REFINEMENT * closed.increments;
        let mut first: Option<(usize, CycleWear)> =
            (is_refined && !extrapolates).then(|| (increments, coarser.clone()));
        loop {
            // If the first cycle agrees with the coupled path points, possibly by chance, the next one tests the agreement.
            let confirms = may_agree
                && first
                    .as_ref()
                    .is_some_and(|(at, wear)| increments == *at && self.agree(coupled, wear, used));
            let ratio = if confirms { CONFIRMING_REFINEMENT.min(most / increments).max(2) } else { 2 };
            increments *= ratio;
            let way = (path, closed, (increments, slip_spread_share));
            let Some(wear) = self.resolved_cycle(way, (&mut *wear_step, &mut place))? else {
                return Ok(None);
            };
            let limit = if extrapolates { wear.extrapolated(&coarser, ratio as f64) } else { wear.clone() };
            if first.is_none() && increments >= MIN_REFINEMENT * closed.increments {
                first = Some((increments, limit.clone()));
            }
            if let Some(last) = &last {
                let change = self.relative_rms_difference(&limit.rate, &last.rate);
                let measured =
                    MEASUREMENT_TOLERANCE_SHARE * self.relative_rms_difference(&coupled.rate, &limit.rate);
                let tolerance = if corrects { used.tolerance } else { used.tolerance.max(measured) };
                let near = may_agree && self.agree(coupled, &limit, used);
                let confirmed = |(at, wear): &(usize, CycleWear)| {
                    increments >= most.min(CONFIRMING_REFINEMENT * at)
                        && self.agree(coupled, wear, used)
                        && self.agree(wear, &limit, used)
                };
                let agrees = near && first.as_ref().is_some_and(confirmed);
                let open = near
                    && first.as_ref().is_none_or(|(at, _)| increments < most.min(CONFIRMING_REFINEMENT * at));
                // At least two refinements are required, because the first alone may change little by chance.
                let twice = increments >= MIN_REFINEMENT * closed.increments;
                let settled = !corrects || limit.force_change(last) <= MAX_FORCE_CHANGE;
                if twice && !open && settled && (change <= tolerance || agrees) || increments >= most {
                    // Warn once, not in every jump.
                    let known =
                        wear_step.resolved_cycle.as_ref().is_some_and(|before| before.increments >= most);
                    if change > tolerance && corrects && !agrees && !known {
                        self.result.warnings.push(format!(
                            "step \"{}\": after {} cycles, doubling the increments per stroke to {increments} still changes the wear per cycle by {} (root mean square), more than wear.tolerance = {tolerance:e}. The estimated errors include this change; accept it, or increase wear.tolerance",
                            self.step().name,
                            self.state.cycles_done,
                            percent(change)
                        ));
                    }
                    let both = limit.rate.iter().zip(&last.rate);
                    let change =
                        both.map(|(now, last)| if *now > 0.0 { 1.0 - last / now } else { 0.0 }).collect();
                    return Ok(Some(RefinedCycle {
                        wear: limit,
                        change,
                        increments,
                        agrees_with_coupled: agrees,
                    }));
                }
            }
            (coarser, last) = (wear, Some(limit));
        }
    }

    /// Computes wear and dissipation of a cycle with a given number of increments per stroke, at the current wear depth. The cycle
    /// starts from `place` at the - reversal point, and replaces `place` by the state one cycle later. `None` if an increment does
    /// not converge.
    fn resolved_cycle(
        &mut self,
        (coupled_path, closed, (increments, transition)): (&FrettingPath, &ClosedPath, (usize, f64)),
        (wear_step, place): (&mut WearStepState, &mut IncrementStart),
    ) -> Result<Option<CycleWear>> {
        let areas = &self.prepared.model.frame.areas;
        let (step, cycles) = (self.step(), self.cycles());
        let path = coupled_path.refined(&ClosedPath { increments, ..*closed }, transition);
        let (loads, _) = self.loads_at(wear_step, wear_step.completed / cycles.count);
        let (worn, options) = (self.state.wear_depth.clone(), stroke_options(&self.options));
        let part = wear_step.completed / cycles.count;
        let progress = ProgressSpan { name: &step.name, from: part, to: part };
        let n = worn.len();
        let mut wear =
            CycleWear { rate: vec![0.0; n], power: 0.0, drift: 0.0, reversals: Default::default() };
        let mut here = place.clone();
        // The first of three strokes does not count: after it only sticking cells remember the initial state. `drift` compares the
        // last stroke with the first.
        let up = (increments + 1..=2 * increments).map(|point| (point, false));
        let round = (1..=2 * increments).map(|point| (point, true));
        for (point, counts) in up.chain(round) {
            let way = (&path, point % (2 * increments), loads);
            let pressures = here.it.tractions[2 * n..].to_vec();
            let (next, report, checks) =
                self.solve_cycle_increment(way, (&worn, &options), here, &progress)?;
            wear_step.uncharged_work += SolveWork::of(&report);
            if report.stop != StopReason::Converged {
                if report.stop != StopReason::Interrupted {
                    self.result.warnings.push(format!(
                        "step \"{}\": after {} cycles an increment of the resolved cycle did not converge. The wear follows from the reversal points and earlier resolved cycles; the path error since then is not estimated",
                        step.name, self.state.cycles_done
                    ));
                }
                return Ok(None);
            }
            let pressures = pressures.iter().zip(&next.it.tractions[2 * n..]).map(|(a, b)| 0.5 * (a + b));
            let worn: Vec<f64> = pressures.zip(&next.it.wear_path).map(|(p, path)| p * path).collect();
            if counts {
                wear.rate.iter_mut().zip(&worn).for_each(|(sum, worn)| *sum += worn);
                wear.power += checks.dissipation;
            }
            if point > increments {
                wear.drift += if counts { volume(&worn, areas) } else { -volume(&worn, areas) };
            }
            here = next;
            if counts && point % increments == 0 {
                let laws = ActiveLaws { wear: false, ..ActiveLaws::of(step) };
                let depth = self.state.wear_depth.as_slice();
                let problem = increment_problem(&self.prepared, &options, depth, laws, Vec::new());
                let reversal = if point == increments { 1 } else { 0 };
                wear.reversals[reversal] = state::resultants(&self.prepared, &problem, &here.it, 0);
            }
            if counts && point == increments {
                *place = here.clone();
            }
        }
        Ok(Some(wear))
    }

    /// Relative change of the slip between the coupled path points: root mean square over the cells in contact at any path point.
    fn slip_change(&self, it: &ContactState, before: &[f64]) -> f64 {
        let n = self.prepared.n();
        let (touching, areas) = (self.cells_in_contact(&it.scaled), &self.prepared.model.frame.areas);
        let (mut change, mut sum) = (0.0, 0.0);
        for (k, (now, before)) in it.slip.iter().zip(before).enumerate().filter(|(k, _)| touching[k % n]) {
            change += areas[k % n] * (now - before).powi(2);
            sum += areas[k % n] * now * now;
        }
        if sum > 0.0 { (change / sum).sqrt() } else { 0.0 }
    }

    /// Root mean square of the difference of two wear rates over the cells that wear, relative to the largest value of `rate`.
    fn relative_rms_difference(&self, rate: &[f64], other: &[f64]) -> f64 {
        let areas = &self.prepared.model.frame.areas;
        let difference: Vec<f64> = rate.iter().zip(other).map(|(rate, other)| rate - other).collect();
        let largest = rate.iter().copied().fold(0.0, f64::max);
        if largest > 0.0 { root_mean_square(&difference, areas, |i| rate[i] > 0.0) / largest } else { 0.0 }
    }

    /// Difference of the wear volumes of two cycles, relative to the larger volume.
    fn volume_difference(&self, wear: &CycleWear, other: &CycleWear) -> f64 {
        let areas = &self.prepared.model.frame.areas;
        let [volume, others] = [&wear.rate, &other.rate].map(|rate| volume(rate, areas));
        let larger = volume.max(others);
        if larger > 0.0 { (volume - others).abs() / larger } else { 0.0 }
    }

    /// Returns whether the wear volumes of two cycles agree within the tolerance.
    fn agree(&self, one: &CycleWear, other: &CycleWear, used: ResolvedCycleSettings) -> bool {
        self.volume_difference(one, other) <= used.tolerance
    }

    /// Factors on the wear of the coupled cycle, `[N]`, that give the wear of the resolved cycle. Also returns the share of the
    /// resolved wear volume that the factors miss.
    fn wear_factors(&self, wear: &[f64], coupled: &[f64]) -> (Vec<f64>, f64) {
        let areas = &self.prepared.model.frame.areas;
        let [all, all_coupled] = [wear, coupled].map(|rate| volume(rate, areas));
        if all <= 0.0 || all_coupled <= 0.0 {
            return (vec![1.0; wear.len()], 0.0);
        }
        let least = NEGLIGIBLE_WEAR_SHARE * coupled.iter().copied().fold(0.0, f64::max);
        let factor = |(wear, coupled): (&f64, &f64)| {
            if *coupled > least {
                (wear / coupled).min(MAX_WEAR_FACTOR)
            } else {
                (all / all_coupled).min(MAX_WEAR_FACTOR)
            }
        };
        let factors: Vec<f64> = wear.iter().zip(coupled).map(factor).collect();
        let covered: Vec<f64> = coupled.iter().zip(&factors).map(|(rate, factor)| rate * factor).collect();
        (factors, 1.0 - volume(&covered, areas) / all)
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

/// A share in percent with two decimals, for messages.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.01 { "less than 0.01 %".to_owned() } else { format!("{percent:.2} %") }
}
