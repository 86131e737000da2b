//! Increments of a fretting cycle, solved one after the other.

use crate::contact::certificate::StateChecks;
use crate::contact::solver::SolveReport;
use crate::contact::{ContactState, SlipReference, SolverOptions};
use crate::error::Result;
use crate::evolution::controls::PrescribedLoads;
use crate::evolution::fretting::path::FrettingPath;
use crate::evolution::fretting::settings::STICK_ZONE;
use crate::evolution::increment_solve::{ActiveLaws, ProgressSpan, increment_problem, solve_and_check};
use crate::evolution::run::Run;

/// Solver options for strokes that are solved increment by increment.
pub(super) fn stroke_options(options: &SolverOptions) -> SolverOptions {
    SolverOptions { tolerance: options.tolerance.max(STICK_ZONE.stroke_tolerance), ..*options }
}

#[derive(Clone)]
pub(super) struct IncrementStart {
    /// Tangential gap from which slip is measured, `[2, N]`, mm.
    pub reference: Vec<f64>,
    pub contact: ContactState,
}

pub(super) struct Strokes<'c> {
    pub path: &'c FrettingPath,
    /// Prescribed loads without the cyclic motion or force.
    pub loads: PrescribedLoads,
    /// Wear depth, `[N]`, mm.
    pub wear_depth: &'c [f64],
    pub options: &'c SolverOptions,
}

pub(super) struct SolvedIncrement {
    pub next: IncrementStart,
    pub report: SolveReport,
    pub checks: StateChecks,
}

impl IncrementStart {
    /// Start of an increment at a path point of `cycle`, whose gap must have been evaluated.
    pub fn at_path_point(cycle: &ContactState, point: usize) -> Self {
        let n = cycle.wear_per_pass.len();
        let mut contact = ContactState::new(n, vec![cycle.rigid_motion[point]]);
        contact.mode_amplitudes = vec![cycle.mode_amplitudes[point]];
        contact.scaled.copy_from_slice(&cycle.scaled[point * 3 * n..(point + 1) * 3 * n]);
        Self { reference: cycle.gap[point * 3 * n..point * 3 * n + 2 * n].to_vec(), contact }
    }
}

impl Run<'_> {
    pub(super) fn solve_cycle_increment(
        &mut self,
        strokes: &Strokes,
        point: usize,
        start: IncrementStart,
        progress: &ProgressSpan,
    ) -> Result<SolvedIncrement> {
        let &Strokes { path, loads, wear_depth, options } = strokes;
        let (laws, n) = (ActiveLaws::of(self.step()), self.prepared.n());
        let pressures = start.contact.scaled[2 * n..].to_vec();
        let reference = SlipReference::Previous { gap: start.reference, pressures };
        let path_point = self.path_point(&path.loads(point, loads), reference)?;
        let mut problem = increment_problem(&self.prepared, options, wear_depth, laws, vec![path_point]);
        let mut contact = start.contact;
        path.set_shift(point, &mut contact.rigid_motion[0]);
        let (report, checks) =
            solve_and_check(&self.prepared, &mut problem, &mut contact, options, self.observer, progress)?;
        let reference = contact.gap[..2 * n].to_vec();
        Ok(SolvedIncrement { next: IncrementStart { reference, contact }, report, checks })
    }
}
