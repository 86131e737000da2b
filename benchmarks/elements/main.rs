//! Error of load and peak pressure against processor seconds, for every element type. The two cases are a steel block
//! under a steel sphere, and the CFRP block of scenes/sphere-on-cfrp-block.toml.
//!
//!     cargo build --release
//!     cargo run --release --example elements -- [--out DIR]
//!
//! DIR is docs/benchmarks by default.

#[path = "../machine.rs"]
mod machine;
mod mesh;
#[path = "../places.rs"]
mod places;
#[path = "../../tests/fixtures/structured.rs"]
mod structured;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use orthowear::element::ElementKind::{self, Hex8, Hex20, Hex27, Tet4, Tet10, Wedge6, Wedge15};
use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};
use places::{program, root};
use serde_json::Value;

pub type Outcome<T> = Result<T, Box<dyn Error>>;

const ELEMENTS: [(&str, ElementKind); 9] = [
    ("hex8-eas", Hex8),
    ("hex8", Hex8),
    ("hex8-bbar", Hex8),
    ("hex20", Hex20),
    ("hex27", Hex27),
    ("tet4", Tet4),
    ("tet10", Tet10),
    ("wedge6", Wedge6),
    ("wedge15", Wedge15),
];

/// Cells along the side of the patch: one cell per first-order element, two cells per second-order element. The spacing
/// of surface nodes is then the same for both orders.
const CELLS: [usize; 4] = [8, 12, 16, 24];

/// Element type whose extrapolated values are the reference, and the cells along a finer frame for this type.
const REFERENCE: (&str, usize) = ("hex20", 32);

const HERTZ: &str = r#"
[materials.steel]
model = "isotropic"
E = 210e3
nu = 0.3
[body1]
kind = "fe"
material = "steel"
mesh = "block.msh"
contact = "contact"
fixed = [{ group = "base" }]
[body2]
kind = "half-space"
material = "steel"
[frame]
kind = "grid"
half_width = [1.5, 1.5]
cells = [28, 28]
[gap]
kind = "sphere"
radius = 50.0
[friction]
law = "none"
[[steps]]
name = "indent"
approach = 0.02
"#;

struct Sample {
    cells: usize,
    unknowns: usize,
    seconds: f64,
    /// Normal force and peak pressure.
    values: [f64; 2],
}

fn main() -> Outcome<()> {
    let mut out = root().join("docs/benchmarks");
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--out" => out = arguments.next().ok_or("--out needs a directory")?.into(),
            other => return Err(format!("unknown argument {other}; allowed: --out DIR").into()),
        }
    }
    fs::create_dir_all(&out)?;
    let reference = root().join("scenes/sphere-on-cfrp-block.toml");
    let cfrp = fs::read_to_string(reference)?;
    let cfrp = cfrp.split("[[steps]]").take(2).collect::<Vec<_>>().join("[[steps]]");
    for (name, title, scene) in [
        ("elements-hertz", "Steel sphere on a steel block", HERTZ),
        ("elements-cfrp", "Steel sphere on the CFRP block", cfrp.as_str()),
    ] {
        let folder = std::env::temp_dir().join(format!("orthowear-{name}-{}", std::process::id()));
        fs::create_dir_all(&folder)?;
        fs::write(folder.join("scene.toml"), scene)?;
        let mut families = Vec::new();
        for (element, kind) in ELEMENTS {
            families.push((element, family(&folder, element, kind)?));
        }
        fs::remove_dir_all(&folder)?;
        write(&out, name, title, &families)?;
    }
    Ok(())
}

fn family(folder: &Path, element: &str, kind: ElementKind) -> Outcome<Vec<Sample>> {
    let step = if kind.n_nodes() > kind.n_corners() { 2 } else { 1 };
    let mut samples = Vec::new();
    let finer = (element == REFERENCE.0).then_some(REFERENCE.1);
    for cells in CELLS.into_iter().chain(finer) {
        let mesh = mesh::block(kind, cells / step)?;
        mesh::write(&mesh, &folder.join("block.msh"))?;
        let sample = run(folder, element, cells, 3 * mesh.n_points())?;
        println!(
            "{element} {cells}: {} unknowns, {:.2} s, {:?}",
            sample.unknowns, sample.seconds, sample.values
        );
        samples.push(sample);
    }
    Ok(samples)
}

fn run(folder: &Path, element: &str, cells: usize, unknowns: usize) -> Outcome<Sample> {
    let out = folder.join("out");
    let mut program = Command::new(program()?);
    program.arg("run").arg(folder.join("scene.toml")).args(["--quiet", "--no-cache"]).arg("--out").arg(&out);
    for setting in [
        "output.fields=[]".to_owned(),
        format!("body1.mesh=\"{}\"", folder.join("block.msh").display()),
        format!("body1.element=\"{element}\""),
        // The benchmark compares the elements under the contact.
        "body1.near_field=\"mesh\"".to_owned(),
        format!("frame.cells=[{cells}, {cells}]"),
    ] {
        program.args(["--set", &setting]);
    }
    let before = children_seconds();
    let status = program.env("RAYON_NUM_THREADS", "1").status()?;
    let seconds = children_seconds() - before;
    if !status.success() {
        return Err(format!("{element} with {cells} cells ended with {status}").into());
    }
    let summary: Value = serde_json::from_slice(&fs::read(out.join("summary.json"))?)?;
    fs::remove_dir_all(&out)?;
    let value = |key: &str| summary["steps"][0][key].as_f64().ok_or(format!("no {key} in the summary"));
    Ok(Sample { cells, unknowns, seconds, values: [value("normal_force")?, value("peak_pressure")?] })
}

/// Processor seconds of all finished child processes.
fn children_seconds() -> f64 {
    // SAFETY: an all-zero rusage is valid, and the pointer refers to it.
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        libc::getrusage(libc::RUSAGE_CHILDREN, &mut usage);
        usage
    };
    let seconds = |time: libc::timeval| time.tv_sec as f64 + 1e-6 * time.tv_usec as f64;
    seconds(usage.ru_utime) + seconds(usage.ru_stime)
}

/// Richardson extrapolation of value `value` from the two finest runs. The error is assumed to be of second order in
/// the size of cells and elements.
fn limit(samples: &[Sample], value: usize) -> f64 {
    let [.., coarse, fine] = samples else { return f64::NAN };
    let gain = (fine.cells as f64 / coarse.cells as f64).powi(2) - 1.0;
    fine.values[value] + (fine.values[value] - coarse.values[value]) / gain
}

const QUANTITIES: [(&str, &str); 2] = [("load", "load"), ("peak", "peak pressure")];

fn write(out: &Path, name: &str, title: &str, families: &[(&str, Vec<Sample>)]) -> Outcome<()> {
    let trusted = &families.iter().find(|(element, _)| *element == REFERENCE.0).ok_or("no reference")?.1;
    let references = [0, 1].map(|value| limit(trusted, value));
    let mut text = machine::comment();
    writeln!(text, "# reference: load {:.5} N, peak pressure {:.5} MPa", references[0], references[1])?;
    for (element, samples) in families {
        let [load, peak] = [0, 1].map(|value| limit(samples, value) / references[value] - 1.0);
        writeln!(
            text,
            "# extrapolated {element}: load {load:+.2e}, peak pressure {peak:+.2e} from the reference"
        )?;
    }
    writeln!(
        text,
        "element,frame_cells,unknowns,cpu_seconds,load_N,load_error,peak_pressure_MPa,peak_error"
    )?;
    for (element, samples) in families {
        for sample in samples {
            let [load, peak] = sample.values;
            let [load_error, peak_error] = [0, 1].map(|value| sample.values[value] / references[value] - 1.0);
            writeln!(
                text,
                "{element},{},{},{:.2},{load:.5},{load_error:+.3e},{peak:.4},{peak_error:+.3e}",
                sample.cells, sample.unknowns, sample.seconds
            )?;
        }
    }
    fs::write(out.join(format!("{name}.csv")), text)?;
    for (value, (quantity, words)) in QUANTITIES.into_iter().enumerate() {
        let series = families.iter().map(|(element, samples)| Series {
            name: (*element).to_owned(),
            points: samples
                .iter()
                .map(|s| [s.seconds, (s.values[value] / references[value] - 1.0).abs()])
                .collect(),
        });
        let chart = Chart {
            title: format!("{title}: {} to {} cells along the frame", CELLS[0], CELLS[CELLS.len() - 1]),
            labels: ["processor time, s".to_owned(), format!("relative error of the {words}")],
            scales: [Scale::Logarithmic; 2],
            series: series.collect(),
        };
        fs::write(out.join(format!("{name}-{quantity}.svg")), chart.svg())?;
    }
    Ok(())
}
