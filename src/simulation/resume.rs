//! Decides whether a run resumes, and from which checkpoint.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::error::{Error, Result, Warning};
use crate::evolution::RunCheckpoint;
use crate::evolution::records::IncrementRecord;
use crate::output::atomic_file::{file_error, sha256_of};
use crate::output::checkpoint;
use crate::output::checkpoint_writer::{CheckpointData, CheckpointInterval, CheckpointWriter, CompletedWork};
use crate::output::output_dir::{OutputDir, SUMMARY_FILE, read_json};
use crate::output::provenance::{NamedFile, Provenance};
use crate::output::summary::{Status, Summary};
use crate::scene::Plan;

const LISTED: usize = 6;

/// Start of a run.
pub enum ResumeDecision {
    /// From the beginning.
    FromStart,
    /// From a checkpoint.
    FromCheckpoint(Box<ResumePoint>),
    /// No run, because the output directory contains complete results.
    AlreadyDone,
}

/// Checkpoint from which a run resumes.
pub struct ResumePoint {
    /// Number of the checkpoint.
    pub number: u64,
    /// Content of the checkpoint.
    pub checkpoint_data: CheckpointData<RunCheckpoint>,
}

impl ResumePoint {
    /// Returns the checkpoint writer `keeper`, set to continue after this checkpoint.
    pub fn keeper(&self, keeper: CheckpointWriter) -> CheckpointWriter {
        keeper.continuing_from(self.number, CompletedWork::of(self.checkpoint_data.snapshot.records()))
    }
}

/// Checkpoint settings of a run.
pub struct CheckpointSettings {
    /// Scene and input files of the run.
    pub origin: Provenance,
    /// Interval between checkpoints.
    pub interval: CheckpointInterval,
    /// Checkpoint from which the run resumes.
    pub from: Option<Box<ResumePoint>>,
}

impl CheckpointSettings {
    /// Settings for a run of `plan` from the beginning.
    ///
    /// # Errors
    /// If a file that the scene names can no longer be read (kind `Resources`).
    pub fn for_new_run(plan: &Plan) -> Result<Self> {
        let mut known: BTreeMap<&PathBuf, String> = BTreeMap::new();
        let mut files = Vec::with_capacity(plan.files.len());
        for (key, path) in &plan.files {
            let sha256 = match known.get(path) {
                Some(sha256) => sha256.clone(),
                None => sha256_of(path).map_err(|e| file_error("cannot read", path, &e))?,
            };
            known.insert(path, sha256.clone());
            files.push(NamedFile { key: key.clone(), sha256 });
        }
        Ok(Self {
            origin: Provenance::new(plan.document.root.to_serde_json(), files),
            interval: plan.output.checkpoint,
            from: None,
        })
    }
}

/// Decides how the run of `plan` into `output` starts. `say` receives messages.
///
/// # Errors
/// If the checkpoint belongs to another run or is damaged (kind `Input`), or files cannot be read or moved (kind `Resources`).
pub fn decide_resume(
    plan: &Plan,
    origin: &Provenance,
    output: &mut OutputDir,
    summary: &mut Summary,
    say: &mut dyn FnMut(&str),
) -> Result<ResumeDecision> {
    if is_finished(plan, output.path()) {
        return Ok(ResumeDecision::AlreadyDone);
    }
    let Some(found) = checkpoint::read(output.path())? else {
        say(&format!("no checkpoint in {}: the run starts from the beginning", output.path().display()));
        return Ok(ResumeDecision::FromStart);
    };
    found.warnings.iter().for_each(|note| say(note));
    let differences = found.provenance.differences(origin);
    if !differences.is_empty() {
        return Err(Error::input(format!(
            "the checkpoint in {} belongs to another run:\n  {}\nrun with the scene, files and options of that run, or without --resume to start anew",
            output.path().display(),
            differences.join("\n  ")
        )));
    }
    let mut checkpoint_data: CheckpointData<RunCheckpoint> = found.state()?;
    let mut missing = output.restage(std::mem::take(&mut checkpoint_data.files))?;
    if !missing.is_empty() {
        checkpoint_data.written.remove_missing_files(&missing);
        let more = missing.len().saturating_sub(LISTED);
        let rest = if more > 0 { format!(", and {more} more") } else { String::new() };
        missing.truncate(LISTED);
        summary.warnings.push(Warning::note(format!(
            "files of the run before --resume are missing and are omitted from the collections: {}{rest}",
            missing.join(", ")
        )));
    }
    if let Some(last) = checkpoint_data.snapshot.records().last() {
        say(&format!("resuming in step \"{}\" after entry {}", last.name, last.increment));
    }
    Ok(ResumeDecision::FromCheckpoint(Box::new(ResumePoint { number: found.number, checkpoint_data })))
}

/// Loads the results in `directory` into `summary`. Returns false without a change if the results are not readable, do
/// not belong to `plan`, or have none of the statuses `ways`.
pub fn load_finished_run(plan: &Plan, directory: &Path, ways: &[Status], summary: &mut Summary) -> bool {
    let Some(mut found) = matching_summary(plan, directory) else { return false };
    let Ok(status) = serde_json::from_value::<Status>(found["status"].take()) else { return false };
    if !ways.contains(&status) {
        return false;
    }
    let Ok(steps) = serde_json::from_value::<Vec<IncrementRecord>>(found["steps"].take()) else {
        return false;
    };
    let Ok(warnings) = serde_json::from_value(found["warnings"].take()) else { return false };
    (summary.status, summary.steps, summary.warnings) = (status, steps, warnings);
    summary.reason = serde_json::from_value(found["reason"].take()).unwrap_or(None);
    summary.error = found["error"].as_str().map(str::to_owned);
    summary.exit_code = found["exit_code"].as_u64().and_then(|code| u8::try_from(code).ok());
    for (stage, seconds) in found["timings"].as_object().into_iter().flatten() {
        summary.timings.add(stage, seconds.as_f64().unwrap_or(0.0));
    }
    true
}

fn is_finished(plan: &Plan, directory: &Path) -> bool {
    matching_summary(plan, directory).is_some_and(|summary| summary["status"] == "converged")
}

/// Summary in `directory`, if it has the scene, accuracy and version of `plan`. The summary must not be older than the
/// files that the scene names.
fn matching_summary(plan: &Plan, directory: &Path) -> Option<Value> {
    let path = directory.join(SUMMARY_FILE);
    let changed = |path: &Path| path.metadata().and_then(|data| data.modified()).ok();
    let written = changed(&path)?;
    let summary = read_json(&path)?;
    let is_of_plan = summary["scene_sha256"] == plan.document.sha256.as_str()
        && summary["version"] == env!("CARGO_PKG_VERSION")
        && has_accuracy_of(plan, &summary)
        && plan.files.iter().all(|(_, path)| changed(path).is_some_and(|changed| changed <= written));
    is_of_plan.then_some(summary)
}

/// Whether the run of `summary` requested the accuracy of `plan`. The scene's SHA-256 does not suffice for this
/// comparison, because a command-line option can replace the accuracy.
fn has_accuracy_of(plan: &Plan, summary: &Value) -> bool {
    match (summary["accuracy"]["requested"].as_f64(), &plan.accuracy) {
        (Some(requested), Some(accuracy)) => requested == accuracy.relative,
        (Some(_), None) => false,
        // A run that failed before its first error estimate has no record of the accuracy.
        (None, Some(_)) => summary["status"] != "converged",
        (None, None) => true,
    }
}
