//! Where all of the contact slips, only pressures are unknown: friction follows from them and from the direction of slip.
//!
//! With q̂ = -p ŝ/|ŝ| and the depth worn per pressure taken from the slip ŝ of the state before, what is left is a contact of
//! pressures alone (docs/theory-contact.md); its answer gives the next slip. The natural residual of the whole increment is what
//! ends that, so that no cell that ought to stick is overlooked: where one does, or the slip does not settle, Newton's method goes on.

use super::super::{End, Increment, Iterate, Pressures, SlipReference, TangentialControl};
use super::newton::Newton;
use super::{SolveReport, Solver, SolverOptions, Stop, Watch};
use crate::skip::Skip;

/// Times that the slip is taken anew, at most.
const PASSES: usize = 40;

/// A pass has to lower the residual by this factor, or the slip does not settle.
const GAIN: f64 = 0.2;

/// Residual of the pressures, as a share of that of the increment.
const SHARE: f64 = 0.1;

/// Part of the pressure in the friction of a cell from which on it slips.
const SLIPS: f64 = 1.0 - 1e-6;

/// The method.
pub(super) struct Sliding;

/// Whether friction is at its limit in all of the contact.
fn slips_everywhere(problem: &Increment, it: &Iterate) -> bool {
    let n = problem.n();
    let mut touches = false;
    let all = it.hatted.chunks_exact(3 * n).all(|planes| {
        (0..n).all(|i| {
            let p = planes[2 * n + i];
            touches |= p > 0.0;
            p <= 0.0 || planes[i].hypot(planes[n + i]) >= SLIPS * p
        })
    });
    touches && all
}

/// Turns the friction of all cells against their slip; whether it turned by more than a right angle in any that carries pressure.
fn turn(problem: &Increment, it: &mut Iterate) -> bool {
    let n = problem.n();
    let mut reversed = false;
    for end in 0..problem.ends.len() {
        let base = end * 3 * n;
        for i in 0..n {
            let p = it.hatted[base + 2 * n + i];
            let slip = [it.gradient[base + i], it.gradient[base + n + i]];
            let size = slip[0].hypot(slip[1]);
            let before = [it.hatted[base + i], it.hatted[base + n + i]];
            let q = if size > 0.0 { slip.map(|s| -p * s / size) } else { before };
            reversed |= p > 0.0 && q[0] * before[0] + q[1] * before[1] < 0.0;
            (it.hatted[base + i], it.hatted[base + n + i]) = (q[0], q[1]);
        }
    }
    reversed
}

impl Solver for Sliding {
    fn name(&self) -> &'static str {
        "sliding"
    }

    fn suits(&self, problem: &Increment) -> bool {
        let closed = |end: &End| {
            let steady = matches!(end.reference, SlipReference::EndBefore { .. } | SlipReference::Given(_));
            steady && end.balance.is_none() && end.tangential == TangentialControl::Shift
        };
        problem.skip.has(Skip::SlidingFriction)
            && problem.pressures == Pressures::Unknown
            && problem.friction.is_some()
            && problem.flexibility.grid().is_some()
            && problem.ends.iter().all(closed)
    }

    fn begins(&self, problem: &Increment, it: &mut Iterate) -> bool {
        slips_everywhere(problem, it)
    }

    fn solve(
        &self,
        problem: &Increment,
        it: &mut Iterate,
        options: &SolverOptions,
        watch: &mut Watch,
    ) -> SolveReport {
        let mut report = SolveReport { left: Some("a start"), ..SolveReport::default() };
        let mut pressures = Pressure::new(problem);
        let mut best = f64::INFINITY;
        problem.evaluate(it);
        report.applications += problem.applications();
        for _ in 0..PASSES {
            report.residual = problem.natural_residual(it);
            if report.residual <= options.tolerance {
                report.stop = Stop::Converged;
                return report;
            }
            if report.residual.is_nan() || report.residual > GAIN * best {
                return report;
            }
            if watch(report.iterations, report.residual) {
                report.stop = Stop::Interrupted;
                return report;
            }
            best = report.residual;
            let tolerance = (SHARE * best).max(0.3 * options.tolerance);
            let max_iterations = options.max_iterations.saturating_sub(report.iterations);
            let options = SolverOptions { tolerance, max_iterations, ..*options };
            let found = pressures.solve(problem, it, &options, watch);
            report.iterations += found.iterations;
            report.applications += found.applications;
            if found.stop == Stop::Interrupted {
                report.stop = Stop::Interrupted;
                return report;
            }
            let reversed = turn(problem, it);
            problem.evaluate(it);
            report.applications += problem.applications();
            if reversed || found.stop != Stop::Converged {
                return report;
            }
        }
        report
    }
}

/// The contact of pressures alone, with its buffers.
struct Pressure {
    it: Iterate,
    /// Normal gap that the friction of each end causes, `[N]`.
    lifted: Vec<Vec<f64>>,
    normal: Vec<f64>,
}

impl Pressure {
    fn new(problem: &Increment) -> Self {
        let (n, ends) = (problem.n(), problem.ends.len());
        Self {
            it: Iterate::new(n, vec![[0.0; 3]; ends]),
            lifted: vec![vec![0.0; n]; ends],
            normal: vec![0.0; n],
        }
    }

    /// Pressures and normal motions under the friction and with the slip of the evaluated state in `it`, which takes them.
    fn solve(
        &mut self,
        problem: &Increment,
        it: &mut Iterate,
        options: &SolverOptions,
        watch: &mut Watch,
    ) -> SolveReport {
        let n = problem.n();
        for (end, lifted) in self.lifted.iter_mut().enumerate() {
            let planes = end * 3 * n + 2 * n..(end + 1) * 3 * n;
            problem.flexibility.apply_normal(&it.hatted[planes.clone()], &mut self.normal);
            let parts = it.elastic[planes].iter().zip(&self.normal);
            lifted.iter_mut().zip(parts).for_each(|(lifted, (all, own))| *lifted = all - own);
        }
        let ends = problem.ends.iter().enumerate().map(|(k, end)| End {
            normal: end.normal,
            tangential: TangentialControl::Shift,
            balance: None,
            reference: SlipReference::Given(it.slip[2 * k * n..2 * (k + 1) * n].to_vec()),
            lifted: Some(self.lifted[k].clone()),
        });
        let alone =
            Increment { friction: None, scales: problem.scales.clone(), ends: ends.collect(), ..*problem };
        self.it.follow(it);
        (self.it.rigid, self.it.floating) = (it.rigid.clone(), it.floating.clone());
        self.it.hatted.chunks_exact_mut(3 * n).for_each(|planes| planes[..2 * n].fill(0.0));
        let report = Newton.solve(&alone, &mut self.it, options, watch);
        it.rigid.clone_from(&self.it.rigid);
        for (into, from) in it.hatted.chunks_exact_mut(3 * n).zip(self.it.hatted.chunks_exact(3 * n)) {
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
