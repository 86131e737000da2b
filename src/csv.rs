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

/// Checks that the lines of a table are separated alike, so that a decimal comma is not read as a separator.
#[derive(Default)]
pub(crate) struct Separators {
    /// The comma or semicolon of the lines so far.
    found: Option<char>,
}

impl Separators {
    /// # Errors
    /// If the line has two kinds of separators, or another one than the lines before: why, to be put after its place.
    pub(crate) fn check(&mut self, line: &str) -> Result<(), String> {
        let separator = line.chars().find(|c| [',', ';'].contains(c));
        let other = if separator.is_some() && line.contains(',') && line.contains(';') {
            Some("commas as well as semicolons")
        } else if has_decimal_comma_between_blanks(line) {
            Some("commas between digits as well as blanks between values")
        } else if separator.zip(self.found).is_some_and(|(here, before)| here != before) {
            Some("other separators than the lines above")
        } else {
            None
        };
        self.found = self.found.or(separator);
        match other {
            Some(other) => Err(format!(
                "has {other}: decimal commas are not read; write decimal points, and separate all values alike"
            )),
            None => Ok(()),
        }
    }
}

/// Whether blanks separate the values of a line and a comma stands within a number: "1 100,5".
fn has_decimal_comma_between_blanks(line: &str) -> bool {
    let cells: Vec<&str> = line.split(',').collect();
    cells.windows(2).any(|cells| {
        let (left, right) = (cells[0], cells[1]);
        let last_word = left.rsplit(char::is_whitespace).next().unwrap_or("");
        cells.iter().any(|cell| cell.split_whitespace().nth(1).is_some())
            && last_word.parse::<f64>().is_ok()
            && right.starts_with(|c: char| c.is_ascii_digit())
    })
}

/// A cell without the quotes around it.
fn unquoted(cell: &str) -> &str {
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: docs/scene.md: decimal commas are refused, where they stand beside semicolons, blanks or tabs; texts of other columns may hold blanks.
    #[test]
    fn decimal_commas_are_no_separators() {
        for wrong in ["1\t100,5", "0,001\t3", "0.5 0,001", "0,5;1,5", "load 1,5", "1 0,5 0,5 0,7"] {
            assert!(Separators::default().check(wrong).is_err(), "{wrong}");
        }
        for right in
            ["1,2, 3", "1 , 2", "1 2", "2026-01-02 12:00:00,5", "start of test,1,2", "\"load 1\",5", "1;2"]
        {
            assert_eq!(Separators::default().check(right), Ok(()), "{right}");
        }
        let mut separators = Separators::default();
        assert!(separators.check("time;force").is_ok() && separators.check("0,5").is_err());
    }
}
