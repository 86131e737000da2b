//! Newton steps for steady rolling, one after the other.
//!
//! Barzilai-Borwein steps gain next to nothing against its equations, which are not symmetric. Newton steps need them less than
//! elsewhere: the states of the cells settle from the leading edge on. Where they go to and fro, steps are halved.

use super::super::super::{Increment, Iterate, Unknowns};
use super::super::split::without_friction;
use super::super::{SolveReport, Stop, Watch, solve_whole};
use super::Solve;

/// Steps in a row that need not lower the residual.
const PATIENCE: usize = 5;

/// Share of a step after so many.
const SHORTER: f64 = 0.5;

/// Steps before the method gives up.
const MOST: usize = 60;

impl Solve<'_, '_> {
    /// Solves from the evaluated state in `it`, which holds the best one afterwards.
    pub(super) fn roll(mut self, it: &mut Iterate, watch: &mut Watch) -> SolveReport {
        if self.problem.friction.is_some() && it.hatted.iter().all(|traction| *traction == 0.0) {
            self.press(it, watch);
        }
        let mut trial = it.clone();
        let (mut best, mut least) = (Unknowns::of(it), f64::INFINITY);
        let mut in_vain = 0;
        for step in 0.. {
            let residual = self.problem.natural_residual(it);
            self.report.residual = residual;
            if residual.is_nan() || residual <= self.options.tolerance {
                self.report.stop = if residual.is_nan() { Stop::NotFinite } else { Stop::Converged };
                return self.report;
            }
            in_vain += 1;
            if residual < least {
                best.take(it);
                (least, in_vain) = (residual, 0);
            }
            if step >= MOST.min(self.options.max_iterations) {
                break;
            }
            if watch(self.report.iterations, residual) {
                self.report.stop = Stop::Interrupted;
                break;
            }
            self.step(it, &mut trial);
            if in_vain > PATIENCE {
                shorten(it, &mut trial);
                self.problem.evaluate(&mut trial);
                self.report.applications += self.problem.applications();
            }
            std::mem::swap(it, &mut trial);
        }
        best.put(it);
        self.problem.evaluate(it);
        self.report.applications += self.problem.applications();
        self.report.residual = least;
        self.report
    }

    /// The pressures without friction, to begin with.
    fn press(&mut self, it: &mut Iterate, watch: &mut Watch) {
        // Nothing is worn off while a state is steady.
        let pressed = Increment { wear: None, ..without_friction(self.problem) };
        let report = solve_whole(&pressed, it, self.options, watch);
        self.report.iterations += report.iterations;
        self.report.applications += report.applications + self.problem.applications();
        self.problem.evaluate(it);
    }
}

/// `trial` a part of the way from `it`: tractions stay admissible, since what is admissible is convex.
fn shorten(it: &Iterate, trial: &mut Iterate) {
    let between = |from: &f64, to: &mut f64| *to = from + SHORTER * (*to - from);
    it.hatted.iter().zip(&mut trial.hatted).for_each(|(from, to)| between(from, to));
    let motions = it.rigid.iter().flatten().zip(trial.rigid.iter_mut().flatten());
    motions.for_each(|(from, to)| between(from, to));
    let floating = it.floating.iter().flatten().zip(trial.floating.iter_mut().flatten());
    floating.for_each(|(from, to)| between(from, to));
}
