//! An error together with the key of the scene that it concerns.

use crate::error::Error;

/// An error met while a plan was made ready.
#[derive(Debug, Clone)]
pub struct SceneError {
    /// What went wrong.
    pub error: Error,
    /// The key of the scene that it concerns, dotted.
    pub key: String,
}

/// An error that concerns no key.
impl From<Error> for SceneError {
    fn from(error: Error) -> Self {
        Self { error, key: String::new() }
    }
}

/// Adds the key to a `Result`.
pub(crate) trait AtKey<T> {
    fn at(self, key: &str) -> Result<T, SceneError>;
}

impl<T> AtKey<T> for crate::error::Result<T> {
    fn at(self, key: &str) -> Result<T, SceneError> {
        self.map_err(|error| SceneError { error, key: key.to_owned() })
    }
}
