//! `orthowear schema`.

use super::{exit, to_stdout};
use crate::scene::schema::{json_schema, json_schema_of};
use crate::sweep::spec::StudyFile;

/// Prints the JSON Schema of a scene, or of a study.
pub(super) fn schema(study: bool) -> u8 {
    let schema = if study { json_schema_of::<StudyFile>() } else { json_schema().clone() };
    to_stdout(&format!("{schema:#}\n"));
    exit::DONE
}
