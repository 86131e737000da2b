//! Runs a plan from coarse to fine until its results reach the requested accuracy. The last run writes the files.

use std::path::PathBuf;
use std::time::Instant;

use crate::adaptive::{AccuracySearch, Levels, NextRun};
use crate::error::exit;
use crate::evolution::records::Divergence;
use crate::evolution::records::IncrementRecord;
use crate::output::output_dir::OutputDir;
use crate::output::recorder::ProgressEvent;
use crate::output::summary::{Status, Summary};
use crate::scene::Plan;
use crate::scene::spec::solver::Output;
use crate::simulation::SceneError;
use crate::simulation::segments::{RunOptions, conclude_refused, run_simulation};

/// Runs the plan and writes its results to `output`, if given. Completes `summary` and returns the exit code. A plan
/// that requests no accuracy runs once.
pub fn run(
    plan: &Plan,
    output: Option<OutputDir>,
    summary: &mut Summary,
    job: RunOptions<'_>,
) -> Result<u8, SceneError> {
    match AccuracySearch::new(plan) {
        Ok(None) => run_simulation(plan, output, summary, job),
        Ok(Some(search)) => {
            let directory = output.as_ref().map(|output| output.path().to_owned());
            let base = summary.clone();
            let mut way = AccuracyRun { search, base, output, directory, summary, job, written: None };
            way.run_until_met()
        }
        Err(failure) => conclude_refused(output, summary, failure),
    }
}

enum Ended {
    Converged,
    Interrupted,
    Failed(String),
}

struct AccuracyRun<'a, 'j, 'p> {
    search: AccuracySearch<'p>,
    base: Summary,
    output: Option<OutputDir>,
    directory: Option<PathBuf>,
    summary: &'a mut Summary,
    job: RunOptions<'j>,
    written: Option<Levels>,
}

impl AccuracyRun<'_, '_, '_> {
    fn run_until_met(&mut self) -> Result<u8, SceneError> {
        loop {
            match self.search.next_run() {
                NextRun::Done(levels) if self.written == Some(levels) => return Ok(self.code()),
                // The run at these levels wrote no files, so it is repeated with output.
                NextRun::Done(levels) => return self.final_run(levels),
                NextRun::Run(levels, false) => match self.trial_run(levels) {
                    Ended::Converged => {}
                    Ended::Interrupted => return self.final_run(levels),
                    Ended::Failed(why) => {
                        if !self.search.stop_refining(why) {
                            return self.final_run(levels);
                        }
                    }
                },
                NextRun::Run(levels, true) => {
                    let ended = self.final_run(levels);
                    let go_on = match &ended {
                        Ok(exit::INTERRUPTED) => false,
                        _ if self.search.last() == Some(levels) => true,
                        Ok(_) => self.search.stop_refining(
                            self.summary.reason.map_or_else(String::new, |reason| reason.to_string()),
                        ),
                        Err(failure) => self.search.stop_refining(failure.error.to_string()),
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

    fn trial_run(&mut self, levels: Levels) -> Ended {
        let mut plan = self.search.plan(&levels);
        plan.output = Output { fields: Vec::new(), inside: Vec::new(), ..plan.output };
        plan.interior_requests.clear();
        let mut own = self.base.clone();
        let search = &mut self.search;
        let words = search.describe(&levels);
        let shown = &mut *self.job.on_progress;
        let on_progress = &mut |event: ProgressEvent| show_of_round(shown, &words, event);
        let started = Instant::now();
        let mut complete = |records: &[IncrementRecord], summary: &mut Summary| {
            if summary.status == Status::Converged {
                search.add_run(levels, records, cell_area(summary), started.elapsed().as_secs_f64());
            }
            true
        };
        let job = RunOptions {
            on_end: Some(&mut complete),
            ..RunOptions::new(on_progress, &mut *self.job.observer, self.job.stop)
        };
        let ended = run_simulation(&plan, None, &mut own, job);
        match ended {
            Ok(exit::DONE) => {
                self.show_estimate();
                Ended::Converged
            }
            Ok(exit::INTERRUPTED) => Ended::Interrupted,
            Ok(_) => Ended::Failed(own.reason.map_or_else(String::new, |reason| reason.to_string())),
            Err(failure) => Ended::Failed(failure.error.to_string()),
        }
    }

    /// Runs the plan at `levels` with output. The written files are the results unless finer runs follow.
    fn final_run(&mut self, levels: Levels) -> Result<u8, SceneError> {
        let plan = self.search.plan(&levels);
        let output = match (self.output.take(), &self.directory) {
            (None, Some(directory)) => {
                let again = OutputDir::open(directory);
                Some(again?)
            }
            (output, _) => output,
        };
        let again = self.search.last() == Some(levels);
        *self.summary = self.base.clone();
        let record = self.search.record();
        let coarser = record.runs.iter().map(|run| run.seconds).sum::<f64>();
        self.summary.timings.add("coarser runs", coarser);
        // If the run ends without values, the summary keeps the record of the earlier runs.
        self.summary.accuracy = Some(record);
        let search = &mut self.search;
        let words = search.describe(&levels);
        let shown = &mut *self.job.on_progress;
        let on_progress = &mut |event: ProgressEvent| show_of_round(shown, &words, event);
        let started = Instant::now();
        let mut written = false;
        let mut complete = |records: &[IncrementRecord], summary: &mut Summary| {
            let converged = summary.status == Status::Converged;
            if converged && !again {
                search.add_run(levels, records, cell_area(summary), started.elapsed().as_secs_f64());
            }
            let record = search.record();
            if converged && !record.met {
                (summary.status, summary.reason) = (Status::NotConverged, Some(Divergence::Accuracy));
            }
            summary.accuracy = Some(record);
            written = converged && search.next_run() == NextRun::Done(levels);
            written || !converged
        };
        let job = RunOptions {
            on_end: Some(&mut complete),
            ..RunOptions::new(on_progress, &mut *self.job.observer, self.job.stop)
        };
        let code = run_simulation(&plan, output, self.summary, job);
        self.written = written.then_some(levels);
        if !again && self.search.last() == Some(levels) {
            self.show_estimate();
        }
        code
    }

    fn show_estimate(&mut self) {
        if let Some(text) = self.search.round_message() {
            (self.job.on_progress)(ProgressEvent::Message(&text));
        }
    }
}

fn show_of_round(show: &mut (dyn FnMut(ProgressEvent) + Send), words: &str, event: ProgressEvent) {
    match event {
        ProgressEvent::Stage(stage, done, residual) => {
            show(ProgressEvent::Stage(&format!("{words}: {stage}"), done, residual));
        }
        ProgressEvent::Message(text) => show(ProgressEvent::Message(&format!("{words}: {text}"))),
    }
}

fn cell_area(summary: &Summary) -> Option<f64> {
    let frame = summary.frame.as_ref()?;
    let side = |k: usize| 2.0 * frame.half_width[k] / frame.cells[k] as f64;
    Some(side(0) * side(1))
}
