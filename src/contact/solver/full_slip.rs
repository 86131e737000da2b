//! Where all of the contact slips, only pressures are unknown: friction follows from them and from the direction of slip.
//!
//! With q̂ = -p ŝ/|ŝ| and the depth worn per pressure taken from the slip ŝ of the state before, what is left is a contact of
//! pressures alone (docs/theory-contact.md); its answer gives the next slip. The natural residual of the whole increment is what
//! ends that, so that no cell that ought to stick is overlooked: where one does, or the slip does not settle, Newton's method goes on.

use super::super::{ContactState, Increment, PathPoint, Pressures, SlipReference, TangentialControl};
use super::newton::Newton;
use super::{IncrementSolver, IterationCallback, SolveReport, SolverOptions, StopReason};
use crate::omitted::OmittableWork;

/// Times that the slip is taken anew, at most.
const MAX_SLIP_UPDATES: usize = 40;

/// A pass has to lower the residual by this factor, or the slip does not settle.
const REQUIRED_REDUCTION: f64 = 0.2;

/// Residual of the pressures, as a share of that of the increment.
const PRESSURE_TOLERANCE_SHARE: f64 = 0.1;

/// Part of the pressure in the friction of a cell from which on it slips.
const SLIP_LIMIT: f64 = 1.0 - 1e-6;

/// The method.
pub(super) struct FullSlip;

/// Whether friction is at its limit in all of the contact.
fn slips_everywhere(problem: &Increment, it: &ContactState) -> bool {
    let n = problem.n();
    let mut touches = false;
    let all = it.scaled.chunks_exact(3 * n).all(|planes| {
        (0..n).all(|i| {
            let p = planes[2 * n + i];
            touches |= p > 0.0;
            p <= 0.0 || planes[i].hypot(planes[n + i]) >= SLIP_LIMIT * p
        })
    });
    touches && all
}

/// Turns the friction of all cells against their slip; whether it turned by more than a right angle in any that carries pressure.
fn align_friction_with_slip(problem: &Increment, it: &mut ContactState) -> bool {
    let n = problem.n();
    let mut reversed = false;
    for end in 0..problem.path_points.len() {
        let base = end * 3 * n;
        for i in 0..n {
            let p = it.scaled[base + 2 * n + i];
            let slip = [it.gradient[base + i], it.gradient[base + n + i]];
            let size = slip[0].hypot(slip[1]);
            let before = [it.scaled[base + i], it.scaled[base + n + i]];
            let q = if size > 0.0 { slip.map(|s| -p * s / size) } else { before };
            reversed |= p > 0.0 && q[0] * before[0] + q[1] * before[1] < 0.0;
            (it.scaled[base + i], it.scaled[base + n + i]) = (q[0], q[1]);
        }
    }
    reversed
}

impl IncrementSolver for FullSlip {
    fn name(&self) -> &'static str {
        "sliding"
    }

    fn is_applicable(&self, problem: &Increment) -> bool {
        let closed = |end: &PathPoint| {
            let steady =
                matches!(end.reference, SlipReference::PreviousPoint { .. } | SlipReference::Prescribed(_));
            steady && end.balance.is_none() && end.tangential == TangentialControl::Shift
        };
        problem.skip.allows(OmittableWork::SlidingFriction)
            && problem.pressures == Pressures::Unknown
            && problem.friction.is_some()
            && problem.flexibility.grid().is_some()
            && problem.path_points.iter().all(closed)
    }

    fn is_useful_from(&self, problem: &Increment, it: &mut ContactState) -> bool {
        slips_everywhere(problem, it)
    }

    fn solve(
        &self,
        problem: &Increment,
        it: &mut ContactState,
        options: &SolverOptions,
        watch: &mut IterationCallback,
    ) -> SolveReport {
        let mut report = SolveReport { handover_reason: Some("a start"), ..SolveReport::default() };
        let mut pressures = PressureProblem::new(problem);
        let mut best = f64::INFINITY;
        problem.evaluate(it);
        report.applications += problem.applications();
        for _ in 0..MAX_SLIP_UPDATES {
            report.residual = problem.natural_residual(it);
            if report.residual <= options.tolerance {
                report.stop = StopReason::Converged;
                return report;
            }
            if report.residual.is_nan() || report.residual > REQUIRED_REDUCTION * best {
                return report;
            }
            if watch(report.iterations, report.residual) {
                report.stop = StopReason::Interrupted;
                return report;
            }
            best = report.residual;
            let tolerance = (PRESSURE_TOLERANCE_SHARE * best).max(0.3 * options.tolerance);
            let max_iterations = options.max_iterations.saturating_sub(report.iterations);
            let options = SolverOptions { tolerance, max_iterations, ..*options };
            let found = pressures.solve(problem, it, &options, watch);
            report.iterations += found.iterations;
            report.applications += found.applications;
            if found.stop == StopReason::Interrupted {
                report.stop = StopReason::Interrupted;
                return report;
            }
            let reversed = align_friction_with_slip(problem, it);
            problem.evaluate(it);
            report.applications += problem.applications();
            if reversed || found.stop != StopReason::Converged {
                return report;
            }
        }
        report
    }
}

/// The contact of pressures alone, with its buffers.
struct PressureProblem {
    it: ContactState,
    /// Normal gap that the friction of each end causes, `[N]`.
    lifted: Vec<Vec<f64>>,
    normal: Vec<f64>,
}

impl PressureProblem {
    fn new(problem: &Increment) -> Self {
        let (n, ends) = (problem.n(), problem.path_points.len());
        Self {
            it: ContactState::new(n, vec![[0.0; 3]; ends]),
            lifted: vec![vec![0.0; n]; ends],
            normal: vec![0.0; n],
        }
    }

    /// Pressures and normal motions under the friction and with the slip of the evaluated state in `it`, which takes them.
    fn solve(
        &mut self,
        problem: &Increment,
        it: &mut ContactState,
        options: &SolverOptions,
        watch: &mut IterationCallback,
    ) -> SolveReport {
        let n = problem.n();
        for (end, lifted) in self.lifted.iter_mut().enumerate() {
            let planes = end * 3 * n + 2 * n..(end + 1) * 3 * n;
            problem.flexibility.apply_normal(&it.scaled[planes.clone()], &mut self.normal);
            let parts = it.elastic[planes].iter().zip(&self.normal);
            lifted.iter_mut().zip(parts).for_each(|(lifted, (all, own))| *lifted = all - own);
        }
        let ends = problem.path_points.iter().enumerate().map(|(k, end)| PathPoint {
            normal: end.normal,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: SlipReference::Prescribed(it.slip[2 * k * n..2 * (k + 1) * n].to_vec()),
            fixed_normal_offset: Some(self.lifted[k].clone()),
        });
        let alone = Increment {
            friction: None,
            scales: problem.scales.clone(),
            path_points: ends.collect(),
            ..*problem
        };
        self.it.copy_unknowns(it);
        (self.it.rigid_motion, self.it.mode_amplitudes) =
            (it.rigid_motion.clone(), it.mode_amplitudes.clone());
        self.it.scaled.chunks_exact_mut(3 * n).for_each(|planes| planes[..2 * n].fill(0.0));
        let report = Newton.solve(&alone, &mut self.it, options, watch);
        it.rigid_motion.clone_from(&self.it.rigid_motion);
        for (into, from) in it.scaled.chunks_exact_mut(3 * n).zip(self.it.scaled.chunks_exact(3 * n)) {
            for i in 0..n {
                // Friction in proportion, until it is turned.
                let (before, now) = (into[2 * n + i], from[2 * n + i]);
                let factor = if before > 0.0 { now / before } else { 0.0 };
                (into[i], into[n + i], into[2 * n + i]) = (factor * into[i], factor * into[n + i], now);
            }
        }
        report
    }
}
