//! Text fields of CSV files.

/// Field in quotes. Quotes inside are doubled.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
