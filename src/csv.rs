//! Lines and cells of CSV files.

/// Trimmed lines of a table with their numbers from 1, without blank lines and lines that begin with #.
pub(crate) fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// Cells of a line, without enclosing quotes. Commas or semicolons separate them, or blanks if the line has neither.
pub(crate) fn split_fields(line: &str) -> Vec<&str> {
    if line.contains([',', ';']) {
        // A separator at the end of the line does not start a further cell.
        let line = line.strip_suffix([',', ';']).unwrap_or(line);
        line.split([',', ';']).map(|cell| unquoted(cell.trim())).collect()
    } else {
        line.split_whitespace().map(unquoted).collect()
    }
}

/// Checks that all lines of a table use the same separator, so that a decimal comma is not read as a separator.
#[derive(Default)]
pub(crate) struct Separators {
    /// Separator of the lines so far: comma or semicolon.
    found: Option<char>,
}

impl Separators {
    /// Checks a line.
    ///
    /// # Errors
    /// If the line mixes separators, or uses another one than the lines before. The text is the reason, for the end of a message.
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

/// Whether blanks separate the values of a line and a number contains a comma: "1 100,5".
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

/// Removes the quotes around a cell.
fn unquoted(cell: &str) -> &str {
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: docs/scene.md: decimal commas are refused next to semicolons, blanks or tabs. Texts may contain blanks.
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
