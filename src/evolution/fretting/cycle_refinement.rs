//! Refinement of a resolved cycle: the number of increments per stroke grows until the wear of the cycle changes
//! little.

use crate::evolution::fretting::cycle_increment::{IncrementStart, Strokes, stroke_options};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::cycle_wear::{CycleWear, relative_rms_difference, volume_difference};
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::path_correction::{CycleSlip, PathCorrection};
use crate::evolution::fretting::repeated_cycle::ResolvedStart;
use crate::evolution::fretting::settings::{REFINEMENT, SETTLING};
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::run::{Advance, Run};
use crate::evolution::step::{ClosedPath, Correction, ResolvedCycleSettings};

pub(super) struct RefinedCycle {
    pub wear: CycleWear,
    /// Relative change of the wear of each cell by the last refinement, `[N]`.
    pub change: Vec<f64>,
    pub increments: usize,
    /// Whether the wear volumes of the coupled cycle, of this cycle and of an earlier resolved cycle agree within the
    /// tolerance.
    pub agrees_with_coupled: bool,
}

/// Coupled cycle (path points solved together) before the first jump or at the end of a jump. Its gap and slip have
/// been evaluated.
pub(super) struct CoupledCycle {
    pub cycle: CycleState,
    pub slip: CycleSlip,
    pub wear: CycleWear,
    /// Wear depth, `[N]`, mm.
    pub wear_depth: Vec<f64>,
    /// Completed cycles of the step.
    pub completed: f64,
}

pub(super) struct Refinement<'r> {
    pub path: &'r FrettingPath,
    pub closed: &'r ClosedPath,
    pub settings: ResolvedCycleSettings,
    pub coupled: &'r CoupledCycle,
    /// Areas of the cells, `[N]`, mm².
    pub areas: &'r [f64],
}

/// Largest number of increments per stroke of a resolved cycle on the path `closed`.
pub(super) fn max_increments(closed: &ClosedPath) -> usize {
    let most =
        if closed.is_ellipse() { REFINEMENT.max_increments_on_ellipses } else { REFINEMENT.max_increments };
    most.max(4 * closed.increments)
}

/// Increments per stroke and wear of a resolved cycle.
type Resolution = (usize, CycleWear);

struct Convergence {
    /// Estimated relative error of the wear: the larger of the error of the cells (root mean square) and the error of
    /// the volume.
    change: f64,
    agrees_with_coupled: bool,
    /// Whether the refinement ends, because the cycle is accurate enough or has the largest allowed number of
    /// increments.
    is_last: bool,
}

impl Refinement<'_> {
    /// Whether wear and forces of two resolved cycles are extrapolated. They are not extrapolated if the number of
    /// increments is given.
    fn extrapolates(&self) -> bool {
        self.settings.increments.is_none()
    }

    /// Whether extrapolated wear and forces are extrapolated once more. On an ellipse they converge slowly, with second
    /// order.
    fn extrapolates_twice(&self) -> bool {
        self.extrapolates() && self.closed.is_ellipse()
    }

    /// Increments per stroke of the first cycle. A given number is halved first, because the difference from the cycle
    /// with the full number shows the error.
    fn first_increments(&self, before: Option<&PathCorrection>) -> usize {
        if let Some(given) = self.settings.increments {
            return (given / 2).max(1);
        }
        before.map_or(1, |before| before.increments / 8).max(self.closed.increments)
    }

    /// Whether a cycle has enough increments for its change by refinement to measure its error.
    fn is_refined(&self, increments: usize) -> bool {
        increments >= REFINEMENT.min_increments.max(REFINEMENT.min_refinement * self.closed.increments)
    }

    /// Whether a cycle with this number of increments is repeated until it is steady. Cycles so coarse that no result
    /// depends on them, and cycles that only measure an error, are not repeated.
    pub fn repeats(&self, increments: usize) -> bool {
        self.settings.correction != Correction::Never
            && (self.settings.increments.is_some() || 2 * increments >= REFINEMENT.min_increments)
    }

    fn agree(&self, one: &CycleWear, other: &CycleWear) -> bool {
        volume_difference(one, other, self.areas) <= self.settings.tolerance
    }

    fn may_agree(&self) -> bool {
        self.coupled.slip.full_slip && self.settings.correction == Correction::WhereNeeded
    }

    /// Ratio of the next number of increments to `increments`. If the wear volume of the cycle `first` agrees with the
    /// coupled cycle, a larger ratio tests whether the agreement is a coincidence.
    fn next_ratio(&self, increments: usize, first: Option<&Resolution>) -> usize {
        let confirms = self.may_agree()
            && first.is_some_and(|(at, wear)| increments == *at && self.agree(&self.coupled.wear, wear));
        if confirms {
            REFINEMENT.confirming_refinement.min(max_increments(self.closed) / increments).max(2)
        } else {
            2
        }
    }

    /// Decides whether the refinement ends with the cycle `now`. `last` is the coarser cycle before `now`. `first` is
    /// the first cycle with at least `min_refinement` times the increments of the coupled cycle.
    fn convergence(
        &self,
        increments: usize,
        [now, last]: [&CycleWear; 2],
        first: Option<&Resolution>,
    ) -> Convergence {
        let (corrects, most) = (self.settings.correction != Correction::Never, max_increments(self.closed));
        let change =
            REFINEMENT.cell_change_share * relative_rms_difference(&now.rate, &last.rate, self.areas);
        let change = change.max(volume_difference(now, last, self.areas));
        let measured = REFINEMENT.measurement_tolerance_share
            * relative_rms_difference(&self.coupled.wear.rate, &now.rate, self.areas);
        let own = REFINEMENT.tolerance_share * self.settings.tolerance;
        let tolerance = if corrects { own } else { own.max(measured) };
        let near = self.may_agree() && self.agree(&self.coupled.wear, now);
        let confirming = |at: &usize| most.min(REFINEMENT.confirming_refinement * at);
        let confirmed = |(at, wear): &Resolution| {
            increments >= confirming(at) && self.agree(&self.coupled.wear, wear) && self.agree(wear, now)
        };
        let agrees_with_coupled = near && first.is_some_and(confirmed);
        let is_open = near && first.is_none_or(|(at, _)| increments < confirming(at));
        let forces_agree = !corrects || now.force_change(last) <= REFINEMENT.max_force_change;
        let suffices = self.is_refined(increments)
            && !is_open
            && forces_agree
            && (change <= tolerance || agrees_with_coupled);
        let is_last = suffices || increments >= most || self.settings.increments.is_some();
        Convergence { change, agrees_with_coupled, is_last }
    }
}

impl Run<'_> {
    /// Refines a resolved cycle until its wear is accurate enough. `None` if an increment does not converge.
    pub(super) fn refine_cycle(
        &mut self,
        refinement: &Refinement,
        wear_step: &mut WearStepState,
    ) -> Advance<Option<RefinedCycle>> {
        let (extrapolates, coupled) = (refinement.extrapolates(), refinement.coupled);
        let mut increments = refinement.first_increments(wear_step.path_correction.as_ref());
        // Each resolved cycle starts from a state of the previous, coarser cycle.
        let begin = IncrementStart::at_path_point(&coupled.cycle.contact, refinement.path.reversal_index());
        let mut start = ResolvedStart::new(begin, coupled.cycle.stick_zone.may_drift());
        let mut coarser = if increments == refinement.closed.increments {
            coupled.wear.clone()
        } else {
            let Some(wear) = self.resolved_cycle(refinement, increments, wear_step, &mut start)? else {
                return Ok(None);
            };
            wear
        };
        let mut last: Option<CycleWear> = (!extrapolates).then(|| coarser.clone());
        // Cycle extrapolated once, with the ratio of its numbers of increments.
        let mut once_before: Option<(CycleWear, usize)> = None;
        let mut first: Option<Resolution> = None;
        loop {
            let ratio = refinement.next_ratio(increments, first.as_ref());
            increments = refinement.settings.increments.unwrap_or(ratio * increments);
            let Some(wear) = self.resolved_cycle(refinement, increments, wear_step, &mut start)? else {
                return Ok(None);
            };
            let once = if extrapolates { wear.extrapolated(&coarser, ratio as f64) } else { wear.clone() };
            let now = match &once_before {
                // The first extrapolation leaves an error b / (K k) with the numbers of increments K and k of its two
                // cycles. From one extrapolation to the next, this error decreases by the product of both ratios.
                Some((before, ratio_before)) if refinement.extrapolates_twice() => {
                    once.extrapolated(before, (ratio_before * ratio) as f64)
                }
                _ => once.clone(),
            };
            once_before = Some((once, ratio));
            if first.is_none() && increments >= REFINEMENT.min_refinement * refinement.closed.increments {
                first = Some((increments, now.clone()));
            }
            if let Some(last) = &last {
                let found = refinement.convergence(increments, [&now, last], first.as_ref());
                if found.is_last {
                    self.warn_of_refinement(refinement, increments, &found, wear_step);
                    let both = now.rate.iter().zip(&last.rate);
                    let relative = |(now, last): (&f64, &f64)| match now.max(*last) {
                        larger if larger > 0.0 => (now - last) / larger,
                        _ => 0.0,
                    };
                    let change = both.map(relative);
                    return Ok(Some(RefinedCycle {
                        change: change.collect(),
                        wear: now,
                        increments,
                        agrees_with_coupled: found.agrees_with_coupled,
                    }));
                }
            }
            (coarser, last) = (wear, Some(now));
        }
    }

    /// Warns if the last refinement still changes the corrected wear by more than the tolerance. Does not warn if the
    /// number of increments is given, or if the wear agrees with the coupled cycle. Does not warn either if the
    /// previous resolved cycle already had the largest number of increments.
    fn warn_of_refinement(
        &mut self,
        refinement: &Refinement,
        increments: usize,
        found: &Convergence,
        wear_step: &WearStepState,
    ) {
        let most = max_increments(refinement.closed);
        let known = wear_step.path_correction.as_ref().is_some_and(|before| before.increments >= most);
        let corrects = refinement.settings.correction != Correction::Never;
        let given = refinement.settings.increments.is_some();
        let tolerance = refinement.settings.tolerance;
        if found.change <= tolerance || !corrects || found.agrees_with_coupled || known || given {
            return;
        }
        self.result.warnings.push(format!(
            "step \"{}\": the wear of the cycle that was resolved after {} cycles, with {increments} increments per stroke, has an estimated error of {}, more than wear.tolerance = {:e}. The estimated errors of the results include it; accept it, or increase wear.tolerance",
            self.step().name,
            wear_step.cycles_at(refinement.coupled.completed),
            percent(found.change),
            tolerance
        ));
    }

    /// Computes wear and dissipation of a cycle at the wear depth of the coupled cycle. `None`, with a warning, if an
    /// increment does not converge.
    fn resolved_cycle(
        &mut self,
        refinement: &Refinement,
        increments: usize,
        wear_step: &mut WearStepState,
        start: &mut ResolvedStart,
    ) -> Advance<Option<CycleWear>> {
        let coupled = refinement.coupled;
        let path = refinement
            .path
            .refined(&ClosedPath { increments, ..*refinement.closed }, coupled.slip.slip_spread_share);
        let (loads, _) = self.loads_at(wear_step, coupled.completed / self.cycles().count);
        let options = stroke_options(&self.options);
        let strokes = Strokes { path: &path, loads, wear_depth: &coupled.wear_depth, options: &options };
        let tolerance = SETTLING.tolerance_share * refinement.settings.tolerance;
        let tolerance = refinement.repeats(increments).then_some(tolerance);
        let wear = self.repeated_cycle(&strokes, refinement.areas, tolerance, wear_step, start)?;
        if wear.is_none() {
            self.result.warnings.push(format!(
                "step \"{}\": after {} cycles of the run, an increment of the resolved cycle did not converge. The wear then follows from the reversal points and earlier resolved cycles, without an estimate of the error due to the path between reversal points",
                self.step().name, wear_step.cycles_at(coupled.completed)
            ));
        }
        Ok(wear)
    }
}

pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.01 { "less than 0.01 %".to_owned() } else { format!("{percent:.2} %") }
}
