//! The crate's one error: what is wrong, of which kind, and the chain of places it was found in.

use std::any::Any;
use std::fmt;

/// Exit codes of the program.
pub mod exit {
    /// Done, converged.
    pub const DONE: u8 = 0;
    /// Unexpected failure.
    pub const FAILED: u8 = 1;
    /// The input is wrong.
    pub const INPUT: u8 = 2;
    /// Not converged, or the physics was lost; results so far are kept.
    pub const NOT_CONVERGED: u8 = 3;
    /// Memory or disk do not suffice.
    pub const RESOURCES: u8 = 4;
    /// Stopped by a signal; results so far are kept.
    pub const INTERRUPTED: u8 = 130;

    /// The graver of two exit codes.
    pub fn worse(a: u8, b: u8) -> u8 {
        const ORDER: [u8; 6] = [DONE, NOT_CONVERGED, INPUT, RESOURCES, FAILED, INTERRUPTED];
        let rank = |code: u8| ORDER.iter().position(|known| *known == code).unwrap_or(ORDER.len());
        if rank(b) > rank(a) { b } else { a }
    }
}

/// What sort of failure an [`Error`] is; it decides the exit code of the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// The scene, a mesh, a material or a command-line value is wrong (exit code 2).
    Input,
    /// Memory or disk does not suffice, or a file cannot be written (exit code 4).
    Resources,
    /// A numerical stage failed in a way the input does not explain (exit code 1).
    Numerical,
    /// An iteration did not converge (exit code 3).
    NotConverged,
    /// A signal asked to stop (exit code 130).
    Interrupted,
}

/// An error with the context it was met in, outermost first.
#[derive(Debug, Clone)]
pub struct Error {
    kind: ErrorKind,
    message: String,
    context: Vec<String>,
}

/// `Result` with the crate's [`Error`].
pub type Result<T> = std::result::Result<T, Error>;

/// The text of a panic.
pub fn panic_message(panic: &(dyn Any + Send)) -> &str {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message")
}

impl Error {
    /// An error in what the user gave: say what was found, what is allowed, and how to mend it.
    pub fn input(message: impl Into<String>) -> Self {
        Self { kind: ErrorKind::Input, message: message.into(), context: Vec::new() }
    }

    /// Memory, disk or file-system failure.
    pub fn resources(message: impl Into<String>) -> Self {
        Self { kind: ErrorKind::Resources, message: message.into(), context: Vec::new() }
    }

    /// A numerical stage failed.
    pub fn numerical(message: impl Into<String>) -> Self {
        Self { kind: ErrorKind::Numerical, message: message.into(), context: Vec::new() }
    }

    /// An iteration did not converge.
    pub fn not_converged(message: impl Into<String>) -> Self {
        Self { kind: ErrorKind::NotConverged, message: message.into(), context: Vec::new() }
    }

    /// The computation was stopped on demand.
    pub(crate) fn interrupted() -> Self {
        Self { kind: ErrorKind::Interrupted, message: "interrupted".to_owned(), context: Vec::new() }
    }

    /// The same error, met while doing `place` (file, group, step, ...); a place said last already is not said again.
    pub fn context(mut self, place: impl Into<String>) -> Self {
        let place = place.into();
        if self.context.first() != Some(&place) {
            self.context.insert(0, place);
        }
        self
    }

    /// The same error, that came with another one.
    pub(crate) fn followed_by(mut self, other: &Error) -> Self {
        self.message = format!("{}; besides, {other}", self.message);
        self
    }

    /// Its kind.
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

/// What messages that put results in doubt begin with.
pub const WARNING_PREFIX: &str = "WARNING: ";

/// A message to the user that puts results in doubt, among those that do not.
pub(crate) fn warning(message: &str) -> String {
    format!("{WARNING_PREFIX}{message}")
}

/// Adds context to a `Result`.
pub trait Context<T> {
    /// The same result; an error gets `place` put before its chain of context.
    ///
    /// # Errors
    /// Passes on the error of `self`.
    fn context(self, place: impl FnOnce() -> String) -> Result<T>;
}

impl<T> Context<T> for Result<T> {
    fn context(self, place: impl FnOnce() -> String) -> Result<T> {
        self.map_err(|error| error.context(place()))
    }
}
