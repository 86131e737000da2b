//! Table of results with estimated errors, for runs with a target accuracy.

use super::table::{align_columns, counted, five_digits};
use crate::output::accuracy::{AccuracyRecord, EstimatedResult};

/// Relative error up to which the table omits a result, as a fraction of the requested accuracy.
const NEGLIGIBLE_ERROR_SHARE: f64 = 1e-4;

pub(super) fn describe(record: &AccuracyRecord) -> String {
    let mut rows = vec![
        ["step", "result", "value", "estimated error", "relative error", "extrapolated"]
            .map(str::to_owned)
            .to_vec(),
    ];
    let matters = |result: &&EstimatedResult| {
        result.relative.is_none_or(|relative| relative > NEGLIGIBLE_ERROR_SHARE * record.requested)
    };
    for result in record.results.iter().filter(matters) {
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.1e}"));
        rows.push(vec![
            result.step.clone(),
            result.name.to_owned(),
            value_with_reliable_digits(result.value, result),
            number(result.estimate),
            number(result.relative),
            result.extrapolated.map_or_else(String::new, |limit| value_with_reliable_digits(limit, result)),
        ]);
    }
    let last = record.runs.last();
    let cells =
        last.and_then(|run| run.cells).map(|[x, y]| format!(" with {x} x {y} cells")).unwrap_or_default();
    let times = last.filter(|run| run.increment_factor > 1);
    let times = times.map(|run| format!(", increments x {}", run.increment_factor)).unwrap_or_default();
    let reached = if record.met { "reached" } else { "NOT REACHED; last converged run" };
    let runs = counted(record.runs.len(), "run");
    let in_words = |name: &str| name.replace("worn", "wear").replace('_', " ");
    let mut names: Vec<String> = Vec::new();
    for result in &record.results {
        let name = in_words(result.name);
        if !names.contains(&name) {
            names.push(name);
        }
    }
    let of = if names.is_empty() { in_words(&record.quantities.join(", ")) } else { names.join(", ") };
    let reason = record.reason.as_ref().map(|reason| format!("\n{reason}\n")).unwrap_or_default();
    format!(
        "accuracy {:e} of {of}: {reached}{cells}{times}; {runs}{reason}\n{}",
        record.requested,
        align_columns(&rows)
    )
}

/// Formats a value, rounded to the second significant digit of its estimated error. A large error rounds the value to
/// an integer at most. Without an error estimate, the value has five digits.
fn value_with_reliable_digits(value: f64, result: &EstimatedResult) -> String {
    let Some(estimate) = result.estimate.filter(|estimate| *estimate > 0.0) else {
        return five_digits(value);
    };
    let places = (1.0 - estimate.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.places$}")
}
