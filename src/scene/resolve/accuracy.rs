//! The accuracy that a scene asks for.

use super::Resolver;
use crate::scene::keys::accuracy::{Accuracy, Quantity, Wanted};
use crate::scene::plan::AccuracySpec;

/// Largest relative error that can be asked for.
const LARGEST: f64 = 0.1;

/// The key `accuracy`; the outer `None` if it is wrong.
pub(super) fn resolve(r: &mut Resolver) -> Option<Option<AccuracySpec>> {
    if r.document.get("accuracy").is_none() {
        return Some(None);
    }
    let all = |relative| Wanted { relative, of: None, keep: Vec::new() };
    let Wanted { relative, of, keep } = match r.section::<Accuracy>("accuracy")? {
        Accuracy::Number(relative) => all(relative),
        Accuracy::Table(wanted) => wanted,
        Accuracy::Text(text) => match text.trim().parse::<f64>() {
            Ok(relative) if relative > 0.0 && relative <= LARGEST => all(relative),
            _ => {
                let message = format!("`accuracy` = \"{text}\" is not a relative error");
                let mend = format!("give a number above 0 and at most {LARGEST}, e.g. 1e-3");
                r.wrong("accuracy", message, "this text", mend);
                return None;
            }
        },
    };
    Some(Some(AccuracySpec { relative, of: of.unwrap_or_else(|| Quantity::ALL.to_vec()), keep }))
}
