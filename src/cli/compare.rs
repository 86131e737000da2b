use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::console::{print_diagnostics, print_error, to_stderr, to_stdout};
use super::options::{CommandResult, CompareArgs, flexibility_cache};
use super::progress::{ProgressDisplay, format_duration};
use super::render::with_severity;
use super::run::{explain_reason, show_failure};
use super::signal;
use super::table::{align_columns, counted, five_digits, status_label, without_round_off};
use crate::compare::comparison::{Comparison, Difference, StepResult, VariantResult};
use crate::compare::step_ends::{StepEndStates, VariantStates};
use crate::compare::{Variant, variants};
use crate::error::exit;
use crate::error::{Error, Result, Warning};
use crate::frame::ContactFrame;
use crate::output::output_dir::{OutputDir, file_error, write_atomically};
use crate::output::peak_memory::{peak_bytes, restart_peak};
use crate::output::recorder::ProgressEvent;
use crate::output::report_file::remove_stale_report;
use crate::output::summary::{Status, Summary};
use crate::output::vtu::pvd_collection;
use crate::scene::{Diagnostics, Plan};
use crate::simulation::segments::{RunOptions, run_simulation};

pub(super) fn compare(arguments: &CompareArgs) -> CommandResult {
    let stop = signal::install();
    let started = Instant::now();
    let directory = arguments.out.clone().unwrap_or_else(|| arguments.scene.scene.with_extension("compare"));
    let plan = read_plan(arguments)?;
    let (frame, variants) =
        variants(&plan, &arguments.variants).map_err(|failure| show_failure(&plan, &failure))?;
    let named = !arguments.variants.is_empty() || plan.compare.variants.is_some();
    let mut comparison = Comparison {
        program: env!("CARGO_PKG_NAME"),
        version: env!("CARGO_PKG_VERSION"),
        title: plan.title.clone(),
        scene_sha256: plan.document.sha256.clone(),
        units: plan.units.clone(),
        variants: Vec::new(),
        warnings: plan.notes.iter().cloned().chain(single_variant_warning(&variants, named)).collect(),
    };
    let mut worst = exit::DONE;
    let (mut ends, mut told) = (Vec::new(), Vec::new());
    let mut progress = ProgressDisplay::new(arguments.quiet);
    for (i, variant) in variants.iter().enumerate() {
        let label = format!("{}/{} {}", i + 1, variants.len(), variant.name);
        let mut run = VariantRunner {
            plan: &plan,
            frame: &frame,
            directory: &directory,
            stop,
            progress: &mut progress,
        };
        let (result, seen, code) = run.run_variant(variant, &label);
        told.extend(seen.iter().flat_map(|(_, said)| said).map(|note| (variant.name.clone(), note.clone())));
        comparison.variants.push(result);
        ends.extend(seen.map(|(seen, _)| (variant.name.clone(), seen)));
        worst = exit::worse(worst, code);
        if stop.load(Ordering::Relaxed) {
            worst = exit::INTERRUPTED;
            break;
        }
    }
    progress.end();
    let begun = comparison.variants.len();
    comparison
        .variants
        .extend(variants[begun..].iter().map(|variant| VariantResult::not_started(&variant.name)));
    comparison.add_variant_warnings(told);
    comparison.compute_differences();
    let computed = comparison.variants.iter().any(|variant| variant.status.is_some());
    if !computed && worst == exit::DONE {
        worst = exit::INPUT;
    }
    let differences = comparison.compared_steps();
    let ends = VariantStates { frame: &frame, ends: &ends, differences: &differences };
    write(&comparison, &ends, &directory).map_err(|error| print_error(&error))?;
    if arguments.quiet && !computed {
        to_stderr(&format!("error: no variant was computed\n{}\n", describe(&comparison)));
    } else if !arguments.quiet {
        to_stdout(&report_text(&comparison, started, &directory));
    }
    Ok(worst)
}

/// Plan of the scene with the user's cache of flexibility matrices. Errors are printed, and their exit code is
/// returned. A scene with `accuracy` is an error.
fn read_plan(arguments: &CompareArgs) -> std::result::Result<Plan, u8> {
    let mut plan = arguments.scene.plan().map_err(|mistakes| print_diagnostics(&mistakes))?;
    if plan.accuracy.is_some() {
        let error = Error::input(
            "`compare` runs all variants on the cells of the scene and does not support `accuracy`: remove it",
        );
        return Err(print_diagnostics(&Diagnostics::from_error(&plan.document, "accuracy", &error)));
    }
    plan.flexibility_cache = flexibility_cache(arguments.no_cache)?;
    Ok(plan)
}

fn single_variant_warning(variants: &[Variant], named: bool) -> Option<Warning> {
    (variants.len() == 1 && !named).then(|| {
        Warning::note("neither body has a mesh, so there is only one variant and nothing to compare")
    })
}

struct VariantRunner<'a> {
    plan: &'a Plan,
    frame: &'a ContactFrame,
    directory: &'a Path,
    stop: &'a AtomicBool,
    progress: &'a mut ProgressDisplay,
}

impl VariantRunner<'_> {
    /// Runs a variant and writes its results into its folder. A variant that cannot be computed does not run; its exit
    /// code is 0.
    fn run_variant(
        &mut self,
        variant: &Variant,
        label: &str,
    ) -> (VariantResult, Option<(StepEndStates, Vec<Warning>)>, u8) {
        let mut result = VariantResult { reason: None, ..VariantResult::not_started(&variant.name) };
        let plan = match &variant.plan {
            Ok(plan) => plan,
            Err(error) => {
                result.reason = Some(error.to_string());
                return (result, None, exit::DONE);
            }
        };
        let output = match OutputDir::open(&self.directory.join(variant.folder())) {
            Ok(output) => output,
            Err(error) => {
                result.reason = Some(error.message().to_owned());
                return (result, None, print_error(&error));
            }
        };
        let started = Instant::now();
        restart_peak();
        let mut summary = Summary::new(&plan.title, &plan.document.sha256, plan.units.clone());
        summary.warnings.extend(variant.warnings.iter().cloned());
        let mut ends = StepEndStates::default();
        let on_progress = &mut |event: ProgressEvent| match event {
            ProgressEvent::Stage(stage, done, residual) => {
                self.progress.show(&format!("{label} {stage}"), done, residual);
            }
            ProgressEvent::Message(text) => self.progress.message(&format!("{label}: {text}")),
        };
        let job =
            RunOptions { frame: Some(self.frame), ..RunOptions::new(on_progress, &mut ends, self.stop) };
        let code = run_simulation(plan, Some(output), &mut summary, job).unwrap_or_else(|failure| {
            to_stderr(&format!("{}: ", variant.name));
            show_failure(self.plan, &failure)
        });
        result.status = Some(summary.status);
        result.divergence = summary.reason.filter(|_| summary.error.is_none());
        result.reason = summary.error.clone().or(summary.reason.map(|reason| reason.to_string()));
        result.folder = Some(variant.folder());
        result.seconds = started.elapsed().as_secs_f64();
        result.peak_memory_bytes = peak_bytes();
        result.steps = StepResult::last_entries(&summary);
        (result, Some((ends, summary.warnings)), code)
    }
}

fn write(comparison: &Comparison, ends: &VariantStates, directory: &Path) -> Result<()> {
    let json = comparison.to_json()?;
    fs::create_dir_all(directory)
        .map_err(|e| file_error("cannot create the output directory", directory, &e))?;
    for entry in fs::read_dir(directory).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        let ours = name.to_string_lossy().starts_with("differences_")
            && path.extension().is_some_and(|is| is == "vtu");
        if ours || name == "differences.pvd" {
            fs::remove_file(&path).map_err(|e| file_error("cannot remove", &path, &e))?;
        }
    }
    let mut files = Vec::new();
    for (index, step) in ends.steps().into_iter().enumerate() {
        let name = format!("differences_{:04}.vtu", index + 1);
        let mut bytes = Vec::new();
        ends.difference_grid(step)?.write(&mut bytes)?;
        write_atomically(&directory.join(&name), &bytes)?;
        files.push(((index + 1) as f64, name));
    }
    if !files.is_empty() {
        write_atomically(&directory.join("differences.pvd"), pvd_collection(&files).as_bytes())?;
    }
    write_atomically(&directory.join("compare.csv"), comparison.to_csv().as_bytes())?;
    let picture = directory.join("compare.svg");
    if ends.frame.is_single_valued() {
        write_atomically(&picture, ends.profiles_svg(&comparison.units).as_bytes())?;
    } else if picture.exists() {
        std::fs::remove_file(&picture).map_err(|error| file_error("cannot remove", &picture, &error))?;
    }
    remove_stale_report(directory);
    write_atomically(&directory.join("compare.json"), json.as_bytes())
}

fn report_text(comparison: &Comparison, started: Instant, directory: &Path) -> String {
    let n_computed = comparison.variants.iter().filter(|variant| variant.status.is_some()).count();
    let variants = counted(comparison.variants.len(), "variant");
    let count = match n_computed == comparison.variants.len() {
        true => variants,
        false => format!("{n_computed} of {variants} computed"),
    };
    let total = format_duration(started.elapsed().as_secs_f64());
    let place = directory.join("compare.json");
    format!("{}\n{count} in {total}\nresults: {}\n", describe(comparison), place.display())
}

fn describe(comparison: &Comparison) -> String {
    let mut text = format!("{}\n\n", comparison.title);
    if comparison.reference().is_some() {
        text.push_str(&format!("{}\n", align_columns(&step_rows(comparison))));
    }
    text.push_str(&align_columns(&variant_rows(comparison)));
    let refused = comparison.variants.iter().filter(|variant| variant.status != Some(Status::Converged));
    for variant in refused {
        let unknown =
            if variant.status == Some(Status::Interrupted) { "interrupted" } else { "reason unknown" };
        let words = variant.reason.as_deref().unwrap_or(unknown);
        let words = match variant.status {
            Some(Status::NotConverged) => explain_reason(variant.divergence, Some(words)),
            _ => words.to_owned(),
        };
        text.push_str(&format!("\n{}: {words}\n", variant.name));
    }
    for warning in &comparison.warnings {
        text.push_str(&format!("\n{}\n", with_severity(warning)));
    }
    text
}

fn step_rows(comparison: &Comparison) -> Vec<Vec<String>> {
    let units = &comparison.units;
    let (length, stress) = (&units.length, units.stress().replace("^{2}", "2"));
    let heads = [
        "step",
        "variant",
        "load",
        "approach",
        "tangential force",
        "contact area",
        "stick area",
        "peak pressure",
        "wear volume",
        "residual",
    ];
    let dimensions = [
        "",
        "",
        &units.force,
        length,
        &units.force,
        &format!("{length}2"),
        &format!("{length}2"),
        &stress,
        &format!("{length}3"),
        "",
    ];
    let mut rows = vec![heads.map(str::to_owned).to_vec(), dimensions.map(str::to_owned).to_vec()];
    let Some(first) = comparison.variants.iter().max_by_key(|variant| variant.steps.len()) else {
        return rows;
    };
    for name in first.steps.iter().map(|step| &step.name) {
        for variant in &comparison.variants {
            if let Some(step) = variant.steps.iter().find(|step| step.name == *name) {
                rows.push(step_row(&variant.name, step));
            }
        }
    }
    rows
}

fn step_row(variant: &str, step: &StepResult) -> Vec<String> {
    let with = |value: f64, pick: fn(&Difference) -> Option<f64>| {
        let percent = step.difference.as_ref().and_then(pick);
        format!("{}{}", five_digits(value), percent.map(|p| format!(" ({p:+.1} %)")).unwrap_or_default())
    };
    let [x, y] = step.tangential_force.map(|q| without_round_off(q, step.normal_force));
    let sideways = step.difference.as_ref().and_then(|difference| difference.tangential_force);
    let sideways = sideways.map(|p| format!(" ({p:.1} %)")).unwrap_or_default();
    vec![
        step.name.clone(),
        variant.to_owned(),
        with(step.normal_force, |d| d.normal_force),
        with(step.approach, |d| d.approach),
        format!("({}, {}){sideways}", five_digits(x), five_digits(y)),
        with(step.contact_area, |d| d.contact_area),
        with(step.stick_area, |d| d.stick_area),
        with(step.peak_pressure, |d| d.peak_pressure),
        with(step.worn_volume, |d| d.worn_volume),
        format!("{:.1e}", step.natural_residual),
    ]
}

fn variant_rows(comparison: &Comparison) -> Vec<Vec<String>> {
    let mut rows = vec![["variant", "status", "time", "memory"].map(str::to_owned).to_vec()];
    for variant in &comparison.variants {
        let status = status_label(variant.status, "not computed");
        let memory = variant.peak_memory_bytes as f64 / f64::from(1 << 20);
        let memory = if memory > 0.0 { format!("{memory:.0} MiB") } else { String::new() };
        let time = if variant.status.is_some() { format_duration(variant.seconds) } else { String::new() };
        rows.push(vec![variant.name.clone(), status.to_owned(), time, memory]);
    }
    rows
}
