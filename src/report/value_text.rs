//! Values of a scene or a summary in words, with their units.

use serde_json::Value;

use crate::output::number_format::five_digits;

/// Names of units, as a page shows them.
#[derive(Debug, Clone)]
pub(super) struct UnitNames {
    pub length: String,
    pub force: String,
    pub stress: String,
}

impl UnitNames {
    /// Of what a summary says; mm and N where it does not.
    pub(super) fn of(said: &Value) -> Self {
        let unit = |key: &str, usual: &str| said["units"][key].as_str().unwrap_or(usual).to_owned();
        let (length, force) = (unit("length", "mm"), unit("force", "N"));
        let stress = match (force.as_str(), length.as_str()) {
            ("N", "mm") => "MPa".to_owned(),
            ("N", "m") => "Pa".to_owned(),
            _ => format!("{force}/{length}²"),
        };
        Self { length, force, stress }
    }

    /// The unit of a key of a scene or a summary; empty for numbers, counts and words.
    pub(super) fn unit_of_key(&self, key: &str) -> String {
        let Self { length, force, stress } = self;
        match key {
            "position" | "centre" | "approach" | "distance" | "amplitude" | "amplitude2" | "half_width"
            | "center" | "radius" | "radii" | "semi_axes" | "offset" | "shift" | "max_wear_depth"
            | "wear_depth_error" | "thickness" | "bottom" | "distance_slid" | "truncated" | "vertices"
            | "spacing" | "bow" | "depth_error" => length.clone(),
            "normal_force" | "tangential_force" | "force_amplitude" => force.clone(),
            "von_mises" | "sigma_tangential" | "E" | "E1" | "E2" | "E3" | "G12" | "G13" | "G23" | "Xt"
            | "Xc" | "Yt" | "Yc" | "Zt" | "Zc" | "S12" | "S13" | "S23" | "yield" | "peak_pressure" => {
                stress.clone()
            }
            "moment" | "spin_moment" | "dissipation" => format!("{force} {length}"),
            "contact_area" | "stick_area" => format!("{length}²"),
            "worn_volume"
            | "worn_volume_by_body"
            | "worn_volume_by_energy"
            | "worn_volume_error"
            | "volume_error" => {
                format!("{length}³")
            }
            "i" | "i1" | "i2" | "i_L" | "i_T" | "i_N" => format!("{length}³/({force} {length})"),
            "k" => format!("{length}³/({force} {length})"),
            "tilt" | "azimuth" | "angle" | "rotation" | "twist" | "slope" | "direction" => "°".to_owned(),
            "seconds" => "s".to_owned(),
            _ => String::new(),
        }
    }
}

/// A number as it was written, where that is short, else with five digits.
pub(super) fn number(value: &serde_json::Number) -> String {
    let plain = value.to_string();
    match value.as_f64() {
        Some(x) if plain.len() > 9 && x.abs() < 1e-12 => format!("{x:.1e}"),
        Some(x) if plain.len() > 9 => five_digits(x),
        _ => plain,
    }
}

/// Any value on one line.
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

/// A key as words.
pub(super) fn key_to_words(key: &str) -> String {
    key.replace('_', " ")
}

/// `value` of a key, with its unit.
pub(super) fn with_unit(names: &UnitNames, key: &str, value: &Value) -> String {
    let text = to_line(value);
    let unit = names.unit_of_key(key);
    let counted = value.is_number()
        || value.as_array().is_some_and(|list| list.iter().any(|v| v.is_number() || v.is_array()));
    match (counted, unit.as_str()) {
        (false, _) | (_, "") => text,
        (_, "°") => format!("{text}°"),
        (_, unit) => format!("{text} {unit}"),
    }
}

/// What a step of a scene prescribes.
pub(super) fn describe_step(names: &UnitNames, step: &Value) -> String {
    let Some(fields) = step.as_object() else { return to_line(step) };
    let part = |(key, value): (&String, &Value)| match value {
        Value::Object(inner) => {
            let inner: Vec<String> = inner
                .iter()
                .map(|(key, value)| format!("{} {}", key_to_words(key), with_unit(names, key, value)))
                .collect();
            format!("{}: {}", key_to_words(key), inner.join(", "))
        }
        _ => format!("{} {}", key_to_words(key), with_unit(names, key, value)),
    };
    fields.iter().filter(|(key, _)| *key != "name").map(part).collect::<Vec<_>>().join("; ")
}

/// Rows (dotted key, value with unit) of a table of a scene.
pub(super) fn rows(names: &UnitNames, value: &Value) -> Vec<[String; 2]> {
    let mut rows = Vec::new();
    gather(names, "", value, &mut rows);
    rows
}

fn gather(names: &UnitNames, path: &str, value: &Value, rows: &mut Vec<[String; 2]>) {
    match value {
        Value::Object(fields) => {
            for (key, value) in fields {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                gather(names, &path, value, rows);
            }
        }
        _ => {
            let key = path.rsplit('.').next().unwrap_or("");
            rows.push([path.to_owned(), with_unit(names, key, value)]);
        }
    }
}
