//! What a solve that did not reach its tolerance leaves: the course of the residual, and the cells whose conditions are violated.

use super::super::{ContactState, Increment};

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
    /// power of their number.
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
        let before = history.kept.iter().rfind(|(k, _)| 5 * k <= iterations);
        let reaches = before.is_none_or(|(k, before)| {
            let power = (before / best).ln() / (iterations as f64 / *k as f64).ln();
            best * MAX_ADVISED_FACTOR.powf(-power) <= tolerance
        });
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

#[cfg(test)]
mod tests {
    use super::*;

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
