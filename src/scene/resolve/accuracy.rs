//! The accuracy that a scene asks for.

use super::Resolver;
use crate::scene::plan::AccuracyPlan;
use crate::scene::spec::accuracy::{Accuracy, AccuracyQuantity, AccuracyTable};

/// Largest relative error that can be asked for.
const MAX_RELATIVE_ERROR: f64 = 0.1;

/// The key `accuracy`; the outer `None` if it is wrong.
pub(super) fn resolve(r: &mut Resolver) -> Option<Option<AccuracyPlan>> {
    if r.document.get("accuracy").is_none() {
        return Some(None);
    }
    let all = |relative| AccuracyTable { relative, of: None, keep: Vec::new() };
    let AccuracyTable { relative, of, keep: fixed_parameters } = match r.section::<Accuracy>("accuracy")? {
        Accuracy::Number(relative) => all(relative),
        Accuracy::Table(wanted) => wanted,
        Accuracy::Text(text) => match text.trim().parse::<f64>() {
            Ok(relative) if relative > 0.0 && relative <= MAX_RELATIVE_ERROR => all(relative),
            _ => {
                let message = format!("`accuracy` = \"{text}\" is not a relative error");
                let mend = format!("give a number above 0 and at most {MAX_RELATIVE_ERROR}, e.g. 1e-3");
                r.report("accuracy", message, "this text", mend);
                return None;
            }
        },
    };
    Some(Some(AccuracyPlan {
        relative,
        quantities: of.unwrap_or_else(|| AccuracyQuantity::ALL.to_vec()),
        fixed_parameters,
    }))
}
