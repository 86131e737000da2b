//! History of a run as a table, `history.csv`: one row per increment or cycle jump.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use crate::error::{Error, Result};
use crate::evolution::records::{FrettingLoop, IncrementRecord};
use Cell::{Count, Flag, Missing, Number, Text};

enum Cell<'a> {
    Text(&'a str),
    Number(f64),
    Count(u64),
    Flag(bool),
    Missing,
}

/// Name of a column, and the function that returns its cell for an entry.
type Column = (&'static str, fn(&IncrementRecord) -> Cell);

/// Columns, named after the keys of `summary.steps`. A vector has one column per component.
const HISTORY_COLUMNS: [Column; 47] = [
    ("name", |r| Text(&r.name)),
    ("increment", |r| Count(r.increment as u64)),
    ("approach", |r| Number(r.approach)),
    ("shift_x", |r| Number(r.shift[0])),
    ("shift_y", |r| Number(r.shift[1])),
    ("rotation_x", |r| Number(r.rotation[0])),
    ("rotation_y", |r| Number(r.rotation[1])),
    ("twist", |r| Number(r.twist)),
    ("normal_force", |r| Number(r.normal_force)),
    ("tangential_force_x", |r| Number(r.tangential_force[0])),
    ("tangential_force_y", |r| Number(r.tangential_force[1])),
    ("moment_x", |r| Number(r.moment[0])),
    ("moment_y", |r| Number(r.moment[1])),
    ("moment_n", |r| Number(r.moment[2])),
    ("contact_area", |r| Number(r.contact_area)),
    ("stick_area", |r| Number(r.stick_area)),
    ("peak_pressure", |r| Number(r.peak_pressure)),
    ("contact_touches_edge", |r| Flag(r.contact_touches_edge)),
    ("worn_volume", |r| Number(r.worn_volume)),
    ("worn_volume_error", |r| Number(r.worn_volume_error)),
    ("worn_volume_by_energy", |r| r.worn_volume_by_energy.map_or(Missing, Number)),
    ("worn_volume_body1", |r| Number(r.worn_volume_by_body[0])),
    ("worn_volume_body2", |r| Number(r.worn_volume_by_body[1])),
    ("max_wear_depth", |r| Number(r.max_wear_depth)),
    ("max_wear_depth_error", |r| Number(r.max_wear_depth_error)),
    ("wear_depth_error", |r| Number(r.wear_depth_error)),
    ("cycles_done", |r| Count(r.cycles_done)),
    ("distance_slid", |r| Number(r.distance_slid)),
    ("dissipation", |r| Number(r.dissipation)),
    ("natural_residual", |r| Number(r.certificate.natural_residual)),
    ("min_gap", |r| Number(r.certificate.min_gap)),
    ("max_cone_violation", |r| Number(r.certificate.max_cone_violation)),
    ("normal_gap_energy", |r| Number(r.certificate.normal_gap_energy)),
    ("tangential_gap_energy", |r| Number(r.certificate.tangential_gap_energy)),
    ("operator_defect", |r| r.certificate.operator_defect.map_or(Missing, Number)),
    ("energy_balance", |r| Number(r.certificate.energy_balance)),
    ("iterations", |r| Count(r.iterations as u64)),
    ("operator_applications", |r| Count(r.operator_applications as u64)),
    ("seconds", |r| Number(r.seconds)),
    ("converged", |r| Flag(r.converged)),
    ("rolling_creepage_along", |r| r.rolling.map_or(Missing, |rolling| Number(rolling.creepage[0]))),
    ("rolling_creepage_left", |r| r.rolling.map_or(Missing, |rolling| Number(rolling.creepage[1]))),
    ("rolling_spin", |r| r.rolling.map_or(Missing, |rolling| Number(rolling.spin))),
    ("rolling_distance", |r| r.rolling.map_or(Missing, |rolling| Number(rolling.distance))),
    ("jump_length", |r| r.jump.map_or(Missing, |jump| Number(jump.length))),
    ("jump_solves", |r| r.jump.map_or(Missing, |jump| Count(jump.solves as u64))),
    ("jump_rejected", |r| r.jump.map_or(Missing, |jump| Count(jump.rejected as u64))),
];

/// Text of the table. Numbers read back to the same bits.
///
/// # Errors
/// If a number is not finite (kind `Numerical`).
pub fn history_csv(records: &[IncrementRecord]) -> Result<String> {
    let loads: BTreeSet<&str> =
        records.iter().flat_map(|record| record.loads.keys()).map(String::as_str).collect();
    let mut text = HISTORY_COLUMNS.map(|(name, _)| name).join(",");
    loads.iter().for_each(|name| text += &format!(",{}", quoted(&format!("load_{name}"))));
    text.push('\n');
    for (row, record) in records.iter().enumerate() {
        write_row(&mut text, record, &loads).map_err(|error| {
            error.context(format!("history.csv, row {}, step \"{}\"", row + 1, record.name))
        })?;
    }
    Ok(text)
}

/// Text of the table of fretting loops: one row per increment.
///
/// # Errors
/// If a number is not finite (kind `Numerical`).
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

/// Appends the row of an entry: the cells of all columns, then the amplitudes of `loads`.
fn write_row(text: &mut String, record: &IncrementRecord, loads: &BTreeSet<&str>) -> Result<()> {
    let fixed = HISTORY_COLUMNS.iter().map(|&(name, cell)| (name, cell(record)));
    let amplitudes = loads.iter().map(|&name| (name, record.loads.get(name).map_or(Missing, |a| Number(*a))));
    for (i, (name, cell)) in fixed.chain(amplitudes).enumerate() {
        if i > 0 {
            text.push(',');
        }
        *text += &match cell {
            Text(text) => quoted(text),
            Number(value) if !value.is_finite() => {
                return Err(Error::numerical(format!("`{name}` is {value}, not a finite number")));
            }
            // This format gives the shortest text that reads back to the same bits.
            Number(value) => format!("{value:?}"),
            Count(count) => count.to_string(),
            Flag(flag) => flag.to_string(),
            Missing => String::new(),
        };
    }
    text.push('\n');
    Ok(())
}

/// Quotes a text for a CSV cell, if necessary (RFC 4180).
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

    /// Truth: names are quoted as in RFC 4180, and numbers read back to the same bits.
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
        let at =
            |name: &str| cells[HISTORY_COLUMNS.iter().position(|(column, _)| *column == name).unwrap() - 2];
        assert_eq!(at("seconds").parse::<f64>().unwrap(), 1e-7);
        assert!(
            ["operator_defect", "rolling_spin", "rolling_distance", "worn_volume_by_energy", "jump_solves"]
                .iter()
                .all(|name| at(name).is_empty())
        );
    }

    /// Truth (docs/results.md): values that only some entries have are in separate columns.
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
            let column = HISTORY_COLUMNS.iter().position(|(column, _)| *column == name).unwrap();
            assert_eq!(cells[column].parse::<f64>().unwrap(), value, "{name}");
        }
    }

    /// Truth (docs/results.md): each named load has a column, which is empty in entries without this load.
    #[test]
    fn loads_have_columns() {
        let loads = [("a, b".to_owned(), 0.5), ("bulk".to_owned(), -2.0)];
        let entries = [
            IncrementRecord { loads: loads.into(), ..Default::default() },
            IncrementRecord { loads: [("bulk".to_owned(), 3.0)].into(), ..Default::default() },
        ];
        let text = history_csv(&entries).unwrap();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].ends_with(",\"load_a, b\",load_bulk"), "{}", lines[0]);
        assert!(lines[1].ends_with(",0.5,-2.0") && lines[2].ends_with(",,3.0"), "{text}");
    }

    /// Truth: the error names the column of a number that is not finite.
    #[test]
    fn refuses_what_is_not_finite() {
        let record =
            IncrementRecord { name: "wear".into(), worn_volume: f64::INFINITY, ..Default::default() };
        let message = history_csv(&[record]).unwrap_err().to_string();
        assert!(message.contains("worn_volume") && message.contains("wear"), "{message}");
    }
}
