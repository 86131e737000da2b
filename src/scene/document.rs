//! Document tree of a scene file, with the location of every value.

use std::borrow::Cow;
use std::ops::Range;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Location of an error in the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// Byte range in the text of the scene file.
    File(Range<usize>),
    /// Text of the command-line option `--set`.
    SetOption(String),
    /// The scene as a whole.
    WholeScene,
}

/// Location of a value in the input.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ValueSource {
    /// Byte range in the file.
    File(Range<usize>),
    /// Index of the override (`--set`).
    Override(usize),
}

/// A value with its location.
#[derive(Debug, Clone)]
pub struct TomlNode {
    /// Location of the value.
    pub source: ValueSource,
    /// The value.
    pub value: TomlValue,
}

/// A key of a table with its value.
#[derive(Debug, Clone)]
pub struct TomlEntry {
    /// The key.
    pub name: String,
    /// Location of the key.
    pub origin: ValueSource,
    /// Value of the key.
    pub node: TomlNode,
}

/// A TOML value.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub enum TomlValue {
    Table(Vec<TomlEntry>),
    Array(Vec<TomlNode>),
    String(String),
    /// An integer that fits 64 bits.
    Integer(i64),
    Float(f64),
    Boolean(bool),
    /// A date, or an integer outside the range of i64: kind of value, and its text.
    Unsupported(&'static str, String),
}

impl TomlValue {
    /// Converts the value to JSON; `float` converts floating-point numbers.
    fn to_json(&self, float: fn(f64) -> serde_json::Value) -> serde_json::Value {
        match self {
            Self::Table(entries) => {
                entries.iter().map(|entry| (entry.name.clone(), entry.node.value.to_json(float))).collect()
            }
            Self::Array(items) => items.iter().map(|item| item.value.to_json(float)).collect(),
            Self::String(text) | Self::Unsupported(_, text) => text.clone().into(),
            Self::Integer(number) => (*number).into(),
            Self::Float(number) => float(*number),
            Self::Boolean(flag) => (*flag).into(),
        }
    }
}

/// A scene file with its overrides applied.
#[derive(Debug, Clone)]
pub struct Document {
    /// Name of the file as the user gave it.
    pub file: String,
    /// Folder to which relative paths in the scene refer.
    pub folder: PathBuf,
    /// Text of the file.
    pub text: String,
    /// The overrides, `key.path=value`.
    pub overrides: Vec<String>,
    /// The document tree with the overrides applied.
    pub root: TomlNode,
    /// SHA-256 (hexadecimal) of the file's bytes and the overrides.
    pub sha256: String,
}

impl Document {
    /// A document with an empty tree.
    pub fn new(path: &Path, text: String, overrides: &[String]) -> Self {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        Self {
            file: path.display().to_string(),
            folder,
            overrides: overrides.to_vec(),
            root: TomlNode { source: ValueSource::File(0..text.len()), value: TomlValue::Table(Vec::new()) },
            sha256: fingerprint(&text, overrides),
            text,
        }
    }

    /// Finds the value at a dotted key.
    pub fn get(&self, key: &str) -> Option<&TomlNode> {
        key_segments(key).try_fold(&self.root, |node, segment| node.child(&segment).map(|(_, child)| child))
    }

    /// The scene with its overrides as JSON. Dates, integers outside the range of i64, and floats that are not finite
    /// become strings.
    pub fn to_display_json(&self) -> serde_json::Value {
        self.root.value.to_json(|x| if x.is_finite() { x.into() } else { x.to_string().into() })
    }

    pub(crate) fn remove(&mut self, key: &str) {
        let mut table: Vec<Cow<'_, str>> = key_segments(key).collect();
        let Some(name) = table.pop() else { return };
        let mut node = &mut self.root;
        for segment in table {
            let inner = match &mut node.value {
                TomlValue::Table(entries) => {
                    entries.iter_mut().find(|entry| entry.name == segment).map(|entry| &mut entry.node)
                }
                TomlValue::Array(items) => element_index(items, &segment).and_then(|i| items.get_mut(i)),
                _ => None,
            };
            match inner {
                Some(inner) => node = inner,
                None => return,
            }
        }
        if let TomlValue::Table(entries) = &mut node.value {
            entries.retain(|entry| entry.name != name);
        }
    }

    /// Location of `key`. If the document lacks the key, location of the innermost existing table that should contain
    /// it. Without such a table, the whole scene.
    pub fn location(&self, key: &str) -> Location {
        let mut node = &self.root;
        let mut found = None;
        for segment in key_segments(key) {
            let Some((origin, child)) = node.child(&segment) else { break };
            found = Some((origin, child));
            node = child;
        }
        match found {
            None => Location::WholeScene,
            Some((key_origin, child)) => self.place_of(key_origin, &child.source),
        }
    }

    /// Location of a key and its value. It extends from the start of the key to the end of the value if this text is on
    /// one line. Otherwise it is the key alone. If an override (`--set`) gives the key or the value, the location is
    /// the override.
    fn place_of(&self, key: &ValueSource, value: &ValueSource) -> Location {
        match (key, value) {
            (ValueSource::File(key), ValueSource::File(value)) => {
                let whole = key.start.min(value.start)..key.end.max(value.end);
                let one_line = self.text.get(whole.clone()).is_some_and(|text| !text.contains('\n'));
                Location::File(if one_line && !whole.is_empty() { whole } else { key.clone() })
            }
            (_, ValueSource::Override(i)) | (ValueSource::Override(i), _) => {
                Location::SetOption(self.overrides.get(*i).cloned().unwrap_or_default())
            }
        }
    }
}

/// Splits a dotted key into its segments. A quoted segment may be empty or contain dots; its escape sequences are `\"`
/// and `\\`.
pub(crate) fn key_segments(key: &str) -> impl Iterator<Item = Cow<'_, str>> {
    let mut rest = key;
    std::iter::from_fn(move || {
        rest = rest.trim_start_matches('.');
        if let Some(quoted) = rest.strip_prefix('"') {
            let (segment, after) = unquoted(quoted);
            rest = after;
            return Some(segment.into());
        }
        let (segment, after) = rest.split_once('.').unwrap_or((rest, ""));
        rest = after;
        Some(segment.into()).filter(|_| !segment.is_empty())
    })
}

/// Returns the text up to the closing quote with its escape sequences resolved, and the text after the quote.
fn unquoted(text: &str) -> (String, &str) {
    let (mut segment, mut escaped) = (String::new(), false);
    for (i, c) in text.char_indices() {
        match c {
            '\\' if !escaped => escaped = true,
            '"' if !escaped => return (segment, &text[i + 1..]),
            _ => {
                segment.push(c);
                escaped = false;
            }
        }
    }
    (segment, "")
}

/// Dotted key of the entry `name` in the table at `key`.
pub(super) fn join_key(key: &str, name: &str) -> String {
    let dot = if key.is_empty() { "" } else { "." };
    if name.is_empty() || name.contains(['.', '"', '\\']) {
        let name = name.replace('\\', "\\\\").replace('"', "\\\"");
        format!("{key}{dot}\"{name}\"")
    } else {
        format!("{key}{dot}{name}")
    }
}

fn fingerprint(text: &str, overrides: &[String]) -> String {
    let mut hash = Sha256::new();
    hash.update(text);
    for line in overrides {
        hash.update(b"\n--set ");
        hash.update(line.as_bytes());
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl TomlNode {
    /// In a table: the value of the key `segment`. In a list: the element with this index (from 0) or `name`. The
    /// location of the key or the element comes first.
    pub fn child(&self, segment: &str) -> Option<(&ValueSource, &TomlNode)> {
        match &self.value {
            TomlValue::Table(entries) => {
                entries.iter().find(|entry| entry.name == segment).map(|entry| (&entry.origin, &entry.node))
            }
            TomlValue::Array(items) => {
                let item = element_index(items, segment).and_then(|i| items.get(i))?;
                Some((&item.source, item))
            }
            _ => None,
        }
    }

    /// Describes type and value for messages.
    pub fn describe(&self) -> String {
        match &self.value {
            TomlValue::Table(_) => "a table".to_owned(),
            TomlValue::Array(items) => format!("a list of {} values", items.len()),
            TomlValue::String(text) => format!("the text \"{}\"", shorten(text)),
            TomlValue::Integer(number) => format!("the whole number {number}"),
            TomlValue::Float(number) => format!("the number {number}"),
            TomlValue::Boolean(value) => format!("{value}"),
            TomlValue::Unsupported(what, text) => format!("{what} {}", shorten(text)),
        }
    }

    /// Formats the value as TOML on one line.
    pub fn to_toml(&self) -> String {
        match &self.value {
            TomlValue::Table(entries) => {
                let parts = entries.iter().map(|e| format!("{} = {}", quoted(&e.name), e.node.to_toml()));
                format!("{{ {} }}", parts.collect::<Vec<_>>().join(", "))
            }
            TomlValue::Array(items) => {
                format!("[{}]", items.iter().map(TomlNode::to_toml).collect::<Vec<_>>().join(", "))
            }
            TomlValue::String(text) => quoted(text),
            TomlValue::Integer(number) => number.to_string(),
            // Debug output is the shortest text that reads back to the same bits.
            TomlValue::Float(number) => format!("{number:?}").replace("NaN", "nan"),
            TomlValue::Boolean(value) => value.to_string(),
            TomlValue::Unsupported(_, text) => text.clone(),
        }
    }

    /// Converts the value to JSON. Floats without fractional part become integers, because TOML reads 1e5 as a float.
    pub fn to_serde_json(&self) -> serde_json::Value {
        self.value.to_json(|x| if is_whole(x) { (x as i64).into() } else { x.into() })
    }
}

/// Index in a list of tables. `segment` is a number (from 0) or the `name` of an element.
pub(super) fn element_index(items: &[TomlNode], segment: &str) -> Option<usize> {
    segment.parse().ok().or_else(|| index_of_name(items, segment))
}

/// Index of the last table with this `name` in a list. Results reported by name also belong to the last element with
/// the name.
pub(super) fn index_of_name(items: &[TomlNode], name: &str) -> Option<usize> {
    items.iter().rposition(|item| name_of(item) == Some(name))
}

pub(super) fn name_of(item: &TomlNode) -> Option<&str> {
    match item.child("name") {
        Some((_, TomlNode { value: TomlValue::String(name), .. })) => Some(name),
        _ => None,
    }
}

/// Whether a float is an integer below 9e15 in magnitude, so that its conversion to i64 is exact.
pub(super) fn is_whole(number: f64) -> bool {
    number.fract() == 0.0 && number.abs() < 9.0e15
}

/// Formats a text as a basic string of TOML. TOML and JSON have the same escape sequences, but JSON does not escape
/// U+007F.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

fn shorten(text: &str) -> String {
    let mut line: String = text.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().count() > 60 {
        line.push_str("...");
    }
    line
}

/// Converts a parsed table to the document tree. `origin` maps a byte range of the text to a location.
pub(super) fn table_from_toml(
    parsed: &DeTable<'_>,
    origin: &dyn Fn(Range<usize>) -> ValueSource,
) -> TomlValue {
    let mut entries: Vec<TomlEntry> = parsed
        .iter()
        .map(|(key, value)| TomlEntry {
            name: key.get_ref().to_string(),
            origin: origin(key.span()),
            node: node_from_toml(value, origin),
        })
        .collect();
    entries.sort_by_key(|entry| match &entry.origin {
        ValueSource::File(range) => range.start,
        ValueSource::Override(_) => usize::MAX,
    });
    TomlValue::Table(entries)
}

pub(super) fn node_from_toml(
    parsed: &Spanned<DeValue<'_>>,
    origin: &dyn Fn(Range<usize>) -> ValueSource,
) -> TomlNode {
    let value = match parsed.get_ref() {
        DeValue::String(text) => TomlValue::String(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) => TomlValue::Integer(value),
            Err(_) => TomlValue::Unsupported("the number", number.to_string()),
        },
        DeValue::Float(number) => TomlValue::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => TomlValue::Boolean(*value),
        DeValue::Datetime(date) => TomlValue::Unsupported("the date", date.to_string()),
        DeValue::Array(items) => {
            TomlValue::Array(items.iter().map(|item| node_from_toml(item, origin)).collect())
        }
        DeValue::Table(entries) => table_from_toml(entries, origin),
    };
    TomlNode { source: origin(parsed.span()), value }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: `key_segments` inverts `join_key` for names with any characters.
    #[test]
    fn keys_of_any_names_come_apart_again() {
        for name in ["steel", "a.b", "a.\"b", "", "\"", "back\\slash", "\\\"", "ä ö"] {
            let key = join_key(&join_key("materials", name), "E1");
            assert_eq!(key_segments(&key).collect::<Vec<_>>(), ["materials", name, "E1"], "{key}");
        }
    }
}
