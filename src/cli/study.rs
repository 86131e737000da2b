use std::time::Instant;

use super::console::{print_diagnostics, print_error, to_stderr, to_stdout};
use super::max_memory::MaxMemory;
use super::options::{CommandResult, StudyArgs, flexibility_cache};
use super::progress::{ProgressDisplay, format_duration};
use super::render::with_severity;
use super::run::explain_reason;
use super::table::{align_columns, counted, five_digits, status_label};
use super::{signal, slurm};
use crate::error::exit;
use crate::error::{Error, Result, Warning};
use crate::output::summary::Status;
use crate::sweep::run::{StudyOutcome, StudyRunner};
use crate::sweep::share::Concurrency;
use crate::sweep::table::{StudyResult, StudyRun};
use crate::sweep::{self, Sweep};

const MAX_TABLE_ROWS: usize = 60;

/// Runs a study, or collects the results of its runs. With `--emit`, only prints a script. Returns the most severe exit
/// code of the runs.
pub(super) fn study(arguments: &StudyArgs) -> CommandResult {
    let stop = signal::install();
    let started = Instant::now();
    let mut sweep = sweep::read(&arguments.study, &arguments.overrides)
        .map_err(|files| files.iter().map(print_diagnostics).max().unwrap_or(exit::INPUT))?;
    if !arguments.quiet {
        sweep.notes.iter().for_each(|note| to_stderr(&format!("{note}\n")));
    }
    sweep.set_memory_limit(arguments.max_memory.map(MaxMemory::limit));
    let directory = arguments.out.clone().unwrap_or_else(|| arguments.study.with_extension("study"));
    if arguments.emit.is_some() {
        to_stdout(&slurm::script(arguments, &sweep, &directory));
        return Ok(exit::DONE);
    }
    let cache = flexibility_cache(arguments.no_cache)?;
    let resume = arguments.resume;
    let job = StudyRunner { sweep: &sweep, directory: &directory, cache: cache.as_ref(), stop, resume };
    let wanted = selected_runs(arguments, &sweep).map_err(|error| print_error(&error))?;
    let ready = if arguments.collect { job.find_directory() } else { job.make_directory() };
    ready.map_err(|error| print_error(&error))?;
    let (ended, shared) = run_or_collect(&job, arguments, &wanted);
    let StudyOutcome { runs, code, reused, problems } = ended;
    problems.iter().for_each(|problem| to_stderr(&format!("error: {problem}\n")));
    let result = StudyResult::new(&sweep, runs);
    if arguments.only.is_none() {
        job.write(&result).map_err(|error| print_error(&error))?;
    }
    if arguments.quiet {
        unconverged_lines(&result, &wanted).iter().for_each(|line| to_stderr(line));
        return Ok(code);
    }
    let mut text = describe(&sweep, &result, &wanted);
    text.push_str(&format!("\n{}", counted(wanted.len(), "run")));
    if result.left_out > 0 {
        text.push_str(&format!(", {} omitted", counted(result.left_out, "combination")));
    }
    match shared {
        None => text.push_str(&format!(", {reused} of them finished")),
        Some(shared) => text.push_str(&describe_execution(shared, reused, started)),
    }
    match arguments.only {
        None => text.push_str(&format!("\nresults: {}\n", directory.join("study.json").display())),
        Some(_) => text.push_str(&format!(
            "\nresults: {}; `orthowear study {} --collect` writes the table\n",
            directory.display(),
            arguments.study.display()
        )),
    }
    to_stdout(&text);
    Ok(code)
}

fn run_or_collect(
    job: &StudyRunner,
    arguments: &StudyArgs,
    wanted: &[usize],
) -> (StudyOutcome, Option<Concurrency>) {
    if arguments.collect {
        return (job.collect(), None);
    }
    let shared = job.plan_concurrency(wanted, rayon::current_num_threads());
    let mut progress = ProgressDisplay::new(arguments.quiet);
    progress.show("runs", 0.0, None);
    let show = &mut |done: usize| progress.show("runs", done as f64 / wanted.len() as f64, None);
    let ended = job.run(wanted, shared, show);
    progress.end();
    (ended, Some(shared))
}

fn describe_execution(shared: Concurrency, reused: usize, started: Instant) -> String {
    let kept = if reused > 0 { format!(", {reused} kept from an earlier run") } else { String::new() };
    let total = format_duration(started.elapsed().as_secs_f64());
    format!("{kept}, {}, in {total}", describe_concurrency(shared))
}

fn describe_concurrency(shared: Concurrency) -> String {
    match (shared.parallel_runs, shared.threads_per_run) {
        (1, _) => "one after the other".to_owned(),
        (k, 1) => format!("{k} at a time"),
        (k, each) => format!("{k} at a time with {each} threads each"),
    }
}

fn selected_runs(arguments: &StudyArgs, sweep: &Sweep) -> Result<Vec<usize>> {
    let n = sweep.runs.len();
    let Some(only) = &arguments.only else { return Ok((0..n).collect()) };
    only.indices(n)
        .ok_or_else(|| Error::input(format!("--only {only} is out of range; the study has runs 1 to {n}")))
}

fn unconverged_lines(result: &StudyResult, wanted: &[usize]) -> Vec<String> {
    let line = |run: &StudyRun| {
        let words = run.reason.as_deref();
        let why = match run.status {
            Some(Status::Converged) => return None,
            Some(Status::NotConverged) => explain_reason(run.divergence, words),
            Some(Status::Failed) => format!("failed: {}", words.unwrap_or("reason unknown")),
            Some(Status::Interrupted) => "interrupted".to_owned(),
            None => words.map_or("not run".to_owned(), |why| format!("not run: {why}")),
        };
        Some(format!("{}: {why}\n", run.folder))
    };
    wanted.iter().filter_map(|&number| line(&result.runs[number])).collect()
}

fn describe(sweep: &Sweep, result: &StudyResult, wanted: &[usize]) -> String {
    let heads = sweep.axes.iter().map(|axis| axis.name.clone());
    let paths = result.collect.iter().cloned();
    let mut rows = vec![heads.chain(["status".to_owned()]).chain(paths).collect::<Vec<String>>()];
    for &number in wanted.iter().take(MAX_TABLE_ROWS) {
        let (spec, run) = (&sweep.runs[number], &result.runs[number]);
        let mut cells: Vec<String> =
            sweep.axes.iter().zip(&spec.choice).map(|(axis, &value)| axis.label(value)).collect();
        cells.push(status_label(run.status, "not run").to_owned());
        cells.extend(result.collect.iter().map(|path| run.result(path).map_or(String::new(), five_digits)));
        rows.push(cells);
    }
    let mut text = format!("{}\n\n{}", result.title, align_columns(&rows));
    if wanted.len() > MAX_TABLE_ROWS {
        text.push_str(&format!("({} more rows in study.csv)\n", wanted.len() - MAX_TABLE_ROWS));
    }
    let open = unconverged_lines(result, wanted);
    if !open.is_empty() {
        text.push_str(&format!("\n{}", open.concat()));
    }
    let mut seen: Vec<(&Warning, usize)> = Vec::new();
    for warning in result.runs.iter().flat_map(|run| &run.warnings) {
        match seen.iter_mut().find(|(known, _)| *known == warning) {
            Some((_, count)) => *count += 1,
            None => seen.push((warning, 1)),
        }
    }
    for (warning, count) in seen {
        text.push_str(&format!("\n{} ({})", with_severity(warning), counted(count, "run")));
    }
    if !text.ends_with('\n') {
        text.push('\n');
    }
    text
}
