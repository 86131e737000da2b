//! `orthowear schema`.

use super::{exit, to_stdout};
use crate::scene::schema::json_schema;

/// Prints the JSON Schema of a scene.
pub(super) fn schema() -> u8 {
    to_stdout(&format!("{:#}\n", json_schema()));
    exit::DONE
}
