//! Error type of the crate: message, kind, and context.

use std::any::Any;
use std::fmt;

use serde::{Deserialize, Serialize};

/// Exit codes of the program.
pub mod exit {
    /// Done, converged.
    pub const DONE: u8 = 0;
    /// Unexpected failure: a numerical method failed, or the program has a defect.
    pub const FAILED: u8 = 1;
    /// Invalid input.
    pub const INPUT: u8 = 2;
    /// Not converged, or no physical solution (such as lost contact); results so far are kept.
    pub const NOT_CONVERGED: u8 = 3;
    /// Insufficient memory or disk space, or a file that cannot be written.
    pub const RESOURCES: u8 = 4;
    /// Stopped by a signal; results so far are kept.
    pub const INTERRUPTED: u8 = 130;

    /// Returns the more severe of two exit codes.
    pub fn worse(a: u8, b: u8) -> u8 {
        const ORDER: [u8; 6] = [DONE, NOT_CONVERGED, INPUT, RESOURCES, FAILED, INTERRUPTED];
        let rank = |code: u8| ORDER.iter().position(|known| *known == code).unwrap_or(ORDER.len());
        if rank(b) > rank(a) { b } else { a }
    }
}

/// Kind of an [`Error`]. The kind determines the exit code of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// A scene, mesh, material or command-line value is invalid, or a file cannot be read (exit code 2).
    Input,
    /// Memory or disk space is insufficient, or a file cannot be written (exit code 4).
    Resources,
    /// A numerical method failed although the input is valid, or the program has a defect (exit code 1).
    Numerical,
    /// An iteration did not converge (exit code 3).
    NotConverged,
    /// A signal requested cancellation (exit code 130).
    Interrupted,
}

/// Error: message, kind and context. The context lists where the error occurred, with the outermost place first.
#[derive(Debug, Clone)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    context: Vec<String>,
    /// Mesh group of a support that causes the error, if known.
    pub(crate) group: Option<String>,
}

/// `Result` with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// Message of a panic, or "no message" if the payload of the panic is not a text.
pub fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

impl Error {
    fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), context: Vec::new(), group: None }
    }

    /// Error in the user's input. The message should state the invalid input, the allowed values and the remedy.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, message)
    }

    /// Insufficient memory or disk space, or a file that cannot be written.
    pub fn resources(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Resources, message)
    }

    /// Failure of a numerical method, or a defect of the program.
    pub fn numerical(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Numerical, message)
    }

    /// Error of an iteration that did not converge.
    pub fn not_converged(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::NotConverged, message)
    }

    /// Error of a cancelled computation.
    pub(crate) fn interrupted() -> Self {
        Self::new(ErrorKind::Interrupted, "interrupted")
    }

    /// Adds `place` (file, group, step, ...) in front of the context, unless `place` is already its first entry.
    pub fn context(mut self, place: impl Into<String>) -> Self {
        let place = place.into();
        if self.context.first() != Some(&place) {
            self.context.insert(0, place);
        }
        self
    }

    /// Removes `place` from the context if it is the first entry.
    pub(crate) fn without_context(mut self, place: &str) -> Self {
        if self.context.first().is_some_and(|first| first == place) {
            self.context.remove(0);
        }
        self
    }

    /// Sets the mesh group of the support that causes the error.
    pub(crate) fn at_group(self, group: &str) -> Self {
        Self { group: Some(group.to_owned()), ..self }
    }

    /// Appends the second error `other` to the message.
    pub(crate) fn followed_by(mut self, other: &Error) -> Self {
        self.message = format!("{}; besides, {other}", self.message);
        self
    }

    /// Kind of the error.
    pub fn kind(&self) -> ErrorKind {
        self.kind
    }

    /// Exit code of the program for this error.
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            ErrorKind::Input => exit::INPUT,
            ErrorKind::Resources => exit::RESOURCES,
            ErrorKind::Numerical => exit::FAILED,
            ErrorKind::NotConverged => exit::NOT_CONVERGED,
            ErrorKind::Interrupted => exit::INTERRUPTED,
        }
    }

    /// The message without its context.
    pub fn message(&self) -> &str {
        &self.message
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for place in &self.context {
            write!(f, "{place}: ")?;
        }
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

/// Severity of a [`Warning`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    /// Remark on how the results are obtained.
    Note,
    /// Numbers of the scene indicate mixed-up units.
    UnitError,
    /// The results are not reliable.
    Uncertain,
}

/// Note or warning for the user. Result files contain the text only.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "String", into = "String")]
pub struct Warning {
    /// Severity of the message.
    pub severity: Severity,
    /// Text of the message. Except in notes, the text contains a prefix that states the severity.
    pub text: String,
}

impl Warning {
    /// Remark on how the results are obtained.
    pub fn note(text: impl Into<String>) -> Self {
        Self { severity: Severity::Note, text: text.into() }
    }

    /// Warning about numbers that indicate mixed-up units.
    pub fn unit_error(message: &str) -> Self {
        Self { severity: Severity::UnitError, text: format!("{UNIT_ERROR_PREFIX}{message}") }
    }

    /// Warning about unreliable results.
    pub fn uncertain(message: &str) -> Self {
        Self { severity: Severity::Uncertain, text: warning(message) }
    }

    /// Prepends `place` (key, body, variant, ...) to the text.
    pub fn at(self, place: &str) -> Self {
        Self { text: format!("{place}: {}", self.text), ..self }
    }
}

impl From<Warning> for String {
    fn from(warning: Warning) -> Self {
        warning.text
    }
}

/// Determines the severity of a warning from the prefix in its text (docs/results.md).
impl From<String> for Warning {
    fn from(text: String) -> Self {
        let severity = match &text {
            _ if text.contains(WARNING_PREFIX) => Severity::Uncertain,
            _ if text.starts_with(UNIT_ERROR_PREFIX) => Severity::UnitError,
            _ => Severity::Note,
        };
        Self { severity, text }
    }
}

/// Prefix in the texts of warnings about unreliable results.
const WARNING_PREFIX: &str = "WARNING: ";

/// Prefix in the texts of warnings about units.
const UNIT_ERROR_PREFIX: &str = "possible unit error: ";

/// Text of a warning about unreliable results.
pub(crate) fn warning(message: &str) -> String {
    format!("{WARNING_PREFIX}{message}")
}

/// Adds context to a `Result`.
pub trait Context<T> {
    /// Adds `place` to the context of an error.
    ///
    /// # Errors
    /// If `self` is an error: returns it with `place` added to its context.
    fn context(self, place: impl FnOnce() -> String) -> Result<T>;
}

impl<T> Context<T> for Result<T> {
    fn context(self, place: impl FnOnce() -> String) -> Result<T> {
        self.map_err(|error| error.context(place()))
    }
}
