//! The scene of the user (TOML) and the validated [`plan::Plan`] of a run.
//!
//! [`spec`] defines the keys. [`document`] contains the values of a scene file with their locations in the file.
//! [`schema_check`] checks the document against the JSON Schema. `resolve` checks the values against each other and
//! builds the plan. Both checks report all errors, not only the first.

pub mod diagnostic;
pub mod document;
pub mod mean_material;
mod mesh_cache;
pub mod parse;
pub mod plan;
mod resolve;
pub mod schema;
pub mod schema_check;
pub mod spec;
pub(crate) mod suggest;
mod unit_checks;
pub mod variant;

use std::path::Path;

pub use diagnostic::{Diagnostic, DiagnosticKind, Diagnostics};
pub use document::Document;
pub use mesh_cache::MeshCache;
pub use plan::Plan;

fn missing_diagnostic(document: &Document) -> Diagnostic {
    Diagnostic::at(document, "", "internal error: the scene was rejected without a diagnostic")
        .label("cause unknown")
        .help("please report this scene as a bug; removing keys one by one finds the key that causes it")
}

/// Reads the scene file at `path` and its meshes, and builds the plan. `overrides` (`key.path=value`) replace or add
/// values.
///
/// # Errors
/// All errors of the scene.
pub fn read(path: &Path, overrides: &[String]) -> Result<Plan, Diagnostics> {
    read_with_meshes(path, overrides, &MeshCache::default())
}

/// As [`read`], with the cache `meshes`: a mesh in the cache is not read again.
///
/// # Errors
/// As [`read`].
pub fn read_with_meshes(path: &Path, overrides: &[String], meshes: &MeshCache) -> Result<Plan, Diagnostics> {
    plan_from_document(parse::read_document(path, overrides)?, meshes)
}

/// As [`read`], for a scene given as `text`. `path` gives the file name for messages and the folder of relative paths.
///
/// # Errors
/// As [`read`].
pub fn read_text(path: &Path, text: String, overrides: &[String]) -> Result<Plan, Diagnostics> {
    plan_from_document(parse::parse_document(path, text, overrides)?, &MeshCache::default())
}

fn plan_from_document(mut document: Document, meshes: &MeshCache) -> Result<Plan, Diagnostics> {
    if document.get("study").is_some() && document.get("axes").is_some() {
        let mistake = Diagnostic::at(&document, "study", "this is a study, not a scene").label("a study");
        let mend = format!("run it with `orthowear study {}`", document.file);
        return Err(Diagnostics::new(&document, vec![mistake.help(mend)]));
    }
    let (mut mistakes, unknown) =
        schema_check::check_against_schema(&document, schema::json_schema(), "the scene");
    let clean = mistakes.is_empty();
    // Unknown keys are removed, so that the rest of the scene can be checked.
    unknown.iter().for_each(|key| document.remove(key));
    let (plan, nonsense, notes) = resolve::resolve(&document, meshes, &unknown, clean);
    mistakes.extend(nonsense);
    match plan {
        Some(mut plan) if mistakes.is_empty() => {
            let notes = unit_checks::unit_warnings(&plan);
            plan.notes.extend(notes);
            Ok(plan)
        }
        plan => {
            if plan.is_none() && mistakes.is_empty() {
                mistakes.push(missing_diagnostic(&document));
            }
            Err(Diagnostics { notes, ..Diagnostics::new(&document, mistakes) })
        }
    }
}
