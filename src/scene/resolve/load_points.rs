//! Reads load histories from CSV files. Each row is a load point. The loads change linearly from one load point to the
//! next.

use super::resolver::Resolver;
use crate::csv::{Separators, data_lines, split_fields};
use crate::evolution::step::{Normal, Spin, Tangential, Tilt};
use crate::scene::schema_check::MAGNITUDE_RANGE;
use crate::scene::spec::step::{LoadColumn, LoadHistory};
use crate::scene::suggest::closest;

/// Maximum number of errors of one kind that are reported one by one. Further errors are only counted.
const MAX_LISTED_ERRORS: usize = 20;

const EXCLUSIVE_COLUMNS: [[&[LoadColumn]; 2]; 4] = [
    [&[LoadColumn::Approach], &[LoadColumn::NormalForce]],
    [&[LoadColumn::ShiftX, LoadColumn::ShiftY], &[LoadColumn::TangentialX, LoadColumn::TangentialY]],
    [&[LoadColumn::RotationX, LoadColumn::RotationY], &[LoadColumn::MomentX, LoadColumn::MomentY]],
    [&[LoadColumn::Twist], &[LoadColumn::SpinMoment]],
];

/// Quantity in a column: a control, or the amplitude of a load of the bodies.
#[derive(Debug, Clone, PartialEq)]
enum Column {
    Control(LoadColumn),
    Load(String),
}

impl Column {
    const IGNORED: Self = Self::Control(LoadColumn::Ignored);

    fn name(&self) -> &str {
        match self {
            Self::Control(control) => control.name(),
            Self::Load(name) => name,
        }
    }

    /// Finds the column `name`. `loads` contains the names of the loads of the bodies. If `loads` is `None` (invalid
    /// bodies), any other name counts as a load.
    fn find(name: &str, loads: Option<&[String]>) -> Option<Self> {
        let is_load = || loads.is_none_or(|loads| loads.iter().any(|load| load == name));
        let control = LoadColumn::from_name(name).map(Self::Control);
        control.or_else(|| is_load().then(|| Self::Load(name.to_owned())))
    }

    fn allowed_names(loads: Option<&[String]>) -> String {
        let controls: Vec<&str> = LoadColumn::names().collect();
        let loads = loads.filter(|loads| !loads.is_empty());
        let loads =
            loads.map_or_else(String::new, |loads| format!("; loads of the bodies: {}", loads.join(", ")));
        format!("{}{loads}; \"-\" ignores a column", controls.join(", "))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct LoadPoint {
    pub line: usize,
    /// Amplitudes of loads of the bodies.
    pub loads: Vec<(String, f64)>,
    pub normal: Option<Normal>,
    pub tangential: Option<Tangential>,
    pub tilt: Option<Tilt>,
    pub spin: Option<Spin>,
}

/// Reads the load points of a history from its file. `loads` contains the names of the loads of the bodies; `None` if
/// the bodies are invalid.
pub(super) fn read(
    r: &mut Resolver,
    key: &str,
    history: &LoadHistory,
    loads: Option<&[String]>,
) -> Option<Vec<LoadPoint>> {
    let path = r.file(&format!("{key}.file"), &history.file);
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(error) => {
            let message = format!("the load history {} cannot be read: {error}", path.display());
            return r.refuse(
                &format!("{key}.file"),
                message,
                "this file",
                "give a CSV file; its path is relative to the folder of the scene file",
            );
        }
    };
    let mut lines: Vec<(usize, &str)> = data_lines(&text).collect();
    let before = r.diagnostics.len();
    let mut separators = Separators::default();
    let columns = match &history.columns {
        Some(columns) => {
            let is_header = |line: &str| split_fields(line).iter().all(|cell| cell.parse::<f64>().is_err());
            if let Some((_, line)) = lines.first().copied().filter(|(_, line)| is_header(line)) {
                lines.remove(0);
                // Column titles may contain commas and blanks. The header therefore determines the separator only if it
                // has semicolons and no commas.
                if line.contains(';') && !line.contains(',') {
                    let _ = separators.check(line);
                }
            }
            given_columns(r, key, columns, loads)?
        }
        None => {
            if let Some((_, line)) = lines.first() {
                // `header` reports unknown column names, so an error of the separators is not reported in addition.
                let _ = separators.check(line);
            }
            header(r, key, &history.file, &mut lines, loads)?
        }
    };
    check_columns(r, key, &columns, loads);
    if lines.is_empty() {
        let message = format!("{} has no load points", history.file);
        r.report(&format!("{key}.file"), message, "no rows", "add one row of numbers per load point");
    }
    let points = rows(r, key, &history.file, &columns, &lines, separators);
    (r.diagnostics.len() == before).then_some(points)
}

/// Columns named by the key `columns`. Unknown names are reported.
fn given_columns(
    r: &mut Resolver,
    key: &str,
    names: &[String],
    loads: Option<&[String]>,
) -> Option<Vec<Column>> {
    let columns: Vec<Option<Column>> = names.iter().map(|name| Column::find(name, loads)).collect();
    for (i, name) in names.iter().enumerate().filter(|(i, _)| columns[*i].is_none()) {
        let mut known: Vec<&str> = LoadColumn::names().collect();
        known.extend(loads.unwrap_or_default().iter().map(String::as_str));
        let meant =
            closest(name, &known).map_or_else(String::new, |word| format!("did you mean \"{word}\"? "));
        r.report(
            &format!("{key}.columns.{i}"),
            format!("a load history has no column \"{name}\""),
            "unknown",
            format!("{meant}allowed are {}", Column::allowed_names(loads)),
        );
    }
    columns.into_iter().collect()
}

fn header(
    r: &mut Resolver,
    key: &str,
    file: &str,
    lines: &mut Vec<(usize, &str)>,
    loads: Option<&[String]>,
) -> Option<Vec<Column>> {
    let (line, names) = if lines.is_empty() {
        (1, Vec::new())
    } else {
        let (line, text) = lines.remove(0);
        (line, split_fields(text))
    };
    let before = r.diagnostics.len();
    let mut columns = Vec::new();
    let mut wrong = Vec::new();
    for (index, name) in names.iter().enumerate() {
        match Column::find(name, loads) {
            Some(column) => columns.push(column),
            None => wrong
                .push(format!("{file}, line {line}: column {} has the unknown name \"{name}\"", index + 1)),
        }
    }
    let mend =
        format!("name the columns in the first line or in `columns`: {}", Column::allowed_names(loads));
    report_lines(r, key, file, wrong, ["unknown column", &mend]);
    if names.is_empty() {
        let mend = format!("start the file with a line of column names: {}", Column::allowed_names(loads));
        r.report(&format!("{key}.file"), format!("{file} is empty"), "no columns", mend);
    }
    (r.diagnostics.len() == before).then_some(columns)
}

fn check_columns(r: &mut Resolver, key: &str, columns: &[Column], loads: Option<&[String]>) {
    let place = if r.document.get(&format!("{key}.columns")).is_some() { "columns" } else { "file" };
    let place = format!("{key}.{place}");
    let mut wrong = |message: String, label: &str, mend: &str| r.report(&place, message, label, mend);
    for (i, column) in columns.iter().enumerate() {
        let before = columns[..i].iter().filter(|known| *known == column).count();
        if *column != Column::IGNORED && before == 1 {
            let message = format!("the column `{}` appears twice", column.name());
            wrong(message, "twice", "name each column once; \"-\" ignores a column");
        }
    }
    let ambiguous = |column: &&Column| {
        matches!(column, Column::Control(_))
            && loads.unwrap_or_default().iter().any(|load| load == column.name())
    };
    for column in columns.iter().filter(ambiguous) {
        let message = format!("the column `{}` is also the name of a load", column.name());
        wrong(message, "ambiguous", "give the load another name");
    }
    for [motion, load] in EXCLUSIVE_COLUMNS {
        let there = |group: &[LoadColumn]| {
            group.iter().find(|control| columns.contains(&Column::Control(**control))).copied()
        };
        if let (Some(motion), Some(load)) = (there(motion), there(load)) {
            let message =
                format!("a load history prescribes `{}` or `{}`, not both", motion.name(), load.name());
            wrong(message, "both", "ignore one of them with \"-\" in `columns`");
        }
    }
    if columns.iter().all(|column| *column == Column::IGNORED) {
        wrong(
            "all columns are ignored, so nothing is prescribed".to_owned(),
            "nothing prescribed",
            &Column::allowed_names(loads),
        );
    }
}

fn rows(
    r: &mut Resolver,
    key: &str,
    file: &str,
    columns: &[Column],
    lines: &[(usize, &str)],
    mut separators: Separators,
) -> Vec<LoadPoint> {
    let mut points = Vec::with_capacity(lines.len());
    let mut wrong = Vec::new();
    for (line, text) in lines {
        if let Err(problem) = separators.check(text) {
            wrong.push(format!("{file}, line {line}: the row {problem}; put texts in quotes"));
            continue;
        }
        let cells = split_fields(text);
        if cells.len() != columns.len() {
            let comma = if cells.len() > columns.len() && text.contains(',') {
                " (a comma separates values; decimal commas are not read)"
            } else {
                ""
            };
            wrong.push(format!(
                "{file}, line {line}: {} values, but there are {} columns{comma}",
                cells.len(),
                columns.len()
            ));
            continue;
        }
        let mut values = [None; LoadColumn::COUNT];
        let mut loads = Vec::new();
        for (column, cell) in columns.iter().zip(cells).filter(|(column, _)| **column != Column::IGNORED) {
            match (number(cell), column) {
                (Ok(value), Column::Control(control)) => values[*control as usize] = Some(value),
                (Ok(value), Column::Load(name)) => loads.push((name.clone(), value)),
                (Err(problem), _) => {
                    wrong.push(format!("{file}, line {line}, column `{}`: {problem}", column.name()));
                }
            }
        }
        if let Some(force) = values[LoadColumn::NormalForce as usize].filter(|force| *force < 0.0) {
            wrong.push(format!(
                "{file}, line {line}, column `normal_force`: {force} is negative (tension); compression is positive, 0 or more"
            ));
        }
        points.push(LoadPoint { loads, ..point(*line, &values) });
    }
    report_lines(
        r,
        key,
        file,
        wrong,
        ["this file", "correct this line; each column needs a number in every row"],
    );
    points
}

/// The number in a cell. The error is the reason why the cell is invalid.
fn number(cell: &str) -> Result<f64, String> {
    match cell.parse::<f64>() {
        Ok(value) if value == 0.0 || (MAGNITUDE_RANGE[0]..=MAGNITUDE_RANGE[1]).contains(&value.abs()) => {
            Ok(value)
        }
        Ok(value) if value.is_finite() => Err(format!(
            "{cell} is out of range; magnitudes must be 0 or lie between {:e} and {:e}",
            MAGNITUDE_RANGE[0], MAGNITUDE_RANGE[1]
        )),
        _ if cell.is_empty() => Err("expected a finite number, found nothing".to_owned()),
        _ => Err(format!("expected a finite number, found \"{cell}\"")),
    }
}

fn report_lines(r: &mut Resolver, key: &str, file: &str, wrong: Vec<String>, [label, mend]: [&str; 2]) {
    let count = wrong.len();
    for message in wrong.into_iter().take(MAX_LISTED_ERRORS) {
        r.report(&format!("{key}.file"), message, label, mend);
    }
    if count > MAX_LISTED_ERRORS {
        let message = format!("{file}: {} more errors of this kind", count - MAX_LISTED_ERRORS);
        r.report(&format!("{key}.file"), message, "this file", "fix the errors above first");
    }
}

/// Load point of the row at `line`. In a pair (x, y), a missing value is 0.
fn point(line: usize, values: &[Option<f64>; LoadColumn::COUNT]) -> LoadPoint {
    let one = |column: LoadColumn| values[column as usize];
    let pair = |x: LoadColumn, y: LoadColumn| {
        let given = [one(x), one(y)];
        given.iter().any(Option::is_some).then(|| given.map(|value| value.unwrap_or(0.0)))
    };
    let degrees = |angles: [f64; 2]| angles.map(f64::to_radians);
    LoadPoint {
        line,
        loads: Vec::new(),
        normal: one(LoadColumn::Approach)
            .map(Normal::Approach)
            .or(one(LoadColumn::NormalForce).map(Normal::Force)),
        tangential: pair(LoadColumn::ShiftX, LoadColumn::ShiftY).map(Tangential::Shift).or(pair(
            LoadColumn::TangentialX,
            LoadColumn::TangentialY,
        )
        .map(Tangential::Force)),
        tilt: pair(LoadColumn::RotationX, LoadColumn::RotationY)
            .map(|angles| Tilt::Rotation(degrees(angles)))
            .or(pair(LoadColumn::MomentX, LoadColumn::MomentY).map(Tilt::Moment)),
        spin: one(LoadColumn::Twist)
            .map(|angle| Spin::Twist(angle.to_radians()))
            .or(one(LoadColumn::SpinMoment).map(Spin::Moment)),
    }
}
