//! What is wrong with a scene, and where.

use std::fmt;
use std::ops::Range;

use super::document::Document;
use crate::error::Error;

/// Where in the input a mistake was made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Bytes of the scene file's text.
    File(Range<usize>),
    /// The command-line option `--set` with this text.
    Option(String),
    /// The scene as a whole.
    Scene,
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
pub struct Mistake {
    /// The kind of error.
    pub kind: DiagnosticKind,
    /// The key, dotted as in `--set` ("body1.fibre.tilt"); empty for the scene as a whole.
    pub key: String,
    /// What was found and why it is wrong.
    pub message: String,
    /// A few words beside the excerpt.
    pub label: String,
    /// What is allowed and how to mend it.
    pub mend: String,
    /// Where.
    pub place: Place,
}

impl Mistake {
    /// A mistake at `key` of `document`, with a message that says what was found.
    pub fn at(document: &Document, key: &str, message: impl Into<String>) -> Self {
        Self {
            kind: DiagnosticKind::Other,
            key: key.to_owned(),
            message: message.into(),
            label: "here".to_owned(),
            mend: String::new(),
            place: document.place(key),
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
    pub fn mend(mut self, mend: impl Into<String>) -> Self {
        self.mend = mend.into();
        self
    }
}

/// Everything wrong with a scene, with its text for excerpts.
#[derive(Debug, Clone)]
pub struct Mistakes {
    /// Name of the scene file as the user gave it.
    pub file: String,
    /// Its text.
    pub text: String,
    /// Its fingerprint; empty if it could not be read.
    pub sha256: String,
    /// The mistakes in the order of the file.
    pub list: Vec<Mistake>,
    /// What else was noted of the scene, which may be why they are there.
    pub notes: Vec<String>,
}

impl Mistakes {
    /// All mistakes of a document, in the order of the file and without repetitions.
    pub fn new(document: &Document, mut list: Vec<Mistake>) -> Self {
        list.sort_by_key(|mistake| match &mistake.place {
            Place::File(range) => (0, range.start),
            Place::Option(_) => (1, 0),
            Place::Scene => (2, 0),
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
        Self::new(document, vec![Mistake::at(document, key, message)])
    }

    /// Line (from 1) of a mistake in the file.
    pub fn line(&self, mistake: &Mistake) -> Option<usize> {
        match &mistake.place {
            Place::File(range) => {
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

impl fmt::Display for Mistakes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, mistake) in self.list.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            write!(f, "{}", self.file)?;
            if let Some(line) = self.line(mistake) {
                write!(f, ":{line}")?;
            }
            if let Place::Option(option) = &mistake.place {
                write!(f, ": --set {option}")?;
            }
            if !mistake.key.is_empty() {
                write!(f, ": {}", mistake.key)?;
            }
            write!(f, ": {}", mistake.message)?;
            if !mistake.mend.is_empty() {
                write!(f, " ({})", mistake.mend)?;
            }
        }
        Ok(())
    }
}
