//! Solves for the tangential tractions at given pressures, on a window around the contact. Solutions on coarser cells
//! first find the extent of the slip zone.
//!
//! The gap of the coarse problem is corrected by mean(S P) - S_c mean(P). P are the fine tractions, S is the fine and
//! S_c the coarse operator, and means are over coarse cells. Only the change of the tractions on the coarse cells is
//! transferred, as a ratio to the pressure (full approximation scheme).
//!
//! # Source
//! Brandt 1977, "Multi-level adaptive solutions to boundary-value problems".

use super::super::super::ContactState;
use super::super::super::window::{Window, WindowProblem};
use super::super::control::{SolveControl, SolverOptions};
use super::{
    CoarseToFine, MAX_WINDOW_ITERATIONS, Rectangle, STEADY_ROLLING_RESIDUAL, WINDOW_MARGIN_CELLS,
    contact_rectangle, expanded,
};

const COARSE_TOLERANCE: f64 = 1e-3;

impl CoarseToFine<'_, '_> {
    pub(super) fn solve_tangential(
        &mut self,
        it: &mut ContactState,
        control: &mut SolveControl,
    ) -> Option<()> {
        // In rolling, material enters the contact from adjacent cells, so the window includes a margin.
        let rectangle = expanded(contact_rectangle(it, self.frame)?, WINDOW_MARGIN_CELLS, self.frame);
        let (window, operator) = self.window(rectangle, 1).unwrap_or_else(|| self.whole());
        let part = WindowProblem::new(self.problem, window, operator)?;
        let mut state = part.state(it);
        // In rolling, a correction of the coarse gap cannot correct the slip between coarser cells. If rolling is
        // already steady, no coarser cells are used.
        let problem = part.problem(self.problem);
        let rolls_on =
            self.rolls() && !self.is_beyond(STEADY_ROLLING_RESIDUAL, &problem, &mut state, rectangle);
        let mut factor = if rolls_on { 1 } else { self.coarsest(rectangle) };
        while factor > 1 {
            self.coarse_correction(&part, &mut state, rectangle, factor, it, control)?;
            factor /= 2;
        }
        self.on_part(&part, &mut state, usize::MAX, control);
        part.write_back(&state, it);
        Some(())
    }

    /// Solves on cells whose side is `factor` times as long. Then corrects the tractions of `fine_state` by the change
    /// of the coarse tractions, and copies the rigid motions. `fine_state` is on the window of `fine`, and `it` is the
    /// state on the frame.
    fn coarse_correction(
        &mut self,
        fine: &WindowProblem,
        fine_state: &mut ContactState,
        rectangle: Rectangle,
        factor: usize,
        it: &mut ContactState,
        control: &mut SolveControl,
    ) -> Option<()> {
        let (window, operator) = self.window(rectangle, factor)?;
        let mut coarse = WindowProblem::new(self.problem, window, operator)?;
        fine.write_back(fine_state, it);
        let mut coarse_state = coarse.state(it);
        if !self.rolls() && coarse_state.scaled[..2 * window.n()].iter().any(|q| *q != 0.0) {
            coarse.problem(self.problem).evaluate(&mut coarse_state);
            fine.problem(self.problem).evaluate(fine_state);
            self.report.applications += 2 * self.problem.applications();
            add_coarse_defect(&fine.window, fine_state, &mut coarse, &coarse_state);
        }
        let before = coarse_state.scaled.clone();
        let options =
            SolverOptions { tolerance: COARSE_TOLERANCE.max(self.options.tolerance), ..self.options };
        // The callback decides only whether to cancel, so that it gets a constant instead of the coarse residual.
        let mut told = |iterations: usize, _: f64| control.is_cancelled(iterations, 1.0);
        let mut part_control = SolveControl::new(options, &mut told);
        self.on_part(&coarse, &mut coarse_state, MAX_WINDOW_ITERATIONS, &mut part_control);
        if !self.report.converged() {
            return Some(());
        }
        add_change(&window, &before, &coarse_state.scaled, &fine.window, fine_state);
        fine_state.rigid_motion.clone_from(&coarse_state.rigid_motion);
        Some(())
    }
}

/// Adds the change of the scaled tractions on the window `coarse`, from `before` to `after`, to `fine_state` on the
/// window `fine`. The function interpolates the change divided by the pressure.
fn add_change(coarse: &Window, before: &[f64], after: &[f64], fine: &Window, fine_state: &mut ContactState) {
    let (cells, n) = (coarse.n(), fine.n());
    let pressures = &before[2 * cells..];
    let ratio = |k: usize| {
        let p = pressures[k % cells];
        if p > 0.0 { (after[k] - before[k]) / p } else { 0.0 }
    };
    let ratios: Vec<f64> = (0..2 * cells).map(ratio).collect();
    let pressed: Vec<bool> = pressures.iter().map(|p| *p > 0.0).collect();
    let mut shares = vec![0.0; 2 * coarse.frame[0] * coarse.frame[1]];
    coarse.interpolate(&ratios, &pressed, &mut shares);
    let (tangential, pressures) = fine_state.scaled.split_at_mut(2 * n);
    for (k, share) in fine.restrict(&shares).iter().enumerate() {
        tangential[k] += share * pressures[k % n];
    }
    fine_state.project_to_cone();
}

/// Adds the fine-to-coarse defect correction to the initial gap of the problem `coarse`. The correction is the mean of the elastic
/// displacements in `fine_state`, on the window `fine`, minus the elastic displacements in `coarse_state`. Both states must be
/// evaluated.
fn add_coarse_defect(
    fine: &Window,
    fine_state: &ContactState,
    coarse: &mut WindowProblem,
    coarse_state: &ContactState,
) {
    let (n, cells, window) = (fine.n(), coarse.window.n(), coarse.window);
    let frame = window.frame[0] * window.frame[1];
    let mut field = vec![0.0; frame];
    fine.prolong(&vec![1.0; n], &mut field);
    let covered = window.restrict(&field);
    for plane in 0..2 {
        fine.prolong(&fine_state.elastic[plane * n..(plane + 1) * n], &mut field);
        let means = window.restrict(&field);
        for cell in (0..cells).filter(|&cell| covered[cell] > 0.0) {
            let k = plane * cells + cell;
            coarse.initial_gap[k] += means[cell] / covered[cell] - coarse_state.elastic[k];
        }
    }
}
