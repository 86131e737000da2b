//! Axes of a chart: range, ticks, and the mapping from values to pixels.

/// Scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Linear.
    Linear,
    /// Linear, with ticks at whole numbers only.
    Whole,
    /// Logarithmic. Only positive values are shown.
    Logarithmic,
}

impl Scale {
    fn step(self, rough: f64) -> f64 {
        round_up(if self == Self::Whole { rough.max(1.0) } else { rough }, &[1.0, 2.0, 5.0, 10.0])
    }
}

/// Mapping of a range of values to a range of pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    scale: Scale,
    low: f64,
    high: f64,
    pixels: [f64; 2],
}

impl Axis {
    /// Creates an axis between two pixel positions whose range contains all finite `values`. A logarithmic axis ignores
    /// values that are not positive. The ends of the range are round numbers.
    pub fn spanning(values: impl Iterator<Item = f64>, scale: Scale, pixels: [f64; 2]) -> Self {
        let shown = values.filter(|v| v.is_finite() && (scale != Scale::Logarithmic || *v > 0.0));
        let (mut low, mut high) =
            shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if low > high {
            (low, high) = (1.0, 1.0);
        }
        match scale {
            Scale::Linear | Scale::Whole => {
                if low > 0.0 && low < 0.4 * high {
                    low = 0.0;
                }
                if high - low <= 1e-12 * high.abs().max(low.abs()) {
                    let half = if high == 0.0 { 1.0 } else { 0.5 * high.abs() };
                    (low, high) = (low - half, high + half);
                }
                let step = scale.step((high - low) / 6.0);
                (low, high) = ((low / step + 1e-9).floor() * step, (high / step - 1e-9).ceil() * step);
            }
            Scale::Logarithmic => {
                // Powers of ten for a long range, otherwise 1, 2 or 5 times a power of ten.
                let digits: &[f64] = if high > 30.0 * low { &[1.0, 10.0] } else { &[1.0, 2.0, 5.0, 10.0] };
                (low, high) = (round_down(low, digits), round_up(high, digits));
                if low == high {
                    high *= 10.0;
                }
            }
        }
        Self { scale, low, high, pixels }
    }

    /// Creates a linear axis from exactly `low` to `high`.
    pub fn with_bounds([low, high]: [f64; 2], pixels: [f64; 2]) -> Self {
        Self { scale: Scale::Linear, low, high, pixels }
    }

    /// Pixel position of a value, possibly beyond the axis. `None` if this position is not finite, as for a negative
    /// value on a logarithmic axis.
    pub fn to_pixel(&self, value: f64) -> Option<f64> {
        let share = match self.scale {
            Scale::Linear | Scale::Whole => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value / self.low).ln() / (self.high / self.low).ln(),
        };
        share.is_finite().then(|| self.pixels[0] + share * (self.pixels[1] - self.pixels[0]))
    }

    /// Exponent p of the power 10^p by which the labels must be multiplied; a multiple of three. It is 0 for short
    /// labels, and for axes that are not linear.
    pub fn label_exponent(&self) -> i32 {
        let largest = self.high.abs().max(self.low.abs());
        match self.scale {
            Scale::Linear if largest > 0.0 && !(1e-4..1e6).contains(&self.step()) => {
                3 * (largest.log10() / 3.0).floor() as i32
            }
            _ => 0,
        }
    }

    /// `unit` after the power of ten of [`Axis::label_exponent`], if this exponent is not 0.
    pub(crate) fn scaled_unit(&self, unit: &str) -> String {
        match self.label_exponent() {
            0 => unit.to_owned(),
            power => format!("10^{{{power}}} {unit}").replace("{-", "{\u{2212}"),
        }
    }

    fn step(&self) -> f64 {
        self.scale.step((self.high - self.low) / 6.0)
    }

    /// Tick values and their labels. A label shows the value divided by 10^p, p = [`Axis::label_exponent`]. Minor ticks have no
    /// label.
    pub fn ticks(&self) -> Vec<(f64, Option<String>)> {
        match self.scale {
            Scale::Linear | Scale::Whole => {
                let step = self.step();
                let factor = 10_f64.powi(-self.label_exponent());
                let first = (self.low / step - 1e-9).ceil() as i64;
                let last = (self.high / step + 1e-9).floor() as i64;
                let text = |value: f64| Some(label(value * factor, step * factor));
                (first..=last).map(|i| (i as f64 * step, text(i as f64 * step))).collect()
            }
            Scale::Logarithmic => self.logarithmic_ticks(),
        }
    }

    fn logarithmic_ticks(&self) -> Vec<(f64, Option<String>)> {
        let decades = (self.high / self.low).log10();
        let every = (decades / 8.0).ceil().max(1.0) as i32;
        let mut ticks = Vec::new();
        let first = self.low.log10().floor() as i32;
        let last = self.high.log10().ceil() as i32;
        for exponent in first..=last {
            for digit in 1..10 {
                let value = f64::from(digit) * 10_f64.powi(exponent);
                if value < self.low * (1.0 - 1e-9) || value > self.high * (1.0 + 1e-9) {
                    continue;
                }
                let labelled = if digit == 1 {
                    exponent % every == 0
                } else {
                    decades < 1.75 && [2, 5].contains(&digit)
                };
                if labelled || decades < 6.0 {
                    ticks.push((value, labelled.then(|| power_label(digit, exponent))));
                }
            }
        }
        ticks
    }
}

fn round_up(value: f64, digits: &[f64]) -> f64 {
    let decade = 10_f64.powf(value.log10().floor());
    let digit = digits.iter().find(|d| **d * decade >= value * (1.0 - 1e-9)).unwrap_or(&10.0);
    digit * decade
}

fn round_down(value: f64, digits: &[f64]) -> f64 {
    let decade = 10_f64.powf(value.log10().floor());
    let digit = digits.iter().rev().find(|d| **d * decade <= value * (1.0 + 1e-9)).unwrap_or(&1.0);
    digit * decade
}

/// Formats a tick value with the decimals that `step` requires. Very small and very large steps give a power of ten.
pub(crate) fn label(value: f64, step: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(1e-4..1e6).contains(&step) {
        let text = format!("{value:.1e}");
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}\u{b7}10^{{{exponent}}}", mantissa.trim_end_matches(".0"));
    }
    let decimals = (-step.log10().floor()).max(0.0) as usize;
    format!("{value:.decimals$}").replace('-', "\u{2212}")
}

fn power_label(digit: i32, exponent: i32) -> String {
    if (-2..=4).contains(&exponent) {
        let decimals = (-exponent).max(0) as usize;
        return format!("{:.decimals$}", f64::from(digit) * 10_f64.powi(exponent));
    }
    let factor = if digit == 1 { String::new() } else { format!("{digit}\u{b7}") };
    format!("{factor}10^{{{exponent}}}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(values: &[f64], scale: Scale) -> Vec<String> {
        let axis = Axis::spanning(values.iter().copied(), scale, [0.0, 1.0]);
        axis.ticks().into_iter().filter_map(|(_, label)| label).collect()
    }

    /// Truth: ticks are multiples of 1, 2 or 5 times a power of ten, and cover the values.
    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(labels(&[0.0, 300.0], Scale::Linear), ["0", "50", "100", "150", "200", "250", "300"]);
        assert_eq!(
            labels(&[-0.3, 0.2], Scale::Linear),
            ["\u{2212}0.3", "\u{2212}0.2", "\u{2212}0.1", "0", "0.1", "0.2"]
        );
        assert_eq!(
            labels(&[1e-7, 2e-3], Scale::Logarithmic),
            ["10^{-7}", "10^{-6}", "10^{-5}", "10^{-4}", "10^{-3}", "0.01"]
        );
        assert_eq!(labels(&[16.0, 256.0], Scale::Logarithmic), ["10", "20", "50", "100", "200", "500"]);
    }

    /// Truth: the labels of long numbers are divided by a power of a thousand.
    #[test]
    fn long_numbers_have_a_power() {
        let axis = |high: f64| Axis::spanning([0.0, high].into_iter(), Scale::Linear, [0.0, 1.0]);
        assert_eq!(
            (axis(3e-3).label_exponent(), axis(3e-10).label_exponent(), axis(4.2e8).label_exponent()),
            (0, -12, 6)
        );
        assert_eq!(labels(&[0.0, 3e-10], Scale::Linear), ["0", "50", "100", "150", "200", "250", "300"]);
        assert_eq!(axis(3e-10).scaled_unit("mm"), "10^{\u{2212}12} mm");
        assert_eq!(axis(300.0).scaled_unit("N"), "N");
    }

    /// Truth: an axis has at least two ticks within its pixels, also for constant, missing or unusable values.
    #[test]
    fn constant_empty_and_unusable_values_still_make_an_axis() {
        for values in [&[5.0, 5.0][..], &[0.0], &[], &[f64::NAN, -1.0], &[f64::INFINITY]] {
            for scale in [Scale::Linear, Scale::Whole, Scale::Logarithmic] {
                let axis = Axis::spanning(values.iter().copied(), scale, [0.0, 100.0]);
                assert!(axis.ticks().len() >= 2, "{values:?} {axis:?}");
                assert!(
                    axis.ticks()
                        .iter()
                        .all(|(v, _)| axis.to_pixel(*v).is_some_and(|x| (-1.0..=101.0).contains(&x)))
                );
            }
        }
        assert_eq!(
            Axis::spanning([1.0, 10.0].into_iter(), Scale::Logarithmic, [0.0, 1.0]).to_pixel(-1.0),
            None
        );
    }
}
