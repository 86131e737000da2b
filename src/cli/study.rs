//! `orthowear study`.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::time::Instant;

use clap::Args;

use super::compare::worse;
use super::max_memory::{MaxMemory, max_memory};
use super::progress::{Progress, seconds};
use super::run::{reason, report};
use super::table::{align, short};
use super::{STACK, exit, refuse, remark, signal, to_stderr, to_stdout};
use crate::error::{Error, Result};
use crate::fem::FlexibilityCache;
use crate::job::resume::{Checkpoints, Start, recall, start};
use crate::job::{self, Job, Nobody, nothing};
use crate::results::output::{OutputDir, failure, write_atomically};
use crate::results::report::forget_report;
use crate::results::summary::{Status, Summary};
use crate::scene;
use crate::study::sweep::plots::pictures;
use crate::study::sweep::share::{Share, share};
use crate::study::sweep::table::{RunResult, StudyResult};
use crate::study::sweep::{self, Sweep};
use crate::study::{Failure, forecast};

/// Options of `orthowear study`.
#[derive(Debug, Args)]
pub(super) struct StudyArgs {
    /// Study file (TOML): a scene and the values that vary.
    study: PathBuf,
    /// Directory of the results; default: the study's name with .study beside it.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replaces a value of the scene in all runs, e.g. --set gap.radius=25.0.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE")]
    overrides: Vec<String>,
    /// Number of threads of all runs together; the results are the same for any number.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub(super) threads: Option<u16>,
    /// Memory that all runs together may take: bytes, a size like "4 GiB", or a share of what is available like "50 %"; in place of the scene's `solver.memory_limit`.
    #[arg(long, value_name = "SIZE", value_parser = max_memory, allow_hyphen_values = true)]
    max_memory: Option<MaxMemory>,
    /// Computes flexibilities of meshed bodies anew and keeps none for later runs.
    #[arg(long)]
    no_cache: bool,
    /// Leaves runs that have converged as they are, and goes on with unfinished ones from their last checkpoints.
    #[arg(long)]
    resume: bool,
    /// Prints nothing but errors.
    #[arg(long)]
    quiet: bool,
}

/// Most rows of the table that is printed.
const MOST_ROWS: usize = 60;

/// Runs a scene for all combinations of values, side by side; the worst exit code of the runs.
pub(super) fn study(arguments: &StudyArgs) -> u8 {
    let stop = signal::catch();
    let started = Instant::now();
    let sweep = match sweep::read(&arguments.study, &arguments.overrides) {
        Ok(sweep) => within(sweep, arguments.max_memory),
        Err(files) => {
            return files.iter().map(refuse).max().unwrap_or(exit::INPUT);
        }
    };
    let cache = if arguments.no_cache { Ok(None) } else { FlexibilityCache::of_user() };
    let cache = match cache {
        Ok(cache) => cache,
        Err(error) => return report(&error),
    };
    let directory = arguments.out.clone().unwrap_or_else(|| arguments.study.with_extension("study"));
    if let Err(error) = make(&directory) {
        return report(&error);
    }
    let threads = rayon::current_num_threads();
    let needed = forecast(&sweep.first).ok().map(|forecast| forecast.memory_bytes);
    let free = sweep.runs.first().and_then(|run| run.memory.remaining());
    let shared = share(sweep.runs.len(), threads, needed, free);
    let work = Work {
        sweep: &sweep,
        directory: &directory,
        cache: cache.as_ref(),
        stop,
        resume: arguments.resume,
        kept: AtomicUsize::new(0),
    };
    let mut progress = Progress::new(arguments.quiet);
    let (runs, worst) = work.all(shared, &mut progress);
    progress.end();
    let result = StudyResult::new(&sweep, runs);
    if let Err(error) = write(&sweep, &result, &directory) {
        return report(&error);
    }
    if arguments.quiet {
        unfinished(&result).iter().for_each(|line| to_stderr(line));
    } else {
        let total = seconds(started.elapsed().as_secs_f64());
        let n = result.runs.len();
        let place = directory.join("study.json");
        let aside = match (shared.side_by_side, shared.threads) {
            (1, _) => "one after the other".to_owned(),
            (k, 1) => format!("{k} at a time"),
            (k, each) => format!("{k} at a time with {each} threads each"),
        };
        let left_out = match result.left_out {
            0 => String::new(),
            1 => ", 1 combination left out".to_owned(),
            more => format!(", {more} combinations left out"),
        };
        let kept = match work.kept.load(Ordering::Relaxed) {
            0 => String::new(),
            kept => format!(", {kept} as they were"),
        };
        let text = describe(&sweep, &result);
        to_stdout(&format!(
            "{text}\n{n} runs{left_out}{kept}, {aside}, in {total}\nresults: {}\n",
            place.display()
        ));
    }
    worst
}

/// The study with the memory limit of the command line, where there is one.
fn within(mut sweep: Sweep, limit: Option<MaxMemory>) -> Sweep {
    if let Some(limit) = limit.map(MaxMemory::limit) {
        sweep.runs.iter_mut().for_each(|run| run.memory = limit);
        sweep.first.memory = limit;
    }
    sweep
}

fn make(directory: &Path) -> Result<()> {
    if directory.exists() && !directory.is_dir() {
        let place = directory.display();
        return Err(Error::input(format!(
            "the output directory {place} is a file; name a directory with --out"
        )));
    }
    std::fs::create_dir_all(directory).map_err(|e| failure("cannot make the output directory", directory, &e))
}

/// What the runs of a study share.
struct Work<'a> {
    sweep: &'a Sweep,
    directory: &'a Path,
    cache: Option<&'a FlexibilityCache>,
    stop: &'a AtomicBool,
    /// Whether to leave what has converged, and to go on with what is unfinished.
    resume: bool,
    /// Number of runs left as they were.
    kept: AtomicUsize,
}

/// A run that ended.
struct Ended {
    number: usize,
    result: RunResult,
    code: u8,
}

impl Work<'_> {
    /// Runs everything; results in the order of the study, and the worst exit code.
    fn all(&self, shared: Share, progress: &mut Progress) -> (Vec<RunResult>, u8) {
        let total = self.sweep.runs.len();
        let mut results: Vec<RunResult> =
            (0..total).map(|number| RunResult::new(self.sweep, number)).collect();
        let (next, mut worst) = (AtomicUsize::new(0), exit::DONE);
        let (sender, receiver) = channel();
        std::thread::scope(|scope| {
            for _ in 0..shared.side_by_side {
                let (sender, next) = (sender.clone(), &next);
                scope.spawn(move || self.worker(shared.threads, next, &sender));
            }
            drop(sender);
            progress.show("runs", 0.0, None);
            for (done, ended) in receiver.iter().enumerate() {
                results[ended.number] = ended.result;
                worst = worse(worst, ended.code);
                progress.show("runs", (done + 1) as f64 / total as f64, None);
            }
        });
        let unknown = results.iter().any(|run| run.status.is_none());
        if self.stop.load(Ordering::Relaxed) {
            worst = exit::INTERRUPTED;
        } else if unknown {
            // A worker that could not be started or broke down has said so itself.
            worst = worse(worst, exit::FAILED);
        }
        (results, worst)
    }

    /// Takes one run after the other until there is none left.
    fn worker(&self, threads: usize, next: &AtomicUsize, ended: &Sender<Ended>) {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).stack_size(STACK).build();
        let pool = match pool {
            Ok(pool) => pool,
            Err(error) => return to_stderr(&format!("error: no threads for a run: {error}\n")),
        };
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= self.sweep.runs.len() || self.stop.load(Ordering::Relaxed) {
                return;
            }
            let one = pool.install(|| self.run(number));
            if ended.send(one).is_err() {
                return;
            }
        }
    }

    fn run(&self, number: usize) -> Ended {
        let started = Instant::now();
        let spec = &self.sweep.runs[number];
        let mut result = RunResult::new(self.sweep, number);
        let mut summary = Summary::new(&self.sweep.title, "", self.sweep.units.clone());
        let mut kept = false;
        let code = self.compute(number, &mut summary, &mut kept).unwrap_or_else(|failed| {
            if summary.error.is_none() {
                summary.fail(&failed.error);
            }
            failed.error.exit_code()
        });
        let before: f64 = summary.timings.iter().map(|(_, seconds)| seconds).sum();
        let seconds = if kept { before } else { started.elapsed().as_secs_f64() };
        result.take(self.sweep, &summary, seconds);
        debug_assert_eq!(result.folder, spec.folder);
        Ended { number, result, code }
    }

    fn compute(
        &self,
        number: usize,
        summary: &mut Summary,
        kept: &mut bool,
    ) -> std::result::Result<u8, Failure> {
        let spec = &self.sweep.runs[number];
        let unkeyed = |error: Error| Failure { error, key: String::new() };
        // It was read before; what changed since then is the file's.
        let read = scene::read(&self.sweep.scene, &spec.overrides);
        let mut plan = read.map_err(|mistakes| unkeyed(mistakes.to_error()))?;
        plan.memory = spec.memory;
        plan.cache = self.cache.cloned();
        *summary = job::summary(&plan);
        let directory = self.directory.join(&spec.folder);
        if self.resume && recall(&plan, &directory, summary) {
            *kept = true;
            self.kept.fetch_add(1, Ordering::Relaxed);
            return Ok(exit::DONE);
        }
        let mut output = OutputDir::open(&directory).map_err(unkeyed)?;
        let mut checkpoints = Checkpoints::of(&plan).map_err(unkeyed)?;
        if self.resume && plan.accuracy.is_none() {
            let begun = start(&plan, &checkpoints.origin, (&mut output, summary), &mut |_| {});
            if let Start::From(resumed) = begun.map_err(unkeyed)? {
                checkpoints.from = Some(resumed);
            }
        }
        let show = &mut |_: &str, _: f64, _: Option<f64>| {};
        let (watch, complete) = (&mut Nobody, &mut nothing);
        let job = Job { frame: None, show, watch, stop: self.stop, checkpoints: Some(checkpoints), complete };
        job::run(&plan, Some(output), summary, job)
    }
}

fn write(sweep: &Sweep, result: &StudyResult, directory: &Path) -> Result<()> {
    let json = result.to_json()?;
    write_atomically(&directory.join("study.csv"), result.to_csv().as_bytes())?;
    for (name, picture) in pictures(sweep, result) {
        write_atomically(&directory.join(name), picture.as_bytes())?;
    }
    forget_report(directory);
    write_atomically(&directory.join("study.json"), json.as_bytes())
}

/// A line for each run that did not converge.
fn unfinished(result: &StudyResult) -> Vec<String> {
    let line = |run: &RunResult| {
        let words = run.reason.as_deref();
        let why = match run.status {
            Some(Status::Converged) => return None,
            Some(Status::NotConverged) => format!("not converged: {}", reason(words)),
            Some(Status::Failed) => format!("failed: {}", words.unwrap_or("no reason known")),
            Some(Status::Interrupted) => "interrupted".to_owned(),
            None => "not run".to_owned(),
        };
        Some(format!("{}: {why}\n", run.folder))
    };
    result.runs.iter().filter_map(line).collect()
}

/// The study as a person reads it: a row for each run, what did not converge, what is to be known.
fn describe(sweep: &Sweep, result: &StudyResult) -> String {
    let heads = sweep.axes.iter().map(|axis| axis.name.clone());
    let paths = result.collect.iter().cloned();
    let mut rows = vec![heads.chain(["status".to_owned()]).chain(paths).collect::<Vec<String>>()];
    for (spec, run) in sweep.runs.iter().zip(&result.runs).take(MOST_ROWS) {
        let mut cells: Vec<String> =
            sweep.axes.iter().zip(&spec.choice).map(|(axis, &value)| axis.label(value)).collect();
        cells.push(match run.status {
            None => "not run".to_owned(),
            Some(Status::Converged) => "converged".to_owned(),
            Some(Status::NotConverged) => "NOT CONVERGED".to_owned(),
            Some(Status::Failed) => "FAILED".to_owned(),
            Some(Status::Interrupted) => "INTERRUPTED".to_owned(),
        });
        cells.extend(result.collect.iter().map(|path| run.result(path).map_or(String::new(), short)));
        rows.push(cells);
    }
    let mut text = format!("{}\n\n{}", result.title, align(&rows));
    if result.runs.len() > MOST_ROWS {
        text.push_str(&format!("({} more rows in study.csv)\n", result.runs.len() - MOST_ROWS));
    }
    let open = unfinished(result);
    if !open.is_empty() {
        text.push_str(&format!("\n{}", open.concat()));
    }
    let mut seen: Vec<(&String, usize)> = Vec::new();
    for warning in result.runs.iter().flat_map(|run| &run.warnings) {
        match seen.iter_mut().find(|(known, _)| *known == warning) {
            Some((_, count)) => *count += 1,
            None => seen.push((warning, 1)),
        }
    }
    for (warning, count) in seen {
        let runs = if count == 1 { "1 run".to_owned() } else { format!("{count} runs") };
        text.push_str(&format!("\n{} ({runs})", remark(warning)));
    }
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}
