//! Points of a sample, distributed evenly over the ranges of several keys.

use crate::scene::Diagnostic;
use crate::scene::document::{Document, TomlNode, TomlValue};
use crate::sweep::spec::{SampleKeys, SampleMethod, SampledRange, Spacing};

/// Digits after the first digit to which sampled numbers are rounded.
const DIGITS: usize = 11;

/// Points in the unit cube, `[count][dimensions]`.
///
/// # Sources
/// M. D. McKay, R. J. Beckman, W. J. Conover, A comparison of three methods for selecting values of input variables, 1979.
/// B. Burley, Practical hash-based Owen scrambling, 2020.
fn points(keys: &SampleKeys, dimensions: usize) -> Vec<Vec<f64>> {
    let count = keys.count;
    match keys.method {
        SampleMethod::Sobol => {
            let coordinate =
                |i: usize, k: usize| f64::from(sobol_burley::sample(i as u32, k as u32, keys.seed));
            (0..count).map(|i| (0..dimensions).map(|k| coordinate(i, k)).collect()).collect()
        }
        SampleMethod::LatinHypercube => {
            let mut random = fastrand::Rng::with_seed(u64::from(keys.seed));
            let mut points = vec![Vec::with_capacity(dimensions); count];
            for _ in 0..dimensions {
                let mut strata: Vec<usize> = (0..count).collect();
                random.shuffle(&mut strata);
                for (point, stratum) in points.iter_mut().zip(strata) {
                    point.push((stratum as f64 + random.f64()) / count as f64);
                }
            }
            points
        }
    }
}

/// Maximum number of dimensions that both methods support.
pub(super) const MOST_DIMENSIONS: usize = 256;

/// The sampled numbers of each range, `[dimensions][count]`, or all errors. Each range comes with its key in the study file.
pub(super) fn values(
    keys: &SampleKeys,
    ranges: &[(&SampledRange, String)],
    document: &Document,
) -> Result<Vec<Vec<TomlNode>>, Vec<Diagnostic>> {
    let wrong =
        |place: &str, message: String, mend: &str| Diagnostic::at(document, place, message).help(mend);
    let mut mistakes = Vec::new();
    for (range, place) in ranges {
        let SampledRange { from, to, spacing } = **range;
        if !(from.is_finite() && to.is_finite() && from != to) {
            let message =
                format!("the range goes from {from} to {to}; its ends must be finite and different");
            mistakes.push(wrong(place, message, "give two different numbers"));
        } else if spacing == Spacing::Log && from * to <= 0.0 {
            let message = format!(
                "a range from {from} to {to} cannot have logarithmic spacing: both ends must have the same sign and differ from 0"
            );
            mistakes.push(wrong(
                &format!("{place}.spacing"),
                message,
                "give ends above 0, or remove `spacing`",
            ));
        }
    }
    if ranges.len() > MOST_DIMENSIONS {
        let message = format!("{} axes are sampled; at most {MOST_DIMENSIONS} are allowed", ranges.len());
        mistakes.push(wrong("sample", message, "give some of them `values` instead"));
    }
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let points = points(keys, ranges.len());
    let column = |(k, (range, place)): (usize, &(&SampledRange, String))| {
        let Some(written) = document.get(place) else { return Vec::new() };
        let node = |number: f64| TomlNode { source: written.source.clone(), value: TomlValue::Float(number) };
        points.iter().map(|point| node(within(range, point[k]))).collect()
    };
    Ok(ranges.iter().enumerate().map(column).collect())
}

/// The number at the fraction `share` (0 to 1) of a range, rounded to [`DIGITS`] digits after the first.
fn within(range: &SampledRange, share: f64) -> f64 {
    let SampledRange { from, to, spacing } = *range;
    let between = |a: f64, b: f64| a * (1.0 - share) + b * share;
    let number = match spacing {
        Spacing::Linear => between(from, to),
        Spacing::Log => 10.0_f64.powf(between(from.abs().log10(), to.abs().log10())).copysign(from),
    };
    format!("{number:.DIGITS$e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(method: SampleMethod, count: usize, seed: u32) -> SampleKeys {
        SampleKeys { method, count, seed }
    }

    /// Number of `parts` equal intervals of dimension `k` that contain a point.
    fn parts_met(points: &[Vec<f64>], k: usize, parts: usize) -> usize {
        let mut met = vec![false; parts];
        points.iter().for_each(|point| met[(point[k] * parts as f64) as usize] = true);
        met.into_iter().filter(|met| *met).count()
    }

    /// Truth: a Latin hypercube has one point in each of `count` equal intervals of each axis. A scrambled Sobol sequence has this
    /// property if `count` is a power of two. On its first two axes, every cell of a 2^a x 2^b grid with `count` cells contains one
    /// point (McKay et al. 1979; Owen 1995).
    #[test]
    fn points_are_stratified() {
        let latin = points(&keys(SampleMethod::LatinHypercube, 37, 5), 6);
        for k in 0..6 {
            assert_eq!(parts_met(&latin, k, 37), 37);
        }
        let sobol = points(&keys(SampleMethod::Sobol, 64, 5), 6);
        for k in 0..6 {
            assert_eq!(parts_met(&sobol, k, 64), 64);
        }
        for (a, b) in [(2, 32), (4, 16), (8, 8), (16, 4)] {
            let mut met = vec![0; 64];
            for point in &sobol {
                met[(point[0] * f64::from(a)) as usize * b as usize + (point[1] * f64::from(b)) as usize] +=
                    1;
            }
            assert!(met.iter().all(|count| *count == 1), "{a} x {b}: {met:?}");
        }
    }

    #[test]
    fn seeds() {
        for method in [SampleMethod::Sobol, SampleMethod::LatinHypercube] {
            let of = |seed| points(&keys(method, 8, seed), 2);
            assert_eq!(of(1), of(1));
            assert_ne!(of(1), of(2));
        }
    }

    /// Truth: the mean of a sample is the middle of its range (4, and -7 for the decimal logarithm), to 1/256 of the range.
    #[test]
    fn ranges_are_covered() {
        let linear = SampledRange { from: 2.0, to: 6.0, spacing: Spacing::Linear };
        let log = SampledRange { from: 1e-9, to: 1e-5, spacing: Spacing::Log };
        for method in [SampleMethod::Sobol, SampleMethod::LatinHypercube] {
            let points = points(&keys(method, 256, 3), 2);
            let mean = |of: &dyn Fn(&Vec<f64>) -> f64| points.iter().map(of).sum::<f64>() / 256.0;
            assert!((mean(&|p| within(&linear, p[0])) - 4.0).abs() < 4.0 / 256.0);
            assert!((mean(&|p| within(&log, p[1]).log10()) + 7.0).abs() < 4.0 / 256.0);
        }
    }
}
