//! Checks the document tree of a scene against the JSON Schema and collects all errors.

use serde_json::Value as Json;

use super::diagnostic::{Diagnostic, DiagnosticKind};
use super::document::{Document, Location, TomlEntry, TomlNode, TomlValue, is_whole, join_key};
use super::suggest::{closest, quoted_list};

/// Returns the schema violations of `document`, and its keys that are not in the schema. `what` names the document in
/// messages, such as "the scene".
pub fn check_against_schema(
    document: &Document,
    schema: &Json,
    what: &str,
) -> (Vec<Diagnostic>, Vec<String>) {
    let (diagnostics, unknown_keys) = (Vec::new(), Vec::new());
    let mut walk = SchemaWalk { document, root: schema, what, diagnostics, unknown_keys };
    walk.check_value(&document.root, schema, "");
    (walk.diagnostics, walk.unknown_keys)
}

/// Branches for a number and for a list, if `branches` contains both.
fn number_or_list(branches: &[Json]) -> Option<[&Json; 2]> {
    let of_type = |name: &str| branches.iter().find(|b| b.get("type").and_then(Json::as_str) == Some(name));
    Some([of_type("number").or_else(|| of_type("integer"))?, of_type("array")?])
}

struct SchemaWalk<'a> {
    document: &'a Document,
    root: &'a Json,
    what: &'a str,
    diagnostics: Vec<Diagnostic>,
    unknown_keys: Vec<String>,
}

impl<'a> SchemaWalk<'a> {
    fn report(&mut self, key: &str, message: String, label: &str, mend: String) {
        self.diagnostics.push(Diagnostic::at(self.document, key, message).label(label).help(mend));
    }

    fn name_of(&self, key: &str) -> String {
        if key.is_empty() { self.what.to_owned() } else { format!("`{key}`") }
    }

    /// Returns the schema to which `$ref` of `schema` points, or `schema` itself without `$ref`.
    fn dereference(&self, schema: &'a Json) -> &'a Json {
        let target = schema.get("$ref").and_then(Json::as_str).and_then(|r| r.strip_prefix('#'));
        target.and_then(|pointer| self.root.pointer(pointer)).unwrap_or(schema)
    }

    fn check_value(&mut self, node: &TomlNode, schema: &'a Json, key: &str) {
        let schema = self.dereference(schema);
        if let Some(branches) = schema.get("oneOf").or(schema.get("anyOf")).and_then(Json::as_array) {
            return self.check_branches(node, branches, key);
        }
        if let Some(words) = schema.get("enum").and_then(Json::as_array) {
            let words: Vec<&str> = words.iter().filter_map(Json::as_str).collect();
            return self.check_word(node, &words, "", key);
        }
        if let Some(types) = schema.get("type").and_then(Json::as_array) {
            let whole = !types.iter().any(|kind| kind == "number");
            return match node.value {
                // The bounds of the schema apply to numbers, not to texts.
                TomlValue::Integer(_) => self.check_number(node, schema, key, true),
                TomlValue::Float(_) if !whole => self.check_number(node, schema, key, false),
                TomlValue::String(_) => {}
                _ if whole => self.report_wrong_type(node, key, "a whole number or a text in double quotes"),
                _ => self.report_wrong_type(node, key, "a number or a text in double quotes"),
            };
        }
        match schema.get("type").and_then(Json::as_str) {
            Some("object") => self.check_table(node, schema, key, None),
            Some("array") => self.check_list(node, schema, key),
            Some("number") => self.check_number(node, schema, key, false),
            Some("integer") => self.check_number(node, schema, key, true),
            Some("string") if !matches!(node.value, TomlValue::String(_)) => {
                self.report_wrong_type(node, key, "a text in double quotes")
            }
            Some("boolean") if !matches!(node.value, TomlValue::Boolean(_)) => {
                self.report_wrong_type(node, key, "true or false")
            }
            _ => {}
        }
    }

    /// Checks a value against alternative schemas. The type of the value, or the tag of a table (such as `kind`),
    /// selects the schema.
    fn check_branches(&mut self, node: &TomlNode, branches: &'a [Json], key: &str) {
        let array = branches.iter().find(|branch| branch.get("type").is_some_and(|t| t == "array"));
        if let (Some(array), TomlValue::Array(_)) = (array, &node.value) {
            return self.check_list(node, array, key);
        }
        if branches.iter().any(|branch| branch.get("type").is_some_and(|t| t == "boolean")) {
            return match node.value {
                TomlValue::Boolean(_) => {}
                _ => self.report_wrong_type(node, key, "true, false or a list of names"),
            };
        }
        let is_table = |branch: &&Json| branch.get("type").is_some_and(|t| t == "object");
        let table = branches.iter().map(|branch| self.dereference(branch)).find(is_table);
        if let (Some(table), Some(_)) = (table, array) {
            return match node.value {
                TomlValue::Table(_) => self.check_table(node, table, key, None),
                _ => self.report_wrong_type(node, key, "a list or a table"),
            };
        }
        if let (Some(table), Some(number)) = (table, number_branch(branches)) {
            return match node.value {
                TomlValue::Table(_) => self.check_table(node, table, key, None),
                TomlValue::Integer(_) | TomlValue::Float(_) => self.check_value(node, number, key),
                _ => self.report_no_number(node, key, "a number or a table"),
            };
        }
        match (tag_of(branches), number_or_list(branches)) {
            (Some(tag), _) => self.check_tagged_table(node, branches, tag, key),
            (None, Some([number, list])) => {
                let chosen = if matches!(node.value, TomlValue::Array(_)) { list } else { number };
                self.check_value(node, chosen, key);
            }
            (None, None) => match number_branch(branches) {
                Some(number) if matches!(node.value, TomlValue::Integer(_) | TomlValue::Float(_)) => {
                    self.check_value(node, number, key)
                }
                Some(number) => {
                    let whole = number.get("type").is_some_and(|t| t == "integer");
                    let number = if whole { "a whole number or " } else { "a number or " };
                    self.check_word(node, &branch_words(branches), number, key)
                }
                None => self.check_word(node, &branch_words(branches), "", key),
            },
        }
    }

    /// Checks a string against the allowed words. `others` describes other allowed values for messages.
    fn check_word(&mut self, node: &TomlNode, words: &[&str], others: &str, key: &str) {
        let allowed = format!("{others}{}", quoted_list(words, "\""));
        let TomlValue::String(found) = &node.value else {
            let one_of = if others.is_empty() { "one of " } else { "" };
            return self.report_wrong_type(node, key, &format!("{one_of}{allowed}"));
        };
        if words.contains(&found.as_str()) {
            return;
        }
        if let Some((_, mend)) = REMOVED_VALUES.iter().find(|(value, _)| value == found) {
            return self.report(
                key,
                format!("\"{found}\" is no longer supported"),
                "removed",
                (*mend).to_owned(),
            );
        }
        let name = last_named_segment(key);
        let hint = match closest(found, words) {
            Some(word) => format!("did you mean \"{word}\"? Allowed: {allowed}"),
            None => format!("allowed: {allowed}"),
        };
        self.report(key, format!("`{name}` = \"{found}\" is not an allowed value"), "not allowed", hint);
    }

    fn check_tagged_table(&mut self, node: &TomlNode, branches: &'a [Json], tag: &'a str, key: &str) {
        let TomlValue::Table(entries) = &node.value else {
            return self.report_wrong_type(node, key, &format!("a table with `{tag}`"));
        };
        let words: Vec<&str> =
            branches.iter().filter_map(|branch| tag_word(self.dereference(branch), tag)).collect();
        let Some(entry) = entries.iter().find(|entry| entry.name == tag) else {
            let place = self.name_of(key);
            let near = entries.iter().map(|e| e.name.as_str()).find(|name| closest(name, &[tag]).is_some());
            let mut mend = format!("add `{tag} = ...`, one of {}", quoted_list(&words, "\""));
            if let Some(near) = near {
                mend = format!("did you mean `{tag}` instead of `{near}`? {mend}");
            }
            return self.report(key, format!("{place} lacks `{tag}`"), &format!("lacks `{tag}`"), mend);
        };
        let found = match &entry.node.value {
            TomlValue::String(text) => text.as_str(),
            _ => "",
        };
        match branches.iter().find(|branch| tag_word(self.dereference(branch), tag) == Some(found)) {
            Some(branch) => self.check_table(node, self.dereference(branch), key, Some((tag, branches))),
            None => self.check_word(&entry.node, &words, "", &join_key(key, tag)),
        }
    }

    fn check_table(
        &mut self,
        node: &TomlNode,
        schema: &'a Json,
        key: &str,
        variant: Option<(&'a str, &'a [Json])>,
    ) {
        let TomlValue::Table(entries) = &node.value else {
            let known = names(schema);
            let wanted = match known.len() {
                1..=MAX_KEYS_IN_HELP => format!("a table with the keys {}", quoted_list(&known, "`")),
                _ => "a table".to_owned(),
            };
            return self.report_wrong_type(node, key, &wanted);
        };
        let properties = schema.get("properties").and_then(Json::as_object);
        let free = schema.get("additionalProperties").filter(|s| s.is_object());
        for entry in entries {
            let path = join_key(key, &entry.name);
            match properties.and_then(|p| p.get(&entry.name)).or(free) {
                Some(schema) => self.check_value(&entry.node, schema, &path),
                None => self.report_unknown_key(entry, &path, key, schema, variant),
            }
        }
        let required = schema.get("required").and_then(Json::as_array).into_iter().flatten();
        let known = names(schema);
        for name in required.filter_map(Json::as_str) {
            // A misspelt required key is reported as an unknown key only.
            let there = |entry: &TomlEntry| {
                entry.name == name
                    || (!known.contains(&entry.name.as_str()) && closest(&entry.name, &known) == Some(name))
            };
            if !entries.iter().any(there) {
                let tag = variant.map(|(tag, _)| join_key(key, tag));
                self.report_missing_key(name, key, tag, properties.and_then(|p| p.get(name)));
            }
        }
    }

    /// Reports that the table at `key` lacks `name`. `tag` is the key that selects the kind of table.
    fn report_missing_key(&mut self, name: &str, key: &str, tag: Option<String>, schema: Option<&'a Json>) {
        let what = schema
            .and_then(|s| s.get("description").or(self.dereference(s).get("description")))
            .and_then(Json::as_str)
            .unwrap_or("");
        let place = self.name_of(key);
        let first_paragraph = what.split("\n\n").next().unwrap_or("").replace('\n', " ");
        let mut mend = format!("add `{name}`: {first_paragraph}");
        if let Some(Location::SetOption(option)) = tag.map(|tag| self.document.location(&tag)) {
            mend.push_str(&format!(" It is needed because of --set {option}"));
        }
        let mistake = Diagnostic::at(self.document, key, format!("{place} lacks `{name}`"));
        let mistake = mistake.kind(DiagnosticKind::MissingKey(name.to_owned()));
        self.diagnostics.push(mistake.label(format!("lacks `{name}`")).help(mend));
    }

    fn report_unknown_key(
        &mut self,
        entry: &TomlEntry,
        path: &str,
        key: &str,
        schema: &'a Json,
        variant: Option<(&'a str, &'a [Json])>,
    ) {
        self.unknown_keys.push(path.to_owned());
        let name = &entry.name;
        let known: Vec<&str> = names(schema);
        let place = self.name_of(key);
        let owner = variant.and_then(|(tag, branches)| {
            let owners = branches.iter().map(|b| self.dereference(b));
            let owners = owners.filter(|b| names(b).contains(&name.as_str()));
            let words: Vec<&str> = owners.filter_map(|owner| tag_word(owner, tag)).collect();
            (!words.is_empty()).then(|| (tag, format!("it belongs to {tag} = {}", quoted_list(&words, "\""))))
        });
        let mut mend = format!("allowed keys: {}", quoted_list(&known, "`"));
        if let Some((tag, owner)) = owner {
            mend = format!("{owner}: change `{tag}`, or remove the key; {mend}");
            let is_frp = |law: &str| match self.document.get(law).map(|node| &node.value) {
                Some(TomlValue::String(law)) => law == "frp",
                _ => false,
            };
            if (tag, name.as_str()) == ("kind", "fibre")
                && let Some(section) = ["friction", "wear"].into_iter().find(|s| is_frp(&format!("{s}.law")))
            {
                mend.push_str(&format!(
                    ". {section}.law = \"frp\" needs the fibre of a body that is not rigid"
                ));
            }
        } else if let Some(word) = closest(name, &known) {
            mend = format!("did you mean `{word}`? {mend}");
        }
        let mut message = format!("{place} has no key `{name}`");
        if let Some((_, help)) = REMOVED_KEYS.iter().find(|(key, _)| *key == path) {
            message.push_str(" any more");
            mend = (*help).to_owned();
        }
        let mistake = Diagnostic::at(self.document, path, message);
        self.diagnostics.push(mistake.kind(DiagnosticKind::UnknownKey).label("unknown key").help(mend));
    }

    fn check_list(&mut self, node: &TomlNode, schema: &'a Json, key: &str) {
        let TomlValue::Array(items) = &node.value else {
            let of_tables =
                schema.get("items").is_some_and(|s| self.dereference(s).get("properties").is_some());
            if of_tables && matches!(node.value, TomlValue::Table(_)) {
                let mend = format!("write `[[{key}]]`, once for each element");
                return self.report(
                    key,
                    format!("`{key}` is a table, not a list of tables"),
                    "a single table",
                    mend,
                );
            }
            return self.report_wrong_type(node, key, &describe_list(schema));
        };
        let least = schema.get("minItems").and_then(Json::as_u64).unwrap_or(0);
        let most = schema.get("maxItems").and_then(Json::as_u64).unwrap_or(u64::MAX);
        if !(least..=most).contains(&(items.len() as u64)) {
            let mut mend = format!("give {}", describe_list(schema));
            if most.checked_mul(2) == Some(items.len() as u64) {
                mend.push_str("; decimals are written with a point, as in 1.5");
            }
            let values = if items.len() == 1 { "value" } else { "values" };
            let message = format!("`{}` has {} {values}", last(key), items.len());
            return self.report(key, message, &describe_list(schema), mend);
        }
        if let Some(schema) = schema.get("items") {
            for (i, item) in items.iter().enumerate() {
                self.check_value(item, schema, &join_key(key, &i.to_string()));
            }
        }
    }

    /// Checks that a number is finite and within the bounds of the schema. If `whole`, the number must be an integer of
    /// magnitude at most [`MAX_INTEGER`]. Otherwise it must be 0 or have a magnitude within [`MAGNITUDE_RANGE`].
    fn check_number(&mut self, node: &TomlNode, schema: &'a Json, key: &str, whole: bool) {
        let found = match node.value {
            TomlValue::Integer(number) => number as f64,
            TomlValue::Float(number) => number,
            _ => return self.report_no_number(node, key, if whole { "a whole number" } else { "a number" }),
        };
        let name = last_named_segment(key);
        if !found.is_finite() {
            let message = format!("`{name}` is {found}, not a finite number");
            return self.report(key, message, "not finite", "give a finite number".to_owned());
        }
        let size = found.abs();
        if whole && size > MAX_INTEGER {
            let message = format!("`{name}` is {found:e}, but must be at most {MAX_INTEGER:e}");
            return self.report(key, message, "too large", "give a smaller number".to_owned());
        }
        if !whole && size != 0.0 && !(MAGNITUDE_RANGE[0]..=MAGNITUDE_RANGE[1]).contains(&size) {
            let message = format!(
                "`{name}` is {found:e}; its magnitude must be 0 or lie between {:e} and {:e}",
                MAGNITUDE_RANGE[0], MAGNITUDE_RANGE[1]
            );
            let mend = "choose units in which the numbers of the scene have usual magnitudes".to_owned();
            return self.report(key, message, "outside the range of numbers", mend);
        }
        if whole && !is_whole(found) {
            let message = format!("`{name}` is {found}, not a whole number");
            return self.report(key, message, "not a whole number", "give a whole number".to_owned());
        }
        if let Some(bounds) = violated_bounds(found, schema) {
            let message = format!("`{name}` is {found}, but must be {bounds}");
            let mend = match last(key) {
                "normal_force" => "compressive normal forces are positive: give 0 or more".to_owned(),
                _ => format!("give a number {bounds}"),
            };
            self.report(key, message, &format!("must be {bounds}"), mend);
        }
    }

    fn report_wrong_type(&mut self, node: &TomlNode, key: &str, wanted: &str) {
        self.report_type(node, key, wanted, format!("give {wanted}"));
    }

    /// As [`Self::report_wrong_type`]. The help also covers a number in quotes.
    fn report_no_number(&mut self, node: &TomlNode, key: &str, wanted: &str) {
        let TomlValue::String(text) = &node.value else { return self.report_wrong_type(node, key, wanted) };
        let (found, with_point) = (text.trim(), text.trim().replace(',', "."));
        let mend = if found.parse::<f64>().is_ok() {
            format!("remove the quotes: {} = {found}", last_named_segment(key))
        } else if with_point.parse::<f64>().is_ok() {
            format!("write it with a point and without quotes: {with_point}")
        } else {
            format!("give {wanted}")
        };
        self.report_type(node, key, wanted, mend);
    }

    fn report_type(&mut self, node: &TomlNode, key: &str, wanted: &str, mend: String) {
        let message = format!("`{}` is {}, but must be {wanted}", last_named_segment(key), node.describe());
        self.report(key, message, &format!("must be {wanted}"), mend);
    }
}

/// Keys that were removed from the schema, each with its help text.
const REMOVED_KEYS: [(&str, &str); 2] = [
    (
        "wear.beyond_critical",
        "remove it: explicit jumps beyond the stability limit are refused; for longer jumps use `integrator = \"sdirk2\"`",
    ),
    ("solver.precision", "remove it: all products with the flexibility matrix use double precision"),
];

/// Values that were removed from the schema, each with its help text.
const REMOVED_VALUES: [(&str, &str); 4] = [
    ("gauss-seidel", "remove `method`, or use \"auto\": Newton's method solves these contacts"),
    ("mirror-half", "remove it: mirror-symmetric grids are always computed in full"),
    ("sliding-friction", "remove it: contacts in full slip are solved like all others"),
    ("reduced-precision", "remove it: all products with the flexibility matrix use double precision"),
];

/// Maximum number of keys that are listed if a value should be a table.
const MAX_KEYS_IN_HELP: usize = 4;

const MAX_INTEGER: f64 = 1e15;

/// Allowed magnitudes of numbers other than 0. The range keeps products of up to three numbers within the range of f64.
pub(super) const MAGNITUDE_RANGE: [f64; 2] = [1e-100, 1e100];

/// The tag of the branches: a key with a different constant value in each branch.
fn tag_of(branches: &[Json]) -> Option<&str> {
    let first = branches.first()?.get("properties")?.as_object()?;
    let (tag, _) = first.iter().find(|(_, schema)| schema.get("const").is_some())?;
    Some(tag)
}

fn tag_word<'a>(branch: &'a Json, tag: &str) -> Option<&'a str> {
    branch.get("properties")?.get(tag)?.get("const")?.as_str()
}

fn number_branch(branches: &[Json]) -> Option<&Json> {
    branches.iter().find(|branch| branch.get("type").is_some_and(|t| t == "integer" || t == "number"))
}

fn branch_words(branches: &[Json]) -> Vec<&str> {
    // In a choice between a number and words, the schema nests the words in a `oneOf`.
    let branches = branches.iter().flat_map(|branch| match branch.get("oneOf").and_then(Json::as_array) {
        Some(inner) => inner.as_slice(),
        None => std::slice::from_ref(branch),
    });
    branches
        .flat_map(|branch| {
            let many = branch.get("enum").and_then(Json::as_array).into_iter().flatten();
            branch.get("const").into_iter().chain(many)
        })
        .filter_map(Json::as_str)
        .collect()
}

fn names(schema: &Json) -> Vec<&str> {
    schema
        .get("properties")
        .and_then(Json::as_object)
        .into_iter()
        .flatten()
        .map(|(name, _)| name.as_str())
        .collect()
}

/// Describes the bounds in `schema` if `found` violates one of them.
fn violated_bounds(found: f64, schema: &Json) -> Option<String> {
    let bound = |name: &str| schema.get(name).and_then(Json::as_f64);
    let (least, most) = (bound("minimum"), bound("maximum"));
    let (above, below) = (bound("exclusiveMinimum"), bound("exclusiveMaximum"));
    let fine = least.is_none_or(|b| found >= b)
        && most.is_none_or(|b| found <= b)
        && above.is_none_or(|b| found > b)
        && below.is_none_or(|b| found < b);
    if fine {
        return None;
    }
    let parts = [
        least.map(|b| format!("at least {b}")),
        above.map(|b| format!("above {b}")),
        most.map(|b| format!("at most {b}")),
        below.map(|b| format!("below {b}")),
    ];
    Some(parts.into_iter().flatten().collect::<Vec<_>>().join(" and "))
}

fn describe_list(schema: &Json) -> String {
    let least = schema.get("minItems").and_then(Json::as_u64);
    let most = schema.get("maxItems").and_then(Json::as_u64);
    match (least, most) {
        (Some(n), Some(m)) if n == m => format!("a list of {n} values"),
        (Some(1), _) => "a list of at least 1 value".to_owned(),
        (Some(n), _) => format!("a list of at least {n} values"),
        _ => "a list".to_owned(),
    }
}

fn last(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

/// The last segment of `key` that is a name, and the indices after this segment: `cells.0` in `frame.cells.0`.
fn last_named_segment(key: &str) -> &str {
    let mut start = key.len();
    for part in key.rsplit('.') {
        start = start.saturating_sub(part.len() + usize::from(start != key.len()));
        if part.parse::<usize>().is_err() {
            break;
        }
    }
    &key[start..]
}
