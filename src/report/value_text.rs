//! Values of a scene or a summary as text with units.

use serde_json::Value;

use crate::output::number_format::five_digits;
use crate::output::summary::Units;

/// Units of a summary; mm and N are the defaults.
pub(super) fn units_of(said: &Value) -> Units {
    let unit = |key: &str, usual: &str| said["units"][key].as_str().unwrap_or(usual).to_owned();
    Units { length: unit("length", "mm"), force: unit("force", "N") }
}

/// Unit of a key as shown on a page; empty for counts and words.
pub(super) fn unit_of_key(units: &Units, key: &str) -> String {
    units.of_key(key).replace("degrees", "°").replace("^{2}", "²").replace("^{3}", "³")
}

/// Text of a number. A number with up to 9 characters is unchanged. Longer numbers get five digits, or two digits if
/// their magnitude is below 1e-12.
pub(super) fn number(value: &serde_json::Number) -> String {
    let plain = value.to_string();
    match value.as_f64() {
        Some(x) if plain.len() > 9 && x.abs() < 1e-12 => format!("{x:.1e}"),
        Some(x) if plain.len() > 9 => five_digits(x),
        _ => plain,
    }
}

pub(super) fn to_line(value: &Value) -> String {
    match value {
        Value::Null => "–".to_owned(),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Number(n) => number(n),
        Value::String(text) => text.clone(),
        Value::Array(items) if items.iter().all(|item| !item.is_object() && !item.is_array()) => {
            items.iter().map(to_line).collect::<Vec<_>>().join(", ")
        }
        Value::Array(items) => {
            const SHOWN: usize = 6;
            let mut parts: Vec<String> =
                items.iter().take(SHOWN).map(|item| format!("[{}]", to_line(item))).collect();
            if items.len() > SHOWN {
                parts.push(format!("… {} in all", items.len()));
            }
            parts.join(" ")
        }
        Value::Object(fields) => {
            let part = |(key, value): (&String, &Value)| format!("{} {}", key_to_words(key), to_line(value));
            fields.iter().map(part).collect::<Vec<_>>().join("; ")
        }
    }
}

pub(super) fn key_to_words(key: &str) -> String {
    key.replace('_', " ")
}

pub(super) fn with_unit(units: &Units, key: &str, value: &Value) -> String {
    let text = to_line(value);
    let unit = unit_of_key(units, key);
    let counted = value.is_number()
        || value.as_array().is_some_and(|list| list.iter().any(|v| v.is_number() || v.is_array()));
    match (counted, unit.as_str()) {
        (false, _) | (_, "") => text,
        (_, "°") => format!("{text}°"),
        (_, unit) => format!("{text} {unit}"),
    }
}

pub(super) fn describe_step(units: &Units, step: &Value) -> String {
    let Some(fields) = step.as_object() else { return to_line(step) };
    let part = |(key, value): (&String, &Value)| match value {
        Value::Object(inner) => {
            let inner: Vec<String> = inner
                .iter()
                .map(|(key, value)| format!("{} {}", key_to_words(key), with_unit(units, key, value)))
                .collect();
            format!("{}: {}", key_to_words(key), inner.join(", "))
        }
        _ => format!("{} {}", key_to_words(key), with_unit(units, key, value)),
    };
    fields.iter().filter(|(key, _)| *key != "name").map(part).collect::<Vec<_>>().join("; ")
}

/// Rows (dotted key, value with unit) of a table of the scene.
pub(super) fn rows(units: &Units, value: &Value) -> Vec<[String; 2]> {
    let mut rows = Vec::new();
    gather(units, "", value, &mut rows);
    rows
}

fn gather(units: &Units, path: &str, value: &Value, rows: &mut Vec<[String; 2]>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                gather(units, &path, value, rows);
            }
        }
        _ => {
            let key = path.rsplit('.').next().unwrap_or("");
            rows.push([path.to_owned(), with_unit(units, key, value)]);
        }
    }
}
