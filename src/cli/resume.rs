//! Command that resumes a run.

use super::options::RunArgs;

/// Command that resumes a run with the same scene, overrides, memory limit and output directory. If `other_limit`, the
/// placeholder SIZE replaces the memory limit.
pub(super) fn resume_command(arguments: &RunArgs, other_limit: bool) -> String {
    let mut words = vec!["orthowear run".to_owned(), shell_quoted(&arguments.scene.scene.to_string_lossy())];
    words.extend(arguments.scene.overrides.iter().map(|line| format!("--set {}", shell_quoted(line))));
    if other_limit {
        words.push("--max-memory SIZE".to_owned());
    } else if let Some(limit) = arguments.scene.max_memory {
        words.push(format!("--max-memory {}", shell_quoted(&limit.to_string())));
    }
    words.extend(arguments.out.iter().map(|out| format!("--out {}", shell_quoted(&out.to_string_lossy()))));
    words.push("--resume".to_owned());
    words.join(" ")
}

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
