//! Convergence of a value as the size h of cells, increments or jumps decreases.

/// Bounds of the order p. `MIN_NOISY_ORDER` is the lower bound for values that do not change steadily.
const ORDERS: [f64; 2] = [0.5, 2.0];
const MIN_NOISY_ORDER: f64 = 1.0;

/// Smallest and largest ratio of successive differences of values that change steadily, for sizes that decrease by a
/// factor of about 2/3.
const STEADY: [f64; 2] = [0.55, 1.6];

/// Assumed order if there are too few values.
const ASSUMED: f64 = 1.0;

/// Number of last differences to which the order is fitted (at most), and number of last differences that determine the
/// constant.
const MAX_FITTED_DIFFERENCES: usize = 4;
const ENVELOPE_DIFFERENCES: usize = 3;

/// Smallest number of differences to which an order is fitted.
const MIN_FITTED_DIFFERENCES: usize = 3;

/// Largest difference between the orders of two successive pairs of differences with which a limit is extrapolated.
const MAX_ORDER_DIFFERENCE: f64 = 0.3;

/// Error estimate C h^p with a constant C, the size h and the order p.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convergence {
    order: f64,
    observed_order: Option<f64>,
    constant: f64,
}

impl Convergence {
    /// Estimate from at least two values at decreasing sizes. With five or more values, the estimated error decreases at most with
    /// order 2 from one size to the next. An estimate that decreases faster is small by chance.
    pub fn estimate(sizes: &[f64], values: &[f64]) -> Self {
        let n = values.len();
        let found = Self::fit(sizes, values);
        if n < MIN_FITTED_DIFFERENCES + 2 {
            return found;
        }
        let before = Self::estimate(&sizes[..n - 1], &values[..n - 1]);
        let least = before.error(sizes[n - 2]) * (sizes[n - 1] / sizes[n - 2]).powf(ORDERS[1]);
        Self { constant: found.constant.max(least / sizes[n - 1].powf(found.order)), ..found }
    }

    /// Fits the order p to the last differences; p is 1 if there are too few differences. If the differences change
    /// steadily, p is limited to [1/2, 2]. Otherwise p is reduced by its standard error and limited to [1, 2].
    ///
    /// The constant C is the largest constant of the last three differences. Cells do not resolve the edge of a
    /// contact, so a single difference may be small by chance.
    fn fit(sizes: &[f64], values: &[f64]) -> Self {
        let differences = differences(values);
        let first = differences.len().saturating_sub(MAX_FITTED_DIFFERENCES);
        let seen: Vec<[f64; 2]> = (first..differences.len())
            .filter(|&i| differences[i] != 0.0)
            .map(|i| [sizes[i].ln(), differences[i].abs().ln()])
            .collect();
        let last = differences.len().saturating_sub(ENVELOPE_DIFFERENCES);
        let steady =
            differences[last..].windows(2).all(|pair| (STEADY[0]..=STEADY[1]).contains(&(pair[1] / pair[0])));
        let fitted = (seen.len() >= MIN_FITTED_DIFFERENCES).then(|| slope(&seen));
        let order = match fitted {
            None => ASSUMED,
            Some([slope, _]) if steady => slope.clamp(ORDERS[0], ORDERS[1]),
            Some([slope, error]) => (slope - error).clamp(MIN_NOISY_ORDER, ORDERS[1]),
        };
        let constant = (last..differences.len())
            .map(|i| differences[i].abs() / (sizes[i].powf(order) - sizes[i + 1].powf(order)))
            .fold(0.0, f64::max);
        let least = if steady { ORDERS[0] } else { MIN_NOISY_ORDER };
        let observed_order =
            fitted.map(|[slope, _]| slope).filter(|slope| *slope > least && *slope < ORDERS[1]);
        Self { order, observed_order, constant }
    }

    /// Fitted order p. `None` if p is out of bounds, or if there are too few values.
    pub fn order(&self) -> Option<f64> {
        self.observed_order
    }

    pub fn error(&self, size: f64) -> f64 {
        self.constant * size.powf(self.order)
    }
}

/// Extrapolated limit of values at decreasing sizes; `None` unless the last three differences have the same sign and about the same
/// order.
///
/// # Source
/// Richardson 1911, "The approximate arithmetical solution by finite differences".
pub fn limit(sizes: &[f64], values: &[f64]) -> Option<f64> {
    let n = values.len();
    let first = n.checked_sub(4)?;
    let (sizes, values) = (&sizes[first..], &values[first..]);
    let d = differences(values);
    if d.iter().any(|x| *x == 0.0 || x.signum() != d[0].signum()) {
        return None;
    }
    let [before, last] =
        [0, 1].map(|i| order_between([sizes[i], sizes[i + 1], sizes[i + 2]], [d[i], d[i + 1]]));
    let (before, last) = (before?, last?);
    ((last - before).abs() <= MAX_ORDER_DIFFERENCE)
        .then(|| values[3] + d[2] / ((sizes[2] / sizes[3]).powf(last) - 1.0))
}

/// Order p with which the error C h^p has the differences `d` between the sizes `h`, found by bisection. `None` if no
/// admissible p fits.
fn order_between(h: [f64; 3], d: [f64; 2]) -> Option<f64> {
    let excess = |p: f64| (h[0].powf(p) - h[1].powf(p)) / (h[1].powf(p) - h[2].powf(p)) - d[0] / d[1];
    let [mut low, mut high] = [0.5 * ORDERS[0], 1.5 * ORDERS[1]];
    if excess(low) > 0.0 || excess(high) < 0.0 {
        return None;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if excess(middle) < 0.0 { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

fn differences(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| pair[1] - pair[0]).collect()
}

/// Slope of the least-squares line through at least three points, and its standard error.
fn slope(points: &[[f64; 2]]) -> [f64; 2] {
    let n = points.len() as f64;
    let mean = [0, 1].map(|c| points.iter().map(|point| point[c]).sum::<f64>() / n);
    let product = |c: usize| -> f64 { points.iter().map(|p| (p[0] - mean[0]) * (p[c] - mean[c])).sum() };
    let slope = product(1) / product(0);
    let off = |p: &[f64; 2]| (p[1] - mean[1] - slope * (p[0] - mean[0])).powi(2);
    [slope, (points.iter().map(off).sum::<f64>() / (n - 2.0) / product(0)).sqrt()]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sizes() -> Vec<f64> {
        [12.0, 18.0, 26.0, 40.0, 60.0].map(|n: f64| 1.0 / n).to_vec()
    }

    /// Truth: values 3 + C h^p have the error |C| h^p, the order p and the limit 3.
    #[test]
    fn powers_of_the_size() {
        for order in [0.7, 1.0, 1.6, 2.0] {
            let values: Vec<f64> = sizes().iter().map(|h| 3.0 - 5.0 * h.powf(order)).collect();
            let found = Convergence::estimate(&sizes(), &values);
            assert!((found.order - order).abs() < 0.15, "{order}: {found:?}");
            let error = 5.0 * (1.0 / 60f64).powf(order);
            let ratio = found.error(1.0 / 60.0) / error;
            assert!((0.7..1.5).contains(&ratio), "{order}: {ratio}");
            let limit = limit(&sizes(), &values).unwrap();
            assert!((limit - 3.0).abs() < 1e-8, "{order}: {limit}");
        }
    }

    /// Truth: values whose errors change sign have no extrapolated limit. The estimate exceeds the amplitude 0.1 h² of
    /// the errors, even if a difference is small by chance.
    #[test]
    fn values_that_jump() {
        let signs = [1.0, -1.0, 1.0, 1.0, -0.4];
        let values: Vec<f64> = sizes().iter().zip(signs).map(|(h, sign)| 1.0 + sign * 0.1 * h * h).collect();
        assert_eq!(limit(&sizes(), &values), None);
        for n in 3..=5 {
            let found = Convergence::estimate(&sizes()[..n], &values[..n]);
            let h = sizes()[n - 1];
            assert!(found.error(h) > 0.1 * h * h, "{n}: {found:?}");
        }
    }

    /// Truth: values have the error h (1 + a cos t) at phases t, as for a stick zone whose edge lies between cells. At
    /// least 7 of 8 estimates exceed the error. The other estimates use few values, which are close by chance.
    #[test]
    fn first_order_with_noise() {
        let sizes = [12.0, 18.0, 26.0, 40.0, 60.0, 90.0, 136.0, 200.0, 300.0, 450.0].map(|n: f64| 1.0 / n);
        for amplitude in [0.3, 0.5, 0.8] {
            let mut covered = 0;
            for phase in 0..100 {
                let off = |k: usize| {
                    let t = 0.02 * std::f64::consts::PI * f64::from(phase)
                        + 1.7 * k as f64
                        + 2.4 * (k * k) as f64;
                    sizes[k] * (1.0 + amplitude * t.cos())
                };
                let values: Vec<f64> = (0..sizes.len()).map(|k| 1.0 + off(k)).collect();
                let of = |k: usize| Convergence::estimate(&sizes[..=k], &values[..=k]).error(sizes[k]);
                covered += (2..sizes.len()).filter(|&k| of(k) >= off(k)).count();
            }
            assert!(covered >= 700, "{amplitude}: {covered} of 800");
        }
    }

    /// Truth: if the last two values are equal, the estimate decreases at most by the squared ratio of the sizes.
    #[test]
    fn no_faster_than_second_order() {
        let values = [1.1, 1.06, 1.02, 1.01, 1.01];
        let [before, last] =
            [4, 5].map(|n| Convergence::estimate(&sizes()[..n], &values[..n]).error(sizes()[n - 1]));
        assert!(last >= before * (40.0f64 / 60.0).powi(2) * (1.0 - 1e-12), "{last} {before}");
    }

    /// Truth: constant values have no error. Values that grow without bound have a large error and no limit.
    #[test]
    fn values_that_do_not_converge() {
        assert_eq!(Convergence::estimate(&sizes(), &[2.0; 5]).error(0.1), 0.0);
        let values: Vec<f64> = sizes().iter().map(|h| h.powf(-0.5)).collect();
        let found = Convergence::estimate(&sizes(), &values);
        assert!(found.error(1.0 / 60.0) > 0.2 * values[4] && limit(&sizes(), &values).is_none(), "{found:?}");
    }
}
