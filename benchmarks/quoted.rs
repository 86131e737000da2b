//! Quotes text fields of CSV files.

/// CSV field in quotes. Quotes inside the text are doubled.
pub fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "\"\""))
}
