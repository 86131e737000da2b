//! The scene file as a tree whose every value remembers where it was written.

use std::ops::Range;
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::mistake::Place;

/// Where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// Bytes of the file.
    File(Range<usize>),
    /// The override of this index.
    Override(usize),
}

/// A value with its origin.
#[derive(Debug, Clone)]
pub struct Node {
    /// Where the value stands.
    pub origin: Origin,
    /// The value.
    pub value: Value,
}

/// A key of a table with its value.
#[derive(Debug, Clone)]
pub struct Entry {
    /// The key.
    pub name: String,
    /// Where the key stands.
    pub origin: Origin,
    /// Its value.
    pub node: Node,
}

/// A TOML value.
#[derive(Debug, Clone)]
#[allow(missing_docs)]
pub enum Value {
    Table(Vec<Entry>),
    Array(Vec<Node>),
    String(String),
    /// An integer that fits 64 bits.
    Integer(i64),
    Float(f64),
    Boolean(bool),
    /// Text of a date, or of a number too large to hold.
    Other(&'static str, String),
}

impl Value {
    fn json(&self) -> serde_json::Value {
        match self {
            Self::Table(entries) => {
                entries.iter().map(|entry| (entry.name.clone(), entry.node.value.json())).collect()
            }
            Self::Array(items) => items.iter().map(|item| item.value.json()).collect(),
            Self::String(text) | Self::Other(_, text) => text.clone().into(),
            Self::Integer(number) => (*number).into(),
            Self::Float(number) if number.is_finite() => (*number).into(),
            Self::Float(number) => number.to_string().into(),
            Self::Boolean(flag) => (*flag).into(),
        }
    }
}

/// A scene file and the overrides laid over it.
#[derive(Debug, Clone)]
pub struct Document {
    /// Name of the file as the user gave it.
    pub file: String,
    /// Folder that relative paths in the scene start from.
    pub folder: PathBuf,
    /// Text of the file.
    pub text: String,
    /// The overrides, `key.path=value`.
    pub overrides: Vec<String>,
    /// The tree, overrides applied.
    pub root: Node,
    /// SHA-256 (hexadecimal) of the file's bytes and the overrides.
    pub sha256: String,
}

impl Document {
    /// A document without content yet.
    pub fn new(path: &Path, text: String, bytes: &[u8], overrides: &[String]) -> Self {
        let folder = match path.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
            _ => PathBuf::from("."),
        };
        let end = text.len();
        Self {
            file: path.display().to_string(),
            folder,
            text,
            overrides: overrides.to_vec(),
            root: Node { origin: Origin::File(0..end), value: Value::Table(Vec::new()) },
            sha256: fingerprint(bytes, overrides),
        }
    }

    /// The value at a dotted key, if there.
    pub fn get(&self, key: &str) -> Option<&Node> {
        segments(key).try_fold(&self.root, |node, segment| node.child(segment).map(|(_, child)| child))
    }

    /// The scene with its overrides as JSON; numbers that are not finite, dates and numbers too large to hold as text.
    pub fn json(&self) -> serde_json::Value {
        self.root.value.json()
    }

    /// Takes the entry at a dotted key out of its table.
    pub(crate) fn remove(&mut self, key: &str) {
        let mut table: Vec<&str> = segments(key).collect();
        let Some(name) = table.pop() else { return };
        let mut node = &mut self.root;
        for segment in table {
            let inner = match &mut node.value {
                Value::Table(entries) => {
                    entries.iter_mut().find(|entry| entry.name == segment).map(|entry| &mut entry.node)
                }
                Value::Array(items) => position(items, segment).and_then(|i| items.get_mut(i)),
                _ => None,
            };
            match inner {
                Some(inner) => node = inner,
                None => return,
            }
        }
        if let Value::Table(entries) = &mut node.value {
            entries.retain(|entry| entry.name != name);
        }
    }

    /// Where `key` stands, or the nearest table around it that does.
    pub fn place(&self, key: &str) -> Place {
        let mut node = &self.root;
        let mut found = None;
        for segment in segments(key) {
            let Some((origin, child)) = node.child(segment) else { break };
            found = Some((origin, child));
            node = child;
        }
        match found {
            None => Place::Scene,
            Some((key_origin, child)) => self.place_of(key_origin, &child.origin),
        }
    }

    /// From the first byte of a key to the last of its value where both stand on one line, else the key alone.
    fn place_of(&self, key: &Origin, value: &Origin) -> Place {
        match (key, value) {
            (Origin::File(key), Origin::File(value)) => {
                let whole = key.start.min(value.start)..key.end.max(value.end);
                let one_line = self.text.get(whole.clone()).is_some_and(|text| !text.contains('\n'));
                Place::File(if one_line && !whole.is_empty() { whole } else { key.clone() })
            }
            (_, Origin::Override(i)) | (Origin::Override(i), _) => {
                Place::Option(self.overrides.get(*i).cloned().unwrap_or_default())
            }
        }
    }
}

/// The parts of a dotted key; a part in quotes may hold dots, as in TOML.
pub(crate) fn segments(key: &str) -> impl Iterator<Item = &str> {
    let mut rest = key;
    std::iter::from_fn(move || {
        rest = rest.trim_start_matches('.');
        let (segment, after) = match rest.strip_prefix('"') {
            Some(quoted) => quoted.split_once('"').unwrap_or((quoted, "")),
            None => rest.split_once('.').unwrap_or((rest, "")),
        };
        rest = after;
        Some(segment).filter(|segment| !segment.is_empty())
    })
}

/// The dotted key of the entry `name` of the table at `key`.
pub(super) fn join(key: &str, name: &str) -> String {
    let dot = if key.is_empty() { "" } else { "." };
    if name.contains('.') { format!("{key}{dot}\"{name}\"") } else { format!("{key}{dot}{name}") }
}

/// SHA-256 of the bytes of a scene, followed by each override on a line of its own.
fn fingerprint(bytes: &[u8], overrides: &[String]) -> String {
    let mut hash = Sha256::new();
    hash.update(bytes);
    for line in overrides {
        hash.update(b"\n--set ");
        hash.update(line.as_bytes());
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

impl Node {
    /// The child named `segment` of a table, or of this index (from 0) of an array; elements of an array of tables
    /// also answer to their `name`.
    pub fn child(&self, segment: &str) -> Option<(&Origin, &Node)> {
        match &self.value {
            Value::Table(entries) => {
                entries.iter().find(|entry| entry.name == segment).map(|entry| (&entry.origin, &entry.node))
            }
            Value::Array(items) => {
                let item = position(items, segment).and_then(|i| items.get(i))?;
                Some((&item.origin, item))
            }
            _ => None,
        }
    }

    /// What sort of value it is, with its article.
    pub fn describe(&self) -> String {
        match &self.value {
            Value::Table(_) => "a table".to_owned(),
            Value::Array(items) => format!("a list of {} values", items.len()),
            Value::String(text) => format!("the text \"{}\"", shorten(text)),
            Value::Integer(number) => format!("the whole number {number}"),
            Value::Float(number) => format!("the number {number}"),
            Value::Boolean(value) => format!("{value}"),
            Value::Other(what, text) => format!("{what} {}", shorten(text)),
        }
    }

    /// As TOML on one line.
    pub fn to_toml(&self) -> String {
        match &self.value {
            Value::Table(entries) => {
                let parts = entries.iter().map(|e| format!("{} = {}", quoted(&e.name), e.node.to_toml()));
                format!("{{ {} }}", parts.collect::<Vec<_>>().join(", "))
            }
            Value::Array(items) => {
                format!("[{}]", items.iter().map(Node::to_toml).collect::<Vec<_>>().join(", "))
            }
            Value::String(text) => quoted(text),
            Value::Integer(number) => number.to_string(),
            // The shortest text that reads back to the same bits.
            Value::Float(number) => format!("{number:?}").replace("NaN", "nan"),
            Value::Boolean(value) => value.to_string(),
            Value::Other(_, text) => text.clone(),
        }
    }

    /// As JSON; whole floats become integers, since TOML writes 1e5 as a float.
    pub fn to_json(&self) -> serde_json::Value {
        match &self.value {
            Value::Table(entries) => {
                entries.iter().map(|entry| (entry.name.clone(), entry.node.to_json())).collect()
            }
            Value::Array(items) => items.iter().map(Node::to_json).collect(),
            Value::String(text) | Value::Other(_, text) => text.clone().into(),
            Value::Integer(number) => (*number).into(),
            Value::Float(number) if is_whole(*number) => (*number as i64).into(),
            Value::Float(number) => (*number).into(),
            Value::Boolean(value) => (*value).into(),
        }
    }
}

/// Index in a list of tables that a segment names: a number from 0, or the `name` of an element.
pub(super) fn position(items: &[Node], segment: &str) -> Option<usize> {
    segment.parse().ok().or_else(|| {
        // The last of a name is the one whose result the name stands for.
        items.iter().rposition(
            |item| matches!(item.child("name"), Some((_, Node { value: Value::String(n), .. })) if n == segment),
        )
    })
}

/// Whether a float holds an integer exactly.
pub(super) fn is_whole(number: f64) -> bool {
    number.fract() == 0.0 && number.abs() < 9.0e15
}

/// A text in double quotes; TOML's basic strings have the escapes of JSON.
fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

/// At most 60 characters of a text, on one line.
fn shorten(text: &str) -> String {
    let mut line: String = text.chars().take(60).map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.chars().count() > 60 {
        line.push_str("...");
    }
    line
}

/// The tree of a parsed table; `origin` gives the origin of a span.
pub(super) fn table(parsed: &DeTable<'_>, origin: &dyn Fn(Range<usize>) -> Origin) -> Value {
    let mut entries: Vec<Entry> = parsed
        .iter()
        .map(|(key, value)| Entry {
            name: key.get_ref().to_string(),
            origin: origin(key.span()),
            node: node(value, origin),
        })
        .collect();
    entries.sort_by_key(|entry| match &entry.origin {
        Origin::File(range) => range.start,
        Origin::Override(_) => usize::MAX,
    });
    Value::Table(entries)
}

/// The tree of a parsed value.
pub(super) fn node(parsed: &Spanned<DeValue<'_>>, origin: &dyn Fn(Range<usize>) -> Origin) -> Node {
    let value = match parsed.get_ref() {
        DeValue::String(text) => Value::String(text.to_string()),
        DeValue::Integer(number) => match i64::from_str_radix(number.as_str(), number.radix()) {
            Ok(value) => Value::Integer(value),
            Err(_) => Value::Other("the number", number.to_string()),
        },
        DeValue::Float(number) => Value::Float(number.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(value) => Value::Boolean(*value),
        DeValue::Datetime(date) => Value::Other("the date", date.to_string()),
        DeValue::Array(items) => Value::Array(items.iter().map(|item| node(item, origin)).collect()),
        DeValue::Table(entries) => table(entries, origin),
    };
    Node { origin: origin(parsed.span()), value }
}
