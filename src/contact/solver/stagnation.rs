//! Description of a solve that did not reach its tolerance: course of the residual, and number of cells that violate
//! their conditions.

use super::super::{ContactState, Increment};

/// Number of iterations below which an iteration limit counts as too small.
const FEW_ITERATIONS: usize = 100;
/// Largest factor by which a message advises to raise the iteration limit.
const MAX_ADVISED_FACTOR: f64 = 10.0;

/// Course of a solve that did not reach its tolerance, and its last state.
#[derive(Debug, Clone, PartialEq)]
pub struct Stagnation {
    /// Natural residual of the last state.
    pub residual: f64,
    /// Largest accepted natural residual.
    pub tolerance: f64,
    /// Number of iterations.
    pub iterations: usize,
    /// Pairs of a number of iterations (1, 10, 100, ...) and the smallest natural residual up to this number.
    pub history: Vec<(usize, f64)>,
    /// Whether a larger iteration limit would help: the solve ended at its limit, and ten times as many iterations
    /// would reach the tolerance. This estimate extrapolates the residual as a power of the number of iterations. A
    /// limit below 100 iterations always counts as too small.
    pub needs_iterations: bool,
    /// Number of cells whose gap and pressure violate the contact conditions by more than the tolerance, at any path point.
    pub contact_cells: usize,
    /// Number of cells whose traction and slip violate the friction law by more than the tolerance, at any path point.
    pub friction_cells: usize,
}

/// Records the smallest residuals after 1, 10, 100, ... iterations.
#[derive(Default)]
pub(super) struct ResidualHistory {
    kept: Vec<(usize, f64)>,
    best: Option<f64>,
}

impl ResidualHistory {
    /// Records the residual after `iterations` iterations.
    pub fn add(&mut self, iterations: usize, residual: f64) {
        let next = 10_usize.pow(self.kept.len() as u32);
        if let (true, Some(best)) = (iterations > next, self.best) {
            self.kept.push((next, best));
        }
        self.best = Some(self.best.map_or(residual, |best| best.min(residual)));
    }
}

impl Stagnation {
    /// Describes a solve that ended with the evaluated state `it` after `iterations` of at most `most` iterations.
    pub(super) fn new(
        problem: &Increment,
        it: &ContactState,
        tolerance: f64,
        history: ResidualHistory,
        [iterations, most]: [usize; 2],
    ) -> Self {
        let [contact_cells, friction_cells] = problem.violated_cells(it, tolerance);
        let best = history.best.unwrap_or(f64::INFINITY);
        let before = history.kept.iter().rfind(|(k, _)| 5 * k <= iterations && iterations >= FEW_ITERATIONS);
        let reaches = before.is_none_or(|before| reaches(*before, (iterations, best), tolerance));
        Self {
            residual: problem.natural_residual(it),
            tolerance,
            iterations,
            needs_iterations: iterations >= most && reaches,
            history: history.kept,
            contact_cells,
            friction_cells,
        }
    }
}

/// Returns whether the residual reaches `tolerance` after [`MAX_ADVISED_FACTOR`] times the iterations of `last`.
///
/// `before` and `last` are pairs of iterations and residual. The residual is extrapolated as a power of the number of
/// iterations through these two points.
fn reaches(before: (usize, f64), last: (usize, f64), tolerance: f64) -> bool {
    let power = (before.1 / last.1).ln() / (last.0 as f64 / before.0 as f64).ln();
    last.1 * MAX_ADVISED_FACTOR.powf(-power) <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the residual k^-2 is 1e-6 after 1000 iterations. A constant residual never reaches a smaller tolerance.
    #[test]
    fn the_residual_falls_as_a_power_of_the_iterations() {
        let at = |k: usize| (k, (k as f64).powi(-2));
        assert!(reaches(at(10), at(100), 1.01e-6) && !reaches(at(10), at(100), 0.99e-6));
        assert!(!reaches((10, 1e-3), (100, 1e-3), 0.99e-3));
    }

    /// Truth: by definition, the history contains the smallest residuals up to iterations 1 and 10.
    #[test]
    fn history_keeps_the_smallest_residuals() {
        let mut history = ResidualHistory::default();
        for iterations in 0..25 {
            history.add(iterations, if iterations == 7 { 0.25 } else { 1.0 / (1 + iterations % 2) as f64 });
        }
        assert_eq!(history.kept, [(1, 0.5), (10, 0.25)]);
    }
}
