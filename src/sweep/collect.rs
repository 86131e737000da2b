//! Collects numbers from the results of a run by paths such as `fretting.worn_volume`.

use std::borrow::Cow;

use serde_json::Value;

use crate::evolution::records::{IncrementRecord, JumpRecord, Resultants, RollingRecord};
use crate::output::summary::Units;
use crate::scene::document::key_segments;

/// Path of a number in the entries of a step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CollectedQuantity {
    /// Path as written in the study file: step, then the fields of its entries.
    pub path: String,
    /// Name of the step.
    pub step: String,
    fields: Vec<String>,
}

impl CollectedQuantity {
    /// Parses a path.
    ///
    /// # Errors
    /// The message and help text, if the path does not lead to a number in the entries of a step.
    pub fn parse(path: &str) -> Result<Self, (String, String)> {
        let parts: Vec<String> = key_segments(path).map(Cow::into_owned).collect();
        let Some((step, fields)) = parts.split_first() else {
            return Err(("the path is empty".to_owned(), EXAMPLE.to_owned()));
        };
        // Names of loads depend on the scene, so that they are not checked here.
        if let [kind, _] = fields
            && kind == "loads"
        {
            return Ok(Self { path: path.to_owned(), step: step.clone(), fields: fields.to_vec() });
        }
        let template = template();
        let mut at = &template;
        for (i, field) in fields.iter().enumerate() {
            let Some(inner) = child(at, field) else {
                let place =
                    if i == 0 { "the entries of steps".to_owned() } else { format!("`{}`", fields[i - 1]) };
                return Err((
                    format!("`{field}` does not exist in {place}"),
                    format!("available: {}", names(at)),
                ));
            };
            at = inner;
        }
        match at {
            Value::Number(_) | Value::Bool(_) => {
                Ok(Self { path: path.to_owned(), step: step.clone(), fields: fields.to_vec() })
            }
            Value::Object(_) | Value::Array(_) => {
                Err((format!("`{path}` is not a number"), format!("append one of {}", names(at))))
            }
            _ => Err((format!("`{path}` is not a number"), EXAMPLE.to_owned())),
        }
    }

    /// Name of the load, if the quantity is the amplitude of a load.
    pub fn load(&self) -> Option<&str> {
        match &self.fields[..] {
            [kind, name] if kind == "loads" => Some(name),
            _ => None,
        }
    }

    /// The number in an entry, if it has one. Booleans are 0 or 1.
    pub fn value_in(&self, record: &IncrementRecord) -> Option<f64> {
        let entry = serde_json::to_value(record).ok()?;
        let found = self.fields.iter().try_fold(&entry, |at, field| child(at, field))?;
        found.as_f64().or(found.as_bool().map(|b| if b { 1.0 } else { 0.0 }))
    }

    /// The number in the last entry of the step.
    pub fn final_value(&self, records: &[IncrementRecord]) -> Option<f64> {
        self.value_in(records.iter().rev().find(|record| record.name == self.step)?)
    }

    /// Points `[abscissa, value]` of the entries of the step. In a fretting step the abscissa is the number of cycles.
    /// In other steps with wear jumps it is the sliding distance, and otherwise the number of the increment.
    ///
    /// With wear jumps, curves of cumulative quantities start from the last entry before the step, or from 0.
    pub fn curve(&self, records: &[IncrementRecord]) -> Vec<[f64; 2]> {
        let entries = || records.iter().filter(|record| record.name == self.step);
        let cycles = entries().any(|record| record.stroke_ends.is_some());
        let jumps = cycles || entries().any(|record| record.jump.is_some());
        let x = |record: &IncrementRecord| match (cycles, jumps) {
            (true, _) => record.cycles_done as f64,
            (false, true) => record.distance_slid,
            (false, false) => record.increment as f64,
        };
        let first = records.iter().position(|record| record.name == self.step).unwrap_or(0);
        let start = match records[..first].last() {
            Some(before) => self.value_in(before).map(|value| [x(before), value]),
            None => Some([0.0; 2]),
        };
        let adds_up = self.fields.first().is_some_and(|field| CUMULATIVE_FIELDS.contains(&field.as_str()));
        let start = start.filter(|_| jumps && adds_up);
        start
            .into_iter()
            .chain(entries().filter_map(|record| Some([x(record), self.value_in(record)?])))
            .collect()
    }

    /// Name with unit: "wear volume, mm^{3}".
    pub fn label(&self, units: &Units) -> String {
        let name = self.fields.iter().rev().find(|field| field.parse::<usize>().is_err());
        let unit = name.map(|name| units.of_key(name)).unwrap_or_default();
        let words = self.fields.join(" ").replace("worn", "wear").replace('_', " ");
        let comma = if unit.is_empty() { "" } else { ", " };
        format!("{words}{comma}{unit}")
    }
}

/// Fields that accumulate from the start of a run.
const CUMULATIVE_FIELDS: [&str; 8] = [
    "worn_volume",
    "worn_volume_by_body",
    "worn_volume_by_energy",
    "worn_volume_error",
    "max_wear_depth",
    "wear_depth_error",
    "dissipation",
    "distance_slid",
];

const EXAMPLE: &str =
    "give the name of a step and a number of its entries, as in \"fretting.worn_volume\" (docs/results.md)";

/// An entry with all optional fields.
fn template() -> Value {
    let mut record = IncrementRecord {
        stroke_ends: Some([Resultants::default(); 2]),
        rolling: Some(RollingRecord::default()),
        jump: Some(JumpRecord { critical_length: Some(0.0), ..JumpRecord::default() }),
        worn_volume_by_energy: Some(0.0),
        ..Default::default()
    };
    record.certificate.operator_defect = Some(0.0);
    serde_json::to_value(record).unwrap_or_default()
}

fn child<'a>(value: &'a Value, field: &str) -> Option<&'a Value> {
    match value {
        Value::Object(fields) => fields.get(field),
        Value::Array(items) => items.get(field.parse::<usize>().ok()?),
        _ => None,
    }
}

fn names(value: &Value) -> String {
    let names: Vec<String> = match value {
        Value::Object(fields) => fields.keys().map(|name| format!("`{name}`")).collect(),
        Value::Array(items) => (0..items.len()).map(|i| format!("`{i}`")).collect(),
        _ => vec!["nothing".to_owned()],
    };
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: a path gives its field of the last entry. With wear jumps, the curve of a cumulative quantity starts with the entry
    /// before the step.
    #[test]
    fn paths_lead_to_numbers() {
        let entry = |increment: usize, volume: f64| IncrementRecord {
            name: "rub".into(),
            increment,
            worn_volume: volume,
            tangential_force: [volume, -2.0],
            cycles_done: 10 * increment as u64,
            stroke_ends: Some([Resultants::default(); 2]),
            loads: [("bulk".to_owned(), 0.5 * volume)].into(),
            ..Default::default()
        };
        let records = [IncrementRecord::default(), entry(1, 3.0), entry(2, 4.0)];
        let quantity = |path| CollectedQuantity::parse(path).expect("a quantity");
        assert_eq!(quantity("rub.worn_volume").final_value(&records), Some(4.0));
        assert_eq!(quantity("rub.tangential_force.1").final_value(&records), Some(-2.0));
        assert_eq!(quantity("rub.worn_volume").curve(&records), [[0.0, 0.0], [10.0, 3.0], [20.0, 4.0]]);
        assert_eq!(quantity("rub.tangential_force.0").curve(&records), [[10.0, 3.0], [20.0, 4.0]]);
        assert_eq!(quantity("rub.loads.bulk").final_value(&records), Some(2.0));
        assert_eq!(quantity("rub.loads.other").final_value(&records), None);
        assert_eq!(quantity("rub.rolling.spin").final_value(&records), None);
        assert_eq!(quantity("rest.worn_volume").final_value(&records), None);
        assert_eq!(quantity("rub.worn_volume").label(&Units::default()), "wear volume, mm^{3}");
    }

    /// Truth: a path that is not a number of an entry is refused with the allowed names.
    #[test]
    fn other_paths_are_refused() {
        for (path, message, mend) in [
            ("rub.worn_volum", "`worn_volum` does not exist in the entries of steps", "`worn_volume`"),
            ("rub.tangential_force", "is not a number", "`0`, `1`"),
            ("rub.method", "is not a number", "fretting.worn_volume"),
            ("rub", "is not a number", "`normal_force`"),
            ("", "empty", "fretting.worn_volume"),
        ] {
            let (found, help) = CollectedQuantity::parse(path).expect_err("no number");
            assert!(found.contains(message) && help.contains(mend), "{path}: {found}: {help}");
        }
    }
}
