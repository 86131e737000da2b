//! Keys and values of the scene's format that this version does not do yet, so that it can say so.

/// What a key below `table` would be, if it belongs to a later version.
pub(super) fn key(table: &str, name: &str) -> Option<&'static str> {
    let first = table.split('.').next().unwrap_or("");
    let cycles = table.ends_with(".cycles");
    Some(match (first, name) {
        ("steps", "amplitude2") if cycles => "elliptic cycles",
        ("frame", "grow") => "growing frame",
        ("wear", "tolerance") => "error-controlled cycle jumps",
        _ => return None,
    })
}

/// What a value of the key `name` would be, if it belongs to a later version.
pub(super) fn value(name: &str, word: &str) -> Option<&'static str> {
    Some(match (name, word) {
        ("kind", "be") => "finite boundary-element body",
        ("near_field", "half-space") => "half-space near field",
        ("path", "ellipse") => "elliptic cycles",
        _ => return None,
    })
}

/// What leaving out the key `name` would mean, if that belongs to a later version.
pub(super) fn absent(name: &str) -> Option<&'static str> {
    (name == "jumps")
        .then_some("error-controlled jumps, which need none given, are not available in this version")
}
