use serde_json::{Value, json};

use crate::error::Result;
use crate::output::number_format::{five_digits, five_digits_of_group};
use crate::output::summary::Units;
use crate::report::page::{Page, Table};
use crate::report::result_directory::{ResultDirectory, ResultKind};
use crate::report::run_page::{add_figures, format_quantity};
use crate::report::value_text::{key_to_words, to_line, unit_of_key, units_of};

/// Renders the page of a comparison or a parameter study.
pub(super) fn overview(source: &mut ResultDirectory) -> Result<String> {
    let units = units_of(&source.summary);
    let mut page = Page::new(source);
    let said = source.summary.clone();
    let (list, word) = match source.kind {
        ResultKind::Study => (&said["runs"], "runs"),
        _ => (&said["variants"], "variants"),
    };
    let members = list.as_array().map_or(&[][..], Vec::as_slice);
    set_status(&mut page, members, word, said.is_null());
    match source.kind {
        ResultKind::Study => study(&mut page, &said, members, &units),
        _ => comparison(&mut page, members, &units),
    }
    folders(&mut page, source, members);
    add_figures(&mut page, source);
    page.problems.clone_from(&source.problems);
    page.render(&json!({ "frames": [], "bodies": [] }))
}

fn set_status(page: &mut Page, members: &[Value], word: &str, damaged: bool) {
    let good = members.iter().filter(|member| member["status"] == "converged").count();
    (page.severity, page.status) = match members.len() {
        _ if damaged => ("bad", "OUTCOME UNKNOWN: the file of the results cannot be read".to_owned()),
        n if n == good && n > 0 && page.is_uncertain() => {
            ("doubtful", format!("All {n} {word} converged, with warnings that results are uncertain"))
        }
        n if n == good && n > 0 => ("good", format!("All {n} {word} converged")),
        n => ("bad", format!("{} OF {n} {word} DID NOT CONVERGE OR WERE NOT COMPUTED", n - good)),
    };
}

/// Compared quantities: key and column heading.
const COMPARED: [(&str, &str); 7] = [
    ("normal_force", "normal force"),
    ("tangential_force", "tangential force x, y"),
    ("contact_area", "contact area"),
    ("stick_area", "stick area"),
    ("peak_pressure", "peak pressure"),
    ("worn_volume", "wear volume"),
    ("natural_residual", "natural residual"),
];

fn comparison(page: &mut Page, variants: &[Value], units: &Units) {
    let heads = |first: &str| {
        let mut heads = vec![[first.to_owned(), String::new()], ["step".to_owned(), String::new()]];
        heads.extend(COMPARED.iter().map(|(key, head)| [(*head).to_owned(), unit_of_key(units, key)]));
        heads
    };
    let mut rows = Vec::new();
    let mut steps: Vec<&Value> = Vec::new();
    for step in variants.iter().flat_map(|variant| variant["steps"].as_array().into_iter().flatten()) {
        if !steps.contains(&&step["name"]) {
            steps.push(&step["name"]);
        }
    }
    for name in steps {
        for variant in variants {
            let found = variant["steps"].as_array().into_iter().flatten().find(|step| step["name"] == *name);
            let Some(step) = found else { continue };
            let mut row = vec![to_line(&variant["name"]), to_line(name)];
            row.extend(COMPARED.iter().map(|(key, _)| value_with_difference(step, key)));
            rows.push(row);
        }
    }
    page.key_table = Some(Table {
        title: "Results at the ends of the steps".to_owned(),
        note: "In parentheses: difference from the first computed variant.".to_owned(),
        heads: heads("variant"),
        rows,
    });
    let columns = ["variant", "status", "reason", "time", "largest memory"];
    let row = |variant: &Value| {
        let memory = variant["peak_memory_bytes"].as_f64().filter(|bytes| *bytes > 0.0);
        vec![
            to_line(&variant["name"]),
            variant["status"].as_str().unwrap_or("not computed").to_owned(),
            to_line(&variant["reason"]),
            variant["seconds"].as_f64().map_or("–".to_owned(), |s| format!("{} s", five_digits(s))),
            memory.map_or("–".to_owned(), |bytes| format!("{:.0} MiB", bytes / f64::from(1 << 20))),
        ]
    };
    page.tables.push(Table {
        title: "Variants".to_owned(),
        note: "FE finite elements, BE boundary elements, HS half-space, THS half-space with a meshed surface; body 1 first.".to_owned(),
        heads: columns.map(|head| [head.to_owned(), String::new()]).to_vec(),
        rows: variants.iter().map(row).collect(),
    });
}

/// Formats a quantity, with its difference from the reference variant in percent.
fn value_with_difference(step: &Value, key: &str) -> String {
    let value = match step[key].as_f64() {
        Some(residual) if key == "natural_residual" => format!("{residual:.1e}"),
        _ => format_quantity(key, step),
    };
    match step["difference"][key].as_f64() {
        Some(percent) if key == "tangential_force" => format!("{value} ({percent:.1} %)"),
        Some(percent) => format!("{value} ({percent:+.1} %)"),
        None => value,
    }
}

fn study(page: &mut Page, said: &Value, runs: &[Value], units: &Units) {
    let texts = |list: &Value| -> Vec<String> {
        list.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect()
    };
    let axes = said["axes"].as_array().map_or(&[][..], Vec::as_slice);
    let keys: Vec<String> = axes.iter().flat_map(|axis| texts(&axis["keys"])).collect();
    let collected = texts(&said["collect"]);
    let last = |path: &str| path.rsplit('.').next().unwrap_or("").to_owned();
    let mut heads: Vec<[String; 2]> =
        keys.iter().map(|key| [key.clone(), unit_of_key(units, &last(key))]).collect();
    heads.extend(["status", "largest residual"].map(|head| [head.to_owned(), String::new()]));
    heads.extend(collected.iter().map(|path| [key_to_words(path), unit_of_key(units, &last(path))]));
    heads.push(["reason".to_owned(), String::new()]);
    let largest = |path: &str| {
        let values = runs.iter().filter_map(|run| run["results"][path].as_f64());
        values.fold(0.0, |largest: f64, x| largest.max(x.abs()))
    };
    let row = |run: &Value| {
        let mut row: Vec<String> = keys.iter().map(|key| to_line(&run["values"][key])).collect();
        row.push(run["status"].as_str().unwrap_or("not run").to_owned());
        row.push(run["natural_residual"].as_f64().map_or("–".to_owned(), |x| format!("{x:.1e}")));
        row.extend(collected.iter().map(|path| {
            let number = |x| five_digits_of_group(x, largest(path));
            run["results"][path].as_f64().map_or("–".to_owned(), number)
        }));
        row.push(to_line(&run["reason"]));
        row
    };
    page.key_table = Some(Table {
        title: "Runs".to_owned(),
        note: "Varied values of the scene, and collected results.".to_owned(),
        heads,
        rows: runs.iter().map(row).collect(),
    });
}

fn folders(page: &mut Page, source: &ResultDirectory, members: &[Value]) {
    for member in members {
        let Some(folder) = member["folder"].as_str().filter(|folder| source.has(folder)) else { continue };
        let name = member["name"].as_str().unwrap_or(folder);
        page.folders.push([name.to_owned(), folder.to_owned()]);
    }
}
