//! What is wrong with a scene, and where.

use std::fmt;
use std::ops::Range;

use super::document::Document;
use crate::error::Error;

/// Where in the input a mistake was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// Bytes of the scene file's text.
    File(Range<usize>),
    /// The command-line option `--set` with this text.
    SetOption(String),
    /// The scene as a whole.
    WholeScene,
}

/// What kind of error a mistake is, where the code depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DiagnosticKind {
    /// A table has a key that the schema does not know.
    UnknownKey,
    /// An override `--set key.path=value` cannot be applied.
    BadOverride,
    /// Any other error.
    Other,
}

/// One thing the user has to mend.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Diagnostic {
    /// The kind of error.
    pub kind: DiagnosticKind,
    /// The key, dotted as in `--set` ("body1.fibre.tilt"); empty for the scene as a whole.
    pub key: String,
    /// What was found and why it is wrong.
    pub message: String,
    /// A few words beside the excerpt.
    pub label: String,
    /// What is allowed and how to mend it.
    pub help: String,
    /// Where.
    pub location: Location,
}

impl Diagnostic {
    /// A mistake at `key` of `document`, with a message that says what was found.
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

    /// The same mistake with its kind.
    pub fn kind(mut self, kind: DiagnosticKind) -> Self {
        self.kind = kind;
        self
    }

    /// The same mistake with a few words beside the excerpt.
    pub fn label(mut self, label: impl Into<String>) -> Self {
        self.label = label.into();
        self
    }

    /// The same mistake with what is allowed and how to mend it.
    pub fn help(mut self, mend: impl Into<String>) -> Self {
        self.help = mend.into();
        self
    }
}

/// Everything wrong with a scene, with its text for excerpts.
#[derive(Debug, Clone)]
pub struct Diagnostics {
    /// Name of the scene file as the user gave it.
    pub file: String,
    /// Its text.
    pub text: String,
    /// Its fingerprint; empty if it could not be read.
    pub sha256: String,
    /// The mistakes in the order of the file.
    pub list: Vec<Diagnostic>,
    /// What else was noted of the scene, which may be why they are there.
    pub notes: Vec<String>,
}

impl Diagnostics {
    /// All mistakes of a document, in the order of the file and without repetitions.
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

    /// The one mistake that an error raised at `key` is; a mistake is shown with its key, which the error need not repeat.
    pub fn from_error(document: &Document, key: &str, error: &Error) -> Self {
        let text = error.to_string();
        let message = text.strip_prefix(&format!("{key}: ")).unwrap_or(&text);
        Self::new(document, vec![Diagnostic::at(document, key, message)])
    }

    /// Line (from 1) of a mistake in the file.
    pub fn line(&self, mistake: &Diagnostic) -> Option<usize> {
        match &mistake.location {
            Location::File(range) => {
                let before = self.text.as_bytes().get(..range.start.min(self.text.len()))?;
                Some(1 + before.iter().filter(|byte| **byte == b'\n').count())
            }
            _ => None,
        }
    }

    /// The crate's error that stands for all of them, one line each.
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
