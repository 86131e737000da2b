//! Error against run time over the settings that a user can turn, scene by scene, with the front that nothing beats.
//!
//!     cargo build --release
//!     cargo run --release --example pareto -- [--quick] [--repeats N] [SCENE ...]
//!
//! Runs the program as a user does, on one thread, and writes docs/benchmarks/pareto-*.csv and .svg and benchmarks/RESULTS.md (with all scenes
//! only). Errors are against closed forms and an independent program. `--quick` takes every configuration once, and few of them.

#[path = "../machine.rs"]
mod machine;

mod cases;
mod page;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use cases::{Case, Configuration};

pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// Runs of a configuration longer than this are not repeated.
const LONG: f64 = 10.0;

/// What a configuration gave.
pub struct Sample {
    pub configuration: Configuration,
    /// Largest relative error of the values of the case; `None` where the run did not converge.
    pub error: Option<f64>,
    /// Seconds of the whole program, in ascending order.
    pub seconds: Vec<f64>,
    /// Whether nothing is as fast and as accurate.
    pub on_front: bool,
}

impl Sample {
    pub fn median(&self) -> f64 {
        self.seconds[self.seconds.len() / 2]
    }
}

fn main() -> Outcome<()> {
    let (mut quick, mut repeats, mut names) = (false, 3, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--quick" => quick = true,
            "--repeats" => repeats = arguments.next().ok_or("--repeats needs a number")?.parse()?,
            name if cases::NAMES.contains(&name) => names.push(argument),
            other => {
                let allowed = cases::NAMES.join(", ");
                return Err(
                    format!("unknown argument {other}; allowed: --quick, --repeats N, {allowed}").into()
                );
            }
        }
    }
    let whole = names.is_empty() && !quick;
    let repeats = if quick { 1 } else { repeats };
    let mut results = Vec::new();
    for case in
        cases::all(quick).into_iter().filter(|case| names.is_empty() || names.iter().any(|n| n == case.name))
    {
        let mut samples = measured(&case, repeats)?;
        mark_front(&mut samples);
        page::write_table(&case, &samples, &root().join("docs/benchmarks"))?;
        page::write_chart(&case, &samples, &root().join("docs/benchmarks"))?;
        println!("{}", page::section(&case, &samples));
        results.push((case, samples));
    }
    if whole {
        fs::write(root().join("benchmarks/RESULTS.md"), page::results(&results))?;
    }
    Ok(())
}

/// Runs all configurations of a case, all of them once before any is repeated: what disturbs the machine for a while hits them alike.
fn measured(case: &Case, repeats: usize) -> Outcome<Vec<Sample>> {
    let mut samples: Vec<Sample> = Vec::new();
    for repeat in 0..repeats.max(1) {
        for (number, configuration) in case.configurations.iter().enumerate() {
            if repeat == 0 {
                let (seconds, error) = run(case, configuration)?;
                println!("{} {}: {seconds:.3} s, error {error:?}", case.name, configuration.label);
                let configuration = configuration.clone();
                samples.push(Sample { configuration, error, seconds: vec![seconds], on_front: false });
            } else if samples[number].seconds[0] < LONG {
                samples[number].seconds.push(run(case, configuration)?.0);
            }
        }
    }
    samples.iter_mut().for_each(|sample| sample.seconds.sort_by(f64::total_cmp));
    Ok(samples)
}

/// Seconds and error of a run.
fn run(case: &Case, configuration: &Configuration) -> Outcome<(f64, Option<f64>)> {
    let out = std::env::temp_dir().join(format!("orthowear-pareto-{}", std::process::id()));
    let mut program = Command::new(program()?);
    program.arg("run").arg(root().join("scenes").join(case.scene)).arg("--out").arg(&out);
    program.args(["--quiet", "--no-cache", "--threads", "1", "--set", "output.fields=[]"]);
    configuration.sets.iter().for_each(|set| {
        program.args(["--set", set]);
    });
    let start = Instant::now();
    let output = program.output()?;
    let seconds = start.elapsed().as_secs_f64();
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json"))?)?;
    fs::remove_dir_all(&out)?;
    if !output.status.success() {
        return Ok((seconds, None));
    }
    let steps = summary["steps"].as_array().ok_or("no steps in the summary")?;
    let error = |truth: &cases::Truth| -> Outcome<f64> {
        let entry = steps.iter().rfind(|entry| entry["name"] == truth.step).ok_or("a step is missing")?;
        let found = entry.pointer(truth.place).and_then(Value::as_f64).ok_or("a value is missing")?;
        Ok(((found - truth.value) / truth.scale).abs())
    };
    let errors = case.truths.iter().map(error).collect::<Outcome<Vec<f64>>>()?;
    Ok((seconds, Some(errors.into_iter().fold(0.0, f64::max))))
}

/// Marks the samples that no other beats in both.
fn mark_front(samples: &mut [Sample]) {
    let points: Vec<(Option<f64>, f64)> =
        samples.iter().map(|sample| (sample.error, sample.median())).collect();
    for (sample, (error, seconds)) in samples.iter_mut().zip(points.clone()) {
        let Some(error) = error else { continue };
        let beats = |&(other, time): &(Option<f64>, f64)| {
            other
                .is_some_and(|other| (other <= error && time < seconds) || (other < error && time <= seconds))
        };
        sample.on_front = !points.iter().any(beats);
    }
}

/// The program beside this one: target/release/orthowear.
fn program() -> Outcome<PathBuf> {
    let here = std::env::current_exe()?;
    let folder = here.parent().and_then(Path::parent).ok_or("no folder of the program")?;
    let program = folder.join("orthowear");
    if program.exists() { Ok(program) } else { Err("run `cargo build --release` first".into()) }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}
