//! What a solve that did not reach its tolerance leaves: the course of the residual, and the cells whose conditions are violated.

use super::super::{ContactState, Increment};

/// Number of iterations below which an iteration limit counts as too small.
const FEW_ITERATIONS: usize = 100;
/// Largest factor on the number of iterations that is sensible advice.
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
    /// Numbers of iterations 1, 10, 100, ... and the smallest natural residuals up to them.
    pub history: Vec<(usize, f64)>,
    /// Whether the solve ended at its iteration limit, and tenfold iterations would reach the tolerance if the residual falls on as a
    /// power of their number. A limit below 100 iterations always counts as too small.
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
    /// Records the residual after `iterations`.
    pub fn add(&mut self, iterations: usize, residual: f64) {
        let next = 10_usize.pow(self.kept.len() as u32);
        if let (true, Some(best)) = (iterations > next, self.best) {
            self.kept.push((next, best));
        }
        self.best = Some(self.best.map_or(residual, |best| best.min(residual)));
    }
}

impl Stagnation {
    /// Course of a solve that ended with the evaluated state `it` after `iterations` of at most `most`.
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

/// Returns whether the residual is at most `tolerance` after [`MAX_ADVISED_FACTOR`] times the iterations of `last`, if it falls as the
/// power of the iterations through the points `before` and `last` of iterations and residual.
fn reaches(before: (usize, f64), last: (usize, f64), tolerance: f64) -> bool {
    let power = (before.1 / last.1).ln() / (last.0 as f64 / before.0 as f64).ln();
    last.1 * MAX_ADVISED_FACTOR.powf(-power) <= tolerance
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: the residual k^-2 is 1e-6 after 1000 iterations. A residual that does not fall reaches nothing.
    #[test]
    fn the_residual_falls_as_a_power_of_the_iterations() {
        let at = |k: usize| (k, (k as f64).powi(-2));
        assert!(reaches(at(10), at(100), 1.01e-6) && !reaches(at(10), at(100), 0.99e-6));
        assert!(!reaches((10, 1e-3), (100, 1e-3), 0.99e-3));
    }

    /// Truth: the definition, the smallest residuals up to 1 and 10 iterations.
    #[test]
    fn history_keeps_the_smallest_residuals() {
        let mut history = ResidualHistory::default();
        for iterations in 0..25 {
            history.add(iterations, if iterations == 7 { 0.25 } else { 1.0 / (1 + iterations % 2) as f64 });
        }
        assert_eq!(history.kept, [(1, 0.5), (10, 0.25)]);
    }
}
