//! Ranges of numbers in exact decimal arithmetic: for example 15 instead of 14.999999999999998.

use crate::scene::Diagnostic;
use crate::scene::document::{Document, TomlNode, TomlValue};
use crate::sweep::spec::{Range, Spacing};

/// Maximum difference between the powers of ten of numbers that are added as decimals.
const MAX_EXPONENT_SPREAD: i32 = 16;
/// Number of digits after the first to which logarithmic ranges are rounded, so that every machine gives the same
/// numbers.
const DIGITS: usize = 11;

/// Numbers of the range at `key`, at most `most`; integers if all are whole and the file gives both ends as integers.
///
/// # Errors
/// If the range is invalid. The diagnostic names the wrong key.
pub(super) fn values(
    range: &Range,
    document: &Document,
    key: &str,
    most: usize,
) -> Result<Vec<TomlNode>, Box<Diagnostic>> {
    let wrong = |part: &str, message: String, mend: &str| {
        let dot = if part.is_empty() { "" } else { "." };
        Box::new(Diagnostic::at(document, &format!("{key}{dot}{part}"), message).help(mend))
    };
    let Range { from, to, .. } = *range;
    if range.count.is_some_and(|count| count > most) {
        // The schema check reports this error.
        return Ok(Vec::new());
    }
    if !(from.is_finite() && to.is_finite() && from != to) {
        let message = format!("the range goes from {from} to {to}; its ends must be finite and different");
        return Err(wrong("", message, "give two different numbers"));
    }
    let numbers = match (range.count, range.step, range.spacing) {
        (Some(count), None, Spacing::Linear) => linear(from, to, count),
        (Some(count), None, Spacing::Log) if from * to > 0.0 => log(from, to, count),
        (Some(_), None, Spacing::Log) => {
            let message = format!(
                "a range from {from} to {to} cannot have logarithmic spacing: both ends must have the same sign and differ from 0"
            );
            return Err(wrong("spacing", message, "give ends above 0, or remove `spacing`"));
        }
        (None, Some(_), Spacing::Log) => {
            let message = "logarithmic spacing does not support `step`".to_owned();
            return Err(wrong("spacing", message, "give `count` instead of `step`"));
        }
        (None, Some(step), Spacing::Linear) => {
            steps(from, to, step, most).map_err(|(message, mend)| wrong("step", message, &mend))?
        }
        (Some(_), Some(_), _) => {
            return Err(wrong(
                "step",
                "the range has both `count` and `step`".to_owned(),
                "remove one of them",
            ));
        }
        (None, None, _) => {
            return Err(wrong(
                "",
                "the range has neither `count` nor `step`".to_owned(),
                "give `count` or `step`",
            ));
        }
    };
    let is_integer = |part: &str| {
        matches!(document.get(&format!("{key}.{part}")), Some(TomlNode { value: TomlValue::Integer(_), .. }))
    };
    let whole = is_integer("from") && is_integer("to");
    let whole = whole && numbers.iter().all(|n| n.fract() == 0.0 && n.abs() < 9.0e15);
    let Some(written) = document.get(key) else { return Ok(Vec::new()) };
    let node = |number: f64| TomlNode {
        source: written.source.clone(),
        value: if whole { TomlValue::Integer(number as i64) } else { TomlValue::Float(number) },
    };
    Ok(numbers.into_iter().map(node).collect())
}

/// Integers that equal `numbers` when multiplied by a common power of ten, and the exponent of this power. `None` if the exponents
/// of the numbers differ by more than [`MAX_EXPONENT_SPREAD`].
fn decimals<const N: usize>(numbers: [f64; N]) -> Option<([i128; N], i32)> {
    let mut parts = [(0_i128, 0_i32); N];
    for (part, number) in parts.iter_mut().zip(numbers) {
        let text = format!("{number:e}");
        let (digits, power) = text.split_once('e')?;
        let after = digits.split_once('.').map_or(0, |(_, after)| after.len());
        *part = (digits.replace('.', "").parse().ok()?, power.parse::<i32>().ok()? - after as i32);
    }
    let least = parts.iter().filter(|(digits, _)| *digits != 0).map(|(_, power)| *power).min()?;
    let mut all = [0; N];
    for (one, (digits, power)) in all.iter_mut().zip(parts).filter(|(_, (digits, _))| *digits != 0) {
        let apart = power - least;
        *one = (apart <= MAX_EXPONENT_SPREAD).then(|| digits * 10_i128.pow(apart as u32))?;
    }
    Some((all, least))
}

fn nearest(digits: i128, power: i32) -> f64 {
    format!("{digits}e{power}").parse().unwrap_or(f64::NAN)
}

fn linear(from: f64, to: f64, count: usize) -> Vec<f64> {
    let n = (count.max(2) - 1) as i128;
    let Some(([a, b], power)) = decimals([from, to]) else {
        let between = |i: i128| from * ((n - i) as f64 / n as f64) + to * (i as f64 / n as f64);
        return (0..=n).map(between).collect();
    };
    let value = |i: i128| {
        let sum = a * (n - i) + b * i;
        if sum % n == 0 { nearest(sum / n, power) } else { nearest(sum, power) / n as f64 }
    };
    (0..=n).map(value).collect()
}

fn log(from: f64, to: f64, count: usize) -> Vec<f64> {
    let last = count.max(2) - 1;
    let (a, b) = (from.abs().log10(), to.abs().log10());
    let value = |i: usize| match i {
        0 => from,
        _ if i == last => to,
        _ => {
            let share = i as f64 / last as f64;
            let number = 10.0_f64.powf(a * (1.0 - share) + b * share).copysign(from);
            format!("{number:.DIGITS$e}").parse().unwrap_or(number)
        }
    };
    (0..=last).map(value).collect()
}

/// Numbers of a range with a step, which must lead to `to` in at most `most` numbers. Otherwise returns a message and a help text.
fn steps(from: f64, to: f64, step: f64, most: usize) -> Result<Vec<f64>, (String, String)> {
    let use_count = "give `count` instead of `step`".to_owned();
    let Some(([a, b, by], power)) = decimals([from, to, step]) else {
        return Err((
            format!("the step {step} differs too much in magnitude from {from} and {to}"),
            use_count,
        ));
    };
    if by == 0 || (b > a) != (by > 0) {
        let mend = "give a step above 0 for a rising range, below 0 for a falling range".to_owned();
        return Err((format!("the step {step} does not lead from {from} to {to}"), mend));
    }
    let n = (b - a) / by;
    if (b - a) % by != 0 {
        let (before, after) = (nearest(a + n * by, power), nearest(a + (n + 1) * by, power));
        let message = format!("steps of {step} from {from} do not reach {to} exactly");
        return Err((message, format!("end the range at {before} or {after}, or {use_count}")));
    }
    if n >= most as i128 {
        return Err((format!("the range has {} values (at most {most})", n + 1), use_count));
    }
    Ok((0..=n).map(|i| nearest(a + i * by, power)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the numbers equal the decimals that a person would write, without rounding difference.
    #[test]
    fn numbers_are_the_decimals_that_are_meant() {
        assert_eq!(linear(0.0, 90.0, 7), [0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0]);
        assert_eq!(linear(0.1, 0.7, 7), [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]);
        assert_eq!(linear(3e-9, 1e-9, 3), [3e-9, 2e-9, 1e-9]);
        assert_eq!(linear(-0.3, 0.3, 3), [-0.3, 0.0, 0.3]);
        assert_eq!(steps(0.1, 0.5, 0.1, 9), Ok(vec![0.1, 0.2, 0.3, 0.4, 0.5]));
        assert_eq!(steps(90.0, 0.0, -22.5, 9), Ok(vec![90.0, 67.5, 45.0, 22.5, 0.0]));
        assert_eq!(log(1e-9, 1e-6, 4), [1e-9, 1e-8, 1e-7, 1e-6]);
        assert_eq!(log(-2.0, -0.02, 3), [-2.0, -0.2, -0.02]);
    }

    /// Truth: multiples of 1/3 have errors of at most 2^-53. Both ends are exact, even 60 powers of ten apart. The ratios of a
    /// logarithmic range are constant to 2e-11.
    #[test]
    fn other_numbers_are_the_nearest() {
        for (i, found) in linear(0.0, 1.0, 4).into_iter().enumerate() {
            assert!((found - i as f64 / 3.0).abs() <= f64::EPSILON / 2.0);
        }
        let far = linear(1e-30, 1e30, 3);
        assert_eq!([far[0], far[2]], [1e-30, 1e30]);
        let ratios = log(1.0, 2.0, 13);
        assert_eq!([ratios[0], ratios[12]], [1.0, 2.0]);
        for pair in ratios.windows(2) {
            assert!((pair[1] / pair[0] - 2.0_f64.powf(1.0 / 12.0)).abs() < 2e-11);
        }
    }

    /// Truth: steps that miss the end are refused with the possible ends, other wrong steps with their own messages.
    #[test]
    fn steps_that_miss_the_end_are_refused() {
        let (message, mend) = steps(0.0, 1.0, 0.3, 9).expect_err("no step");
        assert!(
            message.contains("do not reach 1 exactly") && mend.contains("0.9 or 1.2"),
            "{message}: {mend}"
        );
        for (step, words) in [
            (0.0, "does not lead"),
            (-0.5, "does not lead"),
            (0.1, "11 values"),
            (1e-40, "differs too much in magnitude"),
        ] {
            let (message, _) = steps(0.0, 1.0, step, 9).expect_err("no step");
            assert!(message.contains(words), "{message}");
        }
    }
}
