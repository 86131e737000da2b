//! What `check` says that a run takes beside what the run took: the scenes of scenes/ and larger ones.
//!
//!     cargo run --release --example memory -- [--out FILE] [--quick] [NAME ..]
//!
//! FILE is docs/memory.md by default: what stands there between two marks is replaced. Names choose the rows whose group or name has one of
//! them in it; then, and with --quick, the table is printed only.

mod cases;
#[path = "../machine.rs"]
mod machine;
mod measure;
#[path = "../places.rs"]
mod places;
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

/// Any failure.
pub type Outcome<T> = Result<T, Box<dyn Error>>;

/// The marks around what is replaced.
const MARKS: [&str; 2] = ["<!-- table: begin -->", "<!-- table: end -->"];

/// Estimate over peak that is wanted.
const WANTED: [f64; 2] = [0.8, 1.2];

fn main() -> Outcome<()> {
    let mut path = root().join("docs/memory.md");
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
    let page = fs::read_to_string(&path)?;
    let [before, after] = MARKS.map(|mark| page.find(mark).ok_or(format!("{}: no {mark}", path.display())));
    let (before, after) = (before? + MARKS[0].len(), after?);
    fs::write(&path, format!("{}\n\n{table}\n{}", &page[..before], &page[after..]))?;
    println!("{}", path.display());
    Ok(())
}

/// Every group under a heading of its own.
fn table(cases: &[Case]) -> Outcome<String> {
    let program = program()?;
    let mut text: String =
        machine::comment().lines().map(|line| format!("{}  \n", line.trim_start_matches("# "))).collect();
    let (mut group, mut outside, mut failed, mut extremes) = ("", 0, 0, [f64::INFINITY, 0.0_f64]);
    for case in cases {
        if case.group != group {
            group = case.group;
            let _ = write!(
                text,
                "\n### {group}\n\n| scene | threads | estimate, MiB | peak, MiB | ratio |\n|{}\n",
                "---|".repeat(5)
            );
        }
        for threads in [1, 2] {
            let measured = match row(&program, case, threads) {
                Ok(measured) => measured,
                Err(error) => {
                    eprintln!("{}: {error}", case.name);
                    let _ = writeln!(text, "| {} | {threads} | | | failed |", case.name);
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
    let _ = write!(
        text,
        "\n{} runs: estimate over peak from {:.2} to {:.2}; {outside} outside of {} .. {}, {failed} failed.\n",
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
    format!("| {} | {threads} | {estimate:.1} | {peak:.1} | {:.2} |\n", case.name, measured.ratio())
}
