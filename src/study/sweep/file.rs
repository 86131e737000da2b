//! Reads a study file: its axes, its runs, and everything wrong with it or with the scenes it makes.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::collect::Quantity;
use super::keys::StudyFile;
use super::scenes::Reader;
use crate::linalg::memory::MemoryLimit;
use crate::results::summary::Units;
use crate::scene::document::{Document, Node, Value, segments};
use crate::scene::plan::Plan;
use crate::scene::schema::json_schema_of;
use crate::scene::{Mistake, Mistakes, check, parse};

/// Most runs of a study.
const MOST_RUNS: usize = 10_000;
/// Longest name of a folder.
const LONGEST: usize = 80;

/// An axis: keys of the scene and the values that they take together.
#[derive(Debug, Clone)]
pub struct Axis {
    /// Name in tables and plots.
    pub name: String,
    /// Keys of the scene.
    pub keys: Vec<String>,
    /// By value, one node per key.
    pub values: Vec<Vec<Node>>,
}

impl Axis {
    /// A value as a person reads it.
    pub fn label(&self, value: usize) -> String {
        let word = |node: &Node| match &node.value {
            Value::String(text) => text.clone(),
            _ => node.to_toml(),
        };
        self.values[value].iter().map(word).collect::<Vec<_>>().join(", ")
    }

    /// A value as a number, where the axis sets one key to numbers.
    pub fn number(&self, value: usize) -> Option<f64> {
        match self.values[value].as_slice() {
            [Node { value: Value::Integer(number), .. }] => Some(*number as f64),
            [Node { value: Value::Float(number), .. }] => Some(*number),
            _ => None,
        }
    }

    /// Whether all its values are numbers.
    pub fn is_numeric(&self) -> bool {
        (0..self.values.len()).all(|value| self.number(value).is_some())
    }
}

/// A run of the study.
#[derive(Debug, Clone)]
pub struct RunSpec {
    /// By axis, which of its values.
    pub choice: Vec<usize>,
    /// What is laid over the scene, `key.path=value`.
    pub overrides: Vec<String>,
    /// Name of its folder.
    pub folder: String,
    /// Memory that was free when the study began, or that the scene allows: the same for all runs, however many go side by side.
    pub memory: MemoryLimit,
}

/// A study that can be run.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Its file.
    pub document: Document,
    /// Title.
    pub title: String,
    /// The scene's file.
    pub scene: PathBuf,
    /// Units of the scene.
    pub units: Units,
    /// The axes.
    pub axes: Vec<Axis>,
    /// What is collected at the end of each run.
    pub collect: Vec<Quantity>,
    /// What is collected of all entries.
    pub curves: Vec<Quantity>,
    /// The runs: all combinations, the last axis fastest.
    pub runs: Vec<RunSpec>,
    /// What steps that wear in jumps have along their curves, by name: "cycles" or "distance slid".
    pub jumping: BTreeMap<String, &'static str>,
    /// The plan of the first run.
    pub first: Plan,
}

/// The study of the file at `path`; `overrides` are laid over the scene of every run.
///
/// # Errors
/// Everything wrong with the study file and with its scene under each combination of values, by file.
pub fn read(path: &Path, overrides: &[String]) -> Result<Sweep, Vec<Mistakes>> {
    let document = parse::read_document(path, &[]).map_err(|mistakes| vec![of_study(mistakes)])?;
    if document.get("study").is_none() && document.get("body1").is_some() {
        let mistake = Mistake::at(&document, "body1", "this is a scene, not a study").label("a scene");
        let mend =
            format!("run it with `orthowear run {}`, or write a study of it (docs/study.md)", path.display());
        return Err(vec![Mistakes::new(&document, vec![mistake.mend(mend)])]);
    }
    let (mut mistakes, unknown) = check::check(&document, &json_schema_of::<StudyFile>());
    let mut known = document.clone();
    unknown.iter().for_each(|key| known.remove(key));
    let keys: StudyFile = match serde_path_to_error::deserialize(known.root.to_json()) {
        Ok(keys) => keys,
        Err(error) => {
            if mistakes.is_empty() {
                let place = error.path().to_string();
                mistakes.push(Mistake::at(&document, &place, error.inner().to_string()));
            }
            return Err(vec![of_study(Mistakes::new(&document, mistakes))]);
        }
    };
    let axes = axes(&document, &keys, overrides, &mut mistakes);
    let mut quantities = |list: &[String], key: &str| -> Vec<Quantity> {
        let parse = |(i, path): (usize, &String)| match Quantity::parse(path) {
            Ok(quantity) => Some(quantity),
            Err((message, mend)) => {
                mistakes.push(Mistake::at(&document, &format!("output.{key}.{i}"), message).mend(mend));
                None
            }
        };
        list.iter().enumerate().filter_map(parse).collect()
    };
    let collect = quantities(&keys.output.collect, "collect");
    let curves = quantities(&keys.output.curves, "curves");
    let here = document.folder == Path::new(".");
    let scene = if here { PathBuf::from(&keys.study.scene) } else { document.folder.join(&keys.study.scene) };
    if !scene.is_file() {
        let message = format!("there is no scene file {}", scene.display());
        let mend = "give the path of a scene (.toml), relative to the study file";
        mistakes.push(Mistake::at(&document, "study.scene", message).label("no such file").mend(mend));
    }
    if !mistakes.is_empty() {
        return Err(vec![of_study(Mistakes::new(&document, mistakes))]);
    }
    let mut reader = Reader::new(&document, &scene);
    let runs = runs(&axes, overrides, |choice, own| reader.run(&axes, choice, own));
    reader.check_steps([(&collect, "collect"), (&curves, "curves")]);
    let Reader { of_study: mistakes, of_scene, first, jumping, .. } = reader;
    let (Some(first), true) = (first, mistakes.is_empty() && of_scene.is_none()) else {
        let study = (!mistakes.is_empty()).then(|| Mistakes::new(&document, mistakes));
        return Err(study.map(of_study).into_iter().chain(of_scene).collect());
    };
    let collect = if collect.is_empty() { usual(&first) } else { collect };
    let title = if keys.study.title.is_empty() { first.title.clone() } else { keys.study.title };
    let units = Units { length: first.units.length.clone(), force: first.units.force.clone() };
    Ok(Sweep { document, title, scene, units, axes, collect, curves, runs, jumping, first })
}

/// Mistakes of a study file, where the words are those of a scene.
fn of_study(mut mistakes: Mistakes) -> Mistakes {
    for mistake in &mut mistakes.list {
        for words in ["the scene lacks", "the scene has no key"] {
            if let Some(rest) = mistake.message.strip_prefix(words) {
                mistake.message = format!("{}{rest}", words.replace("scene", "study"));
            }
        }
    }
    mistakes
}

/// The axes of a study; what is wrong with them is added to `mistakes`.
fn axes(
    document: &Document,
    keys: &StudyFile,
    overrides: &[String],
    mistakes: &mut Vec<Mistake>,
) -> Vec<Axis> {
    let mut taken: BTreeSet<String> = BTreeSet::new();
    let by_option: BTreeSet<&str> =
        overrides.iter().filter_map(|line| line.split_once('=')).map(|(key, _)| key.trim()).collect();
    let mut axes: Vec<Axis> = Vec::new();
    for (i, axis) in keys.axes.iter().enumerate() {
        let mut wrong = |key: String, message: String, mend: &str| {
            mistakes.push(Mistake::at(document, &format!("axes.{i}.{key}"), message).mend(mend));
        };
        for (k, key) in axis.keys.iter().enumerate() {
            if key.contains('=') || segments(key).next().is_none() {
                wrong(format!("keys.{k}"), format!("`{key}` is not a key"), "as in \"body1.fibre.tilt\"");
            } else if !taken.insert(key.clone()) {
                wrong(format!("keys.{k}"), format!("`{key}` is varied twice"), "name each key once");
            } else if by_option.contains(key.as_str()) {
                let message = format!("`{key}` varies, but --set gives it one value");
                wrong(format!("keys.{k}"), message, "leave out the option or the axis");
            }
        }
        let Some(Node { value: Value::Array(items), .. }) = document.get(&format!("axes.{i}.values")) else {
            continue;
        };
        let mut values: Vec<Vec<Node>> = Vec::new();
        for (v, item) in items.iter().enumerate() {
            let n = axis.keys.len();
            let value = match &item.value {
                _ if n == 1 => vec![item.clone()],
                Value::Array(parts) if parts.len() == n => parts.clone(),
                _ => {
                    let message = format!("{} for {n} keys", item.describe());
                    wrong(format!("values.{v}"), message, "give a list with one value for each key");
                    continue;
                }
            };
            let text = |value: &[Node]| value.iter().map(Node::to_toml).collect::<Vec<_>>();
            if values.iter().any(|known| text(known) == text(&value)) {
                let message = format!("the value {} is there twice", item.to_toml());
                wrong(format!("values.{v}"), message, "give each value once");
            }
            values.push(value);
        }
        axes.push(Axis { name: axis.name.clone(), keys: axis.keys.clone(), values });
    }
    name(&mut axes);
    let count = axes.iter().fold(1_usize, |n, axis| n.saturating_mul(axis.values.len()));
    if count > MOST_RUNS {
        let message = format!("the axes make {count} runs (at most {MOST_RUNS})");
        mistakes.push(Mistake::at(document, "axes", message).mend("give fewer values, or split the study"));
    }
    axes
}

/// Names the axes that have no name: by the last part of their first key, or by all of it where that is taken.
fn name(axes: &mut [Axis]) {
    for i in 0..axes.len() {
        if !axes[i].name.is_empty() {
            continue;
        }
        let Some(key) = axes[i].keys.first().cloned() else { continue };
        let short = segments(&key).filter(|part| part.parse::<usize>().is_err()).last().unwrap_or(&key);
        let is_taken = axes.iter().any(|axis| axis.name == short);
        axes[i].name = if is_taken { key } else { short.to_owned() };
    }
}

/// All combinations, the last axis fastest; `memory` hears of each and says what it may take.
fn runs(
    axes: &[Axis],
    overrides: &[String],
    mut memory: impl FnMut(&[usize], &[String]) -> Option<MemoryLimit>,
) -> Vec<RunSpec> {
    let count: usize = axes.iter().map(|axis| axis.values.len()).product();
    let mut runs: Vec<RunSpec> = Vec::new();
    let mut folders = BTreeSet::new();
    for number in 0..count {
        let mut rest = number;
        let mut choice = vec![0; axes.len()];
        for (i, axis) in axes.iter().enumerate().rev() {
            (choice[i], rest) = (rest % axis.values.len(), rest / axis.values.len());
        }
        let mut own = overrides.to_vec();
        for (axis, &value) in axes.iter().zip(&choice) {
            let lines = axis.keys.iter().zip(&axis.values[value]);
            own.extend(lines.map(|(key, node)| format!("{key}={}", node.to_toml())));
        }
        let mut folder = folder(axes, &choice);
        if folder.len() > LONGEST || folders.contains(&folder) {
            folder = format!("{}-{}", &folder[..folder.len().min(LONGEST)], number + 1);
        }
        folders.insert(folder.clone());
        let Some(memory) = memory(&choice, &own) else { continue };
        runs.push(RunSpec { choice, overrides: own, folder, memory });
    }
    runs
}

/// Names of the axes with their values, as far as every file system takes them: `tilt-30_angle-45`.
fn folder(axes: &[Axis], choice: &[usize]) -> String {
    let plain = |text: String| -> String {
        text.chars().map(|c| if c.is_ascii_alphanumeric() || "+-._".contains(c) { c } else { '-' }).collect()
    };
    let part = |(axis, value): (&Axis, &usize)| plain(format!("{}-{}", axis.name, axis.label(*value)));
    axes.iter().zip(choice).map(part).collect::<Vec<_>>().join("_")
}

/// Quantities of the last step, where the study names none.
fn usual(plan: &Plan) -> Vec<Quantity> {
    let Some(last) = plan.steps.last() else { return Vec::new() };
    let names = [
        "normal_force",
        "tangential_force.0",
        "tangential_force.1",
        "contact_area",
        "peak_pressure",
        "worn_volume",
    ];
    let quantity = |name: &&str| Quantity::parse(&format!("\"{}\".{name}", last.name)).ok();
    names.iter().filter_map(quantity).collect()
}
