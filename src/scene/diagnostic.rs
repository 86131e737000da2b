//! Diagnostics: errors in a scene with their locations.

use std::fmt;

use super::document::{Document, Location};
use crate::error::{Error, Warning};

/// Kinds of errors that the program distinguishes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum DiagnosticKind {
    /// A table lacks this key.
    MissingKey(String),
    /// A table has a key that the schema does not know.
    UnknownKey,
    /// An override `--set key.path=value` cannot be applied.
    BadOverride,
    /// Any other error.
    Other,
}

/// One error that the user has to fix.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The kind of error.
    pub kind: DiagnosticKind,
    /// Dotted key as in `--set` ("body1.fibre.tilt"); may be empty, e.g. for syntax errors.
    pub key: String,
    /// The error and its reason.
    pub message: String,
    /// Short label beside the marked text in the excerpt of the scene file.
    pub label: String,
    /// Allowed values and how to fix the error.
    pub help: String,
    /// Location in the input.
    pub location: Location,
}

impl Diagnostic {
    /// Error at `key` of `document`.
    pub fn at(document: &Document, key: &str, message: impl Into<String>) -> Self {
        Self {
            kind: DiagnosticKind::Other,
            key: key.to_owned(),
            message: message.into(),
            label: "here".to_owned(),
            help: String::new(),
            location: document.location(key),
        }
    }

    /// Sets the kind of error.
    pub fn kind(mut self, kind: DiagnosticKind) -> Self {
        self.kind = kind;
        self
    }

    /// Sets the label next to the excerpt.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// Sets the help text.
    pub fn help(mut self, mend: impl Into<String>) -> Self {
        self.help = mend.into();
        self
    }
}

/// All errors of a scene, with its text for excerpts.
#[derive(Debug, Clone)]
pub struct Diagnostics {
    /// Name of the scene file as the user gave it.
    pub file: String,
    /// Text of the scene file.
    pub text: String,
    /// SHA-256 of the file and its overrides; empty if the file could not be read.
    pub sha256: String,
    /// The errors; [`Diagnostics::new`] sorts them.
    pub list: Vec<Diagnostic>,
    /// Notes on the scene, which may explain the errors.
    pub notes: Vec<Warning>,
}

impl Diagnostics {
    /// Sorts the errors by position in the file. Errors in overrides follow, then errors of the whole scene. Removes adjacent
    /// duplicates.
    pub fn new(document: &Document, mut list: Vec<Diagnostic>) -> Self {
        list.sort_by_key(|mistake| match &mistake.location {
            Location::File(range) => (0, range.start),
            Location::SetOption(_) => (1, 0),
            Location::WholeScene => (2, 0),
        });
        list.dedup();
        Self {
            file: document.file.clone(),
            text: document.text.clone(),
            sha256: document.sha256.clone(),
            list,
            notes: Vec::new(),
        }
    }

    /// Diagnostics of a single error at `key`. If `key` is the outermost context of the error, it is removed, because
    /// the diagnostic shows it anyway.
    pub fn from_error(document: &Document, key: &str, error: &Error) -> Self {
        let message = error.clone().without_context(key).to_string();
        Self::new(document, vec![Diagnostic::at(document, key, message)])
    }

    /// Line number (from 1) of an error in the file. `None` if the error has no location in the file.
    pub fn line(&self, mistake: &Diagnostic) -> Option<usize> {
        match &mistake.location {
            Location::File(range) => {
                let before = self.text.as_bytes().get(..range.start.min(self.text.len()))?;
                Some(1 + before.iter().filter(|byte| **byte == b'\n').count())
            }
            _ => None,
        }
    }

    /// Error of kind `Input` with all messages, one per line.
    pub fn to_error(&self) -> Error {
        Error::input(self.to_string())
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, mistake) in self.list.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{}", self.file)?;
            if let Some(line) = self.line(mistake) {
                write!(f, ":{line}")?;
            }
            if let Location::SetOption(option) = &mistake.location {
                write!(f, ": --set {option}")?;
            }
            if !mistake.key.is_empty() {
                write!(f, ": {}", mistake.key)?;
            }
            write!(f, ": {}", mistake.message)?;
            if !mistake.help.is_empty() {
                write!(f, " ({})", mistake.help)?;
            }
        }
        Ok(())
    }
}
