//! Wear depth after 100 000 fretting cycles: error, run time and number of contact problems of each integrator. Also
//! compares the solver for sliding contacts with the solver for all unknowns.
//!
//!     cargo run --release --example wear -- [--cells N] [--repeats N] [--sliding]
//!
//! `--sliding` only compares the two solvers. Tables and charts are written to docs/benchmarks.

#[path = "../machine.rs"]
mod machine;

use std::error::Error;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use orthowear::evolution::observer::Observer;
use orthowear::evolution::records::{FrameState, IncrementRecord};
use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};
use orthowear::{scene, simulation};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Number of equal wear jumps of the reference run.
const FINE: usize = 200;

struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> orthowear::error::Result<()> {
        Ok(())
    }
}

#[derive(Clone)]
struct Run {
    seconds: f64,
    jumps: usize,
    solves: usize,
    worn: Vec<f64>,
    last: IncrementRecord,
}

/// Runs the scene with overrides `repeats` times, and returns the run with the median time.
fn run(overrides: &[String], repeats: usize) -> Outcome<Run> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere-wear.toml");
    let plan = scene::read(&path, overrides).map_err(|mistakes| mistakes.to_error().to_string())?;
    let mut runs = Vec::new();
    for _ in 0..repeats {
        let study = simulation::build(&plan, &mut |_| {}, &AtomicBool::new(false))
            .map_err(|failure| failure.error.to_string())?;
        let result = study.run(&mut Silent).map_err(|error| error.to_string())?;
        let seconds = result.timings.iter().filter(|(stage, _)| stage == "fretting").map(|(_, s)| s).sum();
        let jumps: Vec<_> = result.records.iter().filter_map(|record| record.jump).collect();
        let last = result.records.last().ok_or("no entries")?.clone();
        if !last.converged {
            return Err(format!("{overrides:?} did not converge").into());
        }
        let solves = jumps.iter().map(|jump| jump.solves).sum();
        runs.push(Run { seconds, jumps: jumps.len(), solves, worn: result.state.wear_depth, last });
    }
    runs.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    Ok(runs[runs.len() / 2].clone())
}

/// Root mean square of `a` - `b` over the cells with wear in `b`, divided by the largest wear depth of `b`.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let squares: Vec<f64> =
        a.iter().zip(b).filter(|(_, b)| **b > 0.0).map(|(a, b)| (a - b).powi(2)).collect();
    let deepest = b.iter().copied().fold(0.0, f64::max);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / deepest
}

struct Row {
    integrator: &'static str,
    jumps: String,
    run: Run,
    error: f64,
}

impl Row {
    fn new(integrator: &'static str, jumps: &str, run: Run, fine: &Run) -> Self {
        let error = difference(&run.worn, &fine.worn);
        Self { integrator, jumps: jumps.to_owned(), run, error }
    }

    fn line(&self, fine: &Run) -> String {
        let Run { seconds, jumps, solves, last, .. } = &self.run;
        let relative = |value: f64, of: f64| (value / of - 1.0).abs();
        format!(
            "{},{},{jumps},{solves},{:.2e},{:.2e},{:.2e},{:.2e},{seconds:.3}",
            self.integrator,
            self.jumps,
            self.error,
            last.wear_depth_error / fine.last.max_wear_depth,
            relative(last.max_wear_depth, fine.last.max_wear_depth),
            relative(last.worn_volume, fine.last.worn_volume),
        )
    }
}

fn integrators(tilt: f64, cells: usize, repeats: usize) -> Outcome<()> {
    let scene = |more: &[String]| {
        let common = [format!("body1.fibre.tilt={tilt:?}"), format!("frame.cells=[{cells}, {cells}]")];
        [&common, more].concat()
    };
    let jumps = |n: usize| format!("steps.fretting.cycles.jumps={n}");
    let of = |integrator: &str| format!("wear.integrator=\"{integrator}\"");
    let fine = run(&scene(&[jumps(FINE)]), 1)?;
    let mut rows = Vec::new();
    for (integrator, counts) in [
        ("explicit", &[16, 32, 64, 128][..]),
        ("backward-euler", &[2, 4, 8, 16, 32, 64]),
        ("sdirk2", &[2, 4, 8, 16, 32]),
    ] {
        for &count in counts {
            let found = run(&scene(&[of(integrator), jumps(count)]), repeats)?;
            rows.push(Row::new(integrator, "equal", found, &fine));
        }
        for tolerance in ["1e-2", "1e-3", "1e-4"] {
            let found = run(&scene(&[of(integrator), format!("wear.tolerance={tolerance}")]), repeats)?;
            rows.push(Row::new(integrator, tolerance, found, &fine));
        }
    }
    let mut text = machine::comment();
    writeln!(text, "# tilt {tilt}, {cells} x {cells} cells, errors against {FINE} equal jumps of sdirk2")?;
    writeln!(
        text,
        "integrator,jumps_equal_or_by_tolerance,jumps,contact_solves,rms_depth_error,its_estimate,\
         error_of_largest_depth,error_of_volume,seconds"
    )?;
    rows.iter().try_for_each(|row| writeln!(text, "{}", row.line(&fine)))?;
    print!("{text}");
    fs::write(out(&format!("wear-tilt{tilt}.csv")), text)?;
    let line = |integrator: &str, equal: bool| Series {
        name: format!("{integrator}, {}", if equal { "equal jumps" } else { "by tolerance" }),
        points: rows
            .iter()
            .filter(|row| row.integrator == integrator && (row.jumps == "equal") == equal)
            .map(|row| [row.run.seconds, row.error])
            .collect(),
    };
    let chart = Chart {
        title: format!("100 000 fretting cycles, fibres at {tilt} degrees"),
        labels: ["run time, s".to_owned(), "rms error of the worn depth / largest depth".to_owned()],
        scales: [Scale::Logarithmic; 2],
        series: [
            line("explicit", true),
            line("backward-euler", true),
            line("sdirk2", true),
            line("sdirk2", false),
        ]
        .into(),
    };
    Ok(fs::write(out(&format!("wear-tilt{tilt}.svg")), chart.svg())?)
}

/// Compares two solver methods. "newton" solves for all unknowns. "auto" solves for pressures alone where the
/// contact slides.
fn sliding(repeats: usize) -> Outcome<()> {
    let mut text = machine::comment();
    writeln!(
        text,
        "# 8 equal jumps of sdirk2; auto: pressures alone where the contact slides, newton: all unknowns"
    )?;
    writeln!(text, "cells,tilt,auto_seconds,newton_seconds,ratio,volumes_differ_by")?;
    for (cells, tilt) in
        [58, 116, 232].into_iter().flat_map(|cells| [0.0, 30.0, 90.0].map(|tilt| (cells, tilt)))
    {
        let with = |method: &str| {
            run(
                &[
                    format!("body1.fibre.tilt={tilt:?}"),
                    format!("frame.cells=[{cells}, {cells}]"),
                    "steps.fretting.cycles.jumps=8".to_owned(),
                    format!("solver.method=\"{method}\""),
                ],
                repeats,
            )
        };
        let (auto, newton) = (with("auto")?, with("newton")?);
        writeln!(
            text,
            "{cells},{tilt},{:.3},{:.3},{:.2},{:.1e}",
            auto.seconds,
            newton.seconds,
            newton.seconds / auto.seconds,
            (auto.last.worn_volume / newton.last.worn_volume - 1.0).abs()
        )?;
    }
    print!("{text}");
    Ok(fs::write(out("wear-sliding.csv"), text)?)
}

fn out(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/benchmarks").join(name)
}

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let value = |name: &str, usual: usize| -> Outcome<usize> {
        match words.iter().position(|word| word == name) {
            Some(at) => Ok(words.get(at + 1).ok_or(format!("{name}: a number is missing"))?.parse()?),
            None => Ok(usual),
        }
    };
    let (cells, repeats) = (value("--cells", 64)?, value("--repeats", 3)?.max(1));
    // With more threads, short parallel parts would take longer, because they would wait for other threads.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    if !words.iter().any(|word| word == "--sliding") {
        for tilt in [0.0, 90.0] {
            integrators(tilt, cells, repeats)?;
        }
    }
    sliding(repeats)
}
