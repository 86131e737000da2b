//! Resolved cycles, repeated until their wear is steady.

use std::ops::Range;

use crate::contact::solver::StopReason;
use crate::evolution::field_measures::volume;
use crate::evolution::fretting::cycle_increment::{IncrementStart, Strokes};
use crate::evolution::fretting::cycle_wear::CycleWear;
use crate::evolution::fretting::settings::{REFINEMENT, SETTLING, STICK_ZONE};
use crate::evolution::fretting::settling::Settling;
use crate::evolution::fretting::wear_step_state::WearStepState;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem};
use crate::evolution::records::{FrameState, Resultants};
use crate::evolution::run::{Advance, Run, RunEnd};
use crate::evolution::solve_work::SolveWork;
use crate::evolution::state;

/// Tangential gap at the - reversal point of a steady cycle, with the number of increments per stroke.
struct SteadyGap {
    increments: usize,
    /// `[2, N]`, mm.
    gap: Vec<f64>,
}

/// Start of the next resolved cycle at the - reversal point.
pub(super) struct ResolvedStart {
    state: IncrementStart,
    /// Last two cycles that were repeated until they were steady, the coarser one first.
    steady: [Option<SteadyGap>; 2],
    settling: Settling,
}

struct ResolvedStroke {
    /// State at the end of the stroke.
    end: IncrementStart,
    /// Wear depth, `[N]`, mm.
    depth: Vec<f64>,
    /// Dissipation, N mm.
    power: f64,
    resultants: Resultants,
    /// Fields at the end of the stroke, with the slip of the whole stroke.
    fields: FrameState,
}

/// Extrapolates the gap of two cycles, the coarser one first, to a cycle with `increments` per stroke. The difference
/// from the limit is assumed to be inversely proportional to the number of increments.
fn extrapolated_gap(coarser: &SteadyGap, finer: &SteadyGap, increments: usize) -> Vec<f64> {
    let [first, second, third] = [coarser.increments, finer.increments, increments].map(|k| 1.0 / k as f64);
    let share = (second - third) / (first - second);
    finer.gap.iter().zip(&coarser.gap).map(|(fine, coarse)| fine + share * (fine - coarse)).collect()
}

impl ResolvedStart {
    /// `may_drift`: whether the position of body 2 may change from cycle to cycle.
    pub fn new(state: IncrementStart, may_drift: bool) -> Self {
        Self { state, steady: [None, None], settling: Settling::new(may_drift) }
    }

    /// Start of cycles with `increments` per stroke.
    fn state_for(&self, increments: usize) -> IncrementStart {
        let mut state = self.state.clone();
        if let [Some(coarser), Some(finer)] = &self.steady
            && coarser.increments < finer.increments
        {
            state.reference = extrapolated_gap(coarser, finer, increments);
        }
        state
    }

    fn record_steady(&mut self, increments: usize) {
        let [_, last] = std::mem::take(&mut self.steady);
        self.steady = [last, Some(SteadyGap { increments, gap: self.state.reference.clone() })];
    }
}

impl ResolvedStroke {
    /// Change from the stroke `before`, relative to this stroke: the change of the wear volume, or a share of the sum over
    /// the cells if this is larger. Without wear it is the change of the dissipation.
    fn relative_change(&self, before: &Self, areas: &[f64]) -> f64 {
        let all = volume(&self.depth, areas);
        if all > 0.0 {
            let changes = self.depth.iter().zip(&before.depth).map(|(now, before)| now - before);
            let changes: Vec<f64> = changes.collect();
            let of_cells: f64 = changes.iter().zip(areas).map(|(change, area)| change.abs() * area).sum();
            volume(&changes, areas).abs().max(REFINEMENT.cell_change_share * of_cells) / all
        } else if self.power > 0.0 {
            (self.power - before.power).abs() / self.power
        } else {
            0.0
        }
    }
}

impl Run<'_> {
    /// Computes cycles from the - reversal point, and returns the wear of the last cycle whose increments all converge.
    /// On return, `start` is the state at the - reversal point in this cycle.
    ///
    /// Cycles are repeated until the estimated relative error of their wear is at most `tolerance`. `None` if one cycle
    /// suffices. `areas` are the areas of the cells, `[N]`, mm².
    pub(super) fn repeated_cycle(
        &mut self,
        strokes: &Strokes,
        areas: &[f64],
        tolerance: Option<f64>,
        wear_step: &mut WearStepState,
        start: &mut ResolvedStart,
    ) -> Advance<Option<CycleWear>> {
        let half = strokes.path.reversal_index();
        let (down, up) = (1..half + 1, half + 1..2 * half + 1);
        // After the first stroke, only sticking cells depend on the initial state.
        let begin = start.state_for(half);
        let Some(mut before) = self.resolved_stroke(strokes, up.clone(), begin, wear_step)? else {
            return Ok(None);
        };
        start.settling.restart(&before.end);
        let mut last = None;
        loop {
            let Some(back) = self.resolved_stroke(strokes, down.clone(), before.end.clone(), wear_step)?
            else {
                return Ok(last);
            };
            let Some(mut forth) = self.resolved_stroke(strokes, up.clone(), back.end.clone(), wear_step)?
            else {
                return Ok(last);
            };
            start.state = back.end;
            start.settling.advance(&forth.end);
            let change = forth.relative_change(&before, areas);
            let error = start.settling.remaining_sum() * change;
            let wear = CycleWear {
                rate: back.depth.iter().zip(&forth.depth).map(|(back, forth)| back + forth).collect(),
                power: back.power + forth.power,
                settling_error: error,
                reversals: [forth.resultants, back.resultants],
                body_drift: start.settling.body_drift,
                fields: Some(forth.fields.clone()),
            };
            let Some(tolerance) = tolerance else { return Ok(Some(wear)) };
            let is_steady = start.settling.is_comparable()
                && (error <= tolerance || change <= STICK_ZONE.stroke_tolerance);
            if is_steady || start.settling.cycles >= SETTLING.max_cycles {
                start.record_steady(half);
                return Ok(Some(wear));
            }
            start.settling.extrapolate(&mut forth.end.reference);
            (before, last) = (forth, Some(wear));
        }
    }

    /// Computes a stroke through `points` of the path. `None` if an increment does not converge.
    fn resolved_stroke(
        &mut self,
        strokes: &Strokes,
        points: Range<usize>,
        start: IncrementStart,
        wear_step: &mut WearStepState,
    ) -> Advance<Option<ResolvedStroke>> {
        // The span ends below the fraction 1, so the solver skips the check of the operator. Otherwise every
        // increment would repeat this check.
        let begun = wear_step.completed / self.cycles().count;
        let progress = ProgressSpan { name: &self.step().name, from: begun, to: begun };
        let from = start.reference.clone();
        let (mut end, mut power) = (start, 0.0);
        let mut depth = vec![0.0; strokes.wear_depth.len()];
        for point in points {
            let solved = self.solve_cycle_increment(strokes, point % strokes.path.len(), end, &progress)?;
            wear_step.uncharged_work += SolveWork::of(&solved.report);
            match solved.report.stop {
                StopReason::Converged => {}
                StopReason::Interrupted => return Err(RunEnd::Interrupted.into()),
                _ => return Ok(None),
            }
            end = solved.next;
            let by = self.worn_per_pass(&end.contact);
            depth.iter_mut().zip(&by).for_each(|(sum, by)| *sum += by);
            power += solved.checks.dissipation;
        }
        let (resultants, fields) = self.results_after_stroke(strokes, &end, &from);
        Ok(Some(ResolvedStroke { end, depth, power, resultants, fields }))
    }

    /// Resultants and fields at the end of a stroke. `from` is the tangential gap at its start, `[2, N]`, mm. The slip
    /// of the fields is the change of the gap since then.
    fn results_after_stroke(
        &self,
        &Strokes { wear_depth, options, .. }: &Strokes,
        end: &IncrementStart,
        from: &[f64],
    ) -> (Resultants, FrameState) {
        let laws = ActiveLaws { wear: false, ..ActiveLaws::of(self.step()) };
        let problem = increment_problem(&self.prepared, options, wear_depth, laws, Vec::new());
        let resultants = state::resultants(&self.prepared, &problem, &end.contact, 0);
        let mut fields = state::frame_state(&problem, &end.contact, 0, wear_depth);
        let slip = end.reference.iter().zip(from).map(|(end, start)| end - start);
        fields.slip.iter_mut().zip(slip).for_each(|(to, slip)| *to = slip);
        (resultants, fields)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the gap g + c/K of a cycle with K increments, for any ratios of three numbers of increments.
    #[test]
    fn gaps_are_extrapolated_over_the_refinement() {
        let steady = |increments: usize| SteadyGap {
            increments,
            gap: [1.0, -2.0].iter().zip([0.3, 0.7]).map(|(g, c)| g + c / increments as f64).collect(),
        };
        for [first, second, third] in [[8, 16, 32], [4, 8, 32], [8, 32, 64]] {
            let found = extrapolated_gap(&steady(first), &steady(second), third);
            for (found, wanted) in found.iter().zip(steady(third).gap) {
                assert!((found - wanted).abs() < 1e-15, "{found} {wanted}");
            }
        }
    }
}
