//! Error of the load against seconds for a rigid sphere on blocks. The blocks are computed with the near field of a
//! half-space, and with condensed meshes.
//!
//!     cargo build --release
//!     cargo run --release --example near_field -- [--out DIR] [--repeats N] [--products]
//!
//! DIR is docs/benchmarks by default. `--products` measures only the products with the operators, not the loads.

#[path = "../im7.rs"]
mod material;
#[path = "../machine.rs"]
mod machine;
#[path = "../places.rs"]
mod places;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;
use std::time::Instant;

use material::im7;
use orthowear::bem::half_space::CrossBlocks;
use orthowear::body::hybrid::HalfSpaceFit;
use orthowear::body::{ElasticBody, HalfSpaceBody, HybridBody};
use orthowear::fem::{CondensationResources, FeSpec, HexFormulation, Support};
use orthowear::frame::{ContactFrame, Side};
use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};
use places::{program, root};
use serde_json::Value;

type Outcome<T> = Result<T, Box<dyn Error>>;

const STEEL: &str = "[materials.m]\nmodel = \"isotropic\"\nE = 210e3\nnu = 0.3\n";
const CFRP: &str = "[materials.m]\nmodel = \"orthotropic\"\nE1 = 167230.0\nE2 = 9544.0\nE3 = 9544.0\nG12 = 5292.0\nG13 = 5292.0\n\
                    G23 = 3483.0\nnu12 = 0.272\nnu13 = 0.272\nnu23 = 0.369\n";

const SCENE: &str = r#"
[body1]
kind = "fe"
material = "m"
fibre = { tilt = 30.0 }
mesh = "block.msh"
contact = "contact"
fixed = [{ group = "base" }]
[body2]
kind = "rigid"
[frame]
kind = "grid"
half_width = [1.2, 1.2]
cells = [64, 64]
[gap]
kind = "sphere"
radius = 50.0
[[steps]]
approach = 0.02
[output]
fields = []
"#;

/// Blocks: name, material, half-width (mm), which equals the depth, and reference load (N). An independent program with
/// 14³ hexahedra of 27 nodes computed the load, to a relative accuracy of 1e-4 (steel) and 1e-3 (CFRP).
const BLOCKS: [(&str, &str, f64, f64); 5] = [
    ("steel 3", STEEL, 3.0, 8414.4),
    ("steel 6", STEEL, 6.0, 7138.7),
    ("steel 12", STEEL, 12.0, 6609.7),
    ("cfrp 3", CFRP, 3.0, 462.29),
    ("cfrp 6", CFRP, 6.0, 411.69),
];

/// Meshes that correct a half-space: cells along an edge, order of the elements, and ratio of the largest to the
/// smallest cell size.
const FAR: [(usize, usize, f64); 8] = [
    (4, 1, 1.0),
    (8, 1, 3.0),
    (12, 1, 3.0),
    (16, 1, 3.0),
    (2, 2, 4.0),
    (4, 2, 4.0),
    (6, 2, 4.0),
    (8, 2, 3.0),
];

const PRODUCTS: usize = 15;

/// Condensed meshes: number of first-order elements along the patch, around the patch and over the depth, and number of
/// cells along the frame.
const CONDENSED: [(usize, usize, usize, usize); 4] =
    [(8, 4, 6, 7), (12, 6, 8, 11), (16, 7, 10, 14), (24, 9, 14, 22)];

struct Sample {
    what: String,
    unknowns: usize,
    seconds: f64,
    load: f64,
}

fn main() -> Outcome<()> {
    let mut out = root().join("docs/benchmarks");
    let (mut repeats, mut loads) = (3, true);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        if argument == "--products" {
            loads = false;
            continue;
        }
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--out" => out = value()?.into(),
            "--repeats" => repeats = value()?.parse()?,
            other => {
                return Err(
                    format!("unknown argument {other}; allowed: --out DIR, --repeats N, --products").into()
                );
            }
        }
    }
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    fs::create_dir_all(&out)?;
    let folder = std::env::temp_dir().join(format!("orthowear-near-field-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    if loads {
        write_loads(&folder, &out, repeats)?;
    }
    let products = products(&folder)?;
    fs::remove_dir_all(&folder)?;
    fs::write(out.join("near-field-products.csv"), products)?;
    Ok(())
}

fn write_loads(folder: &Path, out: &Path, repeats: usize) -> Outcome<()> {
    let mut text = machine::comment();
    writeln!(
        text,
        "# wall seconds from the start of the program to its end, one thread, nothing cached, median of {repeats}"
    )?;
    writeln!(text, "block,near_field,mesh,unknowns,seconds,load_N,relative_error")?;
    for (name, material, half, truth) in BLOCKS {
        fs::write(folder.join("scene.toml"), format!("{material}{SCENE}"))?;
        let mut series = Vec::new();
        for (near_field, samples) in
            [("half-space", far_field(folder, half, repeats)?), ("mesh", condensed(folder, half, repeats)?)]
        {
            for sample in &samples {
                let error = sample.load / truth - 1.0;
                let Sample { what, unknowns, seconds, load } = sample;
                let line =
                    format!("{name},{near_field},{what},{unknowns},{seconds:.3},{load:.4},{error:+.2e}");
                println!("{line}");
                writeln!(text, "{line}")?;
            }
            for order in ["order 1", "order 2", "patch"] {
                let own = samples.iter().filter(|sample| sample.what.ends_with(order));
                let points: Vec<_> = own.map(|s| [s.seconds, (s.load / truth - 1.0).abs()]).collect();
                if !points.is_empty() {
                    let name = if order == "patch" {
                        near_field.to_owned()
                    } else {
                        format!("{near_field}, {order}")
                    };
                    series.push(Series { name, points });
                }
            }
        }
        let chart = Chart {
            title: format!("Rigid sphere on a block: {name} mm"),
            labels: ["seconds".to_owned(), "relative error of the load".to_owned()],
            scales: [Scale::Logarithmic; 2],
            series,
        };
        fs::write(out.join(format!("near-field-{}.svg", name.replace(' ', "-"))), chart.svg())?;
    }
    fs::write(out.join("near-field.csv"), text)?;
    Ok(())
}

fn products(folder: &Path) -> Outcome<String> {
    mesh(folder, "far-field-block", &[("half_size", 3.0), ("depth", 3.0), ("cells", 8.0)])?;
    let mut text = machine::comment();
    writeln!(
        text,
        "# seconds of a product with three components, one thread, median of {PRODUCTS} in turn; CFRP block of half-width 3"
    )?;
    writeln!(text, "cells_along_frame,half_space_s,with_far_field_s,ratio")?;
    for n in [64, 128, 256, 512, 1024] {
        let frame = ContactFrame::grid([1.2; 2], [n; 2], [0.0; 2], 0.0)?;
        let mut half_space = HalfSpaceBody::new(&im7(30.0)?, Side::Lower, &frame)?;
        let spec = block(&folder.join("block.msh"))?;
        let site = HalfSpaceFit::find(&spec, "contact", Side::Lower, &frame)?.map_err(|why| why.0)?;
        let mut hybrid = HybridBody::new(
            spec,
            &[],
            "contact",
            Side::Lower,
            &frame,
            &site,
            &CondensationResources::default(),
        )?;
        let operators = [&mut half_space as &mut dyn ElasticBody, &mut hybrid]
            .map(|body| body.take_flexibility(CrossBlocks::SkipVanishing));
        let [near, both] = operators;
        let (near, both) = (near?.ok_or("no operator")?, both?.ok_or("no operator")?);
        let tractions: Vec<f64> = (0..3 * n * n).map(|k| ((k * 7919) % 1000) as f64).collect();
        let mut gap = vec![0.0; tractions.len()];
        let mut seconds = [Vec::new(), Vec::new()];
        for _ in 0..PRODUCTS {
            for (operator, seconds) in [&near, &both].into_iter().zip(&mut seconds) {
                let start = Instant::now();
                operator.apply(&tractions, &mut gap);
                seconds.push(start.elapsed().as_secs_f64());
            }
        }
        let [near, both] = seconds.map(|mut seconds| {
            seconds.sort_by(f64::total_cmp);
            seconds[PRODUCTS / 2]
        });
        println!("{n}: {near:.4} s, {both:.4} s, {:.3}", both / near);
        writeln!(text, "{n},{near:.5},{both:.5},{:.3}", both / near)?;
    }
    Ok(text)
}

fn block(path: &Path) -> Outcome<FeSpec> {
    Ok(FeSpec {
        name: "block".to_owned(),
        mesh: Arc::new(orthowear::mesh::gmsh::read(path)?),
        regions: vec![(None, im7(30.0)?.into())],
        formulation: HexFormulation::Enhanced,
        supports: vec![Support {
            group: "base".to_owned(),
            components: [true; 3],
            value: [0.0; 3],
            gradient: [[0.0; 3]; 3],
        }],
        foundations: Vec::new(),
        pressures: Vec::new(),
        tractions: Vec::new(),
        body_force: [0.0; 3],
        temperature_change: 0.0,
    })
}

fn far_field(folder: &Path, half: f64, repeats: usize) -> Outcome<Vec<Sample>> {
    let mut samples = Vec::new();
    for (cells, order, ratio) in FAR {
        let numbers = [
            ("half_size", half),
            ("depth", half),
            ("cells", cells as f64),
            ("order", order as f64),
            ("ratio", ratio),
        ];
        mesh(folder, "far-field-block", &numbers)?;
        let what = format!("{cells} cells of order {order}");
        samples.push(sample(folder, what, &["body1.near_field=\"half-space\"".to_owned()], repeats)?);
    }
    Ok(samples)
}

fn condensed(folder: &Path, half: f64, repeats: usize) -> Outcome<Vec<Sample>> {
    let mut samples = Vec::new();
    for (patch, outer, depth, cells) in CONDENSED {
        let numbers = [
            ("half_size", half),
            ("depth", half),
            ("patch", 1.2),
            ("patch_cells", patch as f64),
            ("outer_cells", outer as f64),
            ("depth_cells", depth as f64),
            ("first_depth", 2.4 / patch as f64),
        ];
        mesh(folder, "cfrp-block", &numbers)?;
        let settings = ["body1.near_field=\"mesh\"".to_owned(), format!("frame.cells=[{cells}, {cells}]")];
        samples.push(sample(folder, format!("{patch} elements along the patch"), &settings, repeats)?);
    }
    Ok(samples)
}

fn mesh(folder: &Path, script: &str, numbers: &[(&str, f64)]) -> Outcome<()> {
    let mut gmsh = Command::new("gmsh");
    gmsh.arg(root().join(format!("meshes/{script}.geo"))).args(["-3", "-v", "1", "-format", "msh22", "-bin"]);
    for (name, value) in numbers {
        gmsh.args(["-setnumber", name, &value.to_string()]);
    }
    let status = gmsh.arg("-o").arg(folder.join("block.msh")).status()?;
    if status.success() { Ok(()) } else { Err("gmsh failed".into()) }
}

/// Runs a scene several times, and returns load and seconds of the run with the median time.
fn sample(folder: &Path, what: String, settings: &[String], repeats: usize) -> Outcome<Sample> {
    let mut runs = Vec::new();
    for _ in 0..repeats.max(1) {
        runs.push(run(folder, settings)?);
    }
    runs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (seconds, load) = runs[runs.len() / 2];
    Ok(Sample { what, unknowns: unknowns(&folder.join("block.msh"))?, seconds, load })
}

/// Seconds and load of one run in a separate process.
fn run(folder: &Path, settings: &[String]) -> Outcome<(f64, f64)> {
    let out = folder.join("out");
    let mut program = Command::new(program()?);
    program.arg("run").arg(folder.join("scene.toml")).args(["--quiet", "--no-cache", "--threads", "1"]);
    program.arg("--out").arg(&out);
    for setting in settings {
        program.args(["--set", setting]);
    }
    let start = Instant::now();
    let status = program.status()?;
    let seconds = start.elapsed().as_secs_f64();
    if !status.success() {
        return Err(format!("a run ended with {status}").into());
    }
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json"))?)?;
    fs::remove_dir_all(&out)?;
    let load = summary["steps"][0]["normal_force"].as_f64().ok_or("no load in the summary")?;
    Ok((seconds, load))
}

/// Number of unknowns: three for each node outside the base.
fn unknowns(path: &Path) -> Outcome<usize> {
    let mesh = orthowear::mesh::gmsh::read(path)?;
    let held = mesh.group_nodes("base")?.len();
    Ok(3 * (mesh.n_points() - held))
}
