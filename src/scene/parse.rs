//! Reads a scene file and applies the overrides of the command line.

use std::borrow::Cow;
use std::fs;
use std::path::Path;

use toml::de::{DeTable, DeValue};

use super::diagnostic::{Diagnostic, DiagnosticKind, Diagnostics};
use super::document::{
    Document, Location, TomlEntry, TomlNode, TomlValue, ValueSource, element_index, index_of_name,
    key_segments, name_of, node_from_toml, table_from_toml,
};
use crate::scene::suggest::{closest, quoted_list};

/// Maximum number of segments of the key of an override. Keys in a file have the same limit.
const MAX_KEY_DEPTH: usize = 80;

const MAX_SCENE_BYTES: u64 = 16 << 20;

/// Reads the scene file at `path` and applies the overrides (`key.path=value`).
///
/// # Errors
/// If the file cannot be read, is a folder, is larger than 16 MiB, or is not UTF-8. Otherwise the first syntax error of the file,
/// and all overrides that are malformed or cannot be applied.
pub fn read_document(path: &Path, overrides: &[String]) -> Result<Document, Diagnostics> {
    let bytes = read_bytes(path).map_err(|message| file_error(path, message))?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let at = error.utf8_error().valid_up_to();
        let line = 1 + error.as_bytes()[..at].iter().filter(|byte| **byte == b'\n').count();
        let message =
            format!("line {line} (byte {at}) is not UTF-8 text: save the scene with UTF-8 encoding");
        file_error(path, message)
    })?;
    parse_document(path, text, overrides)
}

/// Parses the `text` of the scene file at `path` and applies the overrides.
///
/// # Errors
/// The first syntax error of the text, and all overrides that are malformed or cannot be applied.
pub(super) fn parse_document(
    path: &Path,
    text: String,
    overrides: &[String],
) -> Result<Document, Diagnostics> {
    let mut document = Document::new(path, text, overrides);
    let (parsed, errors) = DeTable::parse_recoverable(&document.text);
    // Only the first error is reported. Later errors mostly follow from it, for example after an unclosed bracket.
    let first = errors.iter().min_by_key(|error| error.span().map_or(0, |span| span.start));
    let mut mistakes: Vec<Diagnostic> =
        first.iter().map(|error| syntax_error(&document.text, error.message(), error.span())).collect();
    let root = table_from_toml(parsed.get_ref(), &ValueSource::File);
    document.root.value = root;
    for (i, line) in overrides.iter().enumerate() {
        if let Err(mistake) = apply_override(&mut document.root, i, line) {
            mistakes.push(*mistake);
        }
    }
    if mistakes.is_empty() { Ok(document) } else { Err(Diagnostics::new(&document, mistakes)) }
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, String> {
    let data = fs::metadata(path)
        .map_err(|error| format!("cannot read the scene: {error}; give the path of a scene file (.toml)"))?;
    if data.is_dir() {
        return Err("this is a folder; give the path of a scene file (.toml)".to_owned());
    }
    if data.len() > MAX_SCENE_BYTES {
        return Err(format!(
            "the file is too large for a scene: {} bytes, at most {MAX_SCENE_BYTES}",
            data.len()
        ));
    }
    fs::read(path).map_err(|error| format!("cannot read the scene: {error}"))
}

fn file_error(path: &Path, message: String) -> Diagnostics {
    let document = Document::new(path, String::new(), &[]);
    let mistakes = Diagnostics::new(&document, vec![Diagnostic::at(&document, "", message)]);
    Diagnostics { sha256: String::new(), ..mistakes }
}

fn syntax_error(text: &str, message: &str, span: Option<std::ops::Range<usize>>) -> Diagnostic {
    let span = span.unwrap_or(0..0);
    let before = &text.as_bytes()[..span.start.min(text.len())];
    let start = before.iter().rposition(|byte| *byte == b'\n').map_or(0, |i| i + 1);
    let line = text.get(start..).and_then(|rest| rest.lines().next()).unwrap_or("");
    let found = text.get(span.clone()).unwrap_or("");
    let is_number = |word: &str| word.parse::<f64>().is_ok();
    // Two adjacent numbers in a list or an inline table indicate a missing comma.
    let numbers = found.split([',', ']', '}']).next().unwrap_or("").split_whitespace();
    let in_list = text.get(start..span.start).is_some_and(|before| before.contains(['[', '{']));
    // The crate `toml` gives its errors a message but no kind. The texts of the messages are therefore compared.
    let mend = if message.contains("duplicate key") {
        "keep one of the two"
    } else if message.contains("missing comma")
        || (in_list && numbers.take_while(|w| is_number(w)).count() > 1)
    {
        "separate the elements of a list or an inline table by commas, as in [1.0, 2.0]"
    } else if has_decimal_comma(line) {
        "write decimals with a point, as in 50.0"
    } else {
        "a scene is a TOML file: `key = value` lines below `[table]` headings, texts in double quotes"
    };
    Diagnostic {
        kind: DiagnosticKind::Other,
        key: String::new(),
        message: format!("not valid TOML: {message}"),
        label: "here".to_owned(),
        help: mend.to_owned(),
        location: Location::File(span),
    }
}

/// Whether a line has a comma between two digits. Lines with lists are excluded, because commas separate their
/// elements.
fn has_decimal_comma(line: &str) -> bool {
    let bytes = line.as_bytes();
    !line.contains('[')
        && bytes.windows(3).any(|w| w[0].is_ascii_digit() && w[1] == b',' && w[2].is_ascii_digit())
}

fn apply_override(root: &mut TomlNode, index: usize, line: &str) -> Result<(), Box<Diagnostic>> {
    let wrong = |message: String, mend: &str| {
        Box::new(Diagnostic {
            kind: DiagnosticKind::BadOverride,
            key: String::new(),
            message,
            label: String::new(),
            help: mend.to_owned(),
            location: Location::SetOption(line.to_owned()),
        })
    };
    let form =
        "write it as --set key.path=value, e.g. --set gap.radius=25.0 or --set steps.indent.approach=0.01";
    let Some((key, value)) = line.split_once('=') else {
        return Err(wrong(format!("`{line}` has no `=`"), form));
    };
    let (key, value) = (key.trim(), value.trim());
    if key.is_empty() || key.split('.').any(str::is_empty) {
        return Err(wrong(format!("`{key}` is not a valid key"), form));
    }
    if key.split('.').count() > MAX_KEY_DEPTH {
        return Err(wrong(
            format!("the key has {} levels; at most {MAX_KEY_DEPTH} are allowed", key.split('.').count()),
            form,
        ));
    }
    let value = override_value(value, index).map_err(|message| {
        wrong(message, "write the value as in the scene file, e.g. 0.5, true, \"text\", [1, 2]")
    })?;
    let parts: Vec<Cow<'_, str>> = key_segments(key).collect();
    set(root, &parts, value, index).map_err(|message| {
        wrong(
            message,
            "use a name, or a number from 0, for an element of a list; docs/keys.md lists all keys",
        )
    })
}

/// Value of an override. A bare word or path is read as a string, any other text as a TOML value.
fn override_value(text: &str, index: usize) -> Result<TomlNode, String> {
    let is_path = ["/", "./", "../"].iter().any(|start| text.starts_with(start));
    let bare = (is_path || text.starts_with(|c: char| c.is_ascii_alphabetic()))
        && text.chars().all(|c| c.is_ascii_alphanumeric() || "-_./".contains(c))
        && !["true", "false", "nan", "inf"].contains(&text);
    if bare {
        return Ok(TomlNode {
            source: ValueSource::Override(index),
            value: TomlValue::String(text.to_owned()),
        });
    }
    if text.is_empty() {
        return Err("the value after `=` is missing".to_owned());
    }
    match DeValue::parse(text) {
        Ok(parsed) => Ok(node_from_toml(&parsed, &|_| ValueSource::Override(index))),
        Err(error) => {
            let number = text.replace(',', ".");
            if text.contains(',') && number.parse::<f64>().is_ok() {
                return Err(format!("`{text}` has a decimal comma; write a decimal point: {number}"));
            }
            Err(format!("`{text}` is not a TOML value: {}", error.message()))
        }
    }
}

fn set(at: &mut TomlNode, path: &[Cow<'_, str>], value: TomlNode, index: usize) -> Result<(), String> {
    let Some((segment, rest)) = path.split_first() else {
        *at = value;
        return Ok(());
    };
    match &mut at.value {
        TomlValue::Table(entries) => {
            let i = entries.iter().position(|entry| entry.name == *segment).unwrap_or_else(|| {
                let node =
                    TomlNode { source: ValueSource::Override(index), value: TomlValue::Table(Vec::new()) };
                entries.push(TomlEntry {
                    name: segment.clone().into_owned(),
                    origin: ValueSource::Override(index),
                    node,
                });
                entries.len() - 1
            });
            set(&mut entries[i].node, rest, value, index)
        }
        TomlValue::Array(items) => {
            let n = items.len();
            if let (Some(named), Ok(number)) = (index_of_name(items, segment), segment.parse::<usize>())
                && named != number
            {
                return Err(format!(
                    "`{segment}` is the name of element {named} and also the number of another element; rename the named element"
                ));
            }
            match element_index(items, segment).and_then(|i| items.get_mut(i)) {
                Some(item) => set(item, rest, value, index),
                None => {
                    let names: Vec<&str> = items.iter().filter_map(name_of).collect();
                    let hint = match closest(segment, &names) {
                        Some(near) if segment.parse::<usize>().is_err() => {
                            format!(". Did you mean \"{near}\"? It has ")
                        }
                        _ => "; it has ".to_owned(),
                    };
                    let elements = if n == 1 { "element" } else { "elements" };
                    let names = if names.is_empty() {
                        String::new()
                    } else {
                        format!(", named {}", quoted_list(&names, "\""))
                    };
                    Err(format!("the list has no element `{segment}`{hint}{n} {elements}{names}"))
                }
            }
        }
        _ => Err(format!("`{segment}` cannot be set: the key before it holds a value, not a table")),
    }
}
