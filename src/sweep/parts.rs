//! Parts of a study for workers that share nothing but the files.

use std::collections::BTreeMap;

use crate::sweep::RunSpec;

/// Splits the runs of these numbers into parts, at least `wanted` of them where there are as many runs: runs that begin alike are in the same
/// part as far as that number allows.
pub fn parts(specs: &[RunSpec], numbers: &[usize], wanted: usize) -> Vec<Vec<usize>> {
    // By what they have in common.
    let mut families: BTreeMap<(Vec<&str>, usize), Vec<usize>> = BTreeMap::new();
    for &number in numbers {
        let beginnings = specs[number].prefix_keys.iter().map(|(_, beginning)| beginning.as_str()).collect();
        families.entry((beginnings, number)).or_default().push(number);
    }
    let of_at_most = |most: usize| {
        let mut parts: Vec<Vec<usize>> = Vec::new();
        let mut last = None;
        for ((beginnings, _), family) in &families {
            let beginning = beginnings.first();
            match parts.last_mut() {
                Some(part)
                    if beginning.is_some() && beginning == last && part.len() + family.len() <= most =>
                {
                    part.extend(family);
                }
                _ => parts.push(family.clone()),
            }
            last = beginning;
        }
        parts
    };
    let wanted = wanted.min(families.len());
    let mut most = numbers.len().div_ceil(wanted.max(1)).max(1);
    while most > 1 && of_at_most(most).len() < wanted {
        most -= 1;
    }
    let mut parts = of_at_most(most);
    // In the order of the study, as far as that goes.
    parts.iter_mut().for_each(|part| part.sort_unstable());
    parts.sort_unstable();
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::memory::MemoryLimit;

    fn spec(beginnings: &[&str]) -> RunSpec {
        let beginnings = beginnings.iter().enumerate().map(|(n, text)| (n + 1, (*text).to_owned()));
        let (choice, overrides, folder) = (Vec::new(), Vec::new(), String::new());
        let memory = MemoryLimit::of_machine();
        RunSpec { choice, overrides, folder, prefix_keys: beginnings.collect(), memory }
    }

    /// Truth: every run once; beginnings stay together while there are as many parts as wanted.
    #[test]
    fn parts_keep_together_what_shares() {
        let specs: Vec<RunSpec> = ["a", "a", "b", "b", "a", "b"].map(|beginning| spec(&[beginning])).into();
        let all = [0, 1, 2, 3, 4, 5];
        assert_eq!(parts(&specs, &all, 2), [vec![0, 1, 4], vec![2, 3, 5]]);
        assert_eq!(parts(&specs, &all, 100).len(), 6);
        let alone: Vec<RunSpec> = (0..3).map(|_| spec(&[])).collect();
        assert_eq!(parts(&alone, &[0, 1, 2], 1), [vec![0], vec![1], vec![2]]);
        assert!(parts(&specs, &[], 4).is_empty());
    }
}
