//! Time that each kind of omitted work saves. Every scene runs alternately with all omissions and without one of them.
//!
//!     cargo build --release
//!     cargo run --release --example skips -- [--repeats N] [SCENE ...]
//!
//! Runs the program as a user does, on one thread. If all scenes are run, writes docs/data/skips.csv.
//! `python3 benchmarks/summaries.py skips` then writes the summary in docs/skips.md.

#[path = "../machine.rs"]
mod machine;
#[path = "../places.rs"]
mod places;
#[path = "../quoted.rs"]
mod quoted;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::process::Command;
use std::time::Instant;

use serde_json::Value;

use places::{program, root};
use quoted::quoted;

type Outcome<T> = Result<T, Box<dyn Error>>;

const HEADER: &str = "scene,omitted,saved_s,run_factor,contact_factor,difference\n";

/// Titles, files and overrides of the scenes.
const SCENES: [(&str, &str, &[&str]); 12] = [
    ("Hertz, 80 cells", "hertz.toml", &["frame.cells=[80, 80]"]),
    ("Hertz, 300 cells", "hertz.toml", &["frame.cells=[300, 300]"]),
    (
        "Hertz, 300 cells, a fifth of the frame in contact",
        "hertz.toml",
        &["frame.cells=[300, 300]", "frame.half_width=[0.8, 0.8]"],
    ),
    ("Cattaneo and Mindlin, 80 cells", "cattaneo-mindlin.toml", &["frame.cells=[80, 80]"]),
    ("Cattaneo and Mindlin, 20 increments", "cattaneo-mindlin.toml", &["steps.pull.increments=20"]),
    ("CFRP, tilt 30, indent and shift", "sphere-on-cfrp-halfspaces.toml", &[]),
    (
        "CFRP, tilt 30, 10 and 10 increments, 128 cells",
        "sphere-on-cfrp-halfspaces.toml",
        &["frame.cells=[128, 128]", "steps.indent.increments=10", "steps.shift.increments=10"],
    ),
    ("CFRP, gross slip, 100 000 cycles", "sphere-wear.toml", &[]),
    (
        "CFRP, partial slip, 1000 cycles",
        "sphere-wear.toml",
        &["steps.fretting.cycles={count = 1000, amplitude = 0.004, angle = 0.0}"],
    ),
    ("Rolling cylinders", "rolling-cylinders.toml", &[]),
    ("Steel cap on CFRP block, meshed", "steel-cap-on-cfrp-block.toml", &[]),
    (
        "Sphere on CFRP block, meshed, approach of 0.005",
        "sphere-on-cfrp-block.toml",
        &["body1.near_field=\"mesh\"", "steps.indent.approach=0.005", "steps.fretting.cycles.jumps=1"],
    ),
];

struct Run {
    whole: f64,
    contact: f64,
    summary: Value,
}

fn main() -> Outcome<()> {
    let (mut repeats, mut names) = (5, Vec::new());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--repeats" => repeats = arguments.next().ok_or("--repeats needs a number")?.parse()?,
            name if SCENES.iter().any(|scene| scene.1.starts_with(name)) => names.push(argument),
            other => {
                return Err(format!(
                    "unknown argument {other}; allowed: --repeats N, beginnings of scenes' names"
                )
                .into());
            }
        }
    }
    let mut table = HEADER.to_owned();
    for (title, file, settings) in SCENES {
        if names.is_empty() || names.iter().any(|name| file.starts_with(name.as_str())) {
            table.push_str(&rows(title, (file, settings), repeats)?);
        }
    }
    println!("{table}");
    if !names.is_empty() {
        return Ok(());
    }
    let command =
        format!("# command: cargo run --release --example skips; medians of {repeats}, one thread\n");
    fs::write(root().join("docs/data/skips.csv"), machine::comment() + &command + &table)?;
    Ok(())
}

/// Table rows of a scene: one row for each kind of omitted work, and one row for all kinds together.
fn rows(title: &str, scene: (&str, &[&str]), repeats: usize) -> Outcome<String> {
    let first = run(scene, None)?;
    let named = names(&first.summary);
    let mut choices: Vec<(String, String)> = named
        .iter()
        .map(|name| {
            let others: Vec<String> =
                named.iter().filter(|other| *other != name).map(|other| format!("{other:?}")).collect();
            (name.clone(), format!("solver.skip=[{}]", others.join(", ")))
        })
        .collect();
    choices.push(("all of these".to_owned(), "solver.skip=false".to_owned()));
    let mut text = String::new();
    for (name, choice) in choices {
        let (mut with, mut without) = (Vec::new(), Vec::new());
        for _ in 0..repeats.max(1) {
            with.push(run(scene, None)?);
            without.push(run(scene, Some(&choice))?);
            // A scene is not repeated if it takes more than a minute without the omission.
            if without[0].whole > 60.0 {
                break;
            }
        }
        let median = |runs: &[Run], of: &dyn Fn(&Run) -> f64| {
            let mut all: Vec<f64> = runs.iter().map(of).collect();
            all.sort_by(f64::total_cmp);
            all[all.len() / 2]
        };
        let [whole, contact] =
            [&|run: &Run| run.whole, &|run: &Run| run.contact] as [&dyn Fn(&Run) -> f64; 2];
        let wholes = [median(&without, whole), median(&with, whole)];
        let contacts = [median(&without, contact), median(&with, contact)];
        let apart = apart(&with[0].summary, &without[0].summary)?;
        let row = format!(
            "{},{name},{:.3},{:.2},{:.2},{apart:.0e}",
            quoted(title),
            wholes[0] - wholes[1],
            wholes[0] / wholes[1],
            contacts[0] / contacts[1]
        );
        println!("{row}");
        writeln!(text, "{row}")?;
    }
    Ok(text)
}

/// Names for `solver.skip`, from the omitted work in the summary of a run.
fn names(summary: &Value) -> Vec<String> {
    let entries = summary["skipped"].as_array().cloned().unwrap_or_default();
    entries.iter().filter_map(|entry| entry["skip"].as_str().map(str::to_owned)).collect()
}

/// Largest difference between two runs of forces, wear volumes and peak pressures at their ends. Each difference is
/// relative to the largest value of the same kind in run `a`.
fn apart(a: &Value, b: &Value) -> Outcome<f64> {
    let steps = |summary: &Value| summary["steps"].as_array().cloned().ok_or("no steps");
    let (a, b) = (steps(a)?, steps(b)?);
    let mut largest: f64 = 0.0;
    let kinds: [&[&str]; 3] = [
        &["/normal_force", "/tangential_force/0", "/tangential_force/1"],
        &["/worn_volume"],
        &["/peak_pressure"],
    ];
    for kind in kinds {
        let values = |step: &Value| -> Vec<f64> {
            kind.iter().map(|place| step.pointer(place).and_then(Value::as_f64).unwrap_or(0.0)).collect()
        };
        let scale = a.iter().flat_map(values).fold(0.0, |sum: f64, value| sum.max(value.abs()));
        // Only the last entries are compared. Wear jumps of different lengths end at the same number of cycles.
        for (a, b) in a.last().iter().zip(b.last().iter()) {
            for (x, y) in values(a).into_iter().zip(values(b)) {
                largest = largest.max(if scale > 0.0 { (x - y).abs() / scale } else { 0.0 });
            }
        }
    }
    Ok(largest)
}

fn run((file, settings): (&str, &[&str]), skip: Option<&str>) -> Outcome<Run> {
    let out = std::env::temp_dir().join(format!("orthowear-skips-{}", std::process::id()));
    let mut command = Command::new(program()?);
    command.arg("run").arg(root().join("scenes").join(file)).arg("--out").arg(&out);
    command.args(["--quiet", "--no-cache", "--threads", "1", "--set", "output.fields=[]"]);
    for set in settings.iter().copied().chain(skip) {
        command.args(["--set", set]);
    }
    let start = Instant::now();
    let output = command.output()?;
    let whole = start.elapsed().as_secs_f64();
    if !output.status.success() {
        return Err(
            format!("{file} {settings:?} {skip:?}: {}", String::from_utf8_lossy(&output.stderr)).into()
        );
    }
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json"))?)?;
    fs::remove_dir_all(&out)?;
    let steps = summary["steps"].as_array().ok_or("no steps in the summary")?;
    let contact = steps.iter().filter_map(|step| step["seconds"].as_f64()).sum();
    Ok(Run { whole, contact, summary })
}
