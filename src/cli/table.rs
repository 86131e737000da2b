use crate::evolution::records::IncrementRecord;
use crate::output::body_peaks::Peak;
pub(super) use crate::output::number_format::five_digits;
use crate::output::number_format::five_digits_of_small;
use crate::output::summary::{Status, Summary, Units};

/// Aligns the first column of a table to the left and the other columns to the right.
pub(super) fn align_columns(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let width = |column: usize| {
        rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..columns).map(width).collect();
    let mut text = String::new();
    for row in rows {
        let cells: Vec<String> = row
            .iter()
            .zip(&widths)
            .enumerate()
            .map(|(column, (cell, &width))| {
                let blank = " ".repeat(width - cell.chars().count());
                if column == 0 { format!("{cell}{blank}") } else { format!("{blank}{cell}") }
            })
            .collect();
        text.push_str(cells.join("   ").trim_end());
        text.push('\n');
    }
    text
}

/// Text for the outcome of a run in tables; `absent` if the run was not computed.
pub(super) fn status_label(status: Option<Status>, absent: &'static str) -> &'static str {
    match status {
        None => absent,
        Some(Status::Converged) => "converged",
        Some(Status::NotConverged) => "NOT CONVERGED",
        Some(Status::Failed) => "FAILED",
        Some(Status::Interrupted) => "INTERRUPTED",
    }
}

/// Number with its noun: "1 run", "2 runs".
pub(super) fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Force component, or 0 if the component is below 1e-7 of the normal load, where it is rounding error.
pub(super) fn without_round_off(force: f64, load: f64) -> f64 {
    if force.abs() < 1e-7 * load { 0.0 } else { force }
}

const REVERSAL_NOTE: &str = "steps with cycles: values at the + reversal point of the last cycle (approach: mean of both reversal points)\n";

#[derive(Clone, Copy)]
struct OptionalColumns {
    cycles: bool,
    rotations: bool,
}

pub(super) fn results(summary: &Summary) -> String {
    let mut last: Vec<&IncrementRecord> = Vec::new();
    for record in &summary.steps {
        match last.iter_mut().find(|known| known.name == record.name) {
            Some(known) => *known = record,
            None => last.push(record),
        }
    }
    if last.is_empty() {
        return String::new();
    }
    let optional = OptionalColumns {
        cycles: last.iter().any(|record| record.cycles_done > 0),
        rotations: last.iter().any(|record| record.rotation != [0.0; 2] || record.twist != 0.0),
    };
    let mut rows = header_rows(&summary.units, optional);
    rows.extend(last.iter().map(|record| row(&record.at_plus_reversal(), optional)));
    let note = if last.iter().any(|record| record.stroke_ends.is_some()) { REVERSAL_NOTE } else { "" };
    align_columns(&rows) + note
}

pub(super) fn body_peak_lines(summary: &Summary) -> String {
    let mut text = String::new();
    for name in ["body1", "body2"] {
        let Some(last) = summary.bodies.iter().rev().find(|record| record.body == name) else { continue };
        let peaks = &last.peaks;
        let at = |x: &[f64; 3]| format!("({})", x.map(five_digits).join(", "));
        let Peak { value, position } = &peaks.von_mises;
        let mut parts = vec![format!("von Mises {} at {}", five_digits(*value), at(position))];
        parts.extend(peaks.indices.iter().map(|index| {
            format!(
                "{} {} ({}) at {}",
                index.criterion,
                five_digits(index.value),
                index.mode,
                at(&index.position)
            )
        }));
        text.push_str(&format!("\n{name}, {}: {}\n", last.name, parts.join("; ")));
        if let Some(error) = &peaks.error {
            text.push_str(&format!("{name}, {}: {}\n", last.name, error.advice(&summary.units.length)));
        }
    }
    text
}

fn header_rows(units: &Units, optional: OptionalColumns) -> Vec<Vec<String>> {
    let (length, force) = (&units.length, &units.force);
    let mut columns = vec![
        ("step", String::new()),
        ("load", force.clone()),
        ("approach", length.clone()),
        ("shift", length.clone()),
        ("tangential force", force.clone()),
        ("contact area", format!("{length}2")),
        ("stick area", format!("{length}2")),
        ("peak pressure", units.stress().replace("^{2}", "2")),
        ("wear volume", format!("{length}3")),
        ("residual", String::new()),
    ];
    if optional.rotations {
        columns.insert(4, ("rotation, twist", "degrees".to_owned()));
    }
    if optional.cycles {
        columns.insert(1, ("cycles", String::new()));
    }
    let (names, units): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
    vec![names.into_iter().map(str::to_owned).collect(), units]
}

fn row(record: &IncrementRecord, optional: OptionalColumns) -> Vec<String> {
    let shift = record.shift.map(five_digits);
    let tangential = record.tangential_force.map(|q| five_digits(without_round_off(q, record.normal_force)));
    let pair = |[x, y]: [String; 2]| format!("({x}, {y})");
    let mark = if record.converged { "" } else { " !" };
    let mut cells = vec![
        record.name.clone(),
        five_digits(record.normal_force),
        five_digits(record.approach),
        pair(shift),
        pair(tangential),
        five_digits_of_small(record.contact_area),
        five_digits_of_small(record.stick_area),
        five_digits(record.peak_pressure),
        five_digits_of_small(record.worn_volume),
        format!("{:.1e}{mark}", record.certificate.natural_residual),
    ];
    if optional.rotations {
        let [x, y] = record.rotation.map(five_digits);
        cells.insert(4, format!("({x}, {y}), {}", five_digits(record.twist)));
    }
    if optional.cycles {
        cells.insert(1, record.cycles_done.to_string());
    }
    cells
}
