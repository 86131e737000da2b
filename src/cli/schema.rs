use super::console::to_stdout;
use super::options::CommandResult;
use crate::error::exit;
use crate::scene::schema::{json_schema, json_schema_of};
use crate::sweep::spec::StudyFile;

pub(super) fn schema(study: bool) -> CommandResult {
    let schema = if study { json_schema_of::<StudyFile>() } else { json_schema().clone() };
    to_stdout(&format!("{schema:#}\n"));
    Ok(exit::DONE)
}
