//! Errors with the key of the scene that causes them.

use crate::error::Error;

/// Error during the preparation of a plan.
#[derive(Debug, Clone)]
pub struct SceneError {
    /// The error.
    pub error: Error,
    /// Dotted key of the scene that causes it; empty if none.
    pub key: String,
}

/// Error without a key.
impl From<Error> for SceneError {
    fn from(error: Error) -> Self {
        Self { error, key: String::new() }
    }
}

/// Adds the key of the scene to the error of a `Result`.
pub(crate) trait AtKey<T> {
    fn at(self, key: &str) -> Result<T, SceneError>;
}

impl<T> AtKey<T> for crate::error::Result<T> {
    fn at(self, key: &str) -> Result<T, SceneError> {
        self.map_err(|error| SceneError { error, key: key.to_owned() })
    }
}
