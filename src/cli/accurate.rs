//! Runs a plan from coarse to fine until its results are as accurate as it asks for; the last run writes the files.

use std::path::PathBuf;
use std::time::Instant;

use super::compute::{Job, compute, refused};
use super::exit;
use super::table::{align, short};
use crate::history::record::IncrementRecord;
use crate::results::accuracy::{AccuracyRecord, Estimated};
use crate::results::output::OutputDir;
use crate::results::summary::{Status, Summary};
use crate::scene::Plan;
use crate::scene::keys::solver::Output;
use crate::study::Failure;
use crate::study::accuracy::{Levels, Next, Search};

/// Why a run of which the estimates stay above the accuracy did not converge.
pub(super) const REASON: &str = "accuracy";

/// Results with estimates below this share of the accuracy are left out of the table.
const NOTHING: f64 = 1e-4;

/// Runs the plan into `output` and completes `summary`, once if it asks for no accuracy; the exit code, or the failure that ended it.
pub(super) fn compute_accurately(
    plan: &Plan,
    output: OutputDir,
    summary: &mut Summary,
    job: Job<'_>,
) -> Result<u8, Failure> {
    match Search::new(plan) {
        Ok(None) => compute(plan, Some(output), summary, job),
        Ok(Some(search)) => {
            let directory = output.path().to_owned();
            let base = summary.clone();
            let mut way = Way { search, base, output: Some(output), directory, summary, job, written: None };
            way.go()
        }
        Err(failure) => refused(output, summary, failure),
    }
}

/// How a run of the search ended.
enum Ended {
    Converged,
    Interrupted,
    /// With the reason.
    Failed(String),
}

/// The runs of a search.
struct Way<'a, 'j, 'p> {
    search: Search<'p>,
    base: Summary,
    output: Option<OutputDir>,
    directory: PathBuf,
    summary: &'a mut Summary,
    job: Job<'j>,
    /// Levels of the run whose files are there.
    written: Option<Levels>,
}

impl Way<'_, '_, '_> {
    fn go(&mut self) -> Result<u8, Failure> {
        loop {
            match self.search.next() {
                Next::Done(levels) if self.written == Some(levels) => return Ok(self.code()),
                // The same once more, with files.
                Next::Done(levels) => return self.with_files(levels),
                Next::Run(levels, false) => match self.without_files(levels) {
                    Ended::Converged => {}
                    Ended::Interrupted => return self.with_files(levels),
                    Ended::Failed(why) => {
                        if !self.search.stop(why) {
                            return self.with_files(levels);
                        }
                    }
                },
                Next::Run(levels, true) => {
                    let ended = self.with_files(levels);
                    let go_on = match &ended {
                        Ok(exit::INTERRUPTED) => false,
                        _ if self.search.last() == Some(levels) => true,
                        Ok(_) => self.search.stop(self.summary.reason.clone().unwrap_or_default()),
                        Err(failure) => self.search.stop(failure.error.to_string()),
                    };
                    if !go_on {
                        return ended;
                    }
                }
            }
        }
    }

    fn code(&self) -> u8 {
        if self.summary.status == Status::Converged { exit::DONE } else { exit::NOT_CONVERGED }
    }

    /// A run of which the estimates alone need something.
    fn without_files(&mut self, levels: Levels) -> Ended {
        let mut plan = self.search.plan(&levels);
        plan.output = Output { fields: Vec::new(), inside: Vec::new(), ..plan.output };
        plan.inside.clear();
        let mut own = self.base.clone();
        let search = &mut self.search;
        let words = search.words(&levels);
        let shown = &mut *self.job.show;
        let show = &mut |stage: &str, done, residual| shown(&format!("{words}: {stage}"), done, residual);
        let started = Instant::now();
        let mut complete = |records: &[IncrementRecord], summary: &mut Summary| {
            if summary.status == Status::Converged {
                search.take(levels, records, (cell_area(summary), started.elapsed().as_secs_f64()));
            }
            true
        };
        let job = Job {
            frame: None,
            show,
            watch: &mut *self.job.watch,
            stop: self.job.stop,
            checkpoints: None,
            complete: &mut complete,
        };
        match compute(&plan, None, &mut own, job) {
            Ok(exit::DONE) => Ended::Converged,
            Ok(exit::INTERRUPTED) => Ended::Interrupted,
            Ok(_) => Ended::Failed(own.reason.unwrap_or_default()),
            Err(failure) => Ended::Failed(failure.error.to_string()),
        }
    }

    /// A run whose files are the results, unless finer ones follow.
    fn with_files(&mut self, levels: Levels) -> Result<u8, Failure> {
        let plan = self.search.plan(&levels);
        let output = match self.output.take() {
            Some(output) => output,
            None => {
                OutputDir::open(&self.directory).map_err(|error| Failure { error, key: String::new() })?
            }
        };
        let again = self.search.last() == Some(levels);
        *self.summary = self.base.clone();
        let record = self.search.record();
        let coarser = record.runs.iter().map(|run| run.seconds).sum::<f64>();
        self.summary.timings.add("coarser runs", coarser);
        // For a run that ends before its own values are there.
        self.summary.accuracy = Some(record);
        let search = &mut self.search;
        let words = search.words(&levels);
        let shown = &mut *self.job.show;
        let show = &mut |stage: &str, done, residual| shown(&format!("{words}: {stage}"), done, residual);
        let started = Instant::now();
        let mut written = false;
        let mut complete = |records: &[IncrementRecord], summary: &mut Summary| {
            let converged = summary.status == Status::Converged;
            if converged && !again {
                search.take(levels, records, (cell_area(summary), started.elapsed().as_secs_f64()));
            }
            let record = search.record();
            if converged && !record.met {
                (summary.status, summary.reason) = (Status::NotConverged, Some(REASON.to_owned()));
            }
            summary.accuracy = Some(record);
            written = converged && search.next() == Next::Done(levels);
            written || !converged
        };
        let job = Job {
            frame: None,
            show,
            watch: &mut *self.job.watch,
            stop: self.job.stop,
            checkpoints: None,
            complete: &mut complete,
        };
        let code = compute(&plan, Some(output), self.summary, job);
        self.written = written.then_some(levels);
        code
    }
}

/// Area of a cell; `None` on frames without a grid.
fn cell_area(summary: &Summary) -> Option<f64> {
    let frame = summary.frame.as_ref()?;
    let side = |k: usize| 2.0 * frame.half_width[k] / frame.cells[k] as f64;
    Some(side(0) * side(1))
}

/// The accuracy as a person reads it.
pub(super) fn describe(record: &AccuracyRecord) -> String {
    let mut rows =
        vec![["step", "result", "value", "+-", "relative", "extrapolated"].map(str::to_owned).to_vec()];
    let matters =
        |result: &&Estimated| result.relative.is_none_or(|relative| relative > NOTHING * record.requested);
    for result in record.results.iter().filter(matters) {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.1e}"));
        rows.push(vec![
            result.step.clone(),
            result.name.to_owned(),
            digits(result.value, result),
            number(result.estimate),
            number(result.relative),
            result.extrapolated.map_or_else(String::new, |limit| digits(limit, result)),
        ]);
    }
    let last = record.runs.last();
    let cells =
        last.and_then(|run| run.cells).map(|[x, y]| format!(" with {x} x {y} cells")).unwrap_or_default();
    let times = last.filter(|run| run.increments > 1);
    let times = times.map(|run| format!(", {} times the increments", run.increments)).unwrap_or_default();
    let reached = if record.met { "reached" } else { "NOT REACHED, the last run that converged is one" };
    let n = record.runs.len();
    let plural = if n == 1 { "run" } else { "runs" };
    let of = record.of.join(", ");
    format!(
        "accuracy {:e} of {of}: {reached}{cells}{times}; {n} {plural}\n{}",
        record.requested,
        align(&rows)
    )
}

/// A value with a digit more than are estimated to be right.
fn digits(value: f64, result: &Estimated) -> String {
    let Some(estimate) = result.estimate.filter(|estimate| *estimate > 0.0) else {
        return short(value);
    };
    let places = (1.0 - estimate.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.places$}")
}
