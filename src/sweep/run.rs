//! Runs of a study, computed in parallel.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use crate::adaptive::run;
use crate::error::{Error, Result, exit, panic_message};
use crate::fem::FlexibilityCache;
use crate::output::output_dir::{OutputDir, SUMMARY_FILE, file_error, write_atomically};
use crate::output::recorder::ProgressEvent;
use crate::output::report_file::remove_stale_report;
use crate::output::summary::{Status, Summary};
use crate::simulation::SceneError;
use crate::simulation::job::{THREAD_STACK_BYTES, new_summary, start_pool_thread};
use crate::simulation::resume::{CheckpointSettings, ResumeDecision, decide_resume, load_finished_run};
use crate::simulation::segments::{NullObserver, RunOptions};
use crate::sweep::Sweep;
use crate::sweep::plots::pictures;
use crate::sweep::share::{Concurrency, plan_concurrency};
use crate::sweep::table::{StudyResult, StudyRun};

const STALE_FOLDER: &str = "the results in its folder are from another scene, other values or another version, or older than a file of the scene";

/// A study with the settings of its execution.
pub struct StudyRunner<'a> {
    /// The study.
    pub sweep: &'a Sweep,
    /// Directory that contains the folders of the runs.
    pub directory: &'a Path,
    /// Cache of the flexibilities of finite-element bodies.
    pub cache: Option<&'a FlexibilityCache>,
    /// Cancellation flag.
    pub stop: &'a AtomicBool,
    /// Whether to keep converged runs and to continue unfinished runs.
    pub resume: bool,
}

/// Results of the runs of a study.
#[derive(Debug, Default)]
pub struct StudyOutcome {
    /// All runs, in the order of the study. Runs that were not computed have no status.
    pub runs: Vec<StudyRun>,
    /// The most severe exit code.
    pub code: u8,
    /// Number of runs whose existing results were kept.
    pub reused: usize,
    /// Reasons why runs could not be started.
    pub problems: Vec<String>,
}

struct FinishedRun {
    number: usize,
    result: StudyRun,
    code: u8,
    kept: bool,
}

enum WorkerMessage {
    Ended(Box<FinishedRun>),
    Problem(String),
}

impl StudyRunner<'_> {
    /// Distributes `threads` and the available memory over the runs with the indices `numbers`.
    pub fn plan_concurrency(&self, numbers: &[usize], threads: usize) -> Concurrency {
        // With one thread the runs are sequential, whatever memory they need.
        let several = threads > 1 && numbers.len() > 1;
        let needed = if several { self.sweep.largest_memory(numbers) } else { None };
        let free = self.sweep.runs.first().and_then(|run| run.memory.remaining());
        plan_concurrency(numbers.len(), threads, needed, free)
    }

    /// Computes the runs with the indices `numbers`. After each run, calls `show` with the number of finished runs.
    pub fn run(&self, numbers: &[usize], shared: Concurrency, show: &mut dyn FnMut(usize)) -> StudyOutcome {
        let runs = (0..self.sweep.runs.len()).map(|number| StudyRun::new(self.sweep, number)).collect();
        let mut ended = StudyOutcome { runs, ..StudyOutcome::default() };
        let next = AtomicUsize::new(0);
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            for _ in 0..shared.parallel_runs {
                let (sender, next) = (sender.clone(), &next);
                let builder = std::thread::Builder::new().stack_size(THREAD_STACK_BYTES);
                let work = move || self.worker(shared.threads_per_run, numbers, next, &sender);
                if let Err(error) = builder.spawn_scoped(scope, work) {
                    ended.problems.push(format!("the thread for a run cannot be started: {error}"));
                }
            }
            drop(sender);
            let mut done = 0;
            for said in &receiver {
                match said {
                    WorkerMessage::Problem(problem) => ended.problems.push(problem),
                    WorkerMessage::Ended(one) => {
                        let FinishedRun { number, result, code, kept } = *one;
                        ended.runs[number] = result;
                        ended.code = exit::worse(ended.code, code);
                        ended.reused += usize::from(kept);
                        done += 1;
                        show(done);
                    }
                }
            }
        });
        let unknown = numbers.iter().any(|&number| ended.runs[number].status.is_none());
        if self.stop.load(Ordering::Relaxed) {
            ended.code = exit::INTERRUPTED;
        } else if unknown {
            ended.code = exit::worse(ended.code, exit::FAILED);
        }
        ended
    }

    fn worker(&self, threads: usize, numbers: &[usize], next: &AtomicUsize, said: &Sender<WorkerMessage>) {
        let pool =
            rayon::ThreadPoolBuilder::new().num_threads(threads).spawn_handler(start_pool_thread).build();
        let pool = match pool {
            Ok(pool) => pool,
            Err(error) => {
                // Sending fails only after the end of the study, so that the error is ignored.
                let _ = said.send(WorkerMessage::Problem(format!(
                    "the threads for a run cannot be started: {error}"
                )));
                return;
            }
        };
        while let Some(&number) = numbers.get(next.fetch_add(1, Ordering::Relaxed))
            && !self.stop.load(Ordering::Relaxed)
        {
            let ended = self.catch_panic(number, || pool.install(|| self.run_one(number)));
            if said.send(WorkerMessage::Ended(Box::new(ended))).is_err() {
                return;
            }
        }
    }

    fn run_one(&self, number: usize) -> FinishedRun {
        let started = Instant::now();
        let mut result = StudyRun::new(self.sweep, number);
        let mut summary = Summary::new(&self.sweep.title, "", self.sweep.units.clone());
        let mut kept = false;
        let code = self.compute(number, &mut summary, &mut kept).unwrap_or_else(|failed| {
            if summary.error.is_none() {
                summary.set_failure(&failed.error);
            }
            failed.error.exit_code()
        });
        let seconds = if kept { summary.timings.sum() } else { started.elapsed().as_secs_f64() };
        result.fill_from(self.sweep, &summary, seconds);
        FinishedRun { number, result, code, kept }
    }

    /// Calls `run`. A panic makes only this run fail, and does not end the study.
    fn catch_panic(&self, number: usize, run: impl FnOnce() -> FinishedRun) -> FinishedRun {
        catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
            let message = panic_message(&*panic);
            let mut result = StudyRun::new(self.sweep, number);
            result.status = Some(Status::Failed);
            result.reason = Some(format!("internal error: {message}; please report it with the scene"));
            FinishedRun { number, result, code: exit::FAILED, kept: false }
        })
    }

    fn compute(
        &self,
        number: usize,
        summary: &mut Summary,
        kept: &mut bool,
    ) -> std::result::Result<u8, SceneError> {
        let spec = &self.sweep.runs[number];
        let unkeyed = |error: Error| SceneError { error, key: String::new() };
        let mut plan = self.sweep.plan(number).map_err(unkeyed)?;
        plan.flexibility_cache = self.cache.cloned();
        *summary = crate::simulation::job::new_summary(&plan);
        let directory = self.directory.join(&spec.folder);
        if self.resume && load_finished_run(&plan, &directory, &[Status::Converged], summary) {
            *kept = true;
            return Ok(exit::DONE);
        }
        let mut output = OutputDir::open(&directory).map_err(unkeyed)?;
        let mut checkpoints = CheckpointSettings::for_new_run(&plan).map_err(unkeyed)?;
        if self.resume && plan.accuracy.is_none() {
            let begun = decide_resume(&plan, &checkpoints.origin, &mut output, summary, &mut |_| {});
            if let ResumeDecision::FromCheckpoint(resumed) = begun.map_err(unkeyed)? {
                checkpoints.from = Some(resumed);
            }
        }
        let on_progress = &mut |_: ProgressEvent| {};
        let mut nobody = NullObserver;
        let job = RunOptions {
            checkpoints: Some(checkpoints),
            ..RunOptions::new(on_progress, &mut nobody, self.stop)
        };
        run(&plan, Some(output), summary, job)
    }

    /// Collects the results of all runs from their folders, without computing.
    pub fn collect(&self) -> StudyOutcome {
        let mut ended = StudyOutcome::default();
        for (number, spec) in self.sweep.runs.iter().enumerate() {
            let mut result = StudyRun::new(self.sweep, number);
            let folder = self.directory.join(&spec.folder);
            let found = self.sweep.plan(number).ok().and_then(|plan| {
                let mut summary = new_summary(&plan);
                load_finished_run(&plan, &folder, &Status::ALL, &mut summary).then_some(summary)
            });
            if found.is_none() && folder.join(SUMMARY_FILE).exists() {
                result.reason = Some(STALE_FOLDER.to_owned());
            }
            let code = match found {
                None => exit::FAILED,
                Some(summary) => {
                    result.fill_from(self.sweep, &summary, summary.timings.sum());
                    ended.reused += 1;
                    match summary.status {
                        Status::Converged => exit::DONE,
                        Status::NotConverged => exit::NOT_CONVERGED,
                        Status::Failed => summary.exit_code.unwrap_or(exit::FAILED),
                        Status::Interrupted => exit::INTERRUPTED,
                    }
                }
            };
            ended.code = exit::worse(ended.code, code);
            ended.runs.push(result);
        }
        ended
    }

    /// Writes the tables and plots of the study; `study.json` is written last.
    ///
    /// # Errors
    /// If a file cannot be written (kind `Resources`), or the results cannot be serialised (kind `Numerical`).
    pub fn write(&self, result: &StudyResult) -> Result<()> {
        let json = result.to_json()?;
        write_atomically(&self.directory.join("study.csv"), result.to_csv().as_bytes())?;
        write_atomically(&self.directory.join("study.npz"), &result.to_npz()?)?;
        for (name, picture) in pictures(self.sweep, result) {
            write_atomically(&self.directory.join(name), picture.as_bytes())?;
        }
        remove_stale_report(self.directory);
        write_atomically(&self.directory.join("study.json"), json.as_bytes())
    }

    /// Checks that the directory exists.
    ///
    /// # Errors
    /// If the directory does not exist (kind `Input`).
    pub fn find_directory(&self) -> Result<()> {
        let place = self.directory.display();
        let none = || {
            Error::input(format!("the folder {place} does not exist; give the folder of the runs with --out"))
        };
        self.directory.is_dir().then_some(()).ok_or_else(none)
    }

    /// Creates the directory.
    ///
    /// # Errors
    /// If the path is a file (kind `Input`), or the directory cannot be created (kind `Resources`).
    pub fn make_directory(&self) -> Result<()> {
        let place = self.directory;
        if place.exists() && !place.is_dir() {
            return Err(Error::input(format!(
                "the output directory {} is a file; give a directory with --out",
                place.display()
            )));
        }
        std::fs::create_dir_all(place)
            .map_err(|e| file_error("cannot create the output directory", place, &e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a panic gives a failed run with exit code 1 and does not end the study.
    #[test]
    fn a_panic_ends_its_run_alone() {
        let folder = tempfile::tempdir().unwrap();
        let study = folder.path().join("study.toml");
        let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/hertz.toml");
        let axis = "[[axes]]\nkeys = [\"gap.radius\"]\nvalues = [40.0, 50.0]\n";
        std::fs::write(&study, format!("[study]\nscene = {scene:?}\n{axis}")).unwrap();
        let sweep = crate::sweep::read(&study, &[]).unwrap();
        let stop = AtomicBool::new(false);
        let (cache, resume) = (None, false);
        let runner = StudyRunner { sweep: &sweep, directory: folder.path(), cache, stop: &stop, resume };
        let ended = runner.catch_panic(1, || panic!("index {} is out of bounds", 7));
        assert_eq!((ended.number, ended.code, ended.result.status), (1, exit::FAILED, Some(Status::Failed)));
        assert!(ended.result.reason.unwrap().contains("index 7 is out of bounds"));
    }
}
