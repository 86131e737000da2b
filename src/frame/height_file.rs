//! Reads gap heights from files: text tables (CSV) and NumPy arrays (NPY).

use std::path::Path;

use crate::csv::{Separators, data_lines, split_fields};
use crate::error::{Error, Result};
use crate::npy::{self, Array2};

/// Reads a table from a NumPy array or lines of numbers. The row is the index along x, and the column is the index
/// along y.
///
/// # Errors
/// If the file cannot be read or is no table of finite numbers.
pub fn read(path: &Path) -> Result<Array2> {
    let bytes = std::fs::read(path).map_err(|error| Error::input(error.to_string()))?;
    let is_npy = bytes.starts_with(b"\x93NUMPY") || path.extension().is_some_and(|end| end == "npy");
    let array = if is_npy { npy::read(&bytes)? } else { csv(&bytes)? };
    let columns = array.shape[1];
    match array.values.iter().position(|value| !value.is_finite()) {
        Some(bad) => Err(Error::input(format!(
            "the value in row {}, column {} is {}; all must be finite numbers",
            bad / columns + 1,
            bad % columns + 1,
            array.values[bad]
        ))),
        None => Ok(array),
    }
}

/// Parses lines with equal counts of numbers. Blank lines and lines that begin with # are skipped.
fn csv(bytes: &[u8]) -> Result<Array2> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| Error::input("the file is neither text (UTF-8) nor a .npy file"))?;
    let (mut values, mut shape) = (Vec::new(), [0, 0]);
    let mut separators = Separators::default();
    for (number, line) in data_lines(text) {
        separators.check(line).map_err(|problem| Error::input(format!("line {number} {problem}")))?;
        let start = values.len();
        for cell in split_fields(line) {
            let column = values.len() - start + 1;
            let value = cell.parse::<f64>().map_err(|_| {
                let found = if cell.is_empty() { "nothing".to_owned() } else { format!("\"{cell}\"") };
                Error::input(format!(
                    "line {} (row {}, column {column}) contains {found} instead of a number",
                    number,
                    shape[0] + 1
                ))
            })?;
            values.push(value);
        }
        let length = values.len() - start;
        if shape[0] > 0 && length != shape[1] {
            return Err(Error::input(format!(
                "line {} (row {}) has {length} values, but the first row has {}",
                number,
                shape[0] + 1,
                shape[1]
            )));
        }
        shape = [shape[0] + 1, length];
    }
    if values.is_empty() {
        Err(Error::input("the file contains no numbers"))
    } else {
        Ok(Array2 { values, shape })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: each text holds the table [[1, 2.5], [-3, 40]]; separators may be commas, semicolons or blanks.
    #[test]
    fn separators() {
        for text in [
            "1,2.5\n-3,4e1",
            "1;2.5;\n-3;4e1;\n",
            "# heights\n\n 1 2.5\r\n-3\t40\r\n",
            "\u{feff}1, 2.5\n-3, 40",
            "\"1\",\"2.5\"\n-3,\"40\"",
        ] {
            let array = csv(text.as_bytes()).unwrap();
            assert_eq!((array.values, array.shape), (vec![1.0, 2.5, -3.0, 40.0], [2, 2]), "{text:?}");
        }
    }

    /// Truth: messages on wrong values give row and column, messages on wrong lines the line number.
    #[test]
    fn mistakes_are_placed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("heights.csv");
        for (text, words) in [
            ("1,2\n3,x", &["line 2 (row 2, column 2)", "\"x\""][..]),
            ("# a\n1,2\n3,,4", &["line 3 (row 2, column 2)", "nothing"]),
            ("1,2\n3,nan", &["row 2, column 2", "NaN"]),
            ("1,inf\n3,4", &["row 1, column 2", "inf"]),
            ("1,2\n3", &["line 2 (row 2) has 1 values, but the first row has 2"]),
            ("0,5;1,5\n1,0;2,0\n", &["line 1", "decimal commas are not read"]),
            ("1\t2\n0,5\t1\n", &["line 2", "decimal commas are not read"]),
            ("# only words\n", &["no numbers"]),
        ] {
            std::fs::write(&path, text).unwrap();
            let error = read(&path).expect_err("refused").to_string();
            words.iter().for_each(|word| assert!(error.contains(word), "{text:?}: {error}"));
        }
        std::fs::write(&path, [0xff, 0xfe, 0]).unwrap();
        assert!(read(&path).expect_err("no text").to_string().contains("neither"));
        assert!(read(&folder.path().join("none.csv")).is_err());
    }
}
