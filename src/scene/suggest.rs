//! The word that a user most likely meant.

/// The candidate nearest to `word` in edits, if near enough to be meant.
pub(crate) fn closest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let plain = normalised(word);
    let most = (plain.chars().count() / 3).max(1);
    candidates
        .iter()
        .map(|candidate| (edit_distance(&plain, &normalised(candidate)), *candidate))
        .filter(|(distance, _)| *distance <= most)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Words in quotes, separated by commas.
pub(crate) fn quoted_list(words: &[&str], quote: &str) -> String {
    if words.is_empty() {
        return "none".to_owned();
    }
    words.iter().map(|word| format!("{quote}{word}{quote}")).collect::<Vec<_>>().join(", ")
}

/// Small letters, with one kind of hyphen.
fn normalised(word: &str) -> String {
    word.to_lowercase().replace(['_', ' '], "-")
}

/// Least number of insertions, deletions, replacements and swaps of neighbours from one word to the other.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(64).collect(), b.chars().take(64).collect());
    let mut table = vec![vec![0; b.len() + 1]; a.len() + 1];
    for (i, row) in table.iter_mut().enumerate() {
        row[0] = i;
    }
    table[0] = (0..=b.len()).collect();
    for i in 1..=a.len() {
        for j in 1..=b.len() {
            let replaced = table[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(table[i - 1][j] + 1).min(table[i][j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(table[i - 2][j - 2] + 1);
            }
            table[i][j] = least;
        }
    }
    table[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::closest;

    /// Truth: one slip of the finger each; a word of another meaning is not suggested.
    #[test]
    fn slips_of_the_finger_are_found() {
        let keys = ["radius", "kind", "half_width", "cells"];
        assert_eq!(closest("raduis", &keys), Some("radius"));
        assert_eq!(closest("Half-Width", &keys), Some("half_width"));
        assert_eq!(closest("cell", &keys), Some("cells"));
        assert_eq!(closest("temperature", &keys), None);
    }
}
