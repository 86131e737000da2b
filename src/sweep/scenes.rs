use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use crate::evolution::step::StepKind;
use crate::linalg::memory::MemoryLimit;
use crate::scene::document::Location;
use crate::scene::plan::Plan;
use crate::scene::{self, Diagnostic, DiagnosticKind, Diagnostics, Document, MeshCache};
use crate::sweep::axes::Axis;
use crate::sweep::collect::CollectedQuantity;

pub(super) struct SceneReader<'a> {
    document: &'a Document,
    scene: &'a Path,
    meshes: &'a MeshCache,
    pub study_diagnostics: Vec<Diagnostic>,
    scene_diagnostics: Option<Diagnostics>,
    /// For each error of the scene: indices (from 0) of the affected runs, and the axis values of the first affected
    /// run.
    runs_of_mistakes: Vec<(Vec<usize>, String)>,
    n_runs: usize,
    pub first: Option<Plan>,
    steps: BTreeSet<String>,
    loads: BTreeSet<String>,
    /// Kinds of the steps with wear jumps, by step name.
    pub step_kinds: BTreeMap<String, StepKind>,
}

impl<'a> SceneReader<'a> {
    pub fn new(document: &'a Document, scene: &'a Path, meshes: &'a MeshCache) -> Self {
        let (steps, loads, step_kinds) = (BTreeSet::new(), BTreeSet::new(), BTreeMap::new());
        Self {
            document,
            scene,
            meshes,
            study_diagnostics: Vec::new(),
            scene_diagnostics: None,
            runs_of_mistakes: Vec::new(),
            n_runs: 0,
            first: None,
            steps,
            loads,
            step_kinds,
        }
    }

    /// Reads the scene of a run, and returns its memory limit if the scene is valid.
    pub fn run(&mut self, axes: &[Axis], choice: &[usize], overrides: &[String]) -> Option<MemoryLimit> {
        self.n_runs += 1;
        match scene::read_with_meshes(self.scene, overrides, self.meshes) {
            Ok(plan) => {
                self.steps.extend(plan.steps.iter().map(|step| step.name.clone()));
                self.loads.extend(plan.load_names());
                let wear_steps = plan.steps.iter().filter(|step| step.kind.cycles().is_some());
                self.step_kinds.extend(wear_steps.map(|step| (step.name.clone(), step.kind)));
                let memory = plan.memory_limit;
                if let Some(first) = &self.first {
                    // Without a limit in the scene, all runs have the default limit of the first plan.
                    let given = plan.solver.memory_limit.is_some();
                    let memory = if given { memory } else { first.memory_limit };
                    if first.units != plan.units {
                        let message = "the units of the scene differ from run to run";
                        self.add(
                            Diagnostic::at(self.document, "axes", message).help("vary values, not units"),
                        );
                    }
                    return Some(memory);
                }
                self.first = Some(plan);
                Some(memory)
            }
            Err(mistakes) => {
                // An override with an invalid key hides other errors. The scene is therefore read again without this
                // override.
                let lost = |mistake: &Diagnostic| match &mistake.location {
                    Location::SetOption(option) if mistake.kind == DiagnosticKind::BadOverride => {
                        Some(option.clone())
                    }
                    _ => None,
                };
                let lost: Vec<String> = mistakes.list.iter().filter_map(lost).collect();
                self.sort_diagnostics(mistakes, axes, choice);
                if !lost.is_empty() {
                    let others: Vec<String> =
                        overrides.iter().filter(|line| !lost.contains(line)).cloned().collect();
                    if let Err(mistakes) = scene::read_with_meshes(self.scene, &others, self.meshes) {
                        self.sort_diagnostics(mistakes, axes, choice);
                    }
                }
                None
            }
        }
    }

    fn add(&mut self, mistake: Diagnostic) {
        if !self.study_diagnostics.contains(&mistake) {
            self.study_diagnostics.push(mistake);
        }
    }

    /// Assigns errors to the keys or values of the study that cause them, or else to the scene.
    fn sort_diagnostics(&mut self, mistakes: Diagnostics, axes: &[Axis], choice: &[usize]) {
        let mut remaining = mistakes.clone();
        remaining.list.clear();
        for mistake in mistakes.list {
            match self.study_key_of(&mistake, axes, choice) {
                Some(place) => {
                    let key =
                        if mistake.key.is_empty() { String::new() } else { format!("{}: ", mistake.key) };
                    let message = format!("{key}{}", mistake.message);
                    let label =
                        if mistake.label.is_empty() { "no such key".to_owned() } else { mistake.label };
                    self.add(Diagnostic {
                        message,
                        label,
                        key: String::new(),
                        location: self.document.location(&place),
                        ..mistake
                    });
                }
                None => remaining.list.push(mistake),
            }
        }
        let run = self.n_runs - 1;
        for mistake in std::mem::take(&mut remaining.list) {
            let known = &mut self.scene_diagnostics.get_or_insert_with(|| remaining.clone()).list;
            // Messages may contain numbers that differ between runs, so errors of different runs are compared by key, label and
            // location.
            let is_same = |(other, (runs, _)): (&Diagnostic, &(Vec<usize>, String))| {
                *other == mistake
                    || runs.last() != Some(&run)
                        && (&other.key, &other.label, &other.location)
                            == (&mistake.key, &mistake.label, &mistake.location)
            };
            let index = known.iter().zip(&self.runs_of_mistakes).position(is_same).unwrap_or_else(|| {
                let values = axes.iter().zip(choice);
                let values = values.map(|(axis, &value)| format!("{} = {}", axis.name, axis.label(value)));
                self.runs_of_mistakes.push((Vec::new(), values.collect::<Vec<_>>().join(", ")));
                known.push(mistake);
                known.len() - 1
            });
            let runs = &mut self.runs_of_mistakes[index].0;
            if runs.last() != Some(&run) {
                runs.push(run);
            }
        }
    }

    /// Errors of the scene. If only some runs have an error, its message names the axis values of the first of these
    /// runs.
    pub fn scene_diagnostics(&self) -> Option<Diagnostics> {
        let mut diagnostics = self.scene_diagnostics.clone()?;
        for (mistake, (runs, values)) in diagnostics.list.iter_mut().zip(&self.runs_of_mistakes) {
            if runs.len() < self.n_runs {
                let of = if runs.len() == 1 { "the run" } else { "first" };
                mistake.message += &format!(" ({} of {} runs; {of} with {values})", runs.len(), self.n_runs);
            }
        }
        Some(diagnostics)
    }

    /// Path in the study file of the key or value that causes an error of a scene.
    fn study_key_of(&self, mistake: &Diagnostic, axes: &[Axis], choice: &[usize]) -> Option<String> {
        let Location::SetOption(option) = &mistake.location else { return None };
        let (key, _) = option.split_once('=')?;
        for (axis, &value) in axes.iter().zip(choice) {
            let Some(k) = axis.keys.iter().position(|known| known == key) else { continue };
            // An unknown or invalid key is an error of the key, whatever its value.
            let of_key = matches!(mistake.kind, DiagnosticKind::UnknownKey | DiagnosticKind::BadOverride);
            return Some(if of_key { axis.place_of_key(k) } else { axis.place_of_value(k, value) });
        }
        None
    }

    /// Reports collected quantities of steps and loads that no run has.
    pub fn check_names(&mut self, lists: [(&Vec<CollectedQuantity>, &str); 2]) {
        if self.first.is_none() {
            return;
        }
        for (quantities, key) in lists {
            for (i, quantity) in quantities.iter().enumerate() {
                let place = format!("output.{key}.{i}");
                self.check_name(&place, ["step", "steps"], &quantity.step, self.steps.clone());
                if let Some(load) = quantity.load() {
                    self.check_name(&place, ["load", "named loads"], load, self.loads.clone());
                }
            }
        }
    }

    fn check_name(&mut self, place: &str, [kind, kinds]: [&str; 2], name: &str, known: BTreeSet<String>) {
        if known.contains(name) {
            return;
        }
        let names = known.iter().map(|name| format!("\"{name}\"")).collect::<Vec<_>>().join(", ");
        let help =
            if known.is_empty() { format!("it has no {kinds}") } else { format!("its {kinds} are {names}") };
        let mistake = Diagnostic::at(self.document, place, format!("the scene has no {kind} \"{name}\""));
        self.study_diagnostics.push(mistake.label(format!("no such {kind}")).help(help));
    }
}
