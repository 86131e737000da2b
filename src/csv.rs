//! Tables of text: lines and cells of CSV files.

/// The lines of a table with their numbers from 1, trimmed; blank lines and those that begin with # are left out.
pub(crate) fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// The cells of a line of a table: between commas or semicolons where it has them, else between blanks; without the quotes
/// around them.
pub(crate) fn split_fields(line: &str) -> Vec<&str> {
    if line.contains([',', ';']) {
        // A separator at the end of the line closes its last cell.
        let line = line.strip_suffix([',', ';']).unwrap_or(line);
        line.split([',', ';']).map(|cell| unquoted(cell.trim())).collect()
    } else {
        line.split_whitespace().map(unquoted).collect()
    }
}

/// What is wrong with a line that has commas as well as semicolons: the commas are decimal ones, or separate other cells.
pub(crate) fn mixed_separators(line: &str) -> Option<&'static str> {
    (line.contains(';') && line.contains(',')).then_some(
        "has commas as well as semicolons: decimal commas are not read; write decimal points, or separate all values alike",
    )
}

/// A cell without the quotes around it.
fn unquoted(cell: &str) -> &str {
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
}
