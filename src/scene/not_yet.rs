//! Keys and values of the scene's format that this version does not do yet, so that it can say so.

/// What a key below `table` would be, if it belongs to a later version.
pub(super) fn key(table: &str, name: &str) -> Option<&'static str> {
    let first = table.split('.').next().unwrap_or("");
    Some(match (first, name) {
        ("frame", "grow") => "growing frame",
        _ => return None,
    })
}

/// What a value of the key `name` would be, if it belongs to a later version.
pub(super) fn value(name: &str, word: &str) -> Option<&'static str> {
    Some(match (name, word) {
        ("kind", "be") => "finite boundary-element body",
        ("near_field", "half-space") => "half-space near field",
        _ => return None,
    })
}
