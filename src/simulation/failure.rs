//! Errors with the scene key that causes them.

use crate::error::Error;
use crate::evolution::step::Step;

/// Error with the scene key that causes it.
#[derive(Debug, Clone)]
pub struct SceneError {
    /// The error.
    pub error: Error,
    /// Dotted scene key that causes the error; empty if none.
    pub key: String,
}

impl From<Error> for SceneError {
    fn from(error: Error) -> Self {
        Self { error, key: String::new() }
    }
}

pub(crate) trait AtKey<T> {
    fn at(self, key: &str) -> Result<T, SceneError>;
}

impl<T> AtKey<T> for crate::error::Result<T> {
    fn at(self, key: &str) -> Result<T, SceneError> {
        self.map_err(|error| SceneError { error, key: key.to_owned() })
    }
}

/// Dotted scene key of `key` in step `index`, such as `steps.2.shift`. All load points of a history share one entry of
/// `steps` and the key `history`.
pub(crate) fn step_key(steps: &[Step], index: usize, key: &str) -> String {
    let first = |step: &&Step| step.history_row.is_none_or(|row| row.index == 0);
    let entry = steps[..=index].iter().filter(first).count() - 1;
    let key = if steps[index].history_row.is_some() { "history" } else { key };
    format!("steps.{entry}.{key}")
}
