//! Provenance of a result (program, scene, files), and the differences between two provenances.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Scene keys that may differ when a run resumes. They may change the number of entries, but not the values in the
/// entries.
const KEYS_FREE_TO_DIFFER: [&str; 4] = ["title", "output.checkpoint", "frame.grow", "compare"];

/// Scene key that must not differ when a run resumes, because it affects the condensation of bodies. The option
/// --max-memory takes precedence over this key, and may differ.
const MEMORY_LIMIT_KEY: &str = "solver.memory_limit";

const MAX_LISTED_DIFFERENCES: usize = 20;

/// File named by a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct NamedFile {
    /// Key of the scene that names the file.
    pub key: String,
    /// SHA-256 of its content, hexadecimal.
    pub sha256: String,
}

/// Input of a run: program version, scene and files.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Scene, including the overrides of --set.
    pub scene: Value,
    /// Files that the scene names.
    pub files: Vec<NamedFile>,
}

impl Provenance {
    /// Creates the provenance of a run of this program version.
    pub fn new(scene: Value, files: Vec<NamedFile>) -> Self {
        Self { version: env!("CARGO_PKG_VERSION").to_owned(), scene, files }
    }

    /// Differences from the provenance `now`, one line each, for example `gap.radius: 50 then, 25 now`. The run can
    /// resume if there are no differences.
    pub fn differences(&self, now: &Self) -> Vec<String> {
        let mut found = Vec::new();
        if self.version != now.version {
            found.push(format!("orthowear {} then, {} now", self.version, now.version));
        }
        compare("", Some(&self.scene), Some(&now.scene), &mut found);
        for file in &self.files {
            let other = now.files.iter().find(|other| other.key == file.key);
            if other.is_some_and(|other| other.sha256 != file.sha256) {
                found.push(format!("{}: the content of the file has changed", file.key));
            }
        }
        if found.len() > MAX_LISTED_DIFFERENCES {
            let more = found.len() - MAX_LISTED_DIFFERENCES;
            found.truncate(MAX_LISTED_DIFFERENCES);
            found.push(format!("and {more} more"));
        }
        found
    }
}

fn compare(key: &str, then: Option<&Value>, now: Option<&Value>, found: &mut Vec<String>) {
    if KEYS_FREE_TO_DIFFER.contains(&key) || then == now {
        return;
    }
    match (then, now) {
        (Some(Value::Object(a)), Some(Value::Object(b))) => {
            for name in a.keys().chain(b.keys().filter(|name| !a.contains_key(*name))) {
                compare(&join(key, name), a.get(name), b.get(name), found);
            }
        }
        // A missing section stands for default values, so its keys are compared one by one.
        (Some(Value::Object(a)), None) if !key.is_empty() => {
            a.iter().for_each(|(name, value)| compare(&join(key, name), Some(value), None, found));
        }
        (None, Some(Value::Object(b))) if !key.is_empty() => {
            b.iter().for_each(|(name, value)| compare(&join(key, name), None, Some(value), found));
        }
        (Some(Value::Array(a)), Some(Value::Array(b))) if of_tables(a) || of_tables(b) => {
            for i in 0..a.len().max(b.len()) {
                compare(&element(key, i, a.get(i).or(b.get(i))), a.get(i), b.get(i), found);
            }
        }
        _ => {
            let mend = if key == MEMORY_LIMIT_KEY {
                " (keep the old value: --max-memory may differ, and overrides it)"
            } else {
                ""
            };
            found.push(format!("{key}: {} then, {} now{mend}", shown(then), shown(now)));
        }
    }
}

fn of_tables(items: &[Value]) -> bool {
    items.iter().any(Value::is_object)
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") }
}

/// Key of an element of a list of tables: its name, or its index from 0.
fn element(key: &str, index: usize, table: Option<&Value>) -> String {
    let name = table.and_then(|table| table["name"].as_str());
    join(key, &name.map_or_else(|| index.to_string(), str::to_owned))
}

fn shown(value: Option<&Value>) -> String {
    let Some(value) = value else { return "not given".to_owned() };
    let text = value.to_string();
    if text.chars().count() <= 60 { text } else { text.chars().take(57).chain("...".chars()).collect() }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn origin(scene: Value) -> Provenance {
        Provenance::new(scene, vec![NamedFile { key: "body1.mesh".into(), sha256: "00".into() }])
    }

    /// Truth (docs/checkpoints.md): another `solver.memory_limit` is refused with a hint to --max-memory.
    #[test]
    fn another_memory_limit() {
        let then = json!({ "solver": { "memory_limit": "1 GB" } });
        for now in [json!({ "solver": { "memory_limit": 2e9 } }), json!({})] {
            let found = origin(then.clone()).differences(&origin(now));
            assert!(
                found.len() == 1 && found[0].starts_with("solver.memory_limit: \"1 GB\" then"),
                "{found:?}"
            );
            assert!(found[0].contains("--max-memory may differ"), "{found:?}");
        }
    }

    /// Truth (docs/checkpoints.md): every differing key is listed with both values, except for keys that may differ, such as title
    /// and checkpoint interval.
    #[test]
    fn differing_keys_are_listed() {
        let then = json!({
            "title": "a", "gap": { "kind": "sphere", "radius": 50 }, "frame": { "cells": [8, 8] },
            "steps": [{ "name": "press", "approach": 0.1 }, { "increments": 2 }]
        });
        let mut now = then.clone();
        now["title"] = "b".into();
        now["output"] = json!({ "checkpoint": { "seconds": 1 } });
        assert_eq!(origin(then.clone()).differences(&origin(now.clone())), Vec::<String>::new());
        now["gap"]["radius"] = 25.into();
        now["frame"]["cells"] = json!([8, 16]);
        now["steps"][0]["friction"] = false.into();
        now["steps"][1] = json!({ "increments": 3 });
        let mut other = origin(now);
        other.files[0].sha256 = "01".into();
        other.version = "9".into();
        let mut found = origin(then).differences(&other);
        found.sort();
        let version = env!("CARGO_PKG_VERSION");
        assert_eq!(
            found,
            [
                "body1.mesh: the content of the file has changed".to_owned(),
                "frame.cells: [8,8] then, [8,16] now".to_owned(),
                "gap.radius: 50 then, 25 now".to_owned(),
                format!("orthowear {version} then, 9 now"),
                "steps.1.increments: 2 then, 3 now".to_owned(),
                "steps.press.friction: not given then, false now".to_owned(),
            ]
        );
    }
}
