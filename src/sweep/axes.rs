//! Axes of a study: lists, ranges or samples of values, which are combined or zipped.

use std::collections::BTreeSet;

use crate::scene::Diagnostic;
use crate::scene::document::{Document, TomlNode, TomlValue, key_segments};
use crate::sweep::range;
use crate::sweep::spec::{AxisKeys, SampleKeys, StudyFile};

/// Maximum number of runs of a study.
pub(super) const MOST_RUNS: usize = 10_000;

/// An axis: keys of the scene, and the values that they take together.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Name in tables and plots.
    pub name: String,
    /// Keys of the scene.
    pub keys: Vec<String>,
    pub(super) locations: Vec<KeyLocation>,
    /// Values of the axis; each contains one node per key.
    pub values: Vec<Vec<TomlNode>>,
    /// Whether the values are a sample.
    pub is_sample: bool,
}

#[derive(Debug, Clone)]
pub(super) struct KeyLocation {
    axis: usize,
    pub name: String,
    key: usize,
    /// Number of keys of the axis in the study file, before axes are merged.
    pub of: usize,
    source: AxisKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AxisKind {
    Values,
    Range,
    Sample,
}

const SAMPLE: &str = "sample";

impl Axis {
    /// Label of a value for the user; for a sample, the number of the point, from 1.
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

    /// Numeric value at the index `value`. `None` if the value is not a number, or if the axis has several keys or is a sample.
    pub fn number(&self, value: usize) -> Option<f64> {
        (self.keys.len() == 1 && !self.is_sample).then(|| self.value_of_key(value, 0)).flatten()
    }

    pub(super) fn value_of_key(&self, value: usize, key: usize) -> Option<f64> {
        match self.values.get(value)?.get(key)?.value {
            TomlValue::Integer(number) => Some(number as f64),
            TomlValue::Float(number) => Some(number),
            _ => None,
        }
    }

    /// Whether the axis has one key, is not a sample, and has only numbers as values.
    pub fn is_numeric(&self) -> bool {
        (0..self.values.len()).all(|value| self.number(value).is_some())
    }

    pub(super) fn place_of_key(&self, k: usize) -> String {
        let KeyLocation { axis, key, .. } = &self.locations[k];
        format!("axes.{axis}.keys.{key}")
    }

    pub(super) fn place_of_value(&self, k: usize, value: usize) -> String {
        match &self.locations[k] {
            KeyLocation { axis, source: AxisKind::Range, .. } => format!("axes.{axis}.range"),
            KeyLocation { axis, source: AxisKind::Sample, .. } => format!("axes.{axis}.sample"),
            KeyLocation { axis, of: 1, .. } => format!("axes.{axis}.values.{value}"),
            KeyLocation { axis, key, .. } => format!("axes.{axis}.values.{value}.{key}"),
        }
    }
}

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
            // The values are drawn later, when all sampled axes are known.
            let written =
                KeyLocation { axis: i, name: String::new(), key: 0, of: 1, source: AxisKind::Sample };
            let (name, keys) = (own.name.clone(), own.keys.clone());
            axes.push(Axis { name, keys, locations: vec![written], values: Vec::new(), is_sample: true });
            continue;
        }
        // An axis with wrong values is kept without values, because `require` may use its name.
        let values = match (list, &own.range) {
            (Some(_), Some(_)) => {
                wrong(
                    "range".into(),
                    "the axis has both `values` and a `range`".into(),
                    "remove one of them",
                );
                Vec::new()
            }
            (None, None) => {
                wrong(
                    "keys".into(),
                    "the axis has no values".into(),
                    "give `values`, a `range` or a `sample`",
                );
                Vec::new()
            }
            (Some(list), None) => listed(own, list, &mut wrong),
            (None, Some(_)) if own.keys.len() > 1 => {
                let mend = "give each key an axis of its own with the same `zip`";
                wrong("range".into(), format!("the axis has one `range` for {} keys", own.keys.len()), mend);
                Vec::new()
            }
            (None, Some(range)) => {
                match range::values(range, document, &format!("axes.{i}.range"), MOST_RUNS) {
                    Ok(nodes) => nodes.into_iter().map(|node| vec![node]).collect(),
                    Err(mistake) => {
                        mistakes.push(*mistake);
                        Vec::new()
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

fn sampled(own: &AxisKeys, list: Option<&TomlNode>, wrong: &mut impl FnMut(String, String, &str)) {
    if list.is_some() || own.range.is_some() {
        let other = if list.is_some() { "values" } else { "range" };
        wrong("sample".into(), format!("the axis has both `{other}` and a `sample`"), "remove one of them");
    }
    if !own.zip.is_empty() {
        let message = "sampled axes always vary together, and cannot be zipped with other axes".to_owned();
        wrong("zip".into(), message, "remove `zip`");
    }
    if own.keys.len() > 1 {
        let message = format!("the axis has one `sample` for {} keys", own.keys.len());
        wrong("sample".into(), message, "give each key an axis of its own with a `sample`");
    }
}

fn draw(document: &Document, keys: &StudyFile, axes: &mut [Axis], mistakes: &mut Vec<Diagnostic>) {
    // The schema check reports counts out of bounds.
    let allowed = |spec: &SampleKeys| (1..=MOST_RUNS).contains(&spec.count);
    if keys.sample.is_some_and(|spec| !allowed(&spec)) {
        return;
    }
    let mut sampled: Vec<&mut Axis> = axes.iter_mut().filter(|axis| axis.is_sample).collect();
    let spec = match (keys.sample, sampled.first()) {
        (None, None) => return,
        (Some(spec), Some(_)) => spec,
        (Some(_), None) => {
            let mistake = Diagnostic::at(
                document,
                SAMPLE,
                "the study has a table `[sample]`, but no axis has a `sample`",
            );
            mistakes
                .push(mistake.help("give axes a `sample = { from = .., to = .. }`, or remove `[sample]`"));
            return;
        }
        (None, Some(axis)) => {
            let place = axis.place_of_value(0, 0);
            let mistake = Diagnostic::at(
                document,
                &place,
                "an axis has a `sample`, but the study has no table `[sample]`",
            );
            mistakes.push(mistake.help("add `[sample]` with `count`, and optionally `method` and `seed`"));
            return;
        }
    };
    if let Some(other) = keys.axes.iter().position(|axis| axis.zip == SAMPLE) {
        let mistake = Diagnostic::at(
            document,
            &format!("axes.{other}.zip"),
            "the name \"sample\" is reserved for sampled axes",
        );
        mistakes.push(mistake.help("use another word"));
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

/// Reports keys that are invalid, that vary twice, or that the option `--set` fixes.
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
            (
                format!("`{key}` varies in the study, but --set gives it a fixed value"),
                "remove the option or the axis",
            )
        } else {
            continue;
        };
        mistakes.push(Diagnostic::at(document, &format!("axes.{i}.keys.{k}"), message).help(mend));
    }
}

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
                let message = format!("{} is given for {n} keys", item.describe());
                wrong(format!("values.{v}"), message, "give a list with one value for each key");
                continue;
            }
        };
        let is_new = known.insert(value.iter().map(TomlNode::to_toml).collect::<Vec<_>>());
        if !is_new && axis.zip.is_empty() {
            let message = format!("the value {} appears twice", item.to_toml());
            wrong(format!("values.{v}"), message, "give each value once");
        }
        values.push(value);
    }
    values
}

/// Names unnamed axes by the last segment of their first key, without list indices. If another axis has this name, the
/// name is the whole key.
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

/// Merges axes with the same `zip` into one axis, at the position of the first axis with this `zip`. Likewise merges
/// all sampled axes.
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
        if found.min(wanted) == 0 {
            // Wrong values are reported elsewhere.
            first.values.clear();
        } else if found != wanted {
            let message = format!("`{}` has {found} values, `{}` has {wanted}", axis.name, first.name);
            let mend = format!("axes with zip = \"{zip}\" need equal numbers of values");
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
            let message = format!("the zipped axes \"{zip}\" have the values {} twice", axis.label(v));
            let place = axis.place_of_value(0, v);
            mistakes
                .push(Diagnostic::at(document, &place, message).help("give each combination of values once"));
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
            let message = format!("two axes are named \"{}\"", axis.name);
            mistakes.push(Diagnostic::at(document, &place, message).help("give each a `name` of its own"));
        }
    }
    axes
}

#[cfg(test)]
impl Axis {
    /// An axis of numbers for one key.
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
