//! The sweeps of `tests/verification/stability` as a table: how each run ends, with which residual, after how many iterations, and what a user
//! is told.
//!
//!     cargo run --release --example stability -- [--out FILE]
//!
//! FILE is docs/stability.md by default: what stands there between two marks is replaced.

#[path = "../../tests/verification/audit.rs"]
mod audit;
#[path = "../machine.rs"]
mod machine;
#[path = "../../tests/verification/stability/random.rs"]
mod random;
#[path = "../../tests/verification/stability/scenes.rs"]
mod scenes;
#[path = "../../tests/verification/stability/sweeps.rs"]
mod sweeps;
#[path = "../../tests/verification/stability/verdict.rs"]
mod verdict;
#[path = "../../tests/verification/mesh/writer.rs"]
mod writer;
#[path = "../../tests/fixtures/structured.rs"]
mod structured;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use sweeps::{Case, End};
use verdict::{Run, Verdict};

/// The marks around what is replaced.
const MARKS: [&str; 2] = ["<!-- table: begin -->", "<!-- table: end -->"];

/// Words of a message that a cell of the table shows.
const LONGEST: usize = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let path = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/stability.md"),
        ["--out", path] => PathBuf::from(path),
        _ => return Err("allowed is --out FILE".into()),
    };
    let page = fs::read_to_string(&path)?;
    let [before, after] = MARKS.map(|mark| page.find(mark).ok_or(format!("{}: no {mark}", path.display())));
    let (before, after) = (before? + MARKS[0].len(), after?);
    let table = table()?;
    fs::write(&path, format!("{}\n\n{table}\n{}", &page[..before], &page[after..]))?;
    println!("{}", path.display());
    Ok(())
}

/// Every sweep under a heading of its own.
///
/// # Errors
/// If a run does not end as it should.
fn table() -> Result<String, Box<dyn Error>> {
    let groups: [(&str, Vec<Case>); 9] = [
        ("Ratio of the moduli", sweeps::modulus_ratio()),
        ("Nearly incompressible", sweeps::poisson()),
        ("Angles of the fibre", sweeps::tilts()),
        ("Coefficients of friction", sweeps::coefficients()),
        ("Aspect ratios", sweeps::aspect_ratios()),
        ("Frames of few cells", sweeps::frames()),
        ("Nothing and next to nothing", sweeps::nothing()),
        ("Units and sizes", sweeps::units()),
        ("Drawn together", sweeps::drawn()),
    ];
    let date = machine::comment();
    let date = date.lines().next().unwrap_or_default().trim_start_matches("# date: ").to_owned();
    let mut text = format!("Made by version {} on {date}.\n", env!("CARGO_PKG_VERSION"));
    let mut ends = [0; 3];
    for (heading, cases) in groups {
        eprintln!("{heading}");
        let _ = write!(
            text,
            "\n### {heading}\n\n| sweep | value | end | residual | iterations | cells in contact | what the user is told |\n|{}\n",
            "---|".repeat(7)
        );
        for case in &cases {
            let verdict = verdict::run(&case.name(), &case.scene, case.mesh.as_deref());
            let (end, allowed) = match verdict {
                Verdict::Certified(_) => (0, case.end != End::Refused),
                Verdict::NotConverged(..) => (1, case.end == End::Honest),
                Verdict::Refused(_) => (2, case.end == End::Refused),
            };
            if !allowed {
                return Err(format!("{}: {:?} was expected", case.name(), case.end).into());
            }
            ends[end] += 1;
            text.push_str(&row(case, &verdict));
        }
    }
    let [certified, open, refused] = ends;
    let _ = write!(
        text,
        "\nIn all {} runs: {certified} certified, {open} not converged and said so, {refused} refused.\n",
        certified + open + refused
    );
    Ok(text)
}

fn row(case: &Case, verdict: &Verdict) -> String {
    let (end, run, told) = match verdict {
        Verdict::Certified(run) => ("certified".to_owned(), Some(run), warnings(run)),
        Verdict::NotConverged(reason, run) => (format!("not converged: {reason}"), Some(run), warnings(run)),
        Verdict::Refused(message) => ("refused".to_owned(), None, short(message)),
    };
    let residual = run.map_or_else(String::new, |run| {
        let residuals = run.records.iter().map(|record| record.certificate.natural_residual);
        format!("{:.0e}", residuals.fold(0.0, f64::max))
    });
    let iterations = run.map_or_else(String::new, |run| {
        let each: Vec<String> = run.records.iter().map(|record| record.iterations.to_string()).collect();
        each.join(", ")
    });
    let touching = run.map_or_else(String::new, |run| {
        let pressures = &run.tractions[2 * run.tractions.len() / 3..];
        pressures.iter().filter(|p| **p > 0.0).count().to_string()
    });
    format!("| {} | {} | {end} | {residual} | {iterations} | {touching} | {told} |\n", case.sweep, case.value)
}

/// What stands before the results as a WARNING; hints about units and paths of loading are the same in every row.
fn warnings(run: &Run) -> String {
    let doubts = run.warnings.iter().filter(|warning| warning.starts_with("WARNING"));
    doubts.map(|warning| short(warning)).collect::<Vec<_>>().join("; ")
}

/// The beginning of a message, fit for a cell of a table.
fn short(message: &str) -> String {
    let line = message.lines().next().unwrap_or_default().replace('|', "\\|");
    if line.chars().count() <= LONGEST {
        return line;
    }
    let begin: String = line.chars().take(LONGEST).collect();
    let end = begin.rfind(' ').unwrap_or(begin.len());
    format!("{} …", &begin[..end])
}
