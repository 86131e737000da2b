//! Adaptive accuracy: runs of a plan are refined until the estimated errors of the requested results are small enough.
//!
//! [`AccuracySearch`] refines increments, then jumps, then cells. Increments and jumps are refined on coarse cells,
//! because their errors hardly depend on the cells. The sum of the errors of these parameters is compared with the
//! accuracy. [`run()`] performs the runs.

mod convergence;
mod levels;
mod run;
pub mod size_field;
mod values;

use crate::adaptive::convergence::{Convergence, limit};
pub use crate::adaptive::levels::Levels;
use crate::adaptive::levels::RefinementLadder;
pub use crate::adaptive::run::run;
use crate::adaptive::values::{TargetValue, min_contact_cells, values};
use crate::error::Error;
use crate::evolution::records::IncrementRecord;
use crate::laws::wear::WearLaw;
use crate::output::accuracy::{AccuracyRecord, EstimatedResult, RefinementRun};
use crate::scene::plan::{AccuracyPlan, Plan};
use crate::scene::spec::accuracy::{AccuracyQuantity, RefinementParameter};
use crate::simulation::failure::SceneError;

/// Share of the accuracy that increments and jumps may each use if cells are refined as well.
const PATH_TOLERANCE_SHARE: f64 = 0.3;

/// Smallest number of runs for a parameter. Two runs suffice if the errors are below `UNCHANGED_SHARE` of the accuracy.
const MIN_RUNS_PER_PARAMETER: usize = 3;
const UNCHANGED_SHARE: f64 = 0.05;

/// Number of successive changes of a value without a decrease after which the value counts as divergent.
const MAX_GROWING_CHANGES: usize = 3;

#[derive(Debug, Clone)]
struct MeasuredRun {
    levels: Levels,
    values: Vec<TargetValue>,
    /// Relative error of the outline area (see [`RefinementLadder::outline_area_error`]).
    outline_area_error: Option<f64>,
    seconds: f64,
}

/// Relative error of the load of a punch, divided by the relative error of the total area of its cells.
const LOAD_ERROR_PER_AREA_ERROR: f64 = 0.5;

/// Largest ratio of predicted error to allowed error with which a run writes files. Files that a later run replaces
/// cost less than another run.
const WRITE_FILES_FACTOR: f64 = 2.0;

/// Next action of the search.
#[derive(Debug, Clone, PartialEq)]
pub enum NextRun {
    /// Runs at these levels. The flag states whether this run is probably the last one.
    Run(Levels, bool),
    /// Ends the search. The run at these levels is the result.
    Done(Levels),
}

/// Search for the levels of refinement at which the results reach the requested accuracy.
pub struct AccuracySearch<'p> {
    plan: &'p Plan,
    spec: &'p AccuracyPlan,
    ladder: RefinementLadder,
    knobs: Vec<RefinementParameter>,
    samples: Vec<MeasuredRun>,
    /// For each parameter refined so far, indices of its runs in `samples`.
    refinements: Vec<Vec<usize>>,
    /// Levels at which the next parameter starts if the previous one did not reach the accuracy.
    base: Option<Levels>,
    stop_reason: Option<String>,
}

impl<'p> AccuracySearch<'p> {
    /// Creates a search for the accuracy that `plan` requests. `None` if `plan` requests no accuracy.
    ///
    /// # Errors
    /// If there is nothing to refine, or the plan cannot be computed. If only the accuracy of the wear volume is requested, but the
    /// plan has no wear.
    pub fn new(plan: &'p Plan) -> Result<Option<Self>, SceneError> {
        let Some(spec) = &plan.accuracy else { return Ok(None) };
        if plan.wear == WearLaw::None && spec.quantities == [AccuracyQuantity::WornVolume] {
            let error = Error::input(
                "the accuracy of the wear volume is requested, but the scene has no wear: add [wear], or request other quantities",
            );
            return Err(SceneError { error, key: "accuracy.of".to_owned() });
        }
        let ladder = RefinementLadder::new(plan, spec)?;
        let knobs = ladder.knobs();
        if knobs.is_empty() {
            let error = Error::input(
                "`accuracy` has nothing to refine: the cells belong to a mesh or are kept, and increments and jumps have no effect or are kept. Remove `accuracy`, or shorten accuracy.keep (`orthowear refine` estimates the error of meshes)",
            );
            return Err(SceneError { error, key: "accuracy".to_owned() });
        }
        let (samples, refinements) = (Vec::new(), Vec::new());
        Ok(Some(Self { plan, spec, ladder, knobs, samples, refinements, base: None, stop_reason: None }))
    }

    /// Refinement parameters, in the order of refinement.
    pub fn knobs(&self) -> &[RefinementParameter] {
        &self.knobs
    }

    /// Plan with the settings of `levels`.
    pub fn plan(&self, levels: &Levels) -> Plan {
        self.ladder.plan(self.plan, levels)
    }

    /// Description of levels, for example "60 x 60 cells, 4 times the increments".
    pub fn describe(&self, levels: &Levels) -> String {
        self.ladder.describe(levels)
    }

    /// Levels of the last run that was added.
    pub fn last(&self) -> Option<Levels> {
        self.samples.last().map(|sample| sample.levels)
    }

    /// Adds the records of a converged run. `cell` is the area of a cell if the frame is a grid, and `seconds` is the
    /// time of the run.
    pub fn add_run(&mut self, levels: Levels, records: &[IncrementRecord], cell: Option<f64>, seconds: f64) {
        let cells = cell.map_or(usize::MAX, |cell| min_contact_cells(self.plan, records, cell));
        let outline_area_error = self.ladder.outline_area_error(self.plan, &levels);
        let punch = self.ladder.outline_cell_area(self.plan, outline_area_error);
        self.samples.push(MeasuredRun {
            levels,
            values: values(self.plan, records, punch),
            outline_area_error,
            seconds,
        });
        let number = self.samples.len() - 1;
        if self.refinements.is_empty() {
            let coarse = self.knobs.contains(&RefinementParameter::Cells) && !self.ladder.resolves(cells);
            if !coarse || self.ladder.is_last(RefinementParameter::Cells, &levels) {
                self.refinements.push(vec![number]);
            }
        } else if let Some(turn) = self.refinements.last_mut() {
            turn.push(number);
        }
        while self.refinements.last().is_some_and(|turn| self.is_finished(self.refinements.len() - 1, turn))
            && self.refinements.len() < self.knobs.len()
        {
            let index = self.refinements.len() - 1;
            if !self.meets_tolerance(index, &self.refinements[index]) {
                // This parameter cannot reach the accuracy, so later runs restart from coarser levels to save time.
                self.base = Some(levels.coarser(self.knobs[index]));
                self.refinements.push(Vec::new());
                break;
            }
            self.refinements.push(vec![number]);
        }
        if let Some(value) = self.diverging_value() {
            self.stop_reason = Some(self.divergence_message(value));
        }
    }

    /// Index of a value that diverges: its last [`MAX_GROWING_CHANGES`] changes have one direction, do not decrease and
    /// are larger than allowed.
    fn diverging_value(&self) -> Option<usize> {
        let index = self.refinements.len().checked_sub(1)?;
        let refinement = &self.refinements[index];
        let first = refinement.len().checked_sub(MAX_GROWING_CHANGES + 1)?;
        let last = self.samples.last()?;
        (0..last.values.len()).find(|&value| {
            let (_, values) = self.convergence_data(&refinement[first..], self.knobs[index], value);
            let changes: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
            let grows = |pair: &[f64]| pair[0] * pair[1] > 0.0 && pair[1].abs() >= pair[0].abs();
            let scale = last.values[value].scale;
            changes.windows(2).all(grows)
                && changes[0].abs() > self.allowed(index, value) * scale
                && scale > 0.0
        })
    }

    fn divergence_message(&self, value: usize) -> String {
        let found = &self.samples[self.samples.len() - 1].values[value];
        let before = &self.samples[self.samples.len() - 2].values[value];
        let rest: Vec<String> = self
            .spec
            .quantities
            .iter()
            .filter(|quantity| {
                let values = &self.samples[self.samples.len() - 1].values;
                **quantity != found.quantity && values.iter().any(|value| value.quantity == **quantity)
            })
            .map(|quantity| format!("\"{}\"", quantity.key()))
            .collect();
        let cells = self.knobs[self.refinements.len() - 1] == RefinementParameter::Cells;
        let cause =
            if cells { ", as at a sharp edge or at an edge that the cells do not resolve" } else { "" };
        let remedy = if rest.is_empty() {
            "request the accuracy of another quantity (accuracy.of)".to_owned()
        } else {
            format!("exclude it with accuracy.of = [{}]", rest.join(", "))
        };
        format!(
            "{} of step \"{}\" does not converge: its change has not decreased in {MAX_GROWING_CHANGES} rounds and was {:.1} % in the last{cause}; {remedy}",
            found.name,
            found.step,
            100.0 * (found.value - before.value).abs() / found.scale
        )
    }

    /// Message if the search ended at the finest level without reaching the accuracy; `None` otherwise.
    fn finest_level_message(&self) -> Option<String> {
        let knob = self.knobs[self.refinements.len().checked_sub(1)?];
        let last = self.samples.last()?;
        let ends = matches!(self.next_run(), NextRun::Done(_)) && self.ladder.is_last(knob, &last.levels);
        (ends && !self.is_met()).then(|| {
            format!(
                "no finer {} are tried than {}: request an accuracy that the estimated errors reach",
                knob.label(),
                self.describe(&last.levels)
            )
        })
    }

    /// Message about the last run. It states the largest estimated error due to the parameter that is being refined.
    pub fn round_message(&self) -> Option<String> {
        let index = self.refinements.len().checked_sub(1)?;
        let (refinement, knob) = (&self.refinements[index], self.knobs[index]);
        let last = self.samples.last()?;
        let errors = self.errors(refinement, knob, &last.levels)?;
        let worst = (0..errors.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]))?;
        let value = &last.values[worst];
        Some(format!(
            "{}: the largest estimated error due to the {} is {:.1e} ({} of step \"{}\"); {:.1e} is requested",
            self.describe(&last.levels),
            knob.label(),
            errors[worst],
            value.name,
            value.step,
            self.spec.relative
        ))
    }

    /// Stops the refinement after a failed run, for the reason `why`. Returns false if no earlier run has a result.
    pub fn stop_refining(&mut self, why: String) -> bool {
        self.stop_reason = Some(why);
        !self.samples.is_empty()
    }

    /// Next action of the search.
    pub fn next_run(&self) -> NextRun {
        let Some(last) = self.samples.last() else { return NextRun::Run(self.ladder.first(), false) };
        if self.stop_reason.is_some() {
            return NextRun::Done(last.levels);
        }
        let Some(turn) = self.refinements.last() else {
            return NextRun::Run(last.levels.finer(RefinementParameter::Cells), false);
        };
        let (index, knob) = (self.refinements.len() - 1, self.knobs[self.refinements.len() - 1]);
        if self.is_finished(index, turn) {
            return NextRun::Done(last.levels);
        }
        if turn.is_empty() {
            return NextRun::Run(self.base.unwrap_or(last.levels), false);
        }
        let levels = last.levels.finer(knob);
        let at_end = self.refinements.len() == self.knobs.len();
        let foreseen = self.errors(turn, knob, &levels).unwrap_or_default();
        let halved: Vec<f64> = foreseen.iter().map(|error| error / WRITE_FILES_FACTOR).collect();
        let likely = turn.len() + 1 >= MIN_RUNS_PER_PARAMETER && self.are_within_tolerance(index, &halved);
        NextRun::Run(levels, at_end && (likely || self.ladder.is_last(knob, &levels)))
    }

    /// Whether the last run reaches the accuracy.
    pub fn is_met(&self) -> bool {
        self.refinements.len() == self.knobs.len()
            && self.refinements.iter().enumerate().all(|(index, turn)| self.meets_tolerance(index, turn))
    }

    fn is_finished(&self, index: usize, turn: &[usize]) -> bool {
        let last = turn.last().map(|&number| self.samples[number].levels);
        self.meets_tolerance(index, turn)
            || last.is_some_and(|levels| self.ladder.is_last(self.knobs[index], &levels))
    }

    fn meets_tolerance(&self, index: usize, turn: &[usize]) -> bool {
        let Some(&last) = turn.last() else { return false };
        let Some(errors) = self.errors(turn, self.knobs[index], &self.samples[last].levels) else {
            return false;
        };
        self.are_within_tolerance(index, &errors)
            && (turn.len() >= MIN_RUNS_PER_PARAMETER
                || errors.iter().all(|error| *error <= UNCHANGED_SHARE * self.spec.relative))
    }

    fn are_within_tolerance(&self, index: usize, errors: &[f64]) -> bool {
        errors.iter().enumerate().all(|(value, error)| *error <= self.allowed(index, value))
    }

    /// Largest relative error that the parameter `index` may cause in the value `value`.
    fn allowed(&self, index: usize, value: usize) -> f64 {
        let whole = self.spec.relative;
        if index + 1 < self.knobs.len() {
            return if self.knobs.contains(&RefinementParameter::Cells) {
                PATH_TOLERANCE_SHARE * whole
            } else {
                whole / self.knobs.len() as f64
            };
        }
        let before =
            (0..index).filter_map(|other| self.error_contribution(other)).map(|errors| errors[value]);
        // The lower bound leaves a tolerance for the last parameter, even if the errors of the other parameters are
        // too large.
        (whole - before.sum::<f64>())
            .max((1.0 - PATH_TOLERANCE_SHARE * (self.knobs.len() - 1) as f64) * whole)
    }

    fn error_contribution(&self, index: usize) -> Option<Vec<f64>> {
        // Uses the levels of the last run, because a parameter that did not reach the accuracy may have been reset
        // to a coarser level.
        self.errors(self.refinements.get(index)?, self.knobs[index], &self.samples.last()?.levels)
    }

    /// Relative errors of all values at `levels`, estimated from the runs `turn` of the parameter `knob`. `None` for
    /// fewer than two runs.
    fn errors(&self, turn: &[usize], knob: RefinementParameter, levels: &Levels) -> Option<Vec<f64>> {
        if turn.len() < 2 {
            return None;
        }
        let size = self.ladder.size(knob, levels);
        let last = &self.samples[*turn.last()?];
        let stairs = if knob == RefinementParameter::Cells {
            LOAD_ERROR_PER_AREA_ERROR * last.outline_area_error.unwrap_or(0.0).abs()
        } else {
            0.0
        };
        let relative = |(value, wanted): (usize, &TargetValue)| {
            let (sizes, values) = self.convergence_data(turn, knob, value);
            let error = Convergence::estimate(&sizes, &values).error(size);
            // A value that is zero by symmetry has no error from the outline area.
            let stairs = if wanted.fills_outline && wanted.value != 0.0 { stairs } else { 0.0 };
            if wanted.scale > 0.0 { error / wanted.scale + stairs } else { 0.0 }
        };
        Some(last.values.iter().enumerate().map(relative).collect())
    }

    /// Sizes and values of the runs `turn` of the parameter `knob`. Values of a punch are corrected for the error of
    /// its cell area.
    fn convergence_data(
        &self,
        turn: &[usize],
        knob: RefinementParameter,
        value: usize,
    ) -> (Vec<f64>, Vec<f64>) {
        let of = |&number: &usize| {
            let sample = &self.samples[number];
            (
                self.ladder.size(knob, &sample.levels),
                sample.values[value].corrected_for_outline(sample.outline_area_error),
            )
        };
        turn.iter().map(of).unzip()
    }

    /// Accuracy of the last run, with the history of runs.
    pub fn record(&self) -> AccuracyRecord {
        let shares: Vec<Option<Vec<f64>>> =
            (0..self.knobs.len()).map(|index| self.error_contribution(index)).collect();
        let of_value = |(value, wanted): (usize, &TargetValue)| {
            let error = |knob: RefinementParameter| {
                let index = self.knobs.iter().position(|known| *known == knob)?;
                Some(shares[index].as_ref()?[value])
            };
            let by =
                [RefinementParameter::Cells, RefinementParameter::Increments, RefinementParameter::Jumps]
                    .map(error);
            let known = shares.iter().all(Option::is_some);
            let relative = known.then(|| by.iter().flatten().sum::<f64>());
            let turn = self.refinements.last().filter(|turn| turn.len() >= 2);
            let course =
                turn.map(|turn| self.convergence_data(turn, self.knobs[self.refinements.len() - 1], value));
            EstimatedResult {
                step: wanted.step.clone(),
                name: wanted.name,
                value: wanted.value,
                estimate: relative.map(|relative| relative * wanted.scale),
                relative,
                cell_error: by[0],
                increment_error: by[1],
                jump_error: by[2],
                order: course
                    .as_ref()
                    .and_then(|(sizes, values)| Convergence::estimate(sizes, values).order()),
                extrapolated: course.and_then(|(sizes, values)| limit(&sizes, &values)),
            }
        };
        let results = self
            .samples
            .last()
            .map_or(&[][..], |last| &last.values)
            .iter()
            .enumerate()
            .map(of_value)
            .collect();
        let tried = |sample: &MeasuredRun| {
            let plan = self.plan(&sample.levels);
            RefinementRun {
                cells: levels::cells(&plan),
                increment_factor: sample.levels.increments(),
                jump_setting: levels::jumps(&plan),
                seconds: sample.seconds,
                values: sample.values.iter().map(|value| value.value).collect(),
            }
        };
        AccuracyRecord {
            requested: self.spec.relative,
            quantities: self.spec.quantities.iter().map(|quantity| quantity.label()).collect(),
            met: self.is_met(),
            reason: self.stop_reason.clone().or_else(|| self.finest_level_message()),
            results,
            runs: self.samples.iter().map(tried).collect(),
        }
    }
}
