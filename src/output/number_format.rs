//! Number formats for figures and reports.

/// Formats a number with five significant digits. Magnitudes from 1e5 to 1e7 give an integer. Magnitudes below 1e-4 and
/// from 1e7 get an exponent. Magnitudes below 1e-12 count as round-off and give 0.
pub fn five_digits(x: f64) -> String {
    if x.abs() < 1e-12 { "0".to_owned() } else { five_digits_of_small(x) }
}

/// Formats a number of a group as [`five_digits`] does. Magnitudes below 1e-12 × `largest`, the largest magnitude of
/// the group, give 0.
pub fn five_digits_of_group(x: f64, largest: f64) -> String {
    if x.abs() < 1e-12 * largest { "0".to_owned() } else { five_digits_of_small(x) }
}

/// Formats a number as [`five_digits`] does, but does not replace small numbers by 0. For quantities without
/// cancellation, such as volumes.
pub fn five_digits_of_small(x: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let digits = x.abs().log10().floor() as i32;
    if !(-4..=6).contains(&digits) {
        return format!("{x:.4e}");
    }
    format!("{x:.*}", usize::try_from((4 - digits).max(0)).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use crate::output::number_format::{five_digits, five_digits_of_group};

    /// Truth: the numbers rounded by hand.
    #[test]
    fn numbers_are_short() {
        assert_eq!(
            [290.726_11, -0.02, 1.0e-9, 123_456.7, 0.0, 3.3e-17].map(five_digits),
            ["290.73", "-0.020000", "1.0000e-9", "123457", "0", "0"]
        );
        // Volumes in cubic metres, and the round-off of a force of 300 N.
        assert_eq!([5e-13, -2e-17].map(|x| five_digits_of_group(x, 5e-13)), ["5.0000e-13", "-2.0000e-17"]);
        assert_eq!(five_digits_of_group(-2e-11, 300.0), "0");
    }
}
