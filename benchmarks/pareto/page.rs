//! Tables, charts and the page of results.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use orthowear::output::plot::axis::Scale;
use orthowear::output::plot::chart::{Chart, Series};

use super::cases::{Case, OWN};
use super::{Outcome, Sample, machine};

/// Error levels for which the page names the fastest settings.
const ERRORS: [f64; 3] = [1e-2, 1e-3, 1e-4];

/// Formats an error for a line in the terminal.
pub fn number(error: Option<f64>) -> String {
    error.map_or_else(|| "not converged".to_owned(), |error| format!("{error:.3e}"))
}

pub fn write_table(case: &Case, samples: &[Sample], folder: &Path) -> Outcome<()> {
    let mut text = machine::comment();
    writeln!(text, "# one thread; errors against: {}", case.source)?;
    writeln!(text, "knob,setting,error,seconds_median,seconds_least,seconds_most,on_front")?;
    for sample in samples {
        let error = number(sample.error);
        writeln!(
            text,
            "{},\"{}\",{error},{:.3},{:.3},{:.3},{}",
            sample.configuration.family,
            sample.configuration.label,
            sample.median(),
            sample.seconds[0],
            sample.seconds[sample.seconds.len() - 1],
            sample.on_front
        )?;
    }
    Ok(fs::write(folder.join(format!("pareto-{}.csv", case.name)), text)?)
}

pub fn write_chart(case: &Case, samples: &[Sample], folder: &Path) -> Outcome<()> {
    let mut families: Vec<&str> = Vec::new();
    for sample in samples {
        if !families.contains(&sample.configuration.family) {
            families.push(sample.configuration.family);
        }
    }
    let points = |wanted: &dyn Fn(&Sample) -> bool| -> Vec<[f64; 2]> {
        let mut points: Vec<[f64; 2]> = samples
            .iter()
            .filter(|sample| wanted(sample))
            .filter_map(|sample| Some([sample.median(), sample.error.filter(|error| *error > 0.0)?]))
            .collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        points
    };
    let mut series = vec![Series { name: "front".to_owned(), points: points(&|sample| sample.on_front) }];
    for family in families {
        let own = points(&|sample| sample.configuration.family == family);
        series.push(Series { name: family.to_owned(), points: own });
    }
    let chart = Chart {
        title: case.title.to_owned(),
        labels: ["run time, s".to_owned(), "relative error".to_owned()],
        scales: [Scale::Logarithmic; 2],
        series,
    };
    Ok(fs::write(folder.join(format!("pareto-{}.svg", case.name)), chart.svg())?)
}

fn fastest(samples: &[Sample], error: f64) -> Option<&Sample> {
    let good = samples.iter().filter(|sample| sample.error.is_some_and(|found| found <= error));
    good.min_by(|a, b| a.median().total_cmp(&b.median()))
}

pub fn section(case: &Case, samples: &[Sample]) -> String {
    let mut text = format!("## {}\n\n", case.title);
    text.push_str(&format!("Errors against: {}. ", case.source));
    text.push_str(&format!("[Table](../docs/benchmarks/pareto-{0}.csv).\n\n", case.name));
    text.push_str(&format!("![{}](../docs/benchmarks/pareto-{}.svg)\n\n", case.title, case.name));
    text.push_str("| error at most | fastest | s |\n|---|---|---|\n");
    for error in ERRORS {
        let row = fastest(samples, error).map_or_else(
            || "none of these |".to_owned(),
            |best| format!("{} | {:.3}", best.configuration.label, best.median()),
        );
        text.push_str(&format!("| {error:e} | {row} |\n"));
    }
    text.push_str("\n| on the front | error | s |\n|---|---|---|\n");
    let mut front: Vec<&Sample> = samples.iter().filter(|sample| sample.on_front).collect();
    front.sort_by(|a, b| a.median().total_cmp(&b.median()));
    for sample in front {
        let error = sample.error.unwrap_or(f64::NAN);
        text.push_str(&format!(
            "| {} | {error:.1e} | {:.3} |\n",
            sample.configuration.label,
            sample.median()
        ));
    }
    text.push_str(&format!("\n{}\n", defaults(samples)));
    text
}

fn defaults(samples: &[Sample]) -> String {
    let Some((own, error)) = samples
        .iter()
        .find(|sample| sample.configuration.family == OWN)
        .and_then(|own| Some((own, own.error?)))
    else {
        return "The scene as it is did not converge.".to_owned();
    };
    let found = format!("The scene as it is: error {error:.1e} in {:.3} s", own.median());
    if own.on_front {
        return format!("{found}, on the front.");
    }
    match fastest(samples, error) {
        Some(best) => format!(
            "{found}, {:.2} times the time of the fastest setting that is as accurate ({}); half of its runs lie within {:.0} % of the median.",
            own.median() / best.median(),
            best.configuration.label,
            100.0 * own.scatter() / own.median()
        ),
        None => format!("{found}."),
    }
}

pub fn results(results: &[(Case, Vec<Sample>)]) -> String {
    let mut text = "# Error against run time\n\nMade by `cargo run --release --example pareto`: every setting by itself, the others as the scene has them; seconds \
                    of the whole program on one thread, the median of nine runs (three if longer than 0.5 s, one if longer than \
                    10 s), which take turns. Meshes are made beforehand.\n\n"
        .to_owned();
    for line in machine::comment().lines() {
        text.push_str(&format!("* {}\n", line.trim_start_matches("# ")));
    }
    for (case, samples) in results {
        text.push_str(&format!("\n{}", section(case, samples)));
    }
    text
}
