//! Memory estimate of `check` compared with the measured peak of the run, for the scenes in scenes/ and for larger
//! scenes.
//!
//!     cargo run --release --example memory -- [--out FILE] [--quick] [NAME ..]
//!
//! FILE is docs/data/memory.csv by default. `python3 benchmarks/summaries.py memory` then writes the summary in
//! docs/memory.md. A NAME selects the rows whose group or name contains it. With names or --quick, the rows are only
//! printed.

mod cases;
#[path = "../machine.rs"]
mod machine;
mod measure;
#[path = "../places.rs"]
mod places;
#[path = "../quoted.rs"]
mod quoted;
#[path = "../../tests/verification/mesh/writer.rs"]
mod writer;
#[path = "../../tests/fixtures/structured.rs"]
mod structured;

use std::error::Error;
use std::fmt::Write as _;
use std::fs;

use cases::Case;
use measure::{Measured, row};
use places::{program, root};
use quoted::quoted;

pub type Outcome<T> = Result<T, Box<dyn Error>>;

const HEADER: &str = "# command: cargo run --release --example memory
# One run each.
group,scene,threads,estimate_MiB,peak_MiB,ratio
";

/// Accepted range of the estimate divided by the measured peak.
const WANTED: [f64; 2] = [0.8, 1.2];

fn main() -> Outcome<()> {
    let mut path = root().join("docs/data/memory.csv");
    let (mut quick, mut names) = (false, Vec::new());
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--out" => path = words.next().ok_or("--out needs a file")?.into(),
            "--quick" => quick = true,
            other if other.starts_with("--") => return Err("allowed are --out FILE and --quick".into()),
            _ => names.push(word),
        }
    }
    let wanted = |case: &Case| {
        let has = |name: &String| case.name.contains(name.as_str()) || case.group.contains(name.as_str());
        names.is_empty() || names.iter().any(has)
    };
    let cases: Vec<Case> = cases::all(quick).into_iter().filter(wanted).collect();
    let table = table(&cases)?;
    if quick || !names.is_empty() {
        println!("{table}");
        return Ok(());
    }
    fs::write(&path, table)?;
    println!("{}", path.display());
    Ok(())
}

/// Table of all cases with its head.
fn table(cases: &[Case]) -> Outcome<String> {
    let program = program()?;
    let mut text = machine::comment() + HEADER;
    let (mut outside, mut failed, mut extremes) = (0, 0, [f64::INFINITY, 0.0_f64]);
    for case in cases {
        for threads in [1, 2] {
            let measured = match row(&program, case, threads) {
                Ok(measured) => measured,
                Err(error) => {
                    eprintln!("{}: {error}", case.name);
                    let _ =
                        writeln!(text, "{},{},{threads},,,failed", quoted(case.group), quoted(&case.name));
                    failed += 1;
                    continue;
                }
            };
            let ratio = measured.ratio();
            outside += usize::from(!(WANTED[0]..=WANTED[1]).contains(&ratio));
            extremes = [extremes[0].min(ratio), extremes[1].max(ratio)];
            text.push_str(&line(case, threads, measured));
            eprint!("{}", line(case, threads, measured));
        }
    }
    eprintln!(
        "{} runs: estimate over peak from {:.2} to {:.2}; {outside} outside of {} .. {}, {failed} failed",
        2 * cases.len(),
        extremes[0],
        extremes[1],
        WANTED[0],
        WANTED[1]
    );
    Ok(text)
}

fn line(case: &Case, threads: usize, measured: Measured) -> String {
    let Measured { estimate, peak } = measured;
    let [group, name] = [case.group, case.name.as_str()].map(quoted);
    format!("{group},{name},{threads},{estimate:.1},{peak:.1},{:.2}\n", measured.ratio())
}
