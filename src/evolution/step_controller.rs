//! Lengths of jumps by a proportional-integral controller of the estimated error (docs/theory-wear.md).
//!
//! # Source
//! Gustafsson 1991, "Control theoretic techniques for stepsize selection in explicit Runge-Kutta methods".

use serde::{Deserialize, Serialize};

/// Safety factor on the length of the next jump.
const ERROR_TARGET: f64 = 0.9;

/// Exponent of the present error: the next length is proportional to (present error ratio)^(-CURRENT_ERROR_EXPONENT / order). An
/// error ratio is the estimated error divided by the allowed error.
const CURRENT_ERROR_EXPONENT: f64 = 0.7;
/// Exponent of the last error: the next length is also proportional to (last error ratio)^(LAST_ERROR_EXPONENT / order). The last
/// error ratio is that of the accepted jump before. For the first jump, and after a rejected jump, the present error ratio is used
/// instead.
const LAST_ERROR_EXPONENT: f64 = 0.4;

/// Largest ratio of the next length to the length of the jump just computed.
const MAX_LENGTH_GROWTH: f64 = 5.0;
/// Smallest ratio of the next length to the length of the jump just computed.
const MIN_LENGTH_GROWTH: f64 = 0.2;

/// Controller of jump lengths: aimed next length (cycles or mm), and ratio of the last estimated error to the allowed error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct StepController {
    next_length: f64,
    last_error_ratio: Option<f64>,
    order: f64,
    /// Length of the last jump if it was rejected.
    #[serde(default)]
    rejected_length: Option<f64>,
}

impl StepController {
    /// Controller with a first length. `order` is the order p of the integrator. The error of a jump grows as length^(p + 1), so
    /// the error divided by the length grows as length^p.
    pub fn new(first: f64, order: f64) -> Self {
        Self { next_length: first, last_error_ratio: None, order, rejected_length: None }
    }

    /// Length of the next jump: the remaining length `left`, divided into equal jumps that exceed the aimed length by at most 1 %.
    /// If `unit` is positive, `left` must be a multiple of it. The length is then rounded up to a multiple of `unit`. After a
    /// rejected jump it is shorter than that jump, but never below `unit`.
    pub fn length(&self, left: f64, unit: f64) -> f64 {
        let parts = (left / self.next_length - 1e-2).ceil().max(1.0);
        let even = left / parts;
        if unit <= 0.0 {
            return even;
        }
        let whole = ((even / unit).ceil() * unit).min(left);
        match self.rejected_length {
            Some(rejected) if whole >= rejected => ((rejected / unit).ceil() - 1.0).max(1.0) * unit,
            _ => whole,
        }
    }

    /// Limits the aimed length of the next jump to `most`. [`Self::length`] may exceed it by 1 %, or by rounding up to a multiple
    /// of `unit`.
    pub fn limit(&mut self, most: f64) {
        self.next_length = self.next_length.min(most);
    }

    /// Sets the next length after an accepted jump. `ratio` is the estimated error divided by the allowed error.
    pub fn accept(&mut self, length: f64, ratio: f64) {
        let ratio = ratio.max(1e-10);
        let last = self.last_error_ratio.unwrap_or(ratio);
        let factor = ERROR_TARGET
            * ratio.powf(-CURRENT_ERROR_EXPONENT / self.order)
            * last.powf(LAST_ERROR_EXPONENT / self.order);
        self.next_length = length * factor.clamp(MIN_LENGTH_GROWTH, MAX_LENGTH_GROWTH);
        (self.last_error_ratio, self.rejected_length) = (Some(ratio), None);
    }

    /// Sets the next length after a jump that was rejected for its error. `ratio` is the estimated error divided by the allowed
    /// error.
    pub fn reject(&mut self, length: f64, ratio: f64) {
        let factor = ERROR_TARGET * ratio.powf(-1.0 / self.order);
        self.next_length = length * factor.clamp(MIN_LENGTH_GROWTH, ERROR_TARGET);
        (self.last_error_ratio, self.rejected_length) = (None, Some(length));
    }

    /// Sets the next length to half of a jump that was rejected for another reason than its error.
    pub fn halve(&mut self, length: f64) {
        self.next_length = 0.5 * length;
        (self.last_error_ratio, self.rejected_length) = (None, Some(length));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: if the error is a power of the length, the lengths converge to a constant. In this limit the growth factor
    /// ERROR_TARGET ratio^((LAST_ERROR_EXPONENT - CURRENT_ERROR_EXPONENT) / order) is 1.
    #[test]
    fn lengths_settle_at_the_aim() {
        for order in [1.0, 2.0] {
            let ratio = |length: f64| (length / 7.0).powf(order);
            let mut control = StepController::new(0.5, order);
            let mut rejected = 0;
            for _ in 0..60 {
                let length = control.next_length;
                if ratio(length) <= 1.0 {
                    control.accept(length, ratio(length));
                } else {
                    control.reject(length, ratio(length));
                    rejected += 1;
                }
            }
            let aim = ERROR_TARGET.powf(order / (CURRENT_ERROR_EXPONENT - LAST_ERROR_EXPONENT));
            assert!(
                (ratio(control.next_length) / aim - 1.0).abs() < 1e-3,
                "{} {aim}",
                ratio(control.next_length)
            );
            assert!(rejected <= 3, "{rejected}");
        }
    }

    /// Truth: every repetition of a rejected jump has fewer whole cycles, until one cycle is left.
    #[test]
    fn rejected_jumps_get_shorter() {
        for (left, rejected) in [(1000.0, 2.0), (1000.0, 7.0), (5.0, 4.0), (5.0, 5.0), (2.0, 2.0)] {
            for ratio in [1.0 + 1e-9, 1.2, 1e6] {
                let mut control = StepController::new(rejected, 2.0);
                let mut length = rejected;
                while length > 1.0 {
                    control.reject(length, ratio);
                    let next = control.length(left, 1.0);
                    assert!((1.0..length).contains(&next) && next.fract() == 0.0, "{length} {next}");
                    length = next;
                }
            }
        }
    }

    /// Truth: 1000 remaining cycles and a next length of 300 give four equal jumps of 250 cycles, without a short last jump.
    #[test]
    fn the_rest_is_shared_out() {
        let control = StepController::new(300.0, 2.0);
        let (mut left, mut lengths) = (1000.0, Vec::new());
        while left > 0.0 {
            lengths.push(control.length(left, 1.0));
            left -= lengths[lengths.len() - 1];
        }
        assert_eq!(lengths, [250.0; 4]);
        assert_eq!(control.length(2.5, 0.0), 2.5);
        assert_eq!(StepController::new(0.2, 2.0).length(10.0, 1.0), 1.0);
    }
}
