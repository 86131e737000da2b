//! Suggestions for misspelt words.

use strsim::osa_distance;

/// Returns the candidate nearest to `word`. Its edit distance is at most a third of the length of `word`, or 1 for
/// short words.
pub(crate) fn closest<'a>(word: &str, candidates: &[&'a str]) -> Option<&'a str> {
    let plain = normalised(word);
    let most = (plain.chars().count() / 3).max(1);
    candidates
        .iter()
        .map(|candidate| (osa_distance(&plain, &normalised(candidate)), *candidate))
        .filter(|(distance, _)| *distance <= most)
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}

/// Joins words in quotes, separated by commas. Returns "none" if there are no words.
pub(crate) fn quoted_list(words: &[&str], quote: &str) -> String {
    if words.is_empty() {
        return "none".to_owned();
    }
    words.iter().map(|word| format!("{quote}{word}{quote}")).collect::<Vec<_>>().join(", ")
}

fn normalised(word: &str) -> String {
    word.to_lowercase().replace(['_', ' '], "-").chars().take(64).collect()
}

#[cfg(test)]
mod tests {
    use super::closest;

    /// Truth: words with one typing error are found. A word with another meaning is not suggested.
    #[test]
    fn slips_of_the_finger_are_found() {
        let keys = ["radius", "kind", "half_width", "cells"];
        assert_eq!(closest("raduis", &keys), Some("radius"));
        assert_eq!(closest("Half-Width", &keys), Some("half_width"));
        assert_eq!(closest("cell", &keys), Some("cells"));
        assert_eq!(closest("temperature", &keys), None);
    }
}
