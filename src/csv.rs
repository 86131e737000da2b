//! Lines and cells of CSV files.

/// Lines of a table without surrounding blanks, each with its line number in `text` (from 1). Blank lines and lines
/// that begin with # are omitted.
pub(crate) fn data_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.trim_start_matches('\u{feff}').lines().map(str::trim);
    lines
        .enumerate()
        .map(|(i, line)| (i + 1, line))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
}

/// Splits a line into cells, without surrounding blanks and double quotes. Commas and semicolons separate cells, even
/// within quotes. If a line has neither commas nor semicolons, blanks separate its cells.
pub(crate) fn split_fields(line: &str) -> Vec<&str> {
    if line.contains([',', ';']) {
        // A separator at the end of the line does not start another cell.
        let line = line.strip_suffix([',', ';']).unwrap_or(line);
        line.split([',', ';']).map(|cell| unquoted(cell.trim())).collect()
    } else {
        line.split_whitespace().map(unquoted).collect()
    }
}

/// Checks that all lines of a table use the same separator. Otherwise a decimal comma might be read as a separator.
#[derive(Default)]
pub(crate) struct Separators {
    /// Separator of the previous lines: comma, semicolon or blank. `None` if the lines had one cell only.
    found: Option<char>,
}

impl Separators {
    /// Checks the separators of a line.
    ///
    /// # Errors
    /// If the line contains commas as well as semicolons, a comma that may be a decimal comma, or a separator that
    /// differs from earlier lines. The error text begins with "has" and needs a subject in front, such as "the row".
    pub(crate) fn check(&mut self, line: &str) -> Result<(), String> {
        let blank = line.split_whitespace().nth(1).map(|_| ' ');
        let separator = line.chars().find(|c| [',', ';'].contains(c)).or(blank);
        let problem = if line.contains(',') && line.contains(';') {
            Some("commas as well as semicolons")
        } else if may_have_decimal_comma(line) {
            Some("a comma that may be a decimal comma, and blanks between values")
        } else if separator.zip(self.found).is_some_and(|(here, before)| here != before) {
            Some("another separator than the lines above")
        } else {
            None
        };
        self.found = self.found.or(separator);
        match problem {
            Some(problem) => Err(format!(
                "has {problem}: decimal commas are not read; write decimal points, and the same separator between all values"
            )),
            None => Ok(()),
        }
    }
}

/// Whether the line has a comma that may be a decimal comma. This is a comma with two properties:
///
/// * Whole numbers stand directly on both sides. An exponent may follow the number on the right.
/// * One of the two cells beside the comma has several words.
///
/// The comma in "1 100,5" has both properties. The comma in "0.1,5 of 10" does not, because 0.1 is not a whole number.
fn may_have_decimal_comma(line: &str) -> bool {
    let is_whole = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let cells: Vec<&str> = line.split(',').collect();
    cells.windows(2).any(|cells| {
        let last_word = cells[0].rsplit(char::is_whitespace).next().unwrap_or("");
        let first_word = cells[1].split(char::is_whitespace).next().unwrap_or("");
        let decimals = first_word.split_once(['e', 'E']).map_or(first_word, |(decimals, _)| decimals);
        cells.iter().any(|cell| cell.split_whitespace().nth(1).is_some())
            && is_whole(last_word.trim_start_matches(['+', '-']))
            && is_whole(decimals)
    })
}

/// Removes a pair of double quotes around a cell.
fn unquoted(cell: &str) -> &str {
    cell.strip_prefix('"').and_then(|cell| cell.strip_suffix('"')).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: docs/scene.md. Decimal commas together with semicolons, blanks or tabs are refused. Texts, units and
    /// dates in other columns may contain blanks. A line whose separator differs from the line before is refused.
    #[test]
    fn decimal_commas_are_no_separators() {
        for wrong in
            ["1\t100,5", "0,001\t3", "0.5 0,001", "0,5;1,5", "load 1,5", "1 0,5 0,5 0,7", "1 -0,5e-3"]
        {
            assert!(Separators::default().check(wrong).is_err(), "{wrong}");
        }
        for right in [
            "1,2, 3",
            "1 , 2",
            "1 2",
            "2026-01-02 12:00:00,5",
            "0.01,2026-01-02 12:00:00",
            "1,2026-01-02 12:00:00,0.01",
            "step 1,0.01",
            "0.01,5 of 10",
            "start of test,1,2",
            "\"load 1\",5",
            "1;2",
        ] {
            assert_eq!(Separators::default().check(right), Ok(()), "{right}");
        }
        for lines in [["time;force", "0,5"], ["1 2", "0,5"], ["1;2", "0 5"]] {
            let mut separators = Separators::default();
            assert!(separators.check(lines[0]).is_ok() && separators.check(lines[1]).is_err(), "{lines:?}");
        }
    }
}
