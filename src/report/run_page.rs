use std::collections::BTreeSet;

use serde_json::{Map, Value, json};

use crate::error::Result;
use crate::output::number_format::{five_digits, five_digits_of_small};
use crate::output::plot::axis::Scale;
use crate::output::plot::chart::{Chart, Series};
use crate::output::summary::Units;
use crate::report::body_surfaces::Bodies;
use crate::report::drawing;
use crate::report::frame_maps::Frames;
use crate::report::page::{EmbeddedImage, Page, Table};
use crate::report::result_directory::ResultDirectory;
use crate::report::value_text::{self, key_to_words, to_line, unit_of_key, units_of, with_unit};

/// Largest number of rows of a table. Longer tables show only their first and last rows.
const MAX_TABLE_ROWS: usize = 2000;

pub(super) fn render_run_page(source: &mut ResultDirectory) -> Result<String> {
    let (frames, bodies) = (Frames::read(source), Bodies::read(source));
    let missing = source.missing();
    if !missing.is_empty() {
        source.problems.push(format!("files that summary.json lists are missing: {}", missing.join(", ")));
    }
    let units = units_of(&source.summary);
    let mut page = Page::new(source);
    set_status(&mut page, &source.summary, source.files("frame_", ".vtu").is_empty());
    scene(&mut page, &source.summary["scene"], &units);
    results(&mut page, &source.summary, &units);
    plan(&mut page, &source.summary, &units);
    add_figures(&mut page, source);
    (page.has_maps, page.n_frames) = (!frames.list.is_empty(), frames.list.len());
    page.has_view = page.has_maps || !bodies.list.is_empty();
    page.problems.clone_from(&source.problems);
    page.render(&json!({
        "units": { "length": units.length, "force": units.force, "stress": unit_of_key(&units, "peak_pressure") },
        "entries": labels(&source.summary),
        "meshes": frames.meshes,
        "frames": frames.list,
        "surfaces": bodies.surfaces,
        "bodies": bodies.list,
        "rolling": records(&source.summary).map(|record| record["rolling"].is_object()).collect::<Vec<_>>(),
    }))
}

fn records(said: &Value) -> impl Iterator<Item = &Value> {
    said["steps"].as_array().into_iter().flatten()
}

fn labels(said: &Value) -> Vec<Value> {
    let label = |(i, record): (usize, &Value)| {
        let cycles = record["cycles_done"].as_u64().filter(|cycles| *cycles > 0);
        let cycles = cycles.map_or(String::new(), |cycles| format!(", {cycles} cycles"));
        let what = if record["jump"].is_object() { "jump" } else { "increment" };
        let name = record["name"].as_str().unwrap_or("");
        json!(format!("{}: {name}, {what} {}{cycles}", i + 1, record["increment"]))
    };
    records(said).enumerate().map(label).collect()
}

fn set_status(page: &mut Page, said: &Value, fieldless: bool) {
    let so_far = if said["steps"].as_array().is_some_and(|steps| !steps.is_empty()) {
        "The results so far are shown."
    } else {
        "Nothing was computed."
    };
    (page.severity, page.status) = match said["status"].as_str() {
        Some("converged") if page.is_uncertain() => {
            ("doubtful", "Converged, with warnings that results are uncertain".to_owned())
        }
        Some("converged") => ("good", "Converged".to_owned()),
        Some("not-converged") => ("bad", format!("NOT CONVERGED. {so_far}")),
        Some("failed") => ("bad", format!("FAILED. {so_far}")),
        Some("interrupted") => ("bad", format!("INTERRUPTED. {so_far}")),
        _ => ("bad", "OUTCOME UNKNOWN: summary.json cannot be read".to_owned()),
    };
    let reason = [&said["reason"], &said["error"]]
        .into_iter()
        .filter_map(Value::as_str)
        .collect::<Vec<_>>()
        .join(": ");
    page.reason = reason;
    if fieldless {
        page.facts.push([
            "fields".to_owned(),
            "there are no maps, because there are no field files (output.fields without \"vtu\", or no entry)".to_owned(),
        ]);
    }
    let seconds: f64 =
        said["timings"].as_object().into_iter().flatten().filter_map(|(_, s)| s.as_f64()).sum();
    let memory = said["peak_memory_bytes"].as_u64().unwrap_or(0);
    let entries = said["steps"].as_array().map_or(0, Vec::len);
    page.facts.push(["entries".to_owned(), entries.to_string()]);
    page.facts.push(["time of all stages".to_owned(), format!("{} s", five_digits(seconds))]);
    if memory > 0 {
        page.facts
            .push(["largest memory".to_owned(), format!("{:.0} MiB", memory as f64 / f64::from(1 << 20))]);
    }
    if let Some(sha) = said["scene_sha256"].as_str().filter(|sha| !sha.is_empty()) {
        page.facts.push(["scene, SHA-256".to_owned(), sha.to_owned()]);
    }
}

fn scene(page: &mut Page, scene: &Value, units: &Units) {
    let Some(tables) = scene.as_object() else {
        page.scene_missing = true;
        return;
    };
    // A frame on a meshed surface has no plan view.
    if scene["frame"]["kind"] != "mesh" {
        let drawing = drawing::top_view_svg(scene, units);
        page.drawing = Some(EmbeddedImage::of_svg("The contact frame from above, to scale", &drawing));
    }
    for (i, step) in scene["steps"].as_array().into_iter().flatten().enumerate() {
        let name = step["name"].as_str().map_or_else(|| format!("step {}", i + 1), str::to_owned);
        page.steps.push([name, value_text::describe_step(units, step)]);
    }
    let shown = tables.iter().filter(|(key, _)| !["title", "steps"].contains(&key.as_str()));
    page.scene = shown.map(|(key, value)| (key.clone(), value_text::rows(units, value))).collect();
}

/// Candidate columns: key and heading. A column is shown if some entry has a value other than zero.
const ENTRY_COLUMNS: [(&str, &str); 17] = [
    ("cycles_done", "cycles"),
    ("normal_force", "normal force"),
    ("approach", "approach"),
    ("shift", "shift x, y"),
    ("rotation", "rotation x, y"),
    ("twist", "twist"),
    ("tangential_force", "tangential force x, y"),
    ("moment", "moment x, y, n"),
    ("contact_area", "contact area"),
    ("stick_area", "stick area"),
    ("peak_pressure", "peak pressure"),
    ("max_wear_depth", "largest wear depth"),
    ("worn_volume", "wear volume"),
    ("dissipation", "dissipation"),
    ("iterations", "iterations"),
    ("operator_applications", "products"),
    ("seconds", "time"),
];

const REVERSAL_NOTE: &str = " Entries of cycles show motions, forces, areas and peaks at the + reversal point, and the mean approach of both reversal points.";

fn results(page: &mut Page, said: &Value, units: &Units) {
    let records = said["steps"].as_array().map_or(&[][..], Vec::as_slice);
    if records.is_empty() {
        return;
    }
    let last = |i: &usize| records.get(i + 1).is_none_or(|next| next["name"] != records[*i]["name"]);
    let ends: Vec<usize> = (0..records.len()).filter(last).collect();
    let has_cycles = records.iter().any(|record| record["stroke_ends"].is_array());
    let reversal = if has_cycles { REVERSAL_NOTE } else { "" };
    let mut note = format!("Forces act on body 1.{reversal}");
    page.key_table = Some(Table {
        title: "Results at the ends of the steps".to_owned(),
        note: note.clone(),
        ..entry_table(records, &ends, units)
    });
    let mut all: Vec<usize> = (0..records.len()).collect();
    if all.len() > MAX_TABLE_ROWS {
        all = (0..MAX_TABLE_ROWS / 2).chain(records.len() - MAX_TABLE_ROWS / 2..records.len()).collect();
        note +=
            &format!(" Of {} entries the first and last {} are shown.", records.len(), MAX_TABLE_ROWS / 2);
    }
    page.certificate = Some(certificate(records, &all));
    page.tables.push(Table { title: "All entries".to_owned(), note, ..entry_table(records, &all, units) });
    page.convergence = convergence(records);
    let peaks = list_table("Peaks in the bodies", &said["bodies"], &["body", "name", "increment"], units);
    page.tables.extend(peaks);
}

/// Record of the + reversal point if it has a value of `key`, otherwise `record` itself.
fn at_plus_reversal<'a>(record: &'a Value, key: &str) -> &'a Value {
    let plus = &record["stroke_ends"][0];
    if plus[key].is_null() { record } else { plus }
}

fn entry_table(records: &[Value], rows: &[usize], units: &Units) -> Table {
    let counts = |value: &Value| match value {
        Value::Array(items) => items.iter().any(|item| item.as_f64().is_some_and(|x| x != 0.0)),
        value => value.as_f64().is_some_and(|x| x != 0.0),
    };
    let columns: Vec<_> = ENTRY_COLUMNS
        .iter()
        .filter(|(key, _)| records.iter().any(|record| counts(&at_plus_reversal(record, key)[key])))
        .collect();
    let mut heads = vec![["entry".to_owned(), String::new()], ["step".to_owned(), String::new()]];
    heads.extend(columns.iter().map(|(key, head)| [(*head).to_owned(), unit_of_key(units, key)]));
    let loads: BTreeSet<&String> =
        records.iter().filter_map(|record| record["loads"].as_object()).flat_map(Map::keys).collect();
    heads.extend(loads.iter().map(|name| [format!("load {name}"), String::new()]));
    heads.push(["converged".to_owned(), String::new()]);
    let row = |&i: &usize| {
        let record = &records[i];
        let mut cells =
            vec![(i + 1).to_string(), format!("{}, {}", to_line(&record["name"]), record["increment"])];
        cells.extend(columns.iter().map(|(key, _)| format_quantity(key, at_plus_reversal(record, key))));
        cells.extend(loads.iter().map(|name| format_quantity(name, &record["loads"])));
        cells.push(if record["converged"] == false { "NO".to_owned() } else { "yes".to_owned() });
        cells
    };
    Table { heads, rows: rows.iter().map(row).collect(), ..Table::default() }
}

/// Quantities that may be below 1e-12 in scenes in metres. Their small values are no round-off and are shown.
const SMALL_QUANTITIES: [&str; 4] = ["worn_volume", "max_wear_depth", "contact_area", "stick_area"];

/// Formats the value at `key` of an entry with normal force F and contact area A. Tangential forces below 1e-7 F and
/// moments below 1e-7 F √A become 0.
pub(super) fn format_quantity(key: &str, record: &Value) -> String {
    let load = record["normal_force"].as_f64().unwrap_or(0.0);
    let least = match key {
        "tangential_force" => 1e-7 * load,
        "moment" => 1e-7 * load * record["contact_area"].as_f64().unwrap_or(0.0).sqrt(),
        _ => 0.0,
    };
    match &record[key] {
        Value::Array(items) => {
            let part = |x: f64| five_digits(if x.abs() < least { 0.0 } else { x });
            items.iter().filter_map(Value::as_f64).map(part).collect::<Vec<_>>().join(", ")
        }
        Value::Number(number) if number.is_u64() => number.to_string(),
        Value::Number(number) if SMALL_QUANTITIES.contains(&key) => {
            number.as_f64().map_or(String::new(), five_digits_of_small)
        }
        Value::Number(number) => number.as_f64().map_or(String::new(), five_digits),
        other => to_line(other),
    }
}

/// Columns of the table of certificates: key and heading.
const CERTIFICATE: [(&str, &str); 7] = [
    ("natural_residual", "natural residual"),
    ("min_gap", "smallest gap / approach"),
    ("max_cone_violation", "largest excess over the friction limit / peak"),
    ("normal_gap_energy", "pressure × gap / energy"),
    ("tangential_gap_energy", "slip rule / energy"),
    ("energy_balance", "energy balance"),
    ("operator_defect", "operator defect"),
];

fn certificate(records: &[Value], rows: &[usize]) -> Table {
    let heads = ["entry", "step"].into_iter().chain(CERTIFICATE.map(|(_, head)| head));
    let row = |&i: &usize| {
        let record = &records[i];
        let number = |(key, _): (&str, &str)| {
            record["certificate"][key].as_f64().map_or("–".to_owned(), |x| format!("{x:.1e}"))
        };
        let mut cells =
            vec![(i + 1).to_string(), format!("{}, {}", to_line(&record["name"]), record["increment"])];
        cells.extend(CERTIFICATE.map(number));
        cells
    };
    Table {
        title: "Certificate".to_owned(),
        note: "Checks of each state, recomputed from its tractions and independent of the solver. All are relative, and 0 is exact. The natural residual must be below solver.tolerance."
            .to_owned(),
        heads: heads.map(|head| [head.to_owned(), String::new()]).collect(),
        rows: rows.iter().map(row).collect(),
    }
}

fn convergence(records: &[Value]) -> Vec<EmbeddedImage> {
    let over = |key: &dyn Fn(&Value) -> Option<f64>| {
        let point = |(i, record): (usize, &Value)| key(record).map(|y| [(i + 1) as f64, y]);
        records.iter().enumerate().filter_map(point).collect::<Vec<_>>()
    };
    let chart = |title: &str, label: &str, scale: Scale, series: Vec<(&str, Vec<[f64; 2]>)>| {
        let series =
            series.into_iter().map(|(name, points)| Series { name: name.to_owned(), points }).collect();
        let labels = ["entry (increment or cycle jump)".to_owned(), label.to_owned()];
        let chart = Chart { title: title.to_owned(), labels, scales: [Scale::Whole, scale], series };
        EmbeddedImage::of_svg(title, &chart.svg())
    };
    let certificate = |key: &'static str| {
        move |record: &Value| record["certificate"][key].as_f64().map(f64::abs).filter(|x| *x > 0.0)
    };
    let count = |key: &'static str| move |record: &Value| record[key].as_f64();
    vec![
        chart(
            "Residuals of the certificate",
            "relative",
            Scale::Logarithmic,
            vec![
                ("natural residual", over(&certificate("natural_residual"))),
                ("pressure × gap", over(&certificate("normal_gap_energy"))),
                ("operator defect", over(&certificate("operator_defect"))),
            ],
        ),
        chart(
            "Work of the contact solver",
            "number per entry",
            Scale::Linear,
            vec![
                ("iterations", over(&count("iterations"))),
                ("products with the flexibility matrix", over(&count("operator_applications"))),
            ],
        ),
        chart("Time", "s per entry", Scale::Linear, vec![("time", over(&count("seconds")))]),
    ]
}

/// Table of a list of records; `None` without records. Columns: the keys `first`, then further keys in order of first use. Fields
/// of nested records have dotted keys.
pub(super) fn list_table(title: &str, list: &Value, first: &[&str], units: &Units) -> Option<Table> {
    let list: Vec<Vec<(String, &Value)>> =
        list.as_array()?.iter().map(|record| flatten_record("", record)).collect();
    let mut keys: Vec<&str> = first.to_vec();
    for (key, _) in list.iter().flatten() {
        if !keys.contains(&key.as_str()) {
            keys.push(key);
        }
    }
    let unit = |key: &str| {
        let mut last = key.rsplit('.').filter(|part| *part != "value");
        unit_of_key(units, last.next().unwrap_or(""))
    };
    let heads = keys.iter().map(|key| [key_to_words(key).replace('.', " "), unit(key)]).collect();
    let cell = |record: &Vec<(String, &Value)>, key: &str| {
        record.iter().find(|(name, _)| name == key).map_or("–".to_owned(), |(_, value)| to_line(value))
    };
    let rows: Vec<Vec<String>> =
        list.iter().map(|record| keys.iter().map(|key| cell(record, key)).collect()).collect();
    (!rows.is_empty()).then(|| Table { title: title.to_owned(), heads, rows, ..Table::default() })
}

fn flatten_record<'a>(path: &str, record: &'a Value) -> Vec<(String, &'a Value)> {
    let field = |(key, value): (&String, &'a Value)| {
        let key = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if value.is_object() { flatten_record(&key, value) } else { vec![(key, value)] }
    };
    record.as_object().into_iter().flatten().flat_map(field).collect()
}

fn plan(page: &mut Page, said: &Value, units: &Units) {
    let skipped = said["skipped"].as_array().into_iter().flatten();
    let rows: Vec<_> = skipped.map(|skip| vec![to_line(&skip["what"]), to_line(&skip["why"])]).collect();
    if !rows.is_empty() {
        let heads = ["what", "why"].map(|head| [head.to_owned(), String::new()]).to_vec();
        let note = "The results are the same if this work is done (solver.skip = false).".to_owned();
        page.plan.push(Table { title: "Omitted work".to_owned(), note, heads, rows });
    }
    let lists = [
        ("Condensation of finite elements", "/condensation", &["body", "method"][..]),
        ("Boundary elements", "/boundary_elements", &["body"]),
        ("Near fields", "/near_fields", &["body", "near_field"]),
        ("Half-spaces with a meshed surface", "/truncations", &["body"]),
        ("Estimated errors", "/accuracy/results", &["step", "name", "value", "estimate", "relative"]),
        ("Runs to reach the accuracy", "/accuracy/runs", &["cells", "increments", "jumps", "seconds"]),
    ];
    for (title, place, first) in lists {
        let list = said.pointer(place).unwrap_or(&Value::Null);
        page.plan.extend(list_table(title, list, first, units));
    }
    let stages = said["timings"].as_object().into_iter().flatten();
    let rows: Vec<Vec<String>> =
        stages.map(|(stage, s)| vec![stage.clone(), with_unit(units, "seconds", s)]).collect();
    if !rows.is_empty() {
        let heads = ["stage", "time"].map(|head| [head.to_owned(), String::new()]).to_vec();
        page.plan.push(Table { title: "Time by stage".to_owned(), heads, rows, ..Table::default() });
    }
}

/// Figure files and their titles, in the order of the page.
const FIGURE_TITLES: [(&str, &str); 7] = [
    ("pressure.svg", "Pressure after each step"),
    ("slip.svg", "Slip in the last entry of each step"),
    ("zones.svg", "Stick, slip and open cells"),
    ("wear.svg", "Wear depth of both bodies"),
    ("profiles.svg", "Profiles along e1 and e2"),
    ("loops.svg", "Fretting loops"),
    ("history.svg", "History of the run"),
];

/// Adds the SVG files of the directory to the page. Files that [`FIGURE_TITLES`] lists come first.
pub(super) fn add_figures(page: &mut Page, source: &mut ResultDirectory) {
    let mut files = source.files("", ".svg");
    let place = |file: &String| {
        FIGURE_TITLES.iter().position(|(name, _)| name == file).unwrap_or(FIGURE_TITLES.len())
    };
    files.sort_by_key(place);
    for file in files {
        let title =
            FIGURE_TITLES.iter().find(|(name, _)| *name == file).map_or(file.as_str(), |(_, title)| title);
        match source.text(&file) {
            Ok(svg) if svg.trim_end().ends_with("</svg>") => {
                page.plots.push(EmbeddedImage::of_svg(title, &svg))
            }
            Ok(_) => source.problems.push(format!("{file} is damaged and omitted: its end is missing")),
            Err(error) => source.problems.push(error.to_string()),
        }
    }
}
