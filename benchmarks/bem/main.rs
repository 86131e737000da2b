//! Cost of finite boundary-element bodies with dense and compressed equations: seconds to assemble and solve, memory,
//! error.
//!
//!     cargo run --release --example bem -- [--sides N ..] [--dense UNKNOWNS] [--loaded NODES] [--tolerance DIGITS] [--case CASE]
//!         [--threads N]
//!
//! The body is a block of CFRP, 8 x 8 x 4 mm, with N first-order elements along its long sides. The elements are finer
//! in the middle of the top. CASE is "block" (base fixed), "rollers" (base and sides fixed along their normals),
//! "plate" (8 x 8 x 0.4 mm, one side fixed) or "free". Dense equations are solved only for at most UNKNOWNS unknowns.
//! The responses of NODES nodes of the top are computed. The tolerance of the compression is 10^-DIGITS.

#[path = "../im7.rs"]
mod im7;
#[path = "../machine.rs"]
mod machine;

use std::error::Error;
use std::time::Instant;

use faer::Par;
use orthowear::bem::finite::{
    BoundaryElements, BoundarySolution, BoundaryValueProblem, CompressedEquations, Domain, Interpolation,
    Panel, SolutionMethod,
};
use orthowear::bem::full_space::FullSpaceField;
use orthowear::element::ElementKind;
use orthowear::geometry::Point;

type Outcome<T> = Result<T, Box<dyn Error>>;

/// Relative accuracy of the boundary integrals.
const ACCURACY: f64 = 1e-6;

struct Settings {
    dense: f64,
    loaded: usize,
    tolerance: f64,
    case: String,
}

/// Surface elements of a block of 8 x 8 x `height` mm, finer in the middle of the top.
fn block(n: usize, height: f64) -> Vec<Panel> {
    let deep = ((n as f64 * height / 8.0).round() as usize).max(1);
    let across = |k: usize| {
        let x = 2.0 * k as f64 / n as f64 - 1.0;
        4.0 * x * (0.5 + 0.5 * x * x)
    };
    let down = |k: usize| {
        let x = k as f64 / deep as f64;
        -height * x * (0.7 + 0.3 * x)
    };
    let at = |k: [usize; 3]| Point::new(across(k[0]), across(k[1]), down(deep - k[2]));
    let counts = [n, n, deep];
    let mut panels = Vec::new();
    for axis in 0..3 {
        for end in [0, counts[axis]] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (i, j) in (0..counts[u]).flat_map(|i| (0..counts[v]).map(move |j| (i, j))) {
                let node = |s: usize, t: usize| {
                    let mut k = [end; 3];
                    (k[u], k[v]) = (i + s, j + t);
                    at(k)
                };
                let mut nodes = vec![node(0, 0), node(1, 0), node(1, 1), node(0, 1)];
                if end == 0 {
                    nodes.swap(1, 3);
                }
                panels.push(Panel { kind: ElementKind::Quad4, nodes });
            }
        }
    }
    panels
}

fn held(case: &str, height: f64, x: &Point, normal: &Point, c: usize) -> bool {
    match case {
        "free" => false,
        "rollers" => normal[c].abs() > 0.5 && x.z < -1e-9,
        "plate" => normal.x < -0.5,
        _ => x.z < -height * (1.0 - 1e-9),
    }
}

/// Peak resident memory of this process, MiB.
fn peak() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find(|line| line.starts_with("VmHWM:")).unwrap_or("");
    line.split_whitespace().nth(1).and_then(|kib| kib.parse::<f64>().ok()).unwrap_or(0.0) / 1024.0
}

/// Processor time of this process in seconds, summed over all threads.
fn processor() -> f64 {
    let text = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after = text.rsplit(')').next().unwrap_or("");
    // Fields 14 and 15 of proc(5) are user and system time, in hundredths of a second.
    after.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>()
        / 100.0
}

fn responses(solution: &BoundarySolution) -> Vec<f64> {
    let loaded = solution.loaded();
    let columns = 3 * loaded.len();
    (0..columns * columns)
        .map(|k| solution.response(3 * loaded[k / columns / 3] + k / columns % 3, k % columns))
        .collect()
}

fn measure(sides: usize, settings: &Settings) -> Outcome<()> {
    let height = if settings.case == "plate" { 0.4 } else { 4.0 };
    let stiffness = im7::im7(30.0)?;
    let field = FullSpaceField::new(&stiffness)?;
    let elements =
        BoundaryElements::new(block(sides, height), Interpolation::Linear, &stiffness, field, ACCURACY);
    let (positions, normals) = (elements.positions(), elements.normals());
    let n = 3 * positions.len();
    let held: Vec<bool> = (0..n)
        .map(|dof| held(&settings.case, height, &positions[dof / 3], &normals[dof / 3], dof % 3))
        .collect();
    let free = elements.free_motions(&held)?;
    let mut loaded: Vec<usize> = (0..n / 3).filter(|&node| positions[node].z > -1e-9).collect();
    loaded.sort_by(|&a, &b| positions[a].norm().total_cmp(&positions[b].norm()));
    loaded.truncate(settings.loaded);
    let problem = BoundaryValueProblem {
        elements: &elements,
        domain: Domain::Interior,
        displacement_known: &held,
        loads: &[],
        loaded: &loaded,
        free_motions: free.as_ref(),
    };
    let before = processor();
    let start = Instant::now();
    let equations = CompressedEquations::new(&problem, settings.tolerance)?;
    let assembly = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let compressed = problem.solve_compressed(&equations)?;
    let solving = start.elapsed().as_secs_f64();
    let report = compressed.compression().ok_or("the equations are compressed")?;
    let processor = processor() - before;
    let memory = peak();
    drop(equations);
    let told = CompressedEquations::expected_bytes(&elements, loaded.len(), settings.tolerance);
    print!(
        "| {n} | {assembly:.1} | {solving:.1} | {processor:.1} | {} | {:.0} | {memory:.0} | {:.0} | {:.1e} |",
        report.iterations,
        report.bytes as f64 / f64::from(1 << 20),
        told as f64 / f64::from(1 << 20),
        compressed.residual()
    );
    if n as f64 > settings.dense {
        println!(" | | |");
        return Ok(());
    }
    let start = Instant::now();
    let dense = problem.solve_by(SolutionMethod::Dense, Par::rayon(0))?;
    let seconds = start.elapsed().as_secs_f64();
    let (found, wanted) = (responses(&compressed), responses(&dense));
    let largest = wanted.iter().fold(0.0_f64, |most, value| most.max(value.abs()));
    let error = found.iter().zip(&wanted).fold(0.0_f64, |most, (a, b)| most.max((a - b).abs())) / largest;
    let bytes = BoundaryValueProblem::dense_bytes(n / 3, loaded.len()) as f64;
    println!(" {seconds:.1} | {:.0} | {error:.1e} |", bytes / f64::from(1 << 20));
    Ok(())
}

/// Slope of value `k` over value 0 of the points, by least squares.
fn slope(points: &[[f64; 3]], k: usize) -> f64 {
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(0), mean(k)];
    let [up, across] = points
        .iter()
        .fold([0.0; 2], |[up, across], p| [up + (p[0] - x) * (p[k] - y), across + (p[0] - x).powi(2)]);
    up / across
}

fn numbers(words: &[String], name: &str, default: &[f64]) -> Outcome<Vec<f64>> {
    let Some(at) = words.iter().rposition(|word| word == name) else { return Ok(default.to_vec()) };
    let values = words[at + 1..].iter().take_while(|word| !word.starts_with("--"));
    Ok(values.map(|word| word.parse()).collect::<Result<_, _>>()?)
}

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let threads = numbers(&words, "--threads", &[0.0])?[0] as usize;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let case = words.iter().position(|word| word == "--case").and_then(|at| words.get(at + 1));
    let settings = Settings {
        dense: numbers(&words, "--dense", &[10_000.0])?[0],
        loaded: numbers(&words, "--loaded", &[100.0])?[0] as usize,
        tolerance: 10f64.powf(-numbers(&words, "--tolerance", &[5.0])?[0].abs()),
        case: case.map_or("block", String::as_str).to_owned(),
    };
    let sides = numbers(&words, "--sides", &[10.0, 14.0, 20.0, 28.0, 32.0])?;
    if let [side] = sides[..] {
        return measure(side as usize, &settings);
    }
    print!("{}", machine::comment());
    println!(
        "# {}, tolerance {:e}, {} threads\n",
        settings.case,
        settings.tolerance,
        rayon::current_num_threads()
    );
    println!(
        "| unknowns | making, s | solving, s | processor, s | products | MiB | peak, MiB | told before | residual | dense, s | MiB | difference |"
    );
    println!("|{}", "---|".repeat(12));
    let mut logs: Vec<[f64; 3]> = Vec::new();
    // Each size runs in its own process, so that its peak memory is measured separately.
    for side in &sides {
        let mut command = std::process::Command::new(std::env::current_exe()?);
        let output = command.args(&words).args(["--sides", &side.to_string()]).output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let row = String::from_utf8_lossy(&output.stdout);
        print!("{row}");
        let numbers: Vec<f64> = row.split('|').filter_map(|cell| cell.trim().parse().ok()).collect();
        if let [unknowns, making, solving, processor, ..] = numbers[..] {
            logs.push([unknowns.ln(), (making + solving).ln(), processor.ln()]);
        }
    }
    let [clock, processor] = [1, 2].map(|k| slope(&logs, k));
    println!(
        "\nThe seconds by the clock grow with the power {clock:.2} of the unknowns, those of the processor with {processor:.2}."
    );
    Ok(())
}
