//! Values of the scene's format that this version does not do yet, so that it can say so.

/// What a value of the key `name` would be, if it belongs to a later version.
pub(super) fn value(name: &str, word: &str) -> Option<&'static str> {
    Some(match (name, word) {
        ("kind", "be") => "finite boundary-element body",
        _ => return None,
    })
}
