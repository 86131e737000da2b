//! Reads a study file, and collects all errors of the file and of the scenes of its runs.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::Error;
use crate::evolution::step::StepKind;
use crate::linalg::memory::MemoryLimit;
use crate::output::summary::Units;
use crate::scene::document::Document;
use crate::scene::plan::Plan;
use crate::scene::schema::json_schema_of;
use crate::scene::{self, Diagnostic, DiagnosticKind, Diagnostics, MeshCache, parse, schema_check};
use crate::sweep::axes::{Axis, MOST_RUNS, axes};
use crate::sweep::collect::CollectedQuantity;
use crate::sweep::require::{Requirement, combinations};
use crate::sweep::scenes::SceneReader;
use crate::sweep::spec::StudyFile;

/// Maximum number of combinations, including those that `require` omits.
const MOST_COMBINATIONS: usize = 1_000_000;
/// Largest length of a folder name to which no run number is appended, bytes.
const LONGEST: usize = 80;

/// A run of the study.
#[derive(Debug, Clone)]
pub struct RunSpec {
    /// Index of the value on each axis.
    pub choice: Vec<usize>,
    /// Overrides of the scene, `key.path=value`.
    pub overrides: Vec<String>,
    /// Name of the folder.
    pub folder: String,
    /// Memory limit of the run. It does not depend on the number of parallel runs.
    pub memory: MemoryLimit,
}

/// A valid study.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// The study file.
    pub document: Document,
    /// Title.
    pub title: String,
    /// Path of the scene file.
    pub scene: PathBuf,
    /// Units of the scene.
    pub units: Units,
    /// The axes.
    pub axes: Vec<Axis>,
    /// Quantities collected at the end of a step of each run.
    pub collect: Vec<CollectedQuantity>,
    /// Quantities collected from all entries of a step.
    pub curves: Vec<CollectedQuantity>,
    /// Number of combinations that `require` omits.
    pub left_out: usize,
    /// Notes on the study file for the user.
    pub notes: Vec<String>,
    /// The runs: all combinations that `require` does not omit, with the last axis varying fastest.
    pub runs: Vec<RunSpec>,
    /// Kinds of the steps with wear jumps, by step name. They determine label and scale of the abscissa of curves.
    pub step_kinds: BTreeMap<String, StepKind>,
    /// The plan of the first run.
    pub first: Plan,
    /// Cache of the meshes of all scenes.
    pub meshes: Arc<MeshCache>,
}

impl Sweep {
    /// The plan of a run.
    ///
    /// # Errors
    /// If the scene, or a file that it names, became invalid after the study was read (kind `Input`).
    pub fn plan(&self, number: usize) -> Result<Plan, Error> {
        let run = &self.runs[number];
        let read = scene::read_with_meshes(&self.scene, &run.overrides, &self.meshes);
        let mut plan = read.map_err(|mistakes| mistakes.to_error())?;
        plan.memory_limit = run.memory;
        Ok(plan)
    }

    /// Sets the memory limit of all runs, if given.
    pub fn set_memory_limit(&mut self, limit: Option<MemoryLimit>) {
        let Some(limit) = limit else { return };
        self.runs.iter_mut().for_each(|run| run.memory = limit);
        self.first.memory_limit = limit;
    }
}

/// Reads the study file at `path`. `overrides` apply to the scene of every run.
///
/// # Errors
/// Returns the errors of the study file. If only paths of `output.collect` and `output.curves` are wrong, or nothing,
/// also returns the errors of the scene of each run. The list has one item per file.
pub fn read(path: &Path, overrides: &[String]) -> Result<Sweep, Vec<Diagnostics>> {
    let (document, keys, mut mistakes) = read_keys(path)?;
    let axes = axes(&document, &keys, overrides, &mut mistakes);
    let choices = choices(&document, &keys, &axes, &mut mistakes);
    let mut output_mistakes = Vec::new();
    let collect = quantities(&document, &keys.output.collect, "collect", &mut output_mistakes);
    let curves = quantities(&document, &keys.output.curves, "curves", &mut output_mistakes);
    let here = document.folder == Path::new(".");
    let scene = if here { PathBuf::from(&keys.study.scene) } else { document.folder.join(&keys.study.scene) };
    if !scene.is_file() {
        let message = format!("there is no scene file {}", scene.display());
        let mend = "give the path of a scene (.toml), relative to the study file";
        mistakes.push(Diagnostic::at(&document, "study.scene", message).label("no such file").help(mend));
    }
    if !mistakes.is_empty() {
        mistakes.extend(output_mistakes);
        return Err(vec![Diagnostics::new(&document, mistakes)]);
    }
    let all: usize = axes.iter().map(|axis| axis.values.len()).product();
    let left_out = all - choices.len();
    let meshes = Arc::new(MeshCache::default());
    let mut reader = SceneReader::new(&document, &scene, &meshes);
    let runs = runs(&axes, choices, overrides, |choice, own| reader.run(&axes, choice, own));
    reader.check_names([(&collect, "collect"), (&curves, "curves")]);
    let scene_diagnostics = reader.scene_diagnostics();
    let SceneReader { study_diagnostics: mut mistakes, first, step_kinds, .. } = reader;
    mistakes.extend(output_mistakes);
    let (Some(first), true) = (first, mistakes.is_empty() && scene_diagnostics.is_none()) else {
        let study = (!mistakes.is_empty()).then(|| Diagnostics::new(&document, mistakes));
        return Err(study.into_iter().chain(scene_diagnostics).collect());
    };
    let collect = if collect.is_empty() { default_quantities(&first) } else { collect };
    let title = if keys.study.title.is_empty() { first.title.clone() } else { keys.study.title };
    let units = Units { length: first.units.length.clone(), force: first.units.force.clone() };
    let notes = match keys.study.symmetry {
        None => Vec::new(),
        Some(_) => vec!["note: study.symmetry has no effect: every run is computed".to_owned()],
    };
    Ok(Sweep {
        document,
        title,
        scene,
        units,
        axes,
        collect,
        curves,
        left_out,
        notes,
        runs,
        step_kinds,
        first,
        meshes,
    })
}

/// Keys of a study file, with the errors that its schema finds.
fn read_keys(path: &Path) -> Result<(Document, StudyFile, Vec<Diagnostic>), Vec<Diagnostics>> {
    let document = parse::read_document(path, &[]).map_err(|mistakes| vec![mistakes])?;
    if document.get("study").is_none() && document.get("body1").is_some() {
        let mistake = Diagnostic::at(&document, "body1", "this is a scene, not a study").label("a scene");
        let mend = format!(
            "run it with `orthowear run {}`, or write a study that uses it (docs/study.md)",
            path.display()
        );
        return Err(vec![Diagnostics::new(&document, vec![mistake.help(mend)])]);
    }
    let (mut mistakes, unknown) =
        schema_check::check_against_schema(&document, &json_schema_of::<StudyFile>(), "the study");
    let no_study = DiagnosticKind::MissingKey("study".to_owned());
    for mistake in mistakes.iter_mut().filter(|mistake| mistake.key.is_empty() && mistake.kind == no_study) {
        mistake.message = "the study file has no table [study]".to_owned();
        mistake.help = "add [study] with scene = \"FILE.toml\"".to_owned();
    }
    let mut known = document.clone();
    unknown.iter().for_each(|key| known.remove(key));
    let keys: StudyFile = match serde_path_to_error::deserialize(known.root.to_serde_json()) {
        Ok(keys) => keys,
        Err(error) => {
            if mistakes.is_empty() {
                let place = error.path().to_string();
                mistakes.push(Diagnostic::at(&document, &place, error.inner().to_string()));
            }
            return Err(vec![Diagnostics::new(&document, mistakes)]);
        }
    };
    Ok((document, keys, mistakes))
}

fn quantities(
    document: &Document,
    list: &[String],
    key: &str,
    mistakes: &mut Vec<Diagnostic>,
) -> Vec<CollectedQuantity> {
    let parse = |(i, path): (usize, &String)| match CollectedQuantity::parse(path) {
        Ok(quantity) => Some(quantity),
        Err((message, mend)) => {
            let place = format!("output.{key}.{i}");
            mistakes.push(Diagnostic::at(document, &place, message).help(mend));
            None
        }
    };
    list.iter().enumerate().filter_map(parse).collect()
}

fn choices(
    document: &Document,
    keys: &StudyFile,
    axes: &[Axis],
    mistakes: &mut Vec<Diagnostic>,
) -> Vec<Vec<usize>> {
    let mut requirements = Vec::new();
    for (i, text) in keys.study.require.iter().enumerate() {
        match Requirement::parse(text, axes) {
            Ok(requirement) => requirements.push(requirement),
            Err((message, mend)) => {
                mistakes.push(Diagnostic::at(document, &format!("study.require.{i}"), message).help(mend));
            }
        }
    }
    let count = axes.iter().fold(1_usize, |n, axis| n.saturating_mul(axis.values.len()));
    let (most, what) = match requirements.is_empty() {
        true => (MOST_RUNS, "runs"),
        false => (MOST_COMBINATIONS, "combinations"),
    };
    let mut refuse = |place: &str, message: String, mend: &str| {
        mistakes.push(Diagnostic::at(document, place, message).help(mend));
        Vec::new()
    };
    if count > most {
        let message = format!("the axes give {count} {what}; at most {most} are allowed");
        return refuse("axes", message, "give fewer values, or split the study");
    }
    let choices = combinations(axes, &requirements);
    if choices.is_empty() && count > 0 {
        let message = format!("none of the {count} combinations meets all conditions of `require`");
        return refuse("study.require", message, "relax the conditions, or give the axes other values");
    }
    if choices.len() > MOST_RUNS {
        let message = format!("the axes give {} runs; at most {MOST_RUNS} are allowed", choices.len());
        return refuse("axes", message, "give fewer values, or split the study");
    }
    choices
}

/// Runs of the combinations `choices` with valid scenes. `read` reads the scene of a run and returns its memory limit, or `None`
/// for an invalid scene.
fn runs(
    axes: &[Axis],
    choices: Vec<Vec<usize>>,
    overrides: &[String],
    mut read: impl FnMut(&[usize], &[String]) -> Option<MemoryLimit>,
) -> Vec<RunSpec> {
    let mut runs: Vec<RunSpec> = Vec::new();
    let mut folders = BTreeSet::new();
    for (number, choice) in choices.into_iter().enumerate() {
        let mut own = overrides.to_vec();
        for (axis, &value) in axes.iter().zip(&choice) {
            let lines = axis.keys.iter().zip(&axis.values[value]);
            own.extend(lines.map(|(key, node)| format!("{key}={}", node.to_toml())));
        }
        let folder = unique_folder_name(folder_name(axes, &choice), number, &folders);
        folders.insert(folder.to_lowercase());
        let Some(memory) = read(&choice, &own) else { continue };
        runs.push(RunSpec { choice, overrides: own, folder, memory });
    }
    runs
}

/// Folder name that is not in `taken` (lower case, for file systems that ignore case). A name that is too long or taken gets the
/// run's number.
fn unique_folder_name(name: String, number: usize, taken: &BTreeSet<String>) -> String {
    if name.len() <= LONGEST && !taken.contains(&name.to_lowercase()) {
        return name;
    }
    // Byte indices are valid, because the name is ASCII.
    let mut short = format!("{}-{}", &name[..name.len().min(LONGEST)], number + 1);
    while taken.contains(&short.to_lowercase()) {
        short.push('-');
    }
    short
}

/// Folder name from axis names and values, in characters that every file system allows: `tilt-30_angle-45`.
fn folder_name(axes: &[Axis], choice: &[usize]) -> String {
    let plain = |text: String| -> String {
        text.chars().map(|c| if c.is_ascii_alphanumeric() || "+-._".contains(c) { c } else { '-' }).collect()
    };
    let part = |(axis, value): (&Axis, &usize)| plain(format!("{}-{}", axis.name, axis.label(*value)));
    axes.iter().zip(choice).map(part).collect::<Vec<_>>().join("_")
}

/// Quantities collected if the study names none.
fn default_quantities(plan: &Plan) -> Vec<CollectedQuantity> {
    let Some(last) = plan.steps.last() else { return Vec::new() };
    let names = [
        "normal_force",
        "tangential_force.0",
        "tangential_force.1",
        "contact_area",
        "peak_pressure",
        "worn_volume",
    ];
    let plain = last.name.chars().all(|c| c.is_alphanumeric() || "-_".contains(c));
    let step = if plain { last.name.clone() } else { format!("\"{}\"", last.name) };
    let quantity = |name: &&str| CollectedQuantity::parse(&format!("{step}.{name}")).ok();
    names.iter().filter_map(quantity).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the folders of runs differ also on a file system that ignores case.
    #[test]
    fn folders_differ_by_more_than_case() {
        let taken = BTreeSet::from(["material-a".to_owned()]);
        assert_eq!(unique_folder_name("material-A".to_owned(), 1, &taken), "material-A-2");
        assert_eq!(unique_folder_name("material-b".to_owned(), 1, &taken), "material-b");
    }
}
