//! Cost of the compressed half-space operator compared with the dense operator: seconds to build, seconds per product,
//! memory, error. With `--tolerance DIGITS` the compression has the tolerance 10^-DIGITS.
//!
//!     cargo run --release --example compressed -- [--cells N ..] [--dense N] [--tolerance DIGITS] [--tilt DEGREES]
//!         [--threads N]

#[path = "../im7.rs"]
mod im7;
#[path = "../machine.rs"]
mod machine;

use std::error::Error;
use std::time::Instant;

use orthowear::bem::half_space::{CompressedFlexibility, DenseFlexibility, Side, SurfaceGreen};
use orthowear::flexibility::Flexibility;
use orthowear::material::Stiffness;

type Outcome<T> = Result<T, Box<dyn Error>>;

const PRODUCTS: usize = 10;

/// Centres, corners and areas of cells.
type Cells = (Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>, Vec<f64>);

/// About `n` quadrilaterals and triangles that fill the unit square, finer in the middle.
fn cells(n: usize) -> Cells {
    // Each third of the `m` x `m` squares is split into two triangles.
    let m = (n as f64 * 0.75).sqrt().round() as usize;
    let node = |i: usize, j: usize| {
        let graded = |k: usize| {
            let x = 2.0 * k as f64 / m as f64 - 1.0;
            0.5 * x * (0.6 + 0.4 * x * x)
        };
        let shake = |k: usize| ((k * 7919 + i * 104_729 + j * 1_299_709) % 1000) as f64 / 1000.0 - 0.5;
        let inner = i > 0 && j > 0 && i < m && j < m;
        let size = if inner { 0.25 / m as f64 } else { 0.0 };
        [graded(i) + size * shake(1), graded(j) + size * shake(2)]
    };
    let mut corners = Vec::new();
    for (i, j) in (0..m * m).map(|k| (k / m, k % m)) {
        let [a, b, c, d] = [node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1)];
        if (i + j) % 3 == 0 {
            corners.extend([vec![a, b, c], vec![a, c, d]]);
        } else {
            corners.push(vec![a, b, c, d]);
        }
    }
    let (mut centers, mut areas) = (Vec::new(), Vec::new());
    for polygon in &corners {
        let (mut area, mut center) = (0.0, [0.0; 2]);
        for (k, p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let cross = p[0] * q[1] - p[1] * q[0];
            area += cross / 2.0;
            (0..2).for_each(|axis| center[axis] += cross * (p[axis] + q[axis]) / 6.0);
        }
        centers.push(center.map(|x| x / area));
        areas.push(area);
    }
    (centers, corners, areas)
}

/// Sum of the surface Green's functions of a lower half-space of CFRP with the fibre angle `tilt` (degrees) and a steel
/// half-space.
fn green(tilt: f64) -> Outcome<SurfaceGreen> {
    let steel = Stiffness::isotropic(210e3, 0.3)?;
    Ok(SurfaceGreen::sum(&[
        &SurfaceGreen::new(&im7::im7(tilt)?, Side::Lower)?,
        &SurfaceGreen::new(&steel, Side::Upper)?,
    ]))
}

/// Least seconds of a product with all components, least seconds of a product with pressures only, and the result of
/// the first.
fn products(operator: &dyn Flexibility, tractions: &[f64]) -> (f64, f64, Vec<f64>) {
    let n = operator.n_cells();
    let mut gap = vec![0.0; 3 * n];
    operator.apply(tractions, &mut gap);
    let mut again = gap.clone();
    let (mut all, mut normal) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..PRODUCTS {
        let start = Instant::now();
        operator.apply(tractions, &mut again);
        all = all.min(start.elapsed().as_secs_f64());
        let start = Instant::now();
        operator.apply_normal(&tractions[2 * n..], &mut again[2 * n..]);
        normal = normal.min(start.elapsed().as_secs_f64());
    }
    (all, normal, gap)
}

/// Iterations of the conjugate gradient method to a relative residual of 1e-8. The unknowns are the pressures that
/// displace the cells of a disc by 1. `inverse` states whether the approximate inverse of the operator is the
/// preconditioner.
fn iterations(
    operator: &CompressedFlexibility,
    (centers, areas): (&[[f64; 2]], &[f64]),
    inverse: bool,
) -> usize {
    let n = areas.len();
    let inside: Vec<bool> = centers.iter().map(|p| p[0].hypot(p[1]) < 0.35).collect();
    let mask =
        |values: &mut [f64]| values.iter_mut().zip(&inside).for_each(|(v, &i)| *v = if i { *v } else { 0.0 });
    let product = |a: &[f64], b: &[f64]| -> f64 { (0..n).map(|i| areas[i] * a[i] * b[i]).sum() };
    let mut residual = vec![1.0; n];
    mask(&mut residual);
    let start = product(&residual, &residual);
    let (mut z, mut image, mut direction, mut before) = (vec![0.0; n], vec![0.0; n], vec![0.0; n], 0.0);
    let mut count = 0;
    while product(&residual, &residual) > 1e-16 * start && count < 1000 {
        if !(inverse && operator.precondition_normal(&residual, &mut z)) {
            z.copy_from_slice(&residual);
        }
        mask(&mut z);
        let now = product(&residual, &z);
        let share = if count == 0 { 0.0 } else { now / before };
        before = now;
        direction.iter_mut().zip(&z).for_each(|(d, z)| *d = z + share * *d);
        operator.apply_normal(&direction, &mut image);
        mask(&mut image);
        let step = now / product(&direction, &image);
        residual.iter_mut().zip(&image).for_each(|(r, image)| *r -= step * image);
        count += 1;
    }
    count
}

fn resident() -> usize {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<usize>().ok()).unwrap_or(0) * 1024
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|value| value * value).sum::<f64>().sqrt()
}

fn numbers(words: &[String], name: &str, otherwise: &[f64]) -> Outcome<Vec<f64>> {
    let Some(at) = words.iter().rposition(|word| word == name) else { return Ok(otherwise.to_vec()) };
    let found: Vec<f64> = words[at + 1..].iter().map_while(|word| word.parse().ok()).collect();
    if found.is_empty() { Err(format!("{name} needs a number").into()) } else { Ok(found) }
}

struct Settings {
    sizes: Vec<f64>,
    dense_up_to: f64,
    tolerance: f64,
    tilt: f64,
}

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let threads = numbers(&words, "--threads", &[0.0])?[0] as usize;
    rayon::ThreadPoolBuilder::new().num_threads(threads).build_global()?;
    let settings = Settings {
        sizes: numbers(&words, "--cells", &[1000.0, 4000.0, 8000.0, 16_000.0, 32_000.0])?,
        dense_up_to: numbers(&words, "--dense", &[4000.0])?[0],
        tolerance: 10f64.powf(-numbers(&words, "--tolerance", &[8.0])?[0].abs()),
        tilt: numbers(&words, "--tilt", &[30.0])?[0],
    };
    if let [size] = settings.sizes[..] {
        return measure(size, &settings);
    }
    print!("{}# load: {}", machine::comment(), load());
    let Settings { tilt, tolerance, .. } = settings;
    let threads = rayon::current_num_threads();
    println!("# fibres at {tilt} degrees, tolerance {tolerance:e}, {threads} threads\n");
    println!(
        "| cells | operator | build, s | product, s | of pressures, s | MiB | told before | bytes per cell | inverse, s | iterations with \
         it, without | error |"
    );
    println!("|{}", "---|".repeat(11));
    // Each size runs in its own process. Otherwise, memory freed by another size would hide the growth of the resident
    // memory.
    let mut seconds: Vec<[f64; 3]> = Vec::new();
    for size in &settings.sizes {
        let mut command = std::process::Command::new(std::env::current_exe()?);
        let output = command.args(&words).args(["--cells", &size.to_string()]).output()?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into());
        }
        let rows = String::from_utf8(output.stdout)?;
        print!("{rows}");
        let cells = rows.lines().next().unwrap_or("").split('|').map(str::trim);
        let values: Vec<f64> = cells.filter_map(|cell| cell.parse().ok()).collect();
        seconds.push([values[0], values[1], values[2]]);
    }
    for pair in seconds.windows(2) {
        let of = |k: usize| (pair[1][k] / pair[0][k]).ln() / (pair[1][0] / pair[0][0]).ln();
        println!("\ngrowth from {} cells on: build N^{:.2}, product N^{:.2}", pair[0][0], of(1), of(2));
    }
    print!("\n# load at the end: {}", load());
    Ok(())
}

fn measure(size: f64, settings: &Settings) -> Outcome<()> {
    let (green, tolerance) = (green(settings.tilt)?, settings.tolerance);
    let (centers, corners, areas) = cells(size as usize);
    let n = centers.len();
    let tractions: Vec<f64> = (0..3 * n).map(|k| 1.0 + (k as f64 * 0.7).sin()).collect();
    let before = resident();
    let start = Instant::now();
    let compressed = CompressedFlexibility::new(&centers, &corners, &areas, &green, tolerance)?;
    let build = start.elapsed().as_secs_f64();
    let (all, normal, gap) = products(&compressed, &tractions);
    let start = Instant::now();
    let mut preconditioned = vec![0.0; 3 * n];
    compressed.precondition(&gap, &mut preconditioned);
    let inverse = start.elapsed().as_secs_f64();
    let held = resident().saturating_sub(before);
    let told = CompressedFlexibility::typical_bytes(&centers, &corners, &areas, &green, tolerance) as f64
        / f64::from(1 << 20);
    let counts = [true, false].map(|inverse| iterations(&compressed, (&centers, &areas), inverse));
    let row = |name: &str, build: f64, (all, normal): (f64, f64), bytes: usize, rest: &str| {
        println!(
            "| {n} | {name} | {build:.2} | {all:.4} | {normal:.4} | {:.0} | {rest} |",
            bytes as f64 / f64::from(1 << 20)
        );
    };
    let mut error = String::new();
    let mut dense = None;
    if size <= settings.dense_up_to {
        let start = Instant::now();
        let operator = DenseFlexibility::new(&centers, &corners, &areas, &green)?;
        let build = start.elapsed().as_secs_f64();
        let (all, normal, expected) = products(&operator, &tractions);
        let difference = norm(gap.iter().zip(&expected).map(|(a, b)| a - b));
        error = format!("{:.1e}", difference / norm(expected.into_iter()));
        dense = Some((build, (all, normal)));
    }
    let [with, without] = counts;
    let rest = format!("{told:.0} | {} | {inverse:.2} | {with}, {without} | {error}", held / n);
    row("compressed", build, (all, normal), held, &rest);
    if let Some((build, times)) = dense {
        row("dense", build, times, 72 * n * n, &format!("| {} | | | ", 72 * n));
    }
    Ok(())
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg").unwrap_or_else(|_| "unknown\n".to_owned())
}
