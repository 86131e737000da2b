//! The history of a run as a table, `history.csv`: one row per increment or cycle jump.

use std::fmt::Write as _;

use crate::error::{Error, Result};
use crate::evolution::records::{FrettingLoop, IncrementRecord};

/// Columns of `history.csv`: the names of `summary.steps`, vectors by component.
pub const HISTORY_COLUMNS: [&str; 46] = [
    "name",
    "increment",
    "approach",
    "shift_x",
    "shift_y",
    "rotation_x",
    "rotation_y",
    "twist",
    "normal_force",
    "tangential_force_x",
    "tangential_force_y",
    "moment_x",
    "moment_y",
    "moment_n",
    "contact_area",
    "stick_area",
    "peak_pressure",
    "contact_touches_edge",
    "worn_volume",
    "worn_volume_error",
    "worn_volume_by_energy",
    "worn_volume_body1",
    "worn_volume_body2",
    "max_wear_depth",
    "wear_depth_error",
    "cycles_done",
    "distance_slid",
    "dissipation",
    "natural_residual",
    "min_gap",
    "max_cone_violation",
    "normal_gap_energy",
    "tangential_gap_energy",
    "operator_defect",
    "energy_balance",
    "iterations",
    "operator_applications",
    "seconds",
    "converged",
    "rolling_creepage_along",
    "rolling_creepage_left",
    "rolling_spin",
    "rolling_distance",
    "jump_length",
    "jump_solves",
    "jump_rejected",
];

/// The table as text: a header, then one row per record; numbers read back to the same bits.
///
/// # Errors
/// Numerical, if a number is not finite.
pub fn history_csv(records: &[IncrementRecord]) -> Result<String> {
    let mut text = HISTORY_COLUMNS.join(",") + "\n";
    for (row, record) in records.iter().enumerate() {
        write_row(&mut text, record).map_err(|error| {
            error.context(format!("history.csv, row {}, step \"{}\"", row + 1, record.name))
        })?;
    }
    Ok(text)
}

/// Fretting loops as text: a row per increment.
///
/// # Errors
/// Numerical, if a number is not finite.
pub fn loops_csv(loops: &[FrettingLoop]) -> Result<String> {
    let mut text =
        "name,cycles_done,shift_x,shift_y,tangential_force_x,tangential_force_y,normal_force\n".to_owned();
    for cycle in loops {
        for point in &cycle.points {
            if point.iter().any(|value| !value.is_finite()) {
                return Err(Error::numerical(format!(
                    "loops.csv, step \"{}\": {point:?} are not finite",
                    cycle.name
                )));
            }
            let numbers: Vec<String> = point.iter().map(|value| format!("{value:?}")).collect();
            writeln!(text, "{},{},{}", quoted(&cycle.name), cycle.cycles_done, numbers.join(","))
                .expect("writing to a string does not fail");
        }
    }
    Ok(text)
}

fn write_row(text: &mut String, r: &IncrementRecord) -> Result<()> {
    let c = &r.certificate;
    let before = [
        r.approach,
        r.shift[0],
        r.shift[1],
        r.rotation[0],
        r.rotation[1],
        r.twist,
        r.normal_force,
        r.tangential_force[0],
        r.tangential_force[1],
        r.moment[0],
        r.moment[1],
        r.moment[2],
        r.contact_area,
        r.stick_area,
        r.peak_pressure,
    ];
    let wear = [r.worn_volume_by_body[0], r.worn_volume_by_body[1], r.max_wear_depth, r.wear_depth_error];
    let checks = [
        r.distance_slid,
        r.dissipation,
        c.natural_residual,
        c.min_gap,
        c.max_cone_violation,
        c.normal_gap_energy,
        c.tangential_gap_energy,
    ];
    let mut cells = vec![quoted(&r.name), r.increment.to_string()];
    numbers(&mut cells, &before)?;
    cells.push(r.contact_touches_edge.to_string());
    numbers(&mut cells, &[r.worn_volume, r.worn_volume_error])?;
    push_optional(&mut cells, r.worn_volume_by_energy.map(|volume| [volume]))?;
    numbers(&mut cells, &wear)?;
    cells.push(r.cycles_done.to_string());
    numbers(&mut cells, &checks)?;
    push_optional(&mut cells, c.operator_defect.map(|defect| [defect]))?;
    numbers(&mut cells, &[c.energy_balance])?;
    cells.extend([r.iterations.to_string(), r.operator_applications.to_string()]);
    numbers(&mut cells, &[r.seconds])?;
    cells.push(r.converged.to_string());
    let rolling = r.rolling.map(|roll| [roll.creepage[0], roll.creepage[1], roll.spin, roll.distance]);
    push_optional(&mut cells, rolling)?;
    match &r.jump {
        Some(jump) => {
            numbers(&mut cells, &[jump.length])?;
            cells.extend([jump.solves.to_string(), jump.rejected.to_string()]);
        }
        None => cells.extend([const { String::new() }; 3]),
    }
    writeln!(text, "{}", cells.join(",")).expect("writing to a string does not fail");
    Ok(())
}

fn numbers(cells: &mut Vec<String>, values: &[f64]) -> Result<()> {
    for value in values {
        if !value.is_finite() {
            return Err(Error::numerical(format!(
                "`{}` is {value}, not a finite number",
                HISTORY_COLUMNS[cells.len()]
            )));
        }
        // The shortest text that reads back to the same bits, with an exponent where it is long.
        cells.push(format!("{value:?}"));
    }
    Ok(())
}

/// Numbers that not every entry has: empty cells where they are missing.
fn push_optional<const N: usize>(cells: &mut Vec<String>, values: Option<[f64; N]>) -> Result<()> {
    let Some(values) = values else {
        cells.extend([const { String::new() }; N]);
        return Ok(());
    };
    numbers(cells, &values)
}

/// A name as a CSV cell (RFC 4180): quoted where it holds a comma, a quote or a line end.
fn quoted(name: &str) -> String {
    if name.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", name.replace('"', "\"\""))
    } else {
        name.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evolution::records::{JumpRecord, RollingRecord};

    /// Truth: RFC 4180, and that shortest-digit text reads back to the same bits.
    #[test]
    fn rows_read_back() {
        let record = IncrementRecord {
            name: "a, \"b\"".into(),
            increment: 3,
            approach: 0.1 + 0.2,
            seconds: 1e-7,
            ..Default::default()
        };
        let text = history_csv(&[record]).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines[0].split(',').count(), HISTORY_COLUMNS.len());
        let rest = lines[1].strip_prefix("\"a, \"\"b\"\"\",3,").unwrap();
        let cells: Vec<&str> = rest.split(',').collect();
        assert_eq!(cells.len() + 2, HISTORY_COLUMNS.len());
        assert_eq!(cells[0].parse::<f64>().unwrap().to_bits(), (0.1_f64 + 0.2).to_bits());
        let at = |name: &str| cells[HISTORY_COLUMNS.iter().position(|column| *column == name).unwrap() - 2];
        assert_eq!(at("seconds").parse::<f64>().unwrap(), 1e-7);
        assert!(
            ["operator_defect", "rolling_spin", "rolling_distance", "worn_volume_by_energy", "jump_solves"]
                .iter()
                .all(|name| at(name).is_empty())
        );
    }

    /// Truth: docs/results.md: what only some entries have stands in its own columns.
    #[test]
    fn rolling_and_direct_sums_have_columns() {
        let roll = RollingRecord { creepage: [1e-3, -2e-3], spin: 0.25, distance: 7.0 };
        let jump = JumpRecord { length: 250.0, solves: 7, rejected: 2, ..Default::default() };
        let mut record = IncrementRecord {
            rolling: Some(roll),
            jump: Some(jump),
            worn_volume_by_energy: Some(0.125),
            wear_depth_error: 3e-7,
            distance_slid: 11.0,
            ..Default::default()
        };
        record.certificate.operator_defect = Some(3e-15);
        let text = history_csv(&[record]).unwrap();
        let cells: Vec<&str> = text.lines().nth(1).unwrap().split(',').collect();
        assert_eq!(cells.len(), HISTORY_COLUMNS.len());
        for (name, value) in [
            ("operator_defect", 3e-15),
            ("rolling_creepage_along", 1e-3),
            ("rolling_creepage_left", -2e-3),
            ("rolling_spin", 0.25),
            ("rolling_distance", 7.0),
            ("worn_volume_by_energy", 0.125),
            ("wear_depth_error", 3e-7),
            ("distance_slid", 11.0),
            ("jump_length", 250.0),
            ("jump_solves", 7.0),
            ("jump_rejected", 2.0),
        ] {
            let column = HISTORY_COLUMNS.iter().position(|column| *column == name).unwrap();
            assert_eq!(cells[column].parse::<f64>().unwrap(), value, "{name}");
        }
    }

    /// Truth: a number that is not finite is refused, named by its column.
    #[test]
    fn refuses_what_is_not_finite() {
        let record =
            IncrementRecord { name: "wear".into(), worn_volume: f64::INFINITY, ..Default::default() };
        let message = history_csv(&[record]).unwrap_err().to_string();
        assert!(message.contains("worn_volume") && message.contains("wear"), "{message}");
    }
}
