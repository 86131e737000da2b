//! The axes of a study: lists or ranges of values, crossed or zipped.

use std::collections::BTreeSet;

use crate::scene::Diagnostic;
use crate::scene::document::{Document, TomlNode, TomlValue, key_segments};
use crate::sweep::range;
use crate::sweep::read::MOST_RUNS;
use crate::sweep::spec::{AxisKeys, SampleKeys, StudyFile};

/// An axis: keys of the scene and the values that they take together.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Name in tables and plots.
    pub name: String,
    /// Keys of the scene.
    pub keys: Vec<String>,
    /// By key, where it stands in the file.
    pub(super) locations: Vec<KeyLocation>,
    /// By value, one node per key.
    pub values: Vec<Vec<TomlNode>>,
    /// Whether its values are a sample.
    pub is_sample: bool,
}

/// Where the study file has a key and its values.
#[derive(Debug, Clone)]
pub(super) struct KeyLocation {
    /// Number of the axis.
    axis: usize,
    /// Name of that axis.
    pub name: String,
    /// Number of the key in it.
    key: usize,
    /// Number of its keys.
    pub of: usize,
    source: AxisKind,
}

/// Which key gives the values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AxisKind {
    Values,
    Range,
    Sample,
}

/// Name of the axis of all that are sampled.
const SAMPLE: &str = "sample";

impl Axis {
    /// A value as a person reads it.
    pub fn label(&self, value: usize) -> String {
        if self.is_sample {
            return format!("{}", value + 1);
        }
        let word = |node: &TomlNode| match &node.value {
            TomlValue::String(text) => text.clone(),
            _ => node.to_toml(),
        };
        self.values[value].iter().map(word).collect::<Vec<_>>().join(", ")
    }

    /// A value as a number, where the axis sets one key to numbers.
    pub fn number(&self, value: usize) -> Option<f64> {
        (self.keys.len() == 1 && !self.is_sample).then(|| self.value_of_key(value, 0)).flatten()
    }

    /// The number that a value gives to one of the keys.
    pub(super) fn value_of_key(&self, value: usize, key: usize) -> Option<f64> {
        match self.values.get(value)?.get(key)?.value {
            TomlValue::Integer(number) => Some(number as f64),
            TomlValue::Float(number) => Some(number),
            _ => None,
        }
    }

    /// Whether all its values are numbers.
    pub fn is_numeric(&self) -> bool {
        (0..self.values.len()).all(|value| self.number(value).is_some())
    }

    /// Where the study file has key `k`.
    pub(super) fn place_of_key(&self, k: usize) -> String {
        let KeyLocation { axis, key, .. } = &self.locations[k];
        format!("axes.{axis}.keys.{key}")
    }

    /// Where the study file has what `value` gives to key `k`.
    pub(super) fn place_of_value(&self, k: usize, value: usize) -> String {
        match &self.locations[k] {
            KeyLocation { axis, source: AxisKind::Range, .. } => format!("axes.{axis}.range"),
            KeyLocation { axis, source: AxisKind::Sample, .. } => format!("axes.{axis}.sample"),
            KeyLocation { axis, of: 1, .. } => format!("axes.{axis}.values.{value}"),
            KeyLocation { axis, key, .. } => format!("axes.{axis}.values.{value}.{key}"),
        }
    }
}

/// The axes of a study; what is wrong with them is added to `mistakes`.
pub(super) fn axes(
    document: &Document,
    keys: &StudyFile,
    overrides: &[String],
    mistakes: &mut Vec<Diagnostic>,
) -> Vec<Axis> {
    check_keys(document, keys, overrides, mistakes);
    let mut axes: Vec<Axis> = Vec::new();
    for (i, own) in keys.axes.iter().enumerate() {
        let mut wrong = |key: String, message: String, mend: &str| {
            mistakes.push(Diagnostic::at(document, &format!("axes.{i}.{key}"), message).help(mend));
        };
        let list = document.get(&format!("axes.{i}.values"));
        if own.sample.is_some() {
            sampled(own, list, &mut wrong);
            // Its values follow when all that are sampled are known.
            let written =
                KeyLocation { axis: i, name: String::new(), key: 0, of: 1, source: AxisKind::Sample };
            let (name, keys) = (own.name.clone(), own.keys.clone());
            axes.push(Axis { name, keys, locations: vec![written], values: Vec::new(), is_sample: true });
            continue;
        }
        let values = match (list, &own.range) {
            (Some(_), Some(_)) => {
                wrong("range".into(), "the axis has `values` and a `range`".into(), "leave out one of them");
                continue;
            }
            (None, None) => {
                wrong(
                    "keys".into(),
                    "the axis has no values".into(),
                    "give `values`, a `range` or a `sample`",
                );
                continue;
            }
            (Some(list), None) => listed(own, list, &mut wrong),
            (None, Some(_)) if own.keys.len() > 1 => {
                let mend = "give each key an axis of its own with the same `zip`";
                wrong("range".into(), format!("a range for {} keys", own.keys.len()), mend);
                continue;
            }
            (None, Some(range)) => {
                match range::values(range, document, &format!("axes.{i}.range"), MOST_RUNS) {
                    Ok(nodes) => nodes.into_iter().map(|node| vec![node]).collect(),
                    Err(mistake) => {
                        mistakes.push(*mistake);
                        continue;
                    }
                }
            }
        };
        let n = own.keys.len();
        let source = if own.range.is_some() { AxisKind::Range } else { AxisKind::Values };
        let written = |key| KeyLocation { axis: i, name: String::new(), key, of: n, source };
        let locations = (0..n).map(written).collect();
        let (name, keys) = (own.name.clone(), own.keys.clone());
        axes.push(Axis { name, keys, locations, values, is_sample: false });
    }
    draw(document, keys, &mut axes, mistakes);
    assign_names(&mut axes);
    merge_zipped(document, keys, axes, mistakes)
}

/// Says what is wrong with an axis that is sampled.
fn sampled(own: &AxisKeys, list: Option<&TomlNode>, wrong: &mut impl FnMut(String, String, &str)) {
    if list.is_some() || own.range.is_some() {
        let other = if list.is_some() { "values" } else { "range" };
        wrong("sample".into(), format!("the axis has `{other}` and a `sample`"), "leave out one of them");
    }
    if !own.zip.is_empty() {
        let message = "axes that are sampled go together, and with no others".to_owned();
        wrong("zip".into(), message, "leave out `zip`");
    }
    if own.keys.len() > 1 {
        let message = format!("a sample for {} keys", own.keys.len());
        wrong("sample".into(), message, "give each key an axis of its own with a `sample`");
    }
}

/// Draws the values of the axes that are sampled.
fn draw(document: &Document, keys: &StudyFile, axes: &mut [Axis], mistakes: &mut Vec<Diagnostic>) {
    // What is out of bounds has been told.
    let allowed = |spec: &SampleKeys| (1..=MOST_RUNS).contains(&spec.count);
    if keys.sample.is_some_and(|spec| !allowed(&spec)) {
        return;
    }
    let mut sampled: Vec<&mut Axis> = axes.iter_mut().filter(|axis| axis.is_sample).collect();
    let spec = match (keys.sample, sampled.first()) {
        (None, None) => return,
        (Some(spec), Some(_)) => spec,
        (Some(_), None) => {
            let mistake = Diagnostic::at(document, SAMPLE, "no axis is sampled");
            mistakes
                .push(mistake.help("give axes a `sample = { from = .., to = .. }`, or leave out `[sample]`"));
            return;
        }
        (None, Some(axis)) => {
            let place = axis.place_of_value(0, 0);
            let mistake = Diagnostic::at(document, &place, "the study does not say how it is sampled");
            mistakes.push(mistake.help("add `[sample]` with `count`, and `method` and `seed` if you like"));
            return;
        }
    };
    if let Some(other) = keys.axes.iter().position(|axis| axis.zip == SAMPLE) {
        let mistake = Diagnostic::at(document, &format!("axes.{other}.zip"), "\"sample\" is what is sampled");
        mistakes.push(mistake.help("take another word"));
    }
    let ranges: Vec<_> = sampled
        .iter()
        .filter_map(|axis| {
            Some((keys.axes[axis.locations[0].axis].sample.as_ref()?, axis.place_of_value(0, 0)))
        })
        .collect();
    match crate::sweep::sample::values(&spec, &ranges, document) {
        Ok(columns) => {
            for (axis, column) in sampled.iter_mut().zip(columns) {
                axis.values = column.into_iter().map(|node| vec![node]).collect();
            }
        }
        Err(wrong) => mistakes.extend(wrong),
    }
}

/// Keys that are none, that vary twice, or that an option sets.
fn check_keys(document: &Document, keys: &StudyFile, overrides: &[String], mistakes: &mut Vec<Diagnostic>) {
    let mut taken: BTreeSet<&str> = BTreeSet::new();
    let by_option: BTreeSet<&str> =
        overrides.iter().filter_map(|line| line.split_once('=')).map(|(key, _)| key.trim()).collect();
    let all =
        keys.axes.iter().enumerate().flat_map(|(i, axis)| axis.keys.iter().enumerate().map(move |k| (i, k)));
    for (i, (k, key)) in all {
        let (message, mend) = if key.contains('=') || key_segments(key).next().is_none() {
            (format!("`{key}` is not a valid key"), "as in \"body1.fibre.tilt\"")
        } else if !taken.insert(key) {
            (format!("`{key}` is varied twice"), "name each key once")
        } else if by_option.contains(key.as_str()) {
            (format!("`{key}` varies, but --set gives it one value"), "leave out the option or the axis")
        } else {
            continue;
        };
        mistakes.push(Diagnostic::at(document, &format!("axes.{i}.keys.{k}"), message).help(mend));
    }
}

/// The values of a list, one node for each key.
fn listed(
    axis: &AxisKeys,
    list: &TomlNode,
    wrong: &mut impl FnMut(String, String, &str),
) -> Vec<Vec<TomlNode>> {
    let TomlValue::Array(items) = &list.value else { return Vec::new() };
    let mut values: Vec<Vec<TomlNode>> = Vec::new();
    let mut known = BTreeSet::new();
    for (v, item) in items.iter().enumerate() {
        let n = axis.keys.len();
        let value = match &item.value {
            _ if n == 1 => vec![item.clone()],
            TomlValue::Array(parts) if parts.len() == n => parts.clone(),
            _ => {
                let message = format!("{} for {n} keys", item.describe());
                wrong(format!("values.{v}"), message, "give a list with one value for each key");
                continue;
            }
        };
        // Axes that are zipped may stay where they are from one run to the next.
        let is_new = known.insert(value.iter().map(TomlNode::to_toml).collect::<Vec<_>>());
        if !is_new && axis.zip.is_empty() {
            let message = format!("the value {} is there twice", item.to_toml());
            wrong(format!("values.{v}"), message, "give each value once");
        }
        values.push(value);
    }
    values
}

/// Names the axes that have no name: by the last part of their first key, or by all of it where that is taken.
fn assign_names(axes: &mut [Axis]) {
    for i in 0..axes.len() {
        if axes[i].name.is_empty() {
            let Some(key) = axes[i].keys.first().cloned() else { continue };
            let short = key_segments(&key)
                .filter(|part| part.parse::<usize>().is_err())
                .last()
                .unwrap_or((&key).into());
            let is_taken = axes.iter().any(|axis| axis.name == short);
            axes[i].name = if is_taken { key } else { short.into_owned() };
        }
        let name = axes[i].name.clone();
        axes[i].locations.iter_mut().for_each(|written| written.name.clone_from(&name));
    }
}

/// The axes with those that have the same `zip`, or are sampled, as one, where the first of them stands.
fn merge_zipped(
    document: &Document,
    keys: &StudyFile,
    axes: Vec<Axis>,
    mistakes: &mut Vec<Diagnostic>,
) -> Vec<Axis> {
    let mut together: Vec<(&str, Axis)> = Vec::new();
    for axis in axes {
        let Some(number) = axis.locations.first().map(|written| written.axis) else { continue };
        let zip = if axis.is_sample { SAMPLE } else { keys.axes[number].zip.as_str() };
        let Some((_, first)) = together.iter_mut().find(|(word, _)| !word.is_empty() && *word == zip) else {
            together.push((zip, axis));
            continue;
        };
        let (found, wanted) = (axis.values.len(), first.values.len());
        if found != wanted {
            let message = format!("`{}` has {found} values, `{}` has {wanted}", axis.name, first.name);
            let mend = format!("axes that are zipped as \"{zip}\" have as many values");
            mistakes.push(Diagnostic::at(document, &format!("axes.{number}.zip"), message).help(mend));
            continue;
        }
        zip.clone_into(&mut first.name);
        first.keys.extend(axis.keys);
        first.locations.extend(axis.locations);
        first.values.iter_mut().zip(axis.values).for_each(|(value, more)| value.extend(more));
    }
    for (zip, axis) in together.iter().filter(|(zip, axis)| !zip.is_empty() && !axis.is_sample) {
        let mut known = BTreeSet::new();
        let text = |value: &Vec<TomlNode>| value.iter().map(TomlNode::to_toml).collect::<Vec<_>>();
        if let Some(v) = axis.values.iter().position(|value| !known.insert(text(value))) {
            let message = format!("\"{zip}\" has the values {} twice", axis.label(v));
            let place = axis.place_of_value(0, v);
            mistakes.push(Diagnostic::at(document, &place, message).help("give each pair of values once"));
        }
    }
    let named = |(_, axis): (&str, Axis)| match axis.is_sample {
        true => Axis { name: SAMPLE.to_owned(), ..axis },
        false => axis,
    };
    let axes: Vec<Axis> = together.into_iter().map(named).collect();
    let mut names = BTreeSet::new();
    for axis in axes.iter().filter(|axis| !axis.name.is_empty()) {
        if !names.insert(axis.name.as_str()) {
            let place = format!("axes.{}.keys.0", axis.locations[0].axis);
            let message = format!("two axes are called \"{}\"", axis.name);
            mistakes.push(Diagnostic::at(document, &place, message).help("give each a `name` of its own"));
        }
    }
    axes
}

#[cfg(test)]
impl Axis {
    /// An axis of numbers.
    pub fn of_numbers(name: &str, key: &str, numbers: &[f64]) -> Self {
        let node = |&number: &f64| {
            let source = crate::scene::document::ValueSource::File(0..0);
            vec![TomlNode { source, value: TomlValue::Float(number) }]
        };
        let written = KeyLocation { axis: 0, name: name.to_owned(), key: 0, of: 1, source: AxisKind::Values };
        Self {
            name: name.to_owned(),
            keys: vec![key.to_owned()],
            locations: vec![written],
            values: numbers.iter().map(node).collect(),
            is_sample: false,
        }
    }
}
