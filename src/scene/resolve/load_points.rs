//! Load histories from CSV files: a row is a load point, reached from the one before.

use super::Resolver;
use crate::frame::height_file::cells;
use crate::history::step::{Normal, Spin, Tangential, Tilt};
use crate::scene::check::SIZES;
use crate::scene::keys::step::{Column, History};

/// Mistakes of one file that are listed; more are counted.
const LISTED: usize = 20;

/// Excluding columns: motion and load of one direction.
const EXCLUSIVE: [[&[Column]; 2]; 4] = [
    [&[Column::Approach], &[Column::NormalForce]],
    [&[Column::ShiftX, Column::ShiftY], &[Column::TangentialX, Column::TangentialY]],
    [&[Column::RotationX, Column::RotationY], &[Column::MomentX, Column::MomentY]],
    [&[Column::Twist], &[Column::SpinMoment]],
];

/// What a row prescribes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadPoint {
    /// Its line in the file, from 1.
    pub line: usize,
    pub normal: Option<Normal>,
    pub tangential: Option<Tangential>,
    pub tilt: Option<Tilt>,
    pub spin: Option<Spin>,
}

/// The load points of the history at `key`, or `None` with what is wrong reported.
pub(super) fn read(r: &mut Resolver, key: &str, history: &History) -> Option<Vec<LoadPoint>> {
    let path = r.file(&format!("{key}.file"), &history.file);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) => {
            let message = format!("the load history {} cannot be read: {error}", path.display());
            r.wrong(
                &format!("{key}.file"),
                message,
                "this file",
                "give a CSV file; its path is relative to the folder of the scene file",
            );
            return None;
        }
    };
    let text = text.trim_start_matches('\u{feff}');
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let mut lines: Vec<(usize, &str)> =
        lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#')).collect();
    let before = r.mistakes.len();
    let columns = match &history.columns {
        Some(columns) => {
            // A header that the scene's columns take the place of.
            let is_header = |line: &str| cells(line).iter().all(|cell| cell.parse::<f64>().is_err());
            if lines.first().is_some_and(|(_, line)| is_header(line)) {
                lines.remove(0);
            }
            columns.clone()
        }
        None => header(r, key, &history.file, &mut lines)?,
    };
    contradictions(r, key, &columns);
    if lines.is_empty() {
        let message = format!("{} has no load points", history.file);
        r.wrong(&format!("{key}.file"), message, "no rows", "add one row of numbers per load point");
    }
    let points = rows(r, key, &history.file, &columns, &lines);
    (r.mistakes.len() == before).then_some(points)
}

/// The columns that the first line names.
fn header(r: &mut Resolver, key: &str, file: &str, lines: &mut Vec<(usize, &str)>) -> Option<Vec<Column>> {
    let (line, names) = if lines.is_empty() {
        (1, Vec::new())
    } else {
        let (line, text) = lines.remove(0);
        (line, cells(text))
    };
    let before = r.mistakes.len();
    let mut columns = Vec::new();
    let mut wrong = Vec::new();
    for (index, name) in names.iter().enumerate() {
        match Column::named(name) {
            Some(column) => columns.push(column),
            None => wrong
                .push(format!("{file}, line {line}: column {} has the unknown name \"{name}\"", index + 1)),
        }
    }
    let mend = format!("name the columns in the first line or in `columns`: {}", Column::list());
    list(r, key, file, wrong, ["unknown column", &mend]);
    if names.is_empty() {
        let mend = format!("start the file with a line of column names: {}", Column::list());
        r.wrong(&format!("{key}.file"), format!("{file} is empty"), "no columns", mend);
    }
    (r.mistakes.len() == before).then_some(columns)
}

/// Columns that exclude or repeat each other, or say nothing.
fn contradictions(r: &mut Resolver, key: &str, columns: &[Column]) {
    let place = if r.document.get(&format!("{key}.columns")).is_some() { "columns" } else { "file" };
    let place = format!("{key}.{place}");
    let mut wrong = |message: String, label: &str, mend: &str| r.wrong(&place, message, label, mend);
    for (i, column) in columns.iter().enumerate() {
        let before = columns[..i].iter().filter(|known| *known == column).count();
        if *column != Column::Ignored && before == 1 {
            let message = format!("the column `{}` appears twice", column.name());
            wrong(message, "twice", "name each column once; \"-\" ignores a column");
        }
    }
    for [motion, load] in EXCLUSIVE {
        let there = |group: &[Column]| group.iter().find(|column| columns.contains(column)).copied();
        if let (Some(motion), Some(load)) = (there(motion), there(load)) {
            let message =
                format!("a load history prescribes `{}` or `{}`, not both", motion.name(), load.name());
            wrong(message, "both", "ignore one of them with \"-\" in `columns`");
        }
    }
    if columns.iter().all(|column| *column == Column::Ignored) {
        wrong(
            "all columns are ignored, so nothing is prescribed".to_owned(),
            "nothing prescribed",
            &Column::list(),
        );
    }
}

/// The numbers of all rows; what is none is reported by file, line and column.
fn rows(
    r: &mut Resolver,
    key: &str,
    file: &str,
    columns: &[Column],
    lines: &[(usize, &str)],
) -> Vec<LoadPoint> {
    let mut points = Vec::with_capacity(lines.len());
    let mut wrong = Vec::new();
    for (line, text) in lines {
        let cells = cells(text);
        if cells.len() != columns.len() {
            wrong.push(format!(
                "{file}, line {line}: {} values, but there are {} columns",
                cells.len(),
                columns.len()
            ));
            continue;
        }
        let mut values = [None; Column::COUNT];
        for (column, cell) in columns.iter().zip(cells).filter(|(column, _)| **column != Column::Ignored) {
            match cell.parse::<f64>() {
                Ok(value) if value == 0.0 || (SIZES[0]..=SIZES[1]).contains(&value.abs()) => {
                    values[*column as usize] = Some(value);
                }
                Ok(value) if value.is_finite() => wrong.push(format!(
                    "{file}, line {line}, column `{}`: {cell} is out of range; magnitudes must be 0 or lie between {:e} and {:e}",
                    column.name(),
                    SIZES[0],
                    SIZES[1]
                )),
                _ => {
                    let found = if cell.is_empty() { "nothing".to_owned() } else { format!("\"{cell}\"") };
                    wrong.push(format!(
                        "{file}, line {line}, column `{}`: expected a finite number, found {found}",
                        column.name()
                    ));
                }
            }
        }
        if let Some(force) = values[Column::NormalForce as usize].filter(|force| *force < 0.0) {
            wrong.push(format!(
                "{file}, line {line}, column `normal_force`: {force} is negative (tension); compression is positive, 0 or more"
            ));
        }
        points.push(point(*line, &values));
    }
    list(r, key, file, wrong, ["this file", "give each column a number in every row"]);
    points
}

/// Reports the first of the mistakes of one kind, and how many more there are.
fn list(r: &mut Resolver, key: &str, file: &str, wrong: Vec<String>, [label, mend]: [&str; 2]) {
    let count = wrong.len();
    for message in wrong.into_iter().take(LISTED) {
        r.wrong(&format!("{key}.file"), message, label, mend);
    }
    if count > LISTED {
        let message = format!("{file}: {} more errors of this kind", count - LISTED);
        r.wrong(&format!("{key}.file"), message, "this file", "fix the errors above first");
    }
}

/// The load point of a row; of a pair x, y what is not given is 0.
fn point(line: usize, values: &[Option<f64>; Column::COUNT]) -> LoadPoint {
    let one = |column: Column| values[column as usize];
    let pair = |x: Column, y: Column| {
        let given = [one(x), one(y)];
        given.iter().any(Option::is_some).then(|| given.map(|value| value.unwrap_or(0.0)))
    };
    let degrees = |angles: [f64; 2]| angles.map(f64::to_radians);
    LoadPoint {
        line,
        normal: one(Column::Approach).map(Normal::Approach).or(one(Column::NormalForce).map(Normal::Force)),
        tangential: pair(Column::ShiftX, Column::ShiftY).map(Tangential::Shift).or(pair(
            Column::TangentialX,
            Column::TangentialY,
        )
        .map(Tangential::Force)),
        tilt: pair(Column::RotationX, Column::RotationY)
            .map(|angles| Tilt::Rotation(degrees(angles)))
            .or(pair(Column::MomentX, Column::MomentY).map(Tilt::Moment)),
        spin: one(Column::Twist)
            .map(|angle| Spin::Twist(angle.to_radians()))
            .or(one(Column::SpinMoment).map(Spin::Moment)),
    }
}
