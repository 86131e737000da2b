//! Runs the program on a scene in a separate process, as a user does.

use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::Outcome;
use super::cases::Case;

#[derive(Debug, Clone)]
pub struct Run {
    /// Seconds of all stages except the output.
    pub total: f64,
    /// Seconds of the stage "flexibility", which computes the kernel table. Part of `total`.
    pub table: f64,
    /// Applications of the operator in all increments.
    pub applications: f64,
    /// Peak memory, MiB.
    pub memory: f64,
    /// Largest natural residual of all increments.
    pub residual: f64,
    /// Reported quantity of the case.
    pub quantity: f64,
    /// Contact area of the last entry, mm2.
    pub contact: f64,
    /// "converged", or the status of a run that did not converge.
    pub status: String,
}

/// Runs `case` on `n` x `n` cells. `how` contains method and width as in [`Case::write`].
///
/// # Errors
/// If the program cannot be run or leaves no summary.
pub fn run(program: &Path, case: Case, (n, threads): (usize, usize), how: (&str, f64)) -> Outcome<Run> {
    let folder = tempfile::tempdir()?;
    case.write(folder.path(), n, how)?;
    let out = folder.path().join("out");
    let done = Command::new(program)
        .args(["run", "--quiet", "--threads", &threads.to_string(), "--out"])
        .arg(&out)
        .arg(folder.path().join("scene.toml"))
        .output()?;
    let text = std::fs::read_to_string(out.join("summary.json"))
        .map_err(|_| format!("no summary: {}", String::from_utf8_lossy(&done.stderr)))?;
    read(case, &serde_json::from_str(&text)?)
}

fn read(case: Case, summary: &Value) -> Outcome<Run> {
    let steps = summary["steps"].as_array().ok_or("a summary without steps")?;
    let last = steps.last().ok_or("a summary without a step")?;
    let timings = summary["timings"].as_object().ok_or("a summary without timings")?;
    let number = |value: &Value| value.as_f64().unwrap_or(f64::NAN);
    let stages = timings.iter().filter(|(name, _)| *name != "output");
    Ok(Run {
        total: stages.map(|(_, seconds)| number(seconds)).sum(),
        table: timings.get("flexibility").map_or(0.0, number),
        applications: steps.iter().map(|step| number(&step["operator_applications"])).sum(),
        memory: number(&summary["peak_memory_bytes"]) / f64::from(1 << 20),
        residual: steps
            .iter()
            .map(|step| number(&step["certificate"]["natural_residual"]))
            .fold(0.0, f64::max),
        quantity: case.quantity(last),
        contact: number(&last["contact_area"]),
        status: summary["status"].as_str().unwrap_or("unknown").to_owned(),
    })
}

pub fn median(mut runs: Vec<Run>) -> Run {
    runs.sort_by(|a, b| a.total.total_cmp(&b.total));
    runs.swap_remove(runs.len() / 2)
}
