//! Measures the memory estimate of `check` and the peak memory of a run. Each is a separate process without the cache.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

use super::Outcome;
use super::cases::Case;

/// Factor between successive trial limits in the search for the smallest accepted limit.
const STEP: f64 = 1.1;

/// Memory of a case, MiB.
#[derive(Debug, Clone, Copy)]
pub struct Measured {
    pub estimate: f64,
    pub peak: f64,
}

impl Measured {
    pub fn ratio(self) -> f64 {
        self.estimate / self.peak
    }
}

/// Measures estimate and peak of a case.
///
/// # Errors
/// If the program cannot be run, refuses the scene or fails.
pub fn row(program: &Path, case: &Case, threads: usize) -> Outcome<Measured> {
    let folder = tempfile::tempdir()?;
    let scene = case.place(folder.path())?;
    let mut options = vec!["--threads".to_owned(), threads.to_string()];
    options.extend(case.sets.iter().flat_map(|set| ["--set".to_owned(), set.clone()]));
    let call = |command: &str, more: &[String]| -> Outcome<Output> {
        let mut call = Command::new(program);
        call.env("ORTHOWEAR_CACHE_LIMIT", "0").arg(command).arg(&scene).args(&options).args(more);
        Ok(call.output()?)
    };
    let limit = if case.least { least(&|more| call("check", more))? } else { Vec::new() };
    let checked = call("check", &limit)?;
    let told = String::from_utf8_lossy(&checked.stdout).into_owned();
    let estimate = estimate(&told).ok_or_else(|| String::from_utf8_lossy(&checked.stderr).into_owned())?;
    let out = folder.path().join("out").to_string_lossy().into_owned();
    let done = call("run", &[limit, ["--quiet", "--out", &out].map(str::to_owned).to_vec()].concat())?;
    let text = std::fs::read_to_string(Path::new(&out).join("summary.json"))
        .map_err(|_| format!("no summary: {}", String::from_utf8_lossy(&done.stderr)))?;
    let summary: Value = serde_json::from_str(&text)?;
    if summary["status"] != "converged" {
        return Err(format!("{}: {}", summary["status"], String::from_utf8_lossy(&done.stderr)).into());
    }
    let peak = summary["peak_memory_bytes"].as_f64().ok_or("a summary without its peak")?;
    Ok(Measured { estimate, peak: peak / f64::from(1 << 20) })
}

/// Option with the smallest memory limit that `check` accepts, found by trial. The limit leads to conjugate gradients.
fn least(check: &dyn Fn(&[String]) -> Outcome<Output>) -> Outcome<Vec<String>> {
    let mut bytes = 1.2e7;
    loop {
        let option = vec!["--max-memory".to_owned(), format!("{bytes:.0}")];
        let checked = check(&option)?;
        match checked.status.code() {
            Some(0) if String::from_utf8_lossy(&checked.stdout).contains("conjugate gradients") => {
                return Ok(option);
            }
            Some(4) => bytes *= STEP,
            _ => return Err("no memory leads to conjugate gradients".into()),
        }
    }
}

/// Memory estimate in the output `told` of `check`, MiB.
fn estimate(told: &str) -> Option<f64> {
    let line = told.lines().find(|line| line.starts_with("memory"))?;
    line.split_once("about ")?.1.split_whitespace().next()?.parse().ok()
}
