//! Runs a plan from coarse to fine until its results are as accurate as it asks for; the last run writes the files.

use std::path::PathBuf;
use std::time::Instant;

use super::compute::{Job, compute, refused};
use super::fork::Shares;
use crate::error::exit;
use crate::history::record::IncrementRecord;
use crate::results::output::OutputDir;
use crate::results::summary::{Status, Summary};
use crate::scene::Plan;
use crate::scene::keys::solver::Output;
use crate::study::Failure;
use crate::study::accuracy::{Levels, Next, Search};

/// Why a run of which the estimates stay above the accuracy did not converge.
pub const REASON: &str = "accuracy";

/// Runs the plan into `output`, if there is one, and completes `summary`, once if it asks for no accuracy; the exit code, or the failure that ended it.
pub fn run(
    plan: &Plan,
    output: Option<OutputDir>,
    summary: &mut Summary,
    job: Job<'_>,
) -> Result<u8, Failure> {
    match Search::new(plan) {
        Ok(None) => compute(plan, output, summary, job),
        Ok(Some(search)) => {
            let directory = output.as_ref().map(|output| output.path().to_owned());
            let base = summary.clone();
            let mut way = Way { search, base, output, directory, summary, job, written: None };
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
    directory: Option<PathBuf>,
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
            shares: Shares::default(),
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
        let output = match (self.output.take(), &self.directory) {
            (None, Some(directory)) => {
                let again = OutputDir::open(directory);
                Some(again.map_err(|error| Failure { error, key: String::new() })?)
            }
            (output, _) => output,
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
            shares: Shares::default(),
            complete: &mut complete,
        };
        let code = compute(&plan, output, self.summary, job);
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
