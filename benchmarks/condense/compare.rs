//! Measures all programs on all blocks. The programs take turns, and each run is a separate process.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};

use crate::case::{Case, NAMES};
use crate::{Outcome, machine};

type Values = BTreeMap<String, f64>;

/// Stages that are compared. Assembly is omitted, because it is the same for all programs.
const STAGES: [&str; 4] = ["order", "symbolic", "factor", "flexibility"];

struct Contestant {
    name: &'static str,
    /// Arguments of `measure` after the name of the block (orthowear), or the file of another program.
    how: How,
}

enum How {
    Own([&'static str; 3]),
    Peer(&'static str),
}

const CONTESTANTS: [Contestant; 6] = [
    Contestant { name: "orthowear", how: How::Own(["metis", "schur", "1"]) },
    Contestant { name: "cholmod", how: How::Peer("cholmod") },
    Contestant { name: "mumps", how: How::Peer("mumps") },
    Contestant { name: "orthowear-2-threads", how: How::Own(["metis", "schur", "2"]) },
    Contestant { name: "orthowear-amd", how: How::Own(["amd", "schur", "1"]) },
    Contestant { name: "orthowear-back-solves", how: How::Own(["metis", "solves", "1"]) },
];

pub struct Settings {
    folder: PathBuf,
    out: PathBuf,
    repeats: usize,
    names: Vec<String>,
}

impl Settings {
    pub fn new(arguments: &[&str]) -> Outcome<Self> {
        let mut arguments = arguments.iter().copied();
        let folder = arguments.next().ok_or("compare needs the folder of the peers")?.into();
        let out = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/benchmarks");
        let mut settings = Self { folder, out, repeats: 3, names: Vec::new() };
        while let Some(argument) = arguments.next() {
            match argument {
                "--out" => settings.out = arguments.next().ok_or("--out needs a directory")?.into(),
                "--repeats" => {
                    settings.repeats = arguments.next().ok_or("--repeats needs a number")?.parse()?
                }
                name if NAMES.contains(&name) => settings.names.push(name.to_owned()),
                other => return Err(format!("unknown argument {other}").into()),
            }
        }
        if settings.names.is_empty() {
            settings.names = NAMES.map(str::to_owned).to_vec();
        }
        Ok(settings)
    }
}

pub fn compare(settings: &Settings) -> Outcome<()> {
    fs::create_dir_all(&settings.out)?;
    let mut table = machine::comment();
    writeln!(table, "# load before: {}", fs::read_to_string("/proc/loadavg").unwrap_or_default().trim())?;
    writeln!(table, "# least of {} runs of each program in turn", settings.repeats)?;
    table.push_str("block,unknowns,contact_rows,program");
    STAGES.iter().for_each(|stage| table.push_str(&format!(",{stage}_cpu")));
    table.push_str(",total_cpu,total_wall,gflop_per_s,entries,peak_megabytes\n");
    let mut series: Vec<Series> = Vec::new();
    for name in &settings.names {
        let matrix = settings.folder.join("matrix");
        Case::new(name)?.write(&matrix)?;
        for (contestant, best) in CONTESTANTS.iter().zip(measure(settings, name, &matrix)?) {
            let Some(values) = best else { continue };
            table.push_str(&row(name, contestant.name, &values)?);
            let point = [values["unknowns"], total(&values, "cpu")];
            match series.iter_mut().find(|series| series.name == contestant.name) {
                Some(series) => series.points.push(point),
                None => series.push(Series { name: contestant.name.to_owned(), points: vec![point] }),
            }
        }
        fs::remove_file(&matrix)?;
    }
    writeln!(table, "# load after: {}", fs::read_to_string("/proc/loadavg").unwrap_or_default().trim())?;
    series.iter_mut().for_each(|series| series.points.sort_by(|a, b| a[0].total_cmp(&b[0])));
    let chart = Chart {
        title: "Condensation of blocks to contact nodes".to_owned(),
        labels: ["unknowns".to_owned(), "processor time, s".to_owned()],
        scales: [Scale::Logarithmic; 2],
        series,
    };
    fs::write(settings.out.join("condense.svg"), chart.svg())?;
    Ok(fs::write(settings.out.join("condense.csv"), table)?)
}

/// Least values of each program over the repetitions; `None` for programs that do not exist.
fn measure(settings: &Settings, name: &str, matrix: &Path) -> Outcome<Vec<Option<Values>>> {
    let mut best: Vec<Option<Values>> = vec![None; CONTESTANTS.len()];
    for _ in 0..settings.repeats {
        for (contestant, best) in CONTESTANTS.iter().zip(&mut best) {
            let Some(values) = run(settings, contestant, name, matrix)? else { continue };
            println!("{name} {}: {:.3} s", contestant.name, total(&values, "cpu"));
            best.get_or_insert_with(|| values.clone())
                .iter_mut()
                .for_each(|(key, least)| *least = least.min(values[key]));
        }
    }
    // MUMPS uses orthowear's elimination order. The time of the ordering therefore also counts for MUMPS.
    if let [Some(own), _, Some(mumps), ..] = &mut best[..] {
        for key in ["order_cpu", "order_wall"] {
            mumps.insert(key.to_owned(), own[key]);
        }
    }
    let traces: Vec<f64> = best.iter().flatten().map(|values| values["trace"]).collect();
    if traces.iter().any(|trace| (trace / traces[0] - 1.0).abs() > 1e-9) {
        return Err(format!("the programs disagree on the flexibility: {traces:?}").into());
    }
    Ok(best)
}

fn run(settings: &Settings, contestant: &Contestant, name: &str, matrix: &Path) -> Outcome<Option<Values>> {
    let mut command = match contestant.how {
        How::Own(arguments) => {
            let mut command = Command::new(std::env::current_exe()?);
            command.args(["measure", name]).args(arguments);
            command
        }
        How::Peer(file) => {
            let program = settings.folder.join(file);
            if !program.exists() {
                return Ok(None);
            }
            let mut command = Command::new(program);
            command.arg(matrix);
            command
        }
    };
    let output = command.output()?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr);
        return Err(format!("{} failed on {name}: {message}", contestant.name).into());
    }
    let text = String::from_utf8(output.stdout)?;
    let pairs = text.lines().filter_map(|line| line.split_once(' '));
    Ok(Some(pairs.filter_map(|(key, value)| Some((key.to_owned(), value.trim().parse().ok()?))).collect()))
}

fn total(values: &Values, clock: &str) -> f64 {
    STAGES.iter().filter_map(|stage| values.get(&format!("{stage}_{clock}"))).sum()
}

fn row(name: &str, program: &str, values: &Values) -> Outcome<String> {
    let mut row = format!("{name},{},{},{program}", values["unknowns"], values["contact"]);
    for stage in STAGES {
        write!(row, ",{:.3}", values.get(&format!("{stage}_cpu")).unwrap_or(&0.0))?;
    }
    let rate = values["flops"] / values["factor_wall"] * 1e-9;
    let (cpu, wall) = (total(values, "cpu"), total(values, "wall"));
    writeln!(
        row,
        ",{cpu:.3},{wall:.3},{rate:.1},{:.0},{:.0}",
        values["entries"],
        values["peak_bytes"] * 1e-6
    )?;
    Ok(row)
}
