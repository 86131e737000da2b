//! Runs the sweeps of `tests/verification/stability` and writes status, residual, iterations and warnings of each run
//! to a CSV file.
//!
//!     cargo run --release --example stability -- [--out FILE]
//!
//! FILE is docs/data/stability.csv by default. `python3 benchmarks/summaries.py stability` then writes the summary in
//! docs/stability.md.

#[path = "../../tests/verification/audit.rs"]
mod audit;
#[path = "../machine.rs"]
mod machine;
#[path = "../quoted.rs"]
mod quoted;
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
use std::fs;
use std::path::PathBuf;

use quoted::quoted;
use sweeps::{Case, End};
use verdict::{Run, Verdict};

const HEADER: &str = "# command: cargo run --release --example stability
# residual: largest natural residual of the steps; iterations: those of each step; message: its beginning
group,sweep,value,end,residual,iterations,cells_in_contact,message
";

/// Largest number of characters of a message.
const LONGEST: usize = 150;

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let path = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs/data/stability.csv"),
        ["--out", path] => PathBuf::from(path),
        _ => return Err("allowed is --out FILE".into()),
    };
    fs::write(&path, table()?)?;
    println!("{}", path.display());
    Ok(())
}

/// Table of all sweeps with its head.
///
/// # Errors
/// If a run does not end as expected.
fn table() -> Result<String, Box<dyn Error>> {
    let groups: [(&str, Vec<Case>); 9] = [
        ("Modulus ratio", sweeps::modulus_ratio()),
        ("Nearly incompressible materials", sweeps::poisson()),
        ("Fibre angles", sweeps::tilts()),
        ("Friction coefficients", sweeps::coefficients()),
        ("Aspect ratios", sweeps::aspect_ratios()),
        ("Frames with few cells", sweeps::frames()),
        ("Zero and very small loads", sweeps::nothing()),
        ("Units and sizes", sweeps::units()),
        ("Random scenes", sweeps::drawn()),
    ];
    let mut text = machine::comment() + HEADER;
    for (group, cases) in groups {
        eprintln!("{group}");
        for case in &cases {
            let verdict = verdict::run(&case.name(), &case.scene, case.mesh.as_deref());
            let allowed = match verdict {
                Verdict::Certified(_) => case.end != End::Refused,
                Verdict::NotConverged(..) => case.end == End::Honest,
                Verdict::Refused(_) => case.end == End::Refused,
            };
            if !allowed {
                return Err(format!("{}: {:?} was expected", case.name(), case.end).into());
            }
            text.push_str(&row(group, case, &verdict));
        }
    }
    Ok(text)
}

fn row(group: &str, case: &Case, verdict: &Verdict) -> String {
    let (end, run, message) = match verdict {
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
    let [group, sweep, value, end, iterations, message] =
        [group, case.sweep, case.value.as_str(), end.as_str(), iterations.as_str(), message.as_str()]
            .map(quoted);
    format!("{group},{sweep},{value},{end},{residual},{iterations},{touching},{message}\n")
}

/// Warnings of a run, shortened. Notes about units and load paths are omitted, because they are the same in every row.
fn warnings(run: &Run) -> String {
    let doubts = run.warnings.iter().filter(|warning| warning.starts_with("WARNING"));
    doubts.map(|warning| short(warning)).collect::<Vec<_>>().join("; ")
}

fn short(message: &str) -> String {
    let line = message.lines().next().unwrap_or_default().to_owned();
    if line.chars().count() <= LONGEST {
        return line;
    }
    let begin: String = line.chars().take(LONGEST).collect();
    let end = begin.rfind(' ').unwrap_or(begin.len());
    format!("{} …", &begin[..end])
}
