//! Command line that resumes a run.

use super::options::RunArgs;
use crate::error::exit;

/// Command that resumes an interrupted run, or a run that ended with `code`.
pub(super) fn resume_command(arguments: &RunArgs, code: u8) -> String {
    let mut words = vec!["orthowear run".to_owned(), shell_quoted(&arguments.scene.scene.to_string_lossy())];
    words.extend(arguments.scene.overrides.iter().map(|line| format!("--set {}", shell_quoted(line))));
    match arguments.scene.max_memory {
        // The memory limit may have been too low, so the user replaces SIZE. No other setting may differ.
        _ if code == exit::RESOURCES => words.push("--max-memory SIZE".to_owned()),
        Some(limit) => words.push(format!("--max-memory {}", shell_quoted(&limit.to_string()))),
        None => {}
    }
    words.extend(arguments.out.iter().map(|out| format!("--out {}", shell_quoted(&out.to_string_lossy()))));
    words.push("--resume".to_owned());
    words.join(" ")
}

/// Quotes a shell word if necessary.
fn shell_quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.to_owned();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use super::shell_quoted;

    /// Truth: the quoting rules of POSIX shells.
    #[test]
    fn words_for_the_shell() {
        assert_eq!(shell_quoted("scenes/a.toml"), "scenes/a.toml");
        assert_eq!(shell_quoted("frame.cells=[8, 8]"), "'frame.cells=[8, 8]'");
        assert_eq!(shell_quoted("it's"), r"'it'\''s'");
        assert_eq!(shell_quoted(""), "''");
    }
}
