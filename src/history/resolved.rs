//! What happens between the ends of a cycle: strokes in many increments give the wear of each cell over that by the slip from end
//! to end, and are resolved again only when that slip has changed (docs/theory-wear.md).

use serde::{Deserialize, Serialize};

use crate::contact::Iterate;
use crate::contact::solver::Stop;
use crate::error::Result;
use crate::frame::grid::spread;

use super::Run;
use super::cycling::{Cycling, Way};
use super::increments::{Stage, mean_square};
use super::loops::Place;
use super::record::Observer;
use super::ring::Course;
use super::step::{Closed, CycleMotion, Cycles, Step};

/// Increments of a stroke, at most, or four times those between the ends.
const MOST: usize = 64;

/// Wear of a cell by the slip from end to end over the largest below which it says nothing.
const NOTHING: f64 = 1e-6;

/// Wear of a cell over that by the slip from end to end, at most.
const MOST_FACTOR: f64 = 4.0;

/// Share that factors may change by on the way to the middle of a jump.
const SWING: f64 = 0.1;

/// A cycle that was resolved, beside the slip from end to end.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Resolved {
    /// Its wear over that by the slip from end to end, as it is expected in the middle of the next jump, `[N]`.
    pub factors: Vec<f64>,
    /// The same as it was found.
    found: Vec<f64>,
    /// Its change per cycle since the one before, `[N]`.
    slope: Vec<f64>,
    /// Cycles of the step before it.
    done: f64,
    /// Its dissipation likewise.
    pub power_factor: f64,
    /// Increments per stroke.
    pub increments: usize,
    /// Whether no jump has followed yet.
    pub fresh: bool,
    /// Slip from end to end then, `[E, 2, N]`, mm.
    slip: Vec<f64>,
    /// Worn depth then, `[N]`, mm.
    worn: Vec<f64>,
    /// What more increments might change of it, relative, `[N]`.
    doubt: Vec<f64>,
    /// Share of its worn volume that no factor stands for.
    missed: f64,
}

/// Wear (`[N]`, mm) and dissipation of a cycle.
#[derive(Clone)]
struct Wear {
    rate: Vec<f64>,
    power: f64,
}

impl Wear {
    /// The limit of first order of this one and one in half as many increments.
    fn beyond(&self, coarser: &Self) -> Self {
        let rate = self.rate.iter().zip(&coarser.rate).map(|(fine, coarse)| (2.0 * fine - coarse).max(0.0));
        Self { rate: rate.collect(), power: 2.0 * self.power - coarser.power }
    }
}

/// Wear of a cycle that more increments change little.
struct Refined {
    wear: Wear,
    /// Its last change, relative, `[N]`.
    doubt: Vec<f64>,
    /// Increments per stroke.
    increments: usize,
}

impl Resolved {
    /// Extrapolates the factors to the middle of a jump after `done` cycles of the step.
    pub fn aim(&mut self, done: f64, length: f64) {
        let ahead = done + 0.5 * length - self.done;
        for ((factor, found), slope) in self.factors.iter_mut().zip(&self.found).zip(&self.slope) {
            *factor = (found + slope * ahead).clamp((1.0 - SWING) * found, (1.0 + SWING) * found);
        }
    }

    /// The same on a larger frame; `places`: the number of each cell there.
    pub fn onto(self, places: &[usize], n: usize) -> Self {
        Self {
            factors: spread(&self.factors, places, n, |_| 1.0),
            found: spread(&self.found, places, n, |_| 1.0),
            slope: spread(&self.slope, places, n, |_| 0.0),
            slip: spread(&self.slip, places, n, |_| 0.0),
            worn: spread(&self.worn, places, n, |_| 0.0),
            doubt: spread(&self.doubt, places, n, |_| 0.0),
            ..self
        }
    }
}

impl Run<'_> {
    /// Resolves the cycle at the worn depth of the state if the slip from end to end has changed by more than the tolerance since it
    /// was; factors and rates of `cycling` follow. Where increments do not converge they stay as they were.
    ///
    /// # Errors
    /// If a body cannot be solved.
    pub(super) fn follow_path(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        cycling: &mut Cycling,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let (Way::Round(course), CycleMotion::Closed(closed)) = (&cycling.way, &cycles.motion) else {
            return Ok(());
        };
        let (Some(tolerance), true) = (closed.resolve, step.wear && self.prepared.intensity.is_some()) else {
            return Ok(());
        };
        // A run that is taken up here has not evaluated its ends yet.
        let worn = self.state.worn.clone();
        self.ends_problem(step, cycling, &worn, cycling.reported_end()).evaluate(&mut cycling.ring.it);
        let before = cycling.resolved.as_ref();
        let slip = &cycling.ring.it.slip;
        if before.is_some_and(|before| self.slip_change(&cycling.ring.it, &before.slip) <= tolerance) {
            return Ok(());
        }
        let (course, slip) = (course.clone(), slip.clone());
        let by_ends =
            Wear { rate: cycling.ring.it.wear_rate.clone(), power: cycling.power / cycling.power_factor() };
        let way = (&course, closed, tolerance);
        let Some(Refined { wear, doubt, increments }) =
            self.refine(step, cycles, way, (cycling, &by_ends), observer)?
        else {
            return Ok(());
        };
        let (factors, missed) = self.factors(&wear.rate, &by_ends.rate);
        let told = cycling.resolved.as_ref().is_some_and(|before| before.missed > tolerance);
        if missed > tolerance && !told {
            self.result.warnings.push(format!(
                "step \"{}\": after {} cycles {:.2} % of the wear is in cells whose slip from end to end does not show it; it is left out, and \
                 in `worn_volume_error`. A number instead of `increments = \"auto\"` (4 or more) puts ends in between",
                step.name,
                self.state.cycles_done,
                100.0 * missed
            ));
        }
        let done = cycling.done;
        let slope = match &cycling.resolved {
            Some(before) if done > before.done => {
                self.note_drift(&factors, before);
                let change = factors.iter().zip(&before.found);
                change.map(|(now, found)| (now - found) / (done - before.done)).collect()
            }
            _ => vec![0.0; factors.len()],
        };
        let rates = by_ends.rate.iter().zip(&factors).map(|(rate, factor)| rate * factor);
        cycling.rate.iter_mut().zip(rates).for_each(|(to, rate)| *to = rate);
        let power_factor = if by_ends.power > 0.0 { wear.power / by_ends.power } else { 1.0 };
        cycling.power = by_ends.power * power_factor;
        let found = factors.clone();
        cycling.resolved = Some(Resolved {
            factors,
            found,
            slope,
            done,
            power_factor,
            increments,
            fresh: true,
            slip,
            worn,
            doubt,
            missed,
        });
        Ok(())
    }

    /// Cycles in ever more increments until they wear the same within the tolerance; `None` if one is not found.
    fn refine(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (course, closed, tolerance): (&Course, &Closed, f64),
        (cycling, by_ends): (&mut Cycling, &Wear),
        observer: &mut dyn Observer,
    ) -> Result<Option<Refined>> {
        // Polygons in an ellipse are of first order, all along it.
        let extrapolates = closed.amplitude[1] != 0.0;
        let begin = cycling
            .resolved
            .as_ref()
            .map_or(1, |before| before.increments / if extrapolates { 8 } else { 4 });
        let mut increments = begin.max(closed.increments);
        let mut coarser = if increments == closed.increments && !extrapolates {
            Wear { rate: by_ends.rate.clone(), power: by_ends.power }
        } else {
            let way = (course, closed, increments);
            let Some(wear) = self.resolved_cycle(step, cycles, way, cycling, observer)? else {
                return Ok(None);
            };
            wear
        };
        let mut last: Option<Wear> = (!extrapolates).then(|| coarser.clone());
        loop {
            increments *= 2;
            let way = (course, closed, increments);
            let Some(wear) = self.resolved_cycle(step, cycles, way, cycling, observer)? else {
                return Ok(None);
            };
            let limit = if extrapolates { wear.beyond(&coarser) } else { wear.clone() };
            if let Some(last) = &last {
                let (change, most) = (self.apart(&limit.rate, &last.rate), MOST.max(4 * closed.increments));
                if change <= tolerance || increments >= most {
                    // Once, not in every jump.
                    let told = cycling.resolved.as_ref().is_some_and(|before| before.increments >= most);
                    if change > tolerance && !told {
                        self.result.warnings.push(format!(
                            "step \"{}\": after {} cycles the wear of a cycle in {increments} increments per stroke still differs by {:.2} % \
                             of its largest from that in half as many; the difference is in the estimated errors",
                            step.name,
                            self.state.cycles_done,
                            100.0 * change
                        ));
                    }
                    let both = limit.rate.iter().zip(&last.rate);
                    let doubt =
                        both.map(|(now, last)| if *now > 0.0 { 1.0 - last / now } else { 0.0 }).collect();
                    return Ok(Some(Refined { wear: limit, doubt, increments }));
                }
            }
            (coarser, last) = (wear, Some(limit));
        }
    }

    /// Wear and dissipation of a cycle in some increments per stroke, at the worn depth of the state; `None` if one is not found.
    fn resolved_cycle(
        &mut self,
        step: &Step,
        cycles: &Cycles,
        (coarse, closed, increments): (&Course, &Closed, usize),
        cycling: &mut Cycling,
        observer: &mut dyn Observer,
    ) -> Result<Option<Wear>> {
        let course = coarse.resolved(&Closed { increments, ..*closed });
        let (loads, _) = self.loads_in_cycles(step, cycling, cycling.done / cycles.count);
        let (worn, options) = (self.state.worn.clone(), self.stroke_options());
        let part = cycling.done / cycles.count;
        let stage = Stage { name: &step.name, from: part, to: part };
        let mut place = Place::of(&cycling.ring.it, coarse.half());
        let n = worn.len();
        let mut wear = Wear { rate: vec![0.0; n], power: 0.0 };
        // What comes before the first stroke back is forgotten but for cells that stick.
        let up = (increments + 1..=2 * increments).map(|end| (end % (2 * increments), false));
        let round = (1..=2 * increments).map(|end| (end % (2 * increments), true));
        for (end, counts) in up.chain(round) {
            let way = (&course, end, loads);
            let pressures = place.it.tractions[2 * n..].to_vec();
            let (next, report, checks) =
                self.stroke_at(step, way, (&worn, &options), place, (&mut *observer, &stage))?;
            cycling.ring.spend(&report);
            if report.stop != Stop::Converged {
                if report.stop != Stop::Interrupted {
                    self.result.warnings.push(format!(
                        "step \"{}\": after {} cycles an increment of the resolved cycle did not converge; wear goes on by the slip \
                         from end to end and what was resolved before",
                        step.name, self.state.cycles_done
                    ));
                }
                return Ok(None);
            }
            if counts {
                for (i, (sum, path)) in wear.rate.iter_mut().zip(&next.it.wear_path).enumerate() {
                    *sum += 0.5 * (pressures[i] + next.it.tractions[2 * n + i]) * path;
                }
                wear.power += checks.dissipation;
            }
            place = next;
        }
        Ok(Some(wear))
    }

    /// Root mean square of the change of the slip from end to end over that of the slip, over the cells in contact at any end.
    fn slip_change(&self, it: &Iterate, before: &[f64]) -> f64 {
        let n = self.prepared.n();
        let (touching, areas) = (self.touching(it), &self.prepared.model.frame.areas);
        let (mut change, mut sum) = (0.0, 0.0);
        for (k, (now, before)) in it.slip.iter().zip(before).enumerate().filter(|(k, _)| touching[k % n]) {
            change += areas[k % n] * (now - before).powi(2);
            sum += areas[k % n] * now * now;
        }
        if sum > 0.0 { (change / sum).sqrt() } else { 0.0 }
    }

    /// Root mean square of the difference of two rates over the cells that wear, over the largest of the first.
    fn apart(&self, rate: &[f64], other: &[f64]) -> f64 {
        let areas = &self.prepared.model.frame.areas;
        let difference: Vec<f64> = rate.iter().zip(other).map(|(rate, other)| rate - other).collect();
        let largest = rate.iter().copied().fold(0.0, f64::max);
        if largest > 0.0 { mean_square(&difference, areas, |i| rate[i] > 0.0) / largest } else { 0.0 }
    }

    /// The wear of a cycle over that by the slip from end to end, `[N]`, and the share of the worn volume that they leave out.
    fn factors(&self, wear: &[f64], by_ends: &[f64]) -> (Vec<f64>, f64) {
        let areas = &self.prepared.model.frame.areas;
        let volume = |rates: &[f64]| rates.iter().zip(areas).map(|(rate, area)| rate * area).sum::<f64>();
        let [all, all_by_ends] = [wear, by_ends].map(volume);
        if all <= 0.0 || all_by_ends <= 0.0 {
            return (vec![1.0; wear.len()], 0.0);
        }
        let least = NOTHING * by_ends.iter().copied().fold(0.0, f64::max);
        let factor = |(wear, by_ends): (&f64, &f64)| {
            if *by_ends > least {
                (wear / by_ends).min(MOST_FACTOR)
            } else {
                (all / all_by_ends).min(MOST_FACTOR)
            }
        };
        let factors: Vec<f64> = wear.iter().zip(by_ends).map(factor).collect();
        let covered: Vec<f64> = by_ends.iter().zip(&factors).map(|(rate, factor)| rate * factor).collect();
        (factors, 1.0 - volume(&covered) / all)
    }

    /// Adds to the estimated errors what is not known of the path that has worn `by` (`[N]`, mm) in a jump.
    pub(super) fn note_doubt(&mut self, resolved: &Resolved, by: &[f64]) {
        let areas = &self.prepared.model.frame.areas;
        let (mut volume, mut all) = (0.0, 0.0);
        for (i, by) in by.iter().enumerate() {
            let error = resolved.doubt[i] * by;
            self.state.depth_errors[i] += error.abs();
            volume += areas[i] * error;
            all += areas[i] * by;
        }
        self.state.volume_error += volume.abs() + resolved.missed.abs() * all.abs();
    }

    /// Adds to the estimated errors what the factors of the jumps since they were found, less the mean of those then and now, make of
    /// the depth worn meanwhile.
    fn note_drift(&mut self, factors: &[f64], before: &Resolved) {
        let areas = &self.prepared.model.frame.areas;
        let mut volume = 0.0;
        for i in 0..factors.len() {
            let by = self.state.worn[i] - before.worn[i];
            if before.factors[i] > 0.0 {
                let mean = 0.5 * (factors[i] + before.found[i]);
                let error = (mean / before.factors[i] - 1.0) * by;
                self.state.depth_errors[i] += error.abs();
                volume += areas[i] * error;
            }
        }
        self.state.volume_error += volume.abs();
    }
}
