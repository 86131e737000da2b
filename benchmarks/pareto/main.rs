//! Error against run time for the settings of a user, scene by scene, with the Pareto front.
//!
//!     cargo build --release
//!     cargo run --release --example pareto -- [--quick] [--repeats N] [SCENE ...]
//!
//! Runs the program as a user does, on one thread. Writes docs/benchmarks/pareto-*.csv and .svg. If all scenes are run,
//! also writes benchmarks/RESULTS.md. Errors are relative to closed-form solutions, an integral equation and an
//! independent program. Meshes are made by gmsh.
//!
//! `--quick` runs few configurations once each and writes no files. It fails if a run does not converge or misses its
//! requested accuracy. It also fails if the error of an unchanged scene exceeds the limit of its case. Times are not
//! checked.

#[path = "../machine.rs"]
mod machine;
#[path = "../places.rs"]
mod places;

mod cases;
mod layer;
mod page;

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use cases::{Case, Configuration, OWN};
use places::{program, root};

pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// Runs of at least this time are not repeated, seconds.
const LONG: f64 = 10.0;
/// Runs of less than this time are repeated three times as often as other runs, seconds.
const SHORT: f64 = 0.5;

pub struct Sample {
    pub configuration: Configuration,
    /// Largest relative error of the values of the case; `None` if the run did not converge.
    pub error: Option<f64>,
    /// Seconds of the whole program, in ascending order.
    pub seconds: Vec<f64>,
    /// Whether no other configuration is both faster and more accurate.
    pub on_front: bool,
}

impl Sample {
    pub fn median(&self) -> f64 {
        self.seconds[self.seconds.len() / 2]
    }

    /// Largest distance of the quartiles of the seconds from the median.
    pub fn scatter(&self) -> f64 {
        let n = self.seconds.len();
        let [low, high] = [self.seconds[n / 4], self.seconds[(3 * n / 4).min(n - 1)]];
        (high - self.median()).max(self.median() - low)
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
    let folder = std::env::temp_dir().join(format!("orthowear-pareto-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let done = if quick { checked(&names, &folder) } else { all(&names, repeats, &folder, whole) };
    fs::remove_dir_all(&folder)?;
    done
}

/// Cases with these names, or all cases if `names` is empty.
fn chosen(quick: bool, names: &[String]) -> impl Iterator<Item = Case> {
    cases::all(quick).into_iter().filter(move |case| names.is_empty() || names.iter().any(|n| n == case.name))
}

fn checked(names: &[String], folder: &Path) -> Outcome<()> {
    let (start, mut wrong, mut runs) = (Instant::now(), Vec::new(), 0);
    for case in chosen(true, names) {
        for configuration in &case.configurations {
            let (seconds, error) = run(&case, configuration, folder)?;
            runs += 1;
            println!("{} {}: {seconds:.3} s, error {}", case.name, configuration.label, page::number(error));
            wrong.extend(complaint(&case, configuration, error));
        }
    }
    println!("{runs} runs in {:.0} s", start.elapsed().as_secs_f64());
    wrong.iter().for_each(|line| eprintln!("{line}"));
    if wrong.is_empty() {
        Ok(())
    } else {
        Err(format!("{} of {runs} runs are not as they must be", wrong.len()).into())
    }
}

fn complaint(case: &Case, configuration: &Configuration, error: Option<f64>) -> Option<String> {
    let place = format!("{} {}", case.name, configuration.label);
    let Some(error) = error else { return Some(format!("{place}: not converged")) };
    if let Some(asked) = configuration.asked.filter(|asked| error > asked + case.known) {
        return Some(format!("{place}: error {error:.2e}, asked for {asked:.0e}"));
    }
    let (allowed, why) = case.allowed;
    let beyond = configuration.family == OWN && error > allowed;
    beyond.then(|| format!("{place}: error {error:.2e}, allowed {allowed:.2e} ({why})"))
}

fn all(names: &[String], repeats: usize, folder: &Path, whole: bool) -> Outcome<()> {
    let mut results = Vec::new();
    for case in chosen(false, names) {
        let mut samples = measured(&case, repeats, folder)?;
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

/// Runs all configurations of a case in several rounds. Each round starts with another configuration, so that
/// disturbances by other programs spread evenly. If a run is repeated, its first time does not count.
fn measured(case: &Case, repeats: usize, folder: &Path) -> Outcome<Vec<Sample>> {
    let mut samples: Vec<Sample> = Vec::new();
    for configuration in &case.configurations {
        let (seconds, error) = run(case, configuration, folder)?;
        println!("{} {}: {seconds:.3} s, error {}", case.name, configuration.label, page::number(error));
        let configuration = configuration.clone();
        samples.push(Sample { configuration, error, seconds: vec![seconds], on_front: false });
    }
    let first: Vec<f64> = samples.iter().map(|sample| sample.seconds[0]).collect();
    let turns = 3 * repeats;
    for turn in 0..turns {
        for place in 0..samples.len() {
            let number = (place + turn * samples.len() / turns) % samples.len();
            let wanted = if first[number] < SHORT { turns } else { repeats };
            if first[number] < LONG && turn < wanted {
                let seconds = run(case, &case.configurations[number], folder)?.0;
                samples[number].seconds.push(seconds);
            }
        }
    }
    for sample in &mut samples {
        if sample.seconds.len() > 1 {
            sample.seconds.remove(0);
        }
        sample.seconds.sort_by(f64::total_cmp);
    }
    Ok(samples)
}

/// Seconds and error of a run. The error is `None` if the run did not converge.
fn run(case: &Case, configuration: &Configuration, folder: &Path) -> Outcome<(f64, Option<f64>)> {
    let out = folder.join("results");
    let mut program = Command::new(program()?);
    program.arg("run").arg(root().join(case.scene)).arg("--out").arg(&out);
    program.args(["--quiet", "--no-cache", "--threads", "1", "--set", "output.fields=[]"]);
    if let Some(mesh) = configuration.mesh {
        program.args(["--set", &format!("body1.mesh=\"{}\"", mesh.make(folder)?.display())]);
    }
    configuration.sets.iter().for_each(|set| {
        program.args(["--set", set]);
    });
    let start = Instant::now();
    let output = program.output()?;
    let seconds = start.elapsed().as_secs_f64();
    let text = fs::read(out.join("summary.json"))
        .map_err(|_| format!("{}: {}", configuration.label, String::from_utf8_lossy(&output.stderr)))?;
    fs::remove_dir_all(&out)?;
    if !output.status.success() {
        return Ok((seconds, None));
    }
    Ok((seconds, Some(largest_error(case, &serde_json::from_slice(&text)?)?)))
}

fn largest_error(case: &Case, summary: &Value) -> Outcome<f64> {
    let steps = summary["steps"].as_array().ok_or("no steps in the summary")?;
    let mut largest: f64 = 0.0;
    for truth in &case.truths {
        let entry = steps.iter().rfind(|entry| entry["name"] == truth.step).ok_or("a step is missing")?;
        let found = entry.pointer(truth.place).and_then(Value::as_f64).ok_or("a value is missing")?;
        largest = largest.max(((found - truth.value) / truth.scale).abs());
    }
    Ok(largest)
}

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
