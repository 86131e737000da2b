//! Resolves the document into the [`Plan`]: checks the values against each other and collects all errors.

mod accuracy;
mod be_body;
mod bodies;
mod compare;
mod cycles;
mod frame;
mod friction_loads;
mod initial_loads;
mod interior_points;
mod laws;
mod load_points;
mod materials;
mod orientations;
mod placements;
mod rolling;
mod steps;
mod support_conflicts;

use std::path::PathBuf;

use serde::de::DeserializeOwned;

use super::diagnostic::Diagnostic;
use super::document::{Document, TomlValue};
use super::plan::Plan;
use super::spec::laws::{Friction, Wear};
use super::spec::solver::{Output, Solver};
use crate::linalg::memory::MemoryLimit;
use crate::output::summary::Units;
use crate::scene::mesh_cache::MeshCache;

/// State of the resolution.
pub(super) struct Resolver<'a> {
    pub document: &'a Document,
    /// Cache of the meshes.
    pub meshes: &'a MeshCache,
    pub diagnostics: Vec<Diagnostic>,
    pub notes: Vec<String>,
    /// Keys and paths of the files that the scene names.
    pub files: Vec<(String, PathBuf)>,
    /// Whether the schema check passed. Only then a section that cannot be deserialised is reported.
    pub schema_valid: bool,
}

impl<'a> Resolver<'a> {
    /// Reports an error at `key`.
    pub fn report(&mut self, key: &str, message: impl Into<String>, label: &str, mend: impl Into<String>) {
        self.diagnostics.push(Diagnostic::at(self.document, key, message).label(label).help(mend));
    }

    /// Reports an error at `key` and returns `None`.
    pub fn refuse<T>(
        &mut self,
        key: &str,
        message: impl Into<String>,
        label: &str,
        mend: impl Into<String>,
    ) -> Option<T> {
        self.report(key, message, label, mend);
        None
    }

    /// Returns the value of `result`; reports its error at `key`.
    pub fn accept<T>(
        &mut self,
        result: crate::error::Result<T>,
        key: &str,
        [label, mend]: [&str; 2],
    ) -> Option<T> {
        result.inspect_err(|error| self.report(key, error.message(), label, mend)).ok()
    }

    /// Path of the file `name`, which is recorded under `key`.
    pub fn file(&mut self, key: &str, name: &str) -> PathBuf {
        let path = self.document.folder.join(name);
        self.files.push((key.to_owned(), path.clone()));
        path
    }

    /// Deserialises the section at `key`; `None` if it is absent or invalid.
    pub fn section<T: DeserializeOwned>(&mut self, key: &str) -> Option<T> {
        let json = self.document.get(key)?.to_serde_json();
        match serde_path_to_error::deserialize(json) {
            Ok(section) => Some(section),
            Err(error) => {
                if self.schema_valid {
                    let place = error.path().to_string();
                    self.report(key, format!("{}: {}", place, error.inner()), "here", "see docs/scene.md");
                }
                None
            }
        }
    }

    /// As [`Self::section`], with the default value for an absent section.
    pub fn section_or_default<T: DeserializeOwned + Default>(&mut self, key: &str) -> Option<T> {
        if self.document.get(key).is_none() { Some(T::default()) } else { self.section(key) }
    }

    /// Number of elements of the list at `key`.
    pub fn list_length(&self, key: &str) -> usize {
        match self.document.get(key).map(|node| &node.value) {
            Some(TomlValue::Array(items)) => items.len(),
            _ => 0,
        }
    }

    /// Names of the entries of the table at `key`.
    pub fn names(&self, key: &str) -> Vec<String> {
        match self.document.get(key).map(|node| &node.value) {
            Some(TomlValue::Table(entries)) => entries.iter().map(|entry| entry.name.clone()).collect(),
            _ => Vec::new(),
        }
    }
}

/// Resolves a document into its plan, errors and notes. The plan exists only without errors and with a valid schema.
pub(super) fn resolve(
    document: &Document,
    meshes: &MeshCache,
    schema_valid: bool,
) -> (Option<Plan>, Vec<Diagnostic>, Vec<String>) {
    let mut r = Resolver {
        document,
        meshes,
        diagnostics: Vec::new(),
        notes: Vec::new(),
        files: Vec::new(),
        schema_valid,
    };
    let plan = build_plan(&mut r);
    let whole = schema_valid && r.diagnostics.is_empty();
    (plan.filter(|_| whole), r.diagnostics, r.notes)
}

/// Name of the scene file without extension, as the title of a scene with an empty title.
fn file_stem(document: &Document) -> String {
    let stem = std::path::Path::new(&document.file).file_stem();
    stem.map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn build_plan(r: &mut Resolver) -> Option<Plan> {
    let title: Option<String> = r.section_or_default("title");
    let units: Option<Units> = r.section_or_default("units");
    let materials = materials::resolve(r);
    let bodies = [bodies::resolve(r, "body1", &materials), bodies::resolve(r, "body2", &materials)];
    let frame = frame::resolve_frame(r, &bodies);
    let gap = frame::resolve_gap(r, frame.as_ref(), &bodies);
    let friction: Option<Friction> = r.section_or_default("friction");
    let wear: Option<Wear> = r.section_or_default("wear");
    let ground = laws::LawContext { bodies: &bodies, frame: frame.as_ref() };
    let laws = laws::resolve(r, ground, friction, wear);
    let steps = steps::resolve(r, laws.as_ref(), frame.as_ref());
    if let (Some(laws), Some(steps)) = (&laws, &steps) {
        r.notes.extend(initial_loads::friction_warnings(&bodies, &laws.friction, steps));
    }
    rolling::check_model(r, frame.as_ref(), &bodies);
    let solver: Option<Solver> = r.section_or_default("solver");
    let memory = memory_limit(r, solver.as_ref());
    let output: Option<Output> = r.section_or_default("output");
    let compare = compare::resolve(r, &bodies);
    let interior_requests = interior_points::resolve(r, output.as_ref(), &bodies, frame.as_ref());
    let accuracy = accuracy::resolve(r);
    let [body1, body2] = bodies;
    let laws = laws?;
    Some(Plan {
        title: title.map(|title| if title.is_empty() { file_stem(r.document) } else { title })?,
        units: units?,
        bodies: [body1?, body2?],
        strength_limits: (materials.into_iter())
            .filter_map(|(name, material)| Some((name, material?.strength?)))
            .collect(),
        frame: frame?,
        gap: gap?,
        friction: laws.friction,
        wear: laws.wear,
        fibre_bodies: laws.fibre_bodies,
        wear_share: laws.integration.share,
        mesh_motion_threshold: laws.integration.move_mesh.map(|threshold| threshold.0),
        integrator: laws.integration.integrator,
        steps: steps?,
        solver: solver?,
        memory_limit: memory?,
        output: output?,
        compare: compare?,
        interior_requests,
        accuracy: accuracy?,
        fields_every: 1,
        flexibility_cache: None,
        notes: r.notes.clone(),
        files: std::mem::take(&mut r.files),
        document: r.document.clone(),
    })
}

/// Memory limit of the run: the value of the scene, or the default for the machine.
fn memory_limit(r: &mut Resolver, solver: Option<&Solver>) -> Option<MemoryLimit> {
    let Some(size) = &solver?.memory_limit else { return Some(MemoryLimit::of_machine()) };
    let bytes = size.bytes();
    if bytes.is_none() {
        r.report(
            "solver.memory_limit",
            "`memory_limit` is not a valid amount of memory",
            "not an amount of memory",
            "give a number of bytes, or a text like \"4 GiB\" or \"500 MB\"",
        );
    }
    bytes.map(MemoryLimit::of_scene)
}
