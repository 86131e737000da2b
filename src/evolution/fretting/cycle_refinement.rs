//! Refinement of a resolved cycle: the number of increments per stroke grows until the wear of the cycle changes
//! little.

use crate::contact::solver::StopReason;
use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_increment::{IncrementStart, Strokes, stroke_options};
use crate::evolution::fretting::cycle_state::CycleState;
use crate::evolution::fretting::cycle_wear::{CycleWear, relative_rms_difference, volume_difference};
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::path_correction::{CycleSlip, PathCorrection};
use crate::evolution::fretting::settings::REFINEMENT;
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem};
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;
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
        self.extrapolates() && self.closed.amplitude[1] != 0.0
    }

    fn max_increments(&self) -> usize {
        REFINEMENT.max_increments.max(4 * self.closed.increments)
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
            REFINEMENT.confirming_refinement.min(self.max_increments() / increments).max(2)
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
        let (corrects, most) = (self.settings.correction != Correction::Never, self.max_increments());
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
        let settled = !corrects || now.force_change(last) <= REFINEMENT.max_force_change;
        let suffices = self.is_refined(increments)
            && !is_open
            && settled
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
        // Each resolved cycle starts from a state of the previous, coarser cycle, so the tractions approach the
        // steady state.
        let mut start =
            IncrementStart::at_path_point(&coupled.cycle.contact, refinement.path.reversal_index());
        let mut coarser = if increments == refinement.closed.increments {
            coupled.wear.clone()
        } else {
            let Some(wear) = self.resolved_cycle(refinement, increments, wear_step, &mut start)? else {
                return Ok(None);
            };
            wear
        };
        let mut last: Option<CycleWear> = (!extrapolates).then(|| coarser.clone());
        let (mut once_before, mut first): (Option<CycleWear>, Option<Resolution>) = (None, None);
        loop {
            let ratio = refinement.next_ratio(increments, first.as_ref());
            increments = refinement.settings.increments.unwrap_or(ratio * increments);
            let Some(wear) = self.resolved_cycle(refinement, increments, wear_step, &mut start)? else {
                return Ok(None);
            };
            let once = if extrapolates { wear.extrapolated(&coarser, ratio as f64) } else { wear.clone() };
            let now = match &once_before {
                Some(before) if refinement.extrapolates_twice() => {
                    once.extrapolated(before, (ratio * ratio) as f64)
                }
                _ => once.clone(),
            };
            once_before = Some(once);
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
        let most = refinement.max_increments();
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

    /// Computes wear and dissipation of a cycle at the wear depth of the coupled cycle. `None` if an increment does not
    /// converge.
    ///
    /// `start` is the state at the - reversal point, where the cycle begins. On return, `start` is the state one cycle
    /// later.
    fn resolved_cycle(
        &mut self,
        refinement: &Refinement,
        increments: usize,
        wear_step: &mut WearStepState,
        start: &mut IncrementStart,
    ) -> Advance<Option<CycleWear>> {
        let (step, coupled) = (self.step(), refinement.coupled);
        let path = refinement
            .path
            .refined(&ClosedPath { increments, ..*refinement.closed }, coupled.slip.slip_spread_share);
        let (loads, _) = self.loads_at(wear_step, coupled.completed / self.cycles().count);
        let options = stroke_options(&self.options);
        // The span ends below the fraction 1, so the solver skips the check of the operator. Otherwise every
        // increment would repeat this check.
        let begun = wear_step.completed / self.cycles().count;
        let progress = ProgressSpan { name: &step.name, from: begun, to: begun };
        let strokes = Strokes { path: &path, loads, wear_depth: &coupled.wear_depth, options: &options };
        let (n, areas) = (coupled.wear_depth.len(), refinement.areas);
        let mut wear = CycleWear { rate: vec![0.0; n], ..CycleWear::default() };
        let (mut here, mut stroke_start, mut before) = (start.clone(), Vec::new(), [0.0; 3]);
        // Three strokes are solved, and the last two count. After the first stroke, only sticking cells depend on the
        // initial state. `drift` compares the wear volume of the last stroke with the first stroke.
        let up = (increments + 1..=2 * increments).map(|point| (point, false));
        let round = (1..=2 * increments).map(|point| (point, true));
        for (point, counts) in up.chain(round) {
            if (point - 1) % increments == 0 {
                stroke_start.clone_from(&here.reference);
            }
            let solved = self.solve_cycle_increment(&strokes, point % (2 * increments), here, &progress)?;
            wear_step.uncharged_work += SolveWork::of(&solved.report);
            if solved.report.stop == StopReason::Interrupted {
                return Err(RunEnd::Interrupted.into());
            }
            if solved.report.stop != StopReason::Converged {
                self.result.warnings.push(format!(
                        "step \"{}\": after {} cycles of the run, an increment of the resolved cycle did not converge. The wear then follows from the reversal points and earlier resolved cycles, without an estimate of the error due to the path between reversal points",
                        step.name, wear_step.cycles_at(coupled.completed)
                    ));
                return Ok(None);
            }
            here = solved.next;
            let depth = self.worn_per_pass(&here.contact);
            if counts {
                wear.rate.iter_mut().zip(&depth).for_each(|(sum, depth)| *sum += depth);
                wear.power += solved.checks.dissipation;
            }
            if point > increments {
                wear.drift += if counts { volume(&depth, areas) } else { -volume(&depth, areas) };
            }
            if counts && point % increments == 0 {
                self.record_reversal(
                    &strokes,
                    usize::from(point == increments),
                    &here,
                    &stroke_start,
                    &mut wear,
                );
            }
            if counts && point == increments {
                *start = here.clone();
            }
            if point == 2 * increments {
                wear.body_drift = [0, 1].map(|k| here.contact.rigid_motion[0][k] - before[k]);
                before = here.contact.rigid_motion[0];
            }
        }
        Ok(Some(wear))
    }

    /// Stores resultants and fields at a reversal point; `reversal` is 0 for +, 1 for -. `from` is the tangential gap
    /// at the start of the stroke, `[2, N]`, mm. The slip of the fields is the change of the gap since then.
    fn record_reversal(
        &self,
        strokes: &Strokes,
        reversal: usize,
        here: &IncrementStart,
        from: &[f64],
        wear: &mut CycleWear,
    ) {
        let &Strokes { wear_depth, options, .. } = strokes;
        let laws = ActiveLaws { wear: false, ..ActiveLaws::of(self.step()) };
        let problem = increment_problem(&self.prepared, options, wear_depth, laws, Vec::new());
        wear.reversals[reversal] = state::resultants(&self.prepared, &problem, &here.contact, 0);
        let mut fields = state::frame_state(&problem, &here.contact, 0, wear_depth);
        let slip = here.reference.iter().zip(from).map(|(end, start)| end - start);
        fields.slip.iter_mut().zip(slip).for_each(|(to, slip)| *to = slip);
        wear.fields = Some(fields);
    }
}

pub(super) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 0.01 { "less than 0.01 %".to_owned() } else { format!("{percent:.2} %") }
}
