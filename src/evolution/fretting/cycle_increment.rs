//! Increments of a cycle, solved one after the other.

use crate::contact::certificate::StateChecks;
use crate::contact::solver::SolveReport;
use crate::contact::{ContactState, SlipReference, SolverOptions};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::run::Run;

/// Smallest tolerance of the natural residual for strokes that only determine the stick zone.
const STROKE_TOLERANCE: f64 = 1e-6;

/// Solver options for strokes that only determine the stick zone.
pub(super) fn stroke_options(options: &SolverOptions) -> SolverOptions {
    SolverOptions { tolerance: options.tolerance.max(STROKE_TOLERANCE), ..*options }
}

/// Slip reference and initial guess of the next increment.
#[derive(Clone)]
pub(super) struct IncrementStart {
    /// Tangential gap from which slip is measured, `[2, N]`, mm.
    pub reference: Vec<f64>,
    /// Tractions and motions from which the iterations start.
    pub it: ContactState,
}

impl IncrementStart {
    /// Start at the path point `end` of a cycle whose state is evaluated.
    pub fn at_path_point(cycle: &ContactState, point: usize) -> Self {
        let n = cycle.wear_rate.len();
        let mut it = ContactState::new(n, vec![cycle.rigid_motion[point]]);
        it.mode_amplitudes = vec![cycle.mode_amplitudes[point]];
        it.scaled.copy_from_slice(&cycle.scaled[point * 3 * n..(point + 1) * 3 * n]);
        Self { reference: cycle.gap[point * 3 * n..point * 3 * n + 2 * n].to_vec(), it }
    }
}

impl Run<'_> {
    /// Solves one increment of a cycle at the wear depth `worn` (`[N]`, mm), from `place` to the path point `end` of `path`.
    ///
    /// # Errors
    /// As `solve_and_check`, and if a load acts along a motion that nothing resists.
    pub(super) fn solve_cycle_increment(
        &mut self,
        (path, point, loads): (&FrettingPath, usize, PrescribedLoads),
        (worn, options): (&[f64], &SolverOptions),
        place: IncrementStart,
        progress: &ProgressSpan,
    ) -> Result<(IncrementStart, SolveReport, StateChecks)> {
        let laws = ActiveLaws::of(self.step());
        let n = self.prepared.n();
        let spec = self.path_point(&path.loads(point, loads), SlipReference::Previous(place.reference))?;
        let mut problem = increment_problem(&self.prepared, options, worn, laws, vec![spec]);
        let mut it = place.it;
        path.set_shift(point, &mut it.rigid_motion[0]);
        let (report, checks) =
            solve_and_check((&self.prepared, &mut problem), &mut it, options, self.observer, progress)?;
        let reference = it.gap[..2 * n].to_vec();
        Ok((IncrementStart { reference, it }, report, checks))
    }
}
