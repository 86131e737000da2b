//! Resolves the required accuracy of a scene.

use super::resolver::Resolver;
use crate::scene::plan::AccuracyPlan;
use crate::scene::spec::accuracy::{Accuracy, AccuracyQuantity, AccuracyTable};

/// Resolves the key `accuracy`. Returns `None` after an error, and `Some(None)` if the scene does not have the key.
pub(super) fn resolve(r: &mut Resolver) -> Option<Option<AccuracyPlan>> {
    if r.document.get("accuracy").is_none() {
        return Some(None);
    }
    let AccuracyTable { relative, of, keep: fixed_parameters } = match r.section::<Accuracy>("accuracy")? {
        Accuracy::Number(relative) => AccuracyTable { relative, of: None, keep: Vec::new() },
        Accuracy::Table(wanted) => wanted,
    };
    Some(Some(AccuracyPlan {
        relative,
        quantities: of.unwrap_or_else(|| AccuracyQuantity::ALL.to_vec()),
        fixed_parameters,
    }))
}
