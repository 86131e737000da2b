//! Error against run time: the scene of two half-spaces with several numbers of cells, and the block scene with several
//! element sizes. Runs the program as a user does, and writes tables and charts.
//!
//!     cargo build --release
//!     cargo run --release --example error_vs_time -- [half-spaces] [block] [--out DIR]
//!
//! Without names, both scenes are run. DIR is docs/benchmarks by default. The block needs gmsh.

mod machine;
mod places;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};
use serde_json::Value;

use places::{program, root};

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Normal forces (N) after the two steps of the half-space scene with a tilt of 30 degrees. They come from an
/// independent program, extrapolated from 128 and 256 cells per side.
const EXTRAPOLATED: [f64; 2] = [417.87604, 303.76251];

struct Sample {
    /// Cells along the frame, or elements along the contact patch.
    size: usize,
    seconds: f64,
    /// Normal force after each step, N.
    forces: Vec<f64>,
    operator_applications: u64,
    peak_megabytes: f64,
}

fn main() -> Outcome<()> {
    let mut names = Vec::new();
    let mut out = root().join("docs/benchmarks");
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a directory")?.into(),
            "half-spaces" | "block" => names.push(argument),
            other => {
                return Err(
                    format!("unknown argument {other}; allowed: half-spaces, block, --out DIR").into()
                );
            }
        }
    }
    fs::create_dir_all(&out)?;
    let wanted = |name: &str| names.is_empty() || names.iter().any(|n| n == name);
    if wanted("half-spaces") {
        half_spaces(&out)?;
    }
    if wanted("block") {
        block(&out)?;
    }
    Ok(())
}

fn half_spaces(out: &Path) -> Outcome<()> {
    let scene = root().join("scenes/sphere-on-cfrp-halfspaces.toml");
    let mut samples = Vec::new();
    for n in [16, 24, 32, 48, 64, 96, 128, 192, 256] {
        samples.push(fastest(n, &scene, &[format!("frame.cells=[{n}, {n}]")])?);
    }
    let errors = relative_errors(&samples, &EXTRAPOLATED);
    write_table(&out.join("half-spaces.csv"), "cells_along_frame", &samples, &errors)?;
    write_chart(
        &out.join("half-spaces.svg"),
        "Two half-spaces: 16 to 256 cells along the frame",
        &samples,
        &errors,
    )
}

fn block(out: &Path) -> Outcome<()> {
    let folder = std::env::temp_dir().join(format!("orthowear-benchmark-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let scene = folder.join("indent-and-shift.toml");
    fs::write(&scene, first_steps(&fs::read_to_string(root().join("scenes/sphere-on-cfrp-block.toml"))?, 2))?;
    let mut samples = Vec::new();
    // The element size in the patch is proportional to 1 / patch.
    for (patch, outer, depth) in [(8, 3, 5), (12, 4, 7), (16, 5, 9), (24, 7, 12), (32, 9, 16), (40, 11, 19)] {
        let mesh = folder.join(format!("block-{patch}.msh"));
        make_block(&mesh, patch, outer, depth)?;
        let overrides = [
            format!("body1.mesh=\"{}\"", mesh.display()),
            // The benchmark measures the elements under the contact.
            "body1.near_field=\"mesh\"".to_owned(),
            "frame.cells=[28, 28]".to_owned(),
        ];
        samples.push(fastest(patch, &scene, &overrides)?);
    }
    fs::remove_dir_all(&folder)?;
    let errors = relative_errors(&samples, &second_order_limit(&samples)?);
    write_table(&out.join("block.csv"), "elements_along_patch", &samples, &errors)?;
    let title = "Block on half-space: 8 to 40 elements along the patch";
    write_chart(&out.join("block.svg"), title, &samples, &errors)
}

/// Richardson extrapolation of the forces from the two finest meshes. The error is assumed to be of second order in the
/// element size.
fn second_order_limit(samples: &[Sample]) -> Outcome<Vec<f64>> {
    let [.., coarse, fine] = samples else { return Err("fewer than two samples".into()) };
    let gain = (fine.size as f64 / coarse.size as f64).powi(2) - 1.0;
    Ok(fine.forces.iter().zip(&coarse.forces).map(|(fine, coarse)| fine + (fine - coarse) / gain).collect())
}

fn first_steps(scene: &str, n: usize) -> String {
    scene.split("[[steps]]").take(n + 1).collect::<Vec<_>>().join("[[steps]]")
}

fn make_block(mesh: &Path, patch: usize, outer: usize, depth: usize) -> Outcome<()> {
    let numbers = [
        ("patch_cells", patch as f64),
        ("outer_cells", outer as f64),
        ("depth_cells", depth as f64),
        ("first_depth", 2.88 / patch as f64),
    ];
    let mut gmsh = Command::new("gmsh");
    gmsh.arg(root().join("meshes/cfrp-block.geo")).args(["-3", "-v", "2", "-format", "msh22", "-bin"]);
    for (name, value) in numbers {
        gmsh.args(["-setnumber", name, &value.to_string()]);
    }
    let status = gmsh.arg("-o").arg(mesh).status()?;
    if status.success() { Ok(()) } else { Err("gmsh failed".into()) }
}

/// Fastest of up to three runs. Slower runs were disturbed by other programs. Runs of at least 10 s are not repeated.
fn fastest(size: usize, scene: &Path, overrides: &[String]) -> Outcome<Sample> {
    let mut best = run(size, scene, overrides)?;
    for _ in 0..2 {
        if best.seconds < 10.0 {
            let again = run(size, scene, overrides)?;
            if again.seconds < best.seconds {
                best = again;
            }
        }
    }
    println!("{size}: {:.3} s, forces {:?}", best.seconds, best.forces);
    Ok(best)
}

fn run(size: usize, scene: &Path, overrides: &[String]) -> Outcome<Sample> {
    let out = std::env::temp_dir().join(format!("orthowear-run-{}", std::process::id()));
    let mut program = Command::new(program()?);
    program.arg("run").arg(scene).arg("--quiet").arg("--out").arg(&out).args(["--set", "output.fields=[]"]);
    for setting in overrides {
        program.args(["--set", setting]);
    }
    let start = Instant::now();
    let status = program.status()?;
    let seconds = start.elapsed().as_secs_f64();
    if !status.success() {
        return Err(format!("the run of size {size} ended with {status}").into());
    }
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json"))?)?;
    fs::remove_dir_all(&out)?;
    let steps = summary["steps"].as_array().ok_or("no steps in the summary")?;
    Ok(Sample {
        size,
        seconds,
        forces: steps.iter().filter_map(|step| step["normal_force"].as_f64()).take(2).collect(),
        operator_applications: steps.iter().filter_map(|step| step["operator_applications"].as_u64()).sum(),
        peak_megabytes: summary["peak_memory_bytes"].as_f64().unwrap_or(0.0) / 1e6,
    })
}

/// Relative errors |force / reference - 1| of the forces of each sample.
fn relative_errors(samples: &[Sample], references: &[f64]) -> Vec<Vec<f64>> {
    samples
        .iter()
        .map(|sample| {
            sample.forces.iter().zip(references).map(|(force, wanted)| (force / wanted - 1.0).abs()).collect()
        })
        .collect()
}

const STEPS: [&str; 2] = ["indentation", "shift"];

fn write_table(path: &Path, size: &str, samples: &[Sample], errors: &[Vec<f64>]) -> Outcome<()> {
    let mut text = machine::comment();
    writeln!(
        text,
        "{size},seconds,normal_force_indent,relative_error_indent,normal_force_shift,relative_error_shift,\
         operator_applications,peak_megabytes"
    )?;
    for (sample, errors) in samples.iter().zip(errors) {
        write!(text, "{},{:.3}", sample.size, sample.seconds)?;
        for (force, error) in sample.forces.iter().zip(errors) {
            write!(text, ",{force:.6},{error:.3e}")?;
        }
        writeln!(text, ",{},{:.0}", sample.operator_applications, sample.peak_megabytes)?;
    }
    Ok(fs::write(path, text)?)
}

fn write_chart(path: &Path, title: &str, samples: &[Sample], errors: &[Vec<f64>]) -> Outcome<()> {
    let series = STEPS.iter().enumerate().map(|(step, name)| Series {
        name: (*name).to_owned(),
        points: samples.iter().zip(errors).map(|(sample, errors)| [sample.seconds, errors[step]]).collect(),
    });
    let chart = Chart {
        title: title.to_owned(),
        labels: ["run time, s".to_owned(), "relative error of the normal force".to_owned()],
        scales: [Scale::Logarithmic; 2],
        series: series.collect(),
    };
    Ok(fs::write(path, chart.svg())?)
}
