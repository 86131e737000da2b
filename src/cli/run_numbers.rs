//! Numbers of runs in the syntax of the option `--only`.

use std::fmt;
use std::str::FromStr;

/// Ranges `[first, last]` of run numbers, counted from 1. A range includes both ends.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct RunNumbers(Vec<[usize; 2]>);

impl RunNumbers {
    /// Indices of the runs, counted from 0 and sorted. `None` if a run number exceeds `most`.
    pub fn indices(&self, most: usize) -> Option<Vec<usize>> {
        if self.0.iter().any(|[_, last]| *last > most) {
            return None;
        }
        let mut numbers: Vec<usize> = self.0.iter().flat_map(|[first, last]| first - 1..*last).collect();
        numbers.sort_unstable();
        numbers.dedup();
        Some(numbers)
    }
}

impl FromStr for RunNumbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let part = |part: &str| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let [first, last] = [first, last].map(|number| number.trim().parse::<usize>().ok());
            match first.zip(last).filter(|(first, last)| *first > 0 && *last > 0) {
                Some((first, last)) if first <= last => Ok([first, last]),
                Some((first, last)) => {
                    Err(format!("{first}-{last} ends before it begins: write {last}-{first}"))
                }
                None => Err("give run numbers from 1, or ranges of them, like 3 or 1-4,9".to_owned()),
            }
        };
        text.split(',').map(part).collect::<Result<_, _>>().map(Self)
    }
}

impl fmt::Display for RunNumbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let part = |[first, last]: &[usize; 2]| {
            if first == last { first.to_string() } else { format!("{first}-{last}") }
        };
        f.write_str(&self.0.iter().map(part).collect::<Vec<_>>().join(","))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth (docs/study.md): run numbers count from 1, a range includes both ends, and each run is selected once.
    #[test]
    fn numbers_and_ranges() {
        let of = |text: &str, most| text.parse::<RunNumbers>().expect(text).indices(most);
        assert_eq!(of("3", 3), Some(vec![2]));
        assert_eq!(of("4-5, 1-2,2", 5), Some(vec![0, 1, 3, 4]));
        assert_eq!(of("3", 2), None);
        for wrong in ["", "0", "2-1", "a", "1,", "-3", "1-"] {
            assert!(wrong.parse::<RunNumbers>().is_err(), "{wrong}");
        }
        let reversed = "2-1".parse::<RunNumbers>().expect_err("a reversed range");
        assert!(reversed.contains("write 1-2"), "{reversed}");
        assert_eq!("1-4,9".parse::<RunNumbers>().expect("numbers").to_string(), "1-4,9");
    }
}
