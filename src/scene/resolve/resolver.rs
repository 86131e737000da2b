//! State of the resolution of a scene, and functions that report errors.

use std::path::PathBuf;

use serde::de::DeserializeOwned;

use crate::error::Warning;
use crate::scene::diagnostic::Diagnostic;
use crate::scene::document::{Document, TomlValue};
use crate::scene::mesh_cache::MeshCache;

pub(super) struct Resolver<'a> {
    pub document: &'a Document,
    pub meshes: &'a MeshCache,
    pub diagnostics: Vec<Diagnostic>,
    pub notes: Vec<Warning>,
    /// Keys and paths of the files that the scene names.
    pub files: Vec<(String, PathBuf)>,
    /// Whether the schema check passed. If it failed, it has already reported the sections that cannot be deserialised.
    pub schema_valid: bool,
    /// Keys that the schema does not contain. The schema check reported them; they are no longer in the document.
    pub unknown_keys: &'a [String],
}

impl<'a> Resolver<'a> {
    pub fn report(&mut self, key: &str, message: impl Into<String>, label: &str, mend: impl Into<String>) {
        self.diagnostics.push(Diagnostic::at(self.document, key, message).label(label).help(mend));
    }

    pub fn note(&mut self, text: impl Into<String>) {
        self.notes.push(Warning::note(text));
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

    /// Returns the value of `result`. An error is reported at `key`.
    pub fn accept<T>(
        &mut self,
        result: crate::error::Result<T>,
        key: &str,
        [label, mend]: [&str; 2],
    ) -> Option<T> {
        result.inspect_err(|error| self.report(key, error.message(), label, mend)).ok()
    }

    /// Path of the file `name` in the folder of the scene. The path is recorded under `key`.
    pub fn file(&mut self, key: &str, name: &str) -> PathBuf {
        let path = self.document.folder.join(name);
        self.files.push((key.to_owned(), path.clone()));
        path
    }

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

    /// As [`Self::section`]. An absent section has its default value.
    pub fn section_or_default<T: DeserializeOwned + Default>(&mut self, key: &str) -> Option<T> {
        if self.document.get(key).is_none() { Some(T::default()) } else { self.section(key) }
    }

    pub fn list_length(&self, key: &str) -> usize {
        match self.document.get(key).map(|node| &node.value) {
            Some(TomlValue::Array(items)) => items.len(),
            _ => 0,
        }
    }

    pub fn names(&self, key: &str) -> Vec<String> {
        match self.document.get(key).map(|node| &node.value) {
            Some(TomlValue::Table(entries)) => entries.iter().map(|entry| entry.name.clone()).collect(),
            _ => Vec::new(),
        }
    }
}
