//! The scene a user writes (TOML), and the validated plan it becomes.
//!
//! [`keys`] are the keys as written; [`document`] holds the file with the place of every value; [`check`] finds
//! what the schema does not allow; `resolve` finds what makes no sense and builds the [`plan::Plan`]. Every
//! mistake is collected, so that a user mends them all at once.

pub mod check;
pub mod document;
pub mod keys;
pub mod mistake;
pub mod parse;
pub mod plan;
mod resolve;
pub mod schema;
pub(crate) mod suggest;
pub mod surface;
mod units;
pub mod variant;

use std::path::Path;

pub use document::Document;
pub use mistake::{DiagnosticKind, Mistake, Mistakes};
pub use plan::Plan;
pub use units::HINT as UNITS_HINT;

/// What is said of a scene that makes no plan although nothing was found to be wrong with it.
fn unexplained(document: &Document) -> Mistake {
    Mistake::at(document, "", "internal error: the scene was rejected without a diagnostic")
        .label("cause unknown")
        .mend("please report this scene as a bug; removing keys one by one finds the key that causes it")
}

/// The plan of the scene file at `path` with overrides `key.path=value`; reads its meshes too.
///
/// # Errors
/// Everything wrong with the scene, all at once.
pub fn read(path: &Path, overrides: &[String]) -> Result<Plan, Mistakes> {
    plan(parse::read_document(path, overrides)?)
}

/// As [`read`], of a scene whose text is given; `path` is its name in messages, in whose folder relative paths begin.
///
/// # Errors
/// As [`read`].
pub fn read_text(path: &Path, text: String, overrides: &[String]) -> Result<Plan, Mistakes> {
    let bytes = text.clone().into_bytes();
    plan(parse::document(path, (text, &bytes), overrides)?)
}

/// The plan of a document.
fn plan(mut document: Document) -> Result<Plan, Mistakes> {
    if document.get("study").is_some() && document.get("axes").is_some() {
        let mistake = Mistake::at(&document, "study", "this is a study, not a scene").label("a study");
        let mend = format!("run it with `orthowear study {}`", document.file);
        return Err(Mistakes::new(&document, vec![mistake.mend(mend)]));
    }
    let (mut mistakes, unknown) = check::check(&document, schema::json_schema());
    let clean = mistakes.is_empty();
    // Without the keys that no table knows, what is left may still be checked.
    unknown.iter().for_each(|key| document.remove(key));
    let (plan, nonsense, notes) = resolve::resolve(&document, clean);
    mistakes.extend(nonsense);
    match plan {
        Some(mut plan) if mistakes.is_empty() => {
            let notes = units::notes(&plan);
            plan.notes.extend(notes);
            Ok(plan)
        }
        plan => {
            if plan.is_none() && mistakes.is_empty() {
                mistakes.push(unexplained(&document));
            }
            Err(Mistakes { notes, ..Mistakes::new(&document, mistakes) })
        }
    }
}
