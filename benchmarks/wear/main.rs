//! Worn depth of 100 000 fretting cycles: error against run time of the integrators, at equal and at controlled jumps; contact solves;
//! the solver for contacts that slide against the one with all unknowns.
//!
//!     cargo run --release --example wear -- [--cells N] [--repeats N]

#[path = "../machine.rs"]
mod machine;

use std::error::Error;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use orthowear::history::step::{FrameState, IncrementRecord, Observer};
use orthowear::{scene, study};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Equal jumps of the run that errors are taken from.
const FINE: usize = 200;

struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &str, _: f64, _: Option<f64>) {}

    fn increment_done(&mut self, _: &IncrementRecord, _: &FrameState) -> orthowear::error::Result<()> {
        Ok(())
    }
}

/// A run of the scene, its median time, and what it found.
#[derive(Clone)]
struct Run {
    seconds: f64,
    jumps: usize,
    solves: usize,
    worn: Vec<f64>,
    last: IncrementRecord,
}

/// Runs the scene with some values changed, as often as `repeats` says.
fn run(overrides: &[String], repeats: usize) -> Outcome<Run> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sphere-wear.toml");
    let plan = scene::read(&path, overrides).map_err(|mistakes| mistakes.to_error().to_string())?;
    let mut runs = Vec::new();
    for _ in 0..repeats {
        let study = study::prepare(&plan, &mut |_, _| {}, &AtomicBool::new(false))
            .map_err(|failure| failure.error.to_string())?
            .ok_or("interrupted")?;
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

/// Root of the mean square difference over the worn cells of the second, over its largest depth.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let squares: Vec<f64> =
        a.iter().zip(b).filter(|(_, b)| **b > 0.0).map(|(a, b)| (a - b).powi(2)).collect();
    let deepest = b.iter().copied().fold(0.0, f64::max);
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / deepest
}

fn row(name: &str, how: &str, run: &Run, fine: &Run) {
    let volume = (run.last.worn_volume / fine.last.worn_volume - 1.0).abs();
    let deepest = (run.last.max_wear_depth / fine.last.max_wear_depth - 1.0).abs();
    println!(
        "| {name} | {how} | {} | {} | {:.1e} | {:.1e} | {deepest:.1e} | {volume:.1e} | {:.3} |",
        run.jumps,
        run.solves,
        difference(&run.worn, &fine.worn),
        run.last.wear_depth_error / fine.last.max_wear_depth,
        run.seconds
    );
}

fn integrators(tilt: f64, cells: usize, repeats: usize) -> Outcome<()> {
    let scene = |more: &[String]| {
        let common = [format!("body1.fibre.tilt={tilt:?}"), format!("frame.cells=[{cells}, {cells}]")];
        [&common, more].concat()
    };
    let jumps = |n: usize| format!("steps.fretting.cycles.jumps={n}");
    let of = |integrator: &str| format!("wear.integrator=\"{integrator}\"");
    let fine = run(&scene(&[jumps(FINE)]), 1)?;
    println!("\n### Tilt {tilt}, {cells} x {cells} cells\n");
    println!(
        "| integrator | jumps | number | solves | rms error / depth | its estimate | of the depth | of the volume | s |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for (integrator, counts) in [
        ("explicit", &[16, 32, 64, 128][..]),
        ("backward-euler", &[2, 4, 8, 16, 32, 64]),
        ("sdirk2", &[2, 4, 8, 16, 32]),
    ] {
        for &count in counts {
            let found = run(&scene(&[of(integrator), jumps(count)]), repeats)?;
            row(integrator, "equal", &found, &fine);
        }
        for tolerance in ["1e-2", "1e-3", "1e-4"] {
            let found = run(&scene(&[of(integrator), format!("wear.tolerance={tolerance}")]), repeats)?;
            row(integrator, &format!("by tolerance {tolerance}"), &found, &fine);
        }
    }
    Ok(())
}

/// All unknowns in the one, pressures alone where the contact slides in the other; not on windows of the frame, in both.
fn sliding(repeats: usize) -> Outcome<()> {
    println!("\n### Contacts that slide: pressures alone (auto) and all unknowns (newton), 8 equal jumps\n");
    println!("| tilt | cells | auto, s | newton, s | ratio | volumes differ by |");
    println!("|---|---|---|---|---|---|");
    for tilt in [0.0, 30.0, 60.0, 90.0] {
        let with = |method: &str| {
            run(
                &[
                    format!("body1.fibre.tilt={tilt:?}"),
                    "frame.cells=[58, 58]".to_owned(),
                    "steps.fretting.cycles.jumps=8".to_owned(),
                    format!("solver.method=\"{method}\""),
                ],
                repeats,
            )
        };
        let (auto, newton) = (with("auto")?, with("newton")?);
        println!(
            "| {tilt} | 58 | {:.3} | {:.3} | {:.2} | {:.1e} |",
            auto.seconds,
            newton.seconds,
            newton.seconds / auto.seconds,
            (auto.last.worn_volume / newton.last.worn_volume - 1.0).abs()
        );
    }
    Ok(())
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
    rayon::ThreadPoolBuilder::new().num_threads(1).build_global()?;
    print!("{}", machine::comment());
    for tilt in [0.0, 90.0] {
        integrators(tilt, cells, repeats)?;
    }
    sliding(repeats)
}
