//! Parts of a study for workers that share nothing but the files.

use std::collections::BTreeMap;

use crate::sweep::RunSpec;

/// Splits the runs of these numbers into parts, at least `wanted` of them where there are as many families, an original and its images being one: runs that
/// begin alike are in the same part as far as that number allows.
pub fn parts(specs: &[RunSpec], numbers: &[usize], wanted: usize) -> Vec<Vec<usize>> {
    let original = |number: usize| specs[number].image_of.map_or(number, |image| image.run);
    // By what they have in common.
    let mut families: BTreeMap<(Vec<&str>, usize), Vec<usize>> = BTreeMap::new();
    for &number in numbers {
        let first = original(number);
        let beginnings = specs[first].prefix_keys.iter().map(|(_, beginning)| beginning.as_str()).collect();
        families.entry((beginnings, first)).or_default().push(number);
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
    use crate::geometry::GridSymmetry;
    use crate::linalg::memory::MemoryLimit;
    use crate::sweep::ImageOf;

    fn spec(beginnings: &[&str], image_of: Option<usize>) -> RunSpec {
        let image_of = image_of.map(|run| ImageOf { run, symmetry: GridSymmetry::IDENTITY });
        let beginnings = beginnings.iter().enumerate().map(|(n, text)| (n + 1, (*text).to_owned()));
        let (choice, overrides, folder) = (Vec::new(), Vec::new(), String::new());
        let memory = MemoryLimit::of_machine();
        RunSpec { choice, overrides, folder, prefix_keys: beginnings.collect(), image_of, memory }
    }

    /// Truth: every run once; beginnings and images stay together while there are as many parts as wanted; families are never divided.
    #[test]
    fn parts_keep_together_what_shares() {
        let specs: Vec<RunSpec> = ["a", "a", "b", "b", "a", "b"]
            .iter()
            .zip([None, None, None, Some(1), None, None])
            .map(|(beginning, image)| spec(&[beginning], image))
            .collect();
        let all = [0, 1, 2, 3, 4, 5];
        assert_eq!(parts(&specs, &all, 1), [vec![0, 1, 3, 4], vec![2, 5]]);
        assert_eq!(parts(&specs, &all, 3), [vec![0], vec![1, 3], vec![2, 5], vec![4]]);
        assert_eq!(parts(&specs, &all, 100), [vec![0], vec![1, 3], vec![2], vec![4], vec![5]]);
        assert_eq!(parts(&specs, &[3, 4], 1), [vec![3, 4]]);
        let alone: Vec<RunSpec> = (0..3).map(|_| spec(&[], None)).collect();
        assert_eq!(parts(&alone, &[0, 1, 2], 1), [vec![0], vec![1], vec![2]]);
        assert_eq!(parts(&[0; 8].map(|_| spec(&["a"], None)), &[0, 1, 2, 3, 4, 5, 6, 7], 6).len(), 8);
        assert!(parts(&specs, &[], 4).is_empty());
    }
}
