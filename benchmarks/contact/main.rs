//! Cost of half-space contacts from 64 to 1024 cells along the frame: seconds, products, memory, error.

mod cases;
#[path = "../machine.rs"]
mod machine;
mod measure;
#[path = "../places.rs"]
mod places;
mod rough;
mod transform;

use std::error::Error;

use cases::Case;
use measure::Run;
use places::program;

type Outcome<T> = Result<T, Box<dyn Error>>;

struct Settings {
    cases: Vec<Case>,
    /// Cells along the frame, by default the numbers of the case.
    cells: Option<Vec<usize>>,
    threads: Vec<usize>,
    repeats: usize,
    /// Time limit, seconds. If a run takes longer, finer grids of its case are omitted.
    limit: f64,
    /// Contact diameter of spheres (a, b, e, f), divided by the side of the frame.
    width: f64,
    uzawa: bool,
}

impl Settings {
    fn new(words: &[String]) -> Outcome<Self> {
        let mut settings = Self {
            cases: Case::ALL.to_vec(),
            cells: None,
            threads: vec![1, 2],
            repeats: 3,
            limit: 60.0,
            width: 0.5,
            uzawa: false,
        };
        let mut words = words.iter().peekable();
        while let Some(word) = words.next() {
            if word == "--width" {
                let share: f64 = words.next().ok_or("--width: a share of the frame is missing")?.parse()?;
                settings.width = share.clamp(0.01, 1.0);
                continue;
            }
            let mut numbers = Vec::new();
            while let Some(number) = words.peek().and_then(|next| next.parse().ok()) {
                numbers.push(number);
                words.next();
            }
            match (word.as_str(), numbers.as_slice()) {
                ("--cells", [_, ..]) => settings.cells = Some(numbers),
                ("--threads", [_, ..]) => settings.threads = numbers,
                ("--repeats", [count]) if *count > 0 => settings.repeats = *count,
                ("--limit", [seconds]) => settings.limit = *seconds as f64,
                ("--uzawa", []) => settings.uzawa = true,
                (letters, []) if letters.chars().all(|c| letter(c).is_some()) => {
                    settings.cases = letters.chars().filter_map(letter).collect();
                }
                (other, _) => {
                    return Err(format!(
                        "{other}: allowed are letters of abcdef, --cells N .., --threads N .., --repeats N, --limit SECONDS, --width SHARE, --uzawa"
                    )
                    .into());
                }
            }
        }
        Ok(settings)
    }
}

fn letter(c: char) -> Option<Case> {
    Case::ALL.into_iter().find(|case| case.letter() == c)
}

fn main() -> Outcome<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let settings = Settings::new(&words)?;
    let program = program()?;
    print!("{}# load: {}# medians of {}\n\n", machine::comment(), load(), settings.repeats);
    if settings.uzawa {
        return uzawa(&program, &settings);
    }
    println!(
        "| case | cells | threads | s | of which kernel table | s per increment | applications | MiB | residual | error | contact mm2 \
         | over its transforms | 1 thread / threads |"
    );
    println!("|{}", "---|".repeat(13));
    let mut growth = Vec::new();
    for &case in &settings.cases {
        let runs = measure_case(&program, case, &settings)?;
        let finest = runs.last().map_or(f64::NAN, |(.., run)| run.quantity);
        growth.extend(growth_of(case, &runs));
        for (n, threads, run) in &runs {
            let wanted = case.exact().unwrap_or(finest);
            let single = runs.iter().find(|(m, t, _)| m == n && *t == 1).map(|(.., run)| run.total);
            println!("{}", row(case, (*n, *threads), run, (wanted, single)));
        }
    }
    println!("\n{}", growth.join("\n"));
    print!("\n# load at the end: {}", load());
    Ok(())
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg").unwrap_or_else(|_| "unknown\n".to_owned())
}

fn measure_case(
    program: &std::path::Path,
    case: Case,
    settings: &Settings,
) -> Outcome<Vec<(usize, usize, Run)>> {
    let mut runs = Vec::new();
    let cells = settings.cells.as_deref().unwrap_or(case.cells());
    for &n in cells {
        let mut longest: f64 = 0.0;
        for &threads in &settings.threads {
            let some: Outcome<Vec<Run>> = (0..settings.repeats)
                .map(|_| measure::run(program, case, (n, threads), ("auto", settings.width)))
                .collect();
            let run = measure::median(some?);
            eprintln!("{} {n} {threads}: {:.3} s, {}", case.letter(), run.total, run.status);
            longest = longest.max(run.total);
            runs.push((n, threads, run));
        }
        if longest > settings.limit {
            break;
        }
    }
    Ok(runs)
}

/// Exponents k in the growth N^k of the seconds with the number of cells N, on one thread.
fn growth_of(case: Case, runs: &[(usize, usize, Run)]) -> Option<String> {
    let seconds: Vec<(f64, f64)> = runs
        .iter()
        .filter(|(_, threads, _)| *threads == 1)
        .map(|(n, _, run)| ((n * n) as f64, run.total))
        .collect();
    let exponent = |a: &(f64, f64), b: &(f64, f64)| (b.1 / a.1).ln() / (b.0 / a.0).ln();
    let (first, last) = (seconds.first()?, seconds.last().filter(|_| seconds.len() > 1)?);
    let each: Vec<String> =
        seconds.windows(2).map(|pair| format!("{:.2}", exponent(&pair[0], &pair[1]))).collect();
    let letter = case.letter();
    Some(format!(
        "growth of {letter} with the cells: N^{:.2} over all, {}",
        exponent(first, last),
        each.join(", ")
    ))
}

fn row(case: Case, (n, threads): (usize, usize), run: &Run, (wanted, single): (f64, Option<f64>)) -> String {
    let floor = run.applications * case.transforms() * transform::seconds(n);
    let error = if run.status == "converged" {
        format!("{:.1e}", (run.quantity / wanted - 1.0).abs())
    } else {
        run.status.clone()
    };
    format!(
        "| {} | {n} | {threads} | {:.3} | {:.3} | {:.4} | {} | {:.0} | {:.1e} | {error} | {:.4} | {:.2} | {} |",
        case.letter(),
        run.total,
        run.table,
        (run.total - run.table) / case.increments() as f64,
        run.applications,
        run.memory,
        run.residual,
        run.contact,
        run.total / floor,
        single.map_or(String::new(), |single| format!("{:.2}", single / run.total)),
    )
}

/// Compares the methods "auto" (default), "bb" and "uzawa" on the scene with fibres.
fn uzawa(program: &std::path::Path, settings: &Settings) -> Outcome<()> {
    println!("| cells | method | s | applications | residual | normal force |");
    println!("|{}", "---|".repeat(6));
    let cells = settings.cells.as_deref().unwrap_or(Case::Fibres.cells());
    for &n in cells.iter().filter(|n| **n <= 128) {
        for method in ["auto", "bb", "uzawa"] {
            let run =
                measure::run(program, Case::Fibres, (n, settings.threads[0]), (method, settings.width))?;
            println!(
                "| {n} | {method} | {:.3} | {} | {:.1e} ({}) | {:.6} |",
                run.total, run.applications, run.residual, run.status, run.quantity
            );
        }
    }
    Ok(())
}
