use std::path::Path;
use std::time::Instant;

use super::accuracy::describe;
use super::console::{print_diagnostics, print_error, to_stderr, to_stdout};
use super::options::{CommandResult, RunArgs, flexibility_cache};
use super::progress::{ProgressDisplay, format_duration};
use super::render::with_severity;
use super::{resume, signal, table};
use crate::adaptive;
use crate::error::exit;
use crate::error::{Error, Result, Severity, Warning};
use crate::evolution::records::Divergence;
use crate::output::checkpoint;
use crate::output::output_dir::{OutputDir, SUMMARY_FILE};
use crate::output::recorder::ProgressEvent;
use crate::output::summary::{Status, Summary, Units};
use crate::scene::plan::AccuracyPlan;
use crate::scene::spec::accuracy::AccuracyQuantity;
use crate::scene::{Diagnostics, Plan};
use crate::simulation::SceneError;
use crate::simulation::job;
use crate::simulation::resume::{CheckpointSettings, ResumeDecision, decide_resume};
use crate::simulation::segments::{NullObserver, RunOptions};

/// Hint with the command that resumes a run; `code` is the exit code of the run. If resources were insufficient and a
/// memory limit was given, the command contains a placeholder for another limit.
fn resume_hint(arguments: &RunArgs, plan: &Plan, code: u8) -> String {
    let has_limit =
        arguments.scene.max_memory.is_some() || plan.document.get("solver.memory_limit").is_some();
    match code {
        exit::RESOURCES => {
            let command = resume::resume_command(arguments, has_limit);
            format!("to resume, once memory and disk space suffice: {command}\n")
        }
        _ => format!("to resume: {}\n", resume::resume_command(arguments, false)),
    }
}

pub(super) fn run(arguments: &RunArgs) -> CommandResult {
    let stop = signal::install();
    let started = Instant::now();
    let directory = arguments.out.clone().unwrap_or_else(|| arguments.scene.scene.with_extension("out"));
    let plan = arguments.scene.plan_with_accuracy(arguments.accuracy);
    let mut plan = plan.map_err(|mistakes| reject_scene(&mistakes, arguments, &directory))?;
    if let Some(relative) = arguments.accuracy {
        let wanted = AccuracyPlan {
            relative,
            quantities: AccuracyQuantity::ALL.to_vec(),
            fixed_parameters: Vec::new(),
        };
        plan.accuracy = Some(plan.accuracy.map_or(wanted, |spec| AccuracyPlan { relative, ..spec }));
    }
    let mut summary = job::new_summary(&plan);
    summary.timings.add("scene", started.elapsed().as_secs_f64());
    let opened = open_output(&plan, arguments, &directory, &mut summary);
    let Some((output, checkpoints)) = opened.map_err(|error| print_error(&error))? else {
        if !arguments.quiet {
            to_stdout(&already_converged(&summary, &directory));
        }
        return Ok(exit::DONE);
    };
    plan.flexibility_cache = flexibility_cache(arguments.no_cache)?;
    let mut progress = ProgressDisplay::new(arguments.quiet);
    let mut nobody = NullObserver;
    let on_progress = &mut |event: ProgressEvent| progress.on_event(event);
    let job =
        RunOptions { checkpoints: Some(checkpoints), ..RunOptions::new(on_progress, &mut nobody, stop) };
    let code = adaptive::run(&plan, Some(output), &mut summary, job);
    progress.end();
    let code = code.unwrap_or_else(|failure| show_failure(&plan, &failure));
    if !arguments.quiet {
        to_stdout(&final_report(
            &summary,
            &directory,
            plan.solver.tolerance,
            started.elapsed().as_secs_f64(),
        ));
        let unfinished = matches!(summary.status, Status::Interrupted | Status::Failed);
        if unfinished && checkpoint::are_in(&directory) {
            to_stdout(&resume_hint(arguments, &plan, code));
        }
    } else if summary.status == Status::NotConverged {
        let results = directory.join("summary.json");
        let (reason, why) = (
            summary.reason.map(reason_label).unwrap_or_default(),
            explain_outcome(&summary, plan.solver.tolerance),
        );
        to_stderr(&format!(
            "not converged{reason}: {}: {why}; results: {}\n",
            summary.title,
            results.display()
        ));
    }
    Ok(code)
}

/// Opens the output directory of a run and determines its checkpoint settings. `None` if `--resume` finds a converged
/// run.
fn open_output(
    plan: &Plan,
    arguments: &RunArgs,
    directory: &Path,
    summary: &mut Summary,
) -> Result<Option<(OutputDir, CheckpointSettings)>> {
    let mut output = OutputDir::open(directory)?;
    let mut checkpoints = CheckpointSettings::for_new_run(plan)?;
    if arguments.resume && plan.accuracy.is_some() {
        return Err(Error::input(
            "--resume cannot be used with a target accuracy, because a run to an accuracy writes no checkpoints. Remove --resume or the accuracy",
        ));
    }
    if arguments.resume {
        let mut say = |text: &str| {
            if !arguments.quiet {
                to_stderr(&format!("note: {text}\n"));
            }
        };
        match decide_resume(plan, &checkpoints.origin, &mut output, summary, &mut say)? {
            ResumeDecision::FromStart => {}
            ResumeDecision::FromCheckpoint(resumed) => checkpoints.from = Some(resumed),
            ResumeDecision::AlreadyDone => return Ok(None),
        }
    }
    Ok(Some((output, checkpoints)))
}

fn already_converged(summary: &Summary, directory: &Path) -> String {
    let results = directory.join(SUMMARY_FILE);
    format!(
        "{}: already converged, nothing to resume (run without --resume to compute it again)\nresults: {}\n",
        summary.title,
        results.display()
    )
}

/// Prints the diagnostics and returns the exit code. Writes a summary if the scene file could be read, or if the option
/// `--out` is given.
fn reject_scene(mistakes: &Diagnostics, arguments: &RunArgs, directory: &Path) -> u8 {
    let code = print_diagnostics(mistakes);
    if !mistakes.sha256.is_empty() || arguments.out.is_some() {
        let mut summary = Summary::new("", &mistakes.sha256, Units::default());
        summary.set_failure(&mistakes.to_error());
        if let Err(error) = OutputDir::open(directory).and_then(|output| output.finish(&mut summary)) {
            print_error(&error);
        }
    }
    code
}

pub(super) fn show_failure(plan: &Plan, failure: &SceneError) -> u8 {
    let code = if failure.error.exit_code() == exit::INPUT && !failure.key.is_empty() {
        print_diagnostics(&Diagnostics::from_error(&plan.document, &failure.key, &failure.error))
    } else {
        print_error(&failure.error)
    };
    // Wrong units are a frequent cause of failures, so the notes on units are repeated.
    for hint in plan.notes.iter().filter(|note| note.severity == Severity::UnitError) {
        to_stderr(&format!("note: {}\n", hint.text));
    }
    code
}

/// Final report: table of results, outcome of the run, run time in `seconds`, and location of the results.
fn final_report(summary: &Summary, directory: &Path, tolerance: f64, seconds: f64) -> String {
    let mut text = format!("{}\n\n", summary.title);
    text.push_str(&table::results(summary));
    text.push_str(&table::body_peak_lines(summary));
    if let Some(record) = &summary.accuracy {
        text.push_str(&format!("\n{}", describe(record)));
    }
    let failed = summary.status == Status::Failed;
    let is_shown = |warning: &&Warning| !(failed && warning.severity == Severity::UnitError);
    for warning in summary.warnings.iter().filter(is_shown) {
        text.push_str(&format!("\n{}", with_severity(warning)));
    }
    let memory = summary.peak_memory_bytes as f64 / f64::from(1 << 20);
    let how = match summary.status {
        Status::Converged => "converged".to_owned(),
        Status::NotConverged => {
            let reason = summary.reason.map(reason_label).unwrap_or_default();
            format!(
                "NOT CONVERGED{reason}: {}; the results so far are kept",
                explain_outcome(summary, tolerance)
            )
        }
        Status::Failed if summary.steps.is_empty() => "FAILED before the first result".to_owned(),
        Status::Failed => "FAILED; the results so far are kept".to_owned(),
        Status::Interrupted => "INTERRUPTED; the results so far are kept".to_owned(),
    };
    let resources = format!("{}, {memory:.0} MiB", format_duration(seconds));
    text.push_str(&match summary.status {
        Status::Converged => format!("\n{how} in {resources}\n"),
        _ => format!("\n{how}\nrun time and memory: {resources}\n"),
    });
    text.push_str(&format!("results: {}\n", directory.join("summary.json").display()));
    text
}

/// Largest residual that counts as rounding error if the iterations do not reduce it.
const ROUNDING_RESIDUAL: f64 = 1e-12;

fn explain_outcome(summary: &Summary, tolerance: f64) -> String {
    let residual = summary.steps.last().map(|record| record.certificate.natural_residual);
    match (summary.reason, residual) {
        (Some(Divergence::Iterations), Some(residual))
            if (tolerance..=ROUNDING_RESIDUAL).contains(&residual) =>
        {
            format!(
                "the residual {residual:.1e} is rounding error and does not decrease further: increase solver.tolerance to at least {:.0e}",
                10.0 * residual
            )
        }
        (Some(reason), _) => explain_divergence(reason).to_owned(),
        (None, _) => REASON_UNKNOWN.to_owned(),
    }
}

pub(super) fn reason_label(reason: Divergence) -> String {
    format!(" (reason \"{}\")", reason.name())
}

pub(super) fn explain_divergence(reason: Divergence) -> &'static str {
    match reason {
        Divergence::Iterations => {
            "the contact solver did not reach solver.tolerance; the run's notes say in which cells, and what to try"
        }
        Divergence::GrossSliding => {
            "the tangential load exceeds the friction limit: reduce it, or prescribe displacements (`shift`, `twist`) \
             of a supported body instead; the run's notes say how the bodies slide"
        }
        Divergence::ContactLost => {
            "the bodies separated: check approach, forces, moments and loads of the bodies"
        }
        Divergence::LargeRotation => {
            "the loads rotate a body beyond the small rotations of the model: check moments, frame.center \
             and supports"
        }
        Divergence::FrameEdge => {
            "the worn contact reached the edge of the frame: enlarge frame.half_width and frame.cells; \
             the notes above say why the frame did not grow"
        }
        Divergence::StickZone => {
            "the stick zone of the fretting cycle did not converge: try more jumps, another amplitude or \
             more cells; more iterations do not help"
        }
        Divergence::Accuracy => {
            "the estimated error stays above the target: request a larger error or other results \
             (accuracy.of); `accuracy` in summary.json has the error of each result"
        }
        Divergence::LinearSolver => {
            "the linear equations of a body were not solved: raise --max-memory or solver.memory_limit"
        }
    }
}

const REASON_UNKNOWN: &str = "reason unknown";

/// Text for a run that did not converge, with the explanation of `divergence`. Without `divergence`, the text contains
/// `error`.
pub(super) fn explain_reason(divergence: Option<Divergence>, error: Option<&str>) -> String {
    match divergence {
        Some(reason) => format!("not converged{}: {}", reason_label(reason), explain_divergence(reason)),
        None => format!("not converged: {}", error.unwrap_or(REASON_UNKNOWN)),
    }
}
