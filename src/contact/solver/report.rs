//! Result of a solve.

use super::super::balance::LossOfEquilibrium;
use super::stagnation::Stagnation;

/// Why a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The natural residual met the tolerance.
    Converged,
    /// The iteration limit was reached, or the solver stopped making progress.
    Iterations,
    /// No equilibrium: the tangential force exceeds the friction limit.
    GrossSliding,
    /// No equilibrium: the loads separate the bodies, tip one of them off, or act tangentially without any contact.
    ContactLost,
    /// The callback cancelled the solve.
    Interrupted,
    /// Each solution converged, but the cells that stick through a fretting cycle changed from one solution to the next.
    StickZoneNotConverged,
    /// A traction, gap or rigid motion was not finite.
    NotFinite,
}

/// Result of a solve.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// Why the solve ended.
    pub stop: StopReason,
    /// Natural residual of the returned state.
    pub residual: f64,
    /// Number of iterations.
    pub iterations: usize,
    /// Number of operator applications.
    pub applications: usize,
    /// How equilibrium was lost, if the solve ended with a loss of equilibrium.
    pub loss_of_equilibrium: Option<LossOfEquilibrium>,
    /// Course of the solve, if it ended with [`StopReason::Iterations`].
    pub stagnation: Option<Stagnation>,
    /// Name of the method. Names of earlier methods precede it, each with iterations and residual. A comma separates
    /// the methods of two stages.
    pub method: String,
}

/// Report of a solve that has not started.
impl Default for SolveReport {
    fn default() -> Self {
        Self {
            stop: StopReason::Iterations,
            residual: f64::INFINITY,
            iterations: 0,
            applications: 0,
            loss_of_equilibrium: None,
            stagnation: None,
            method: String::new(),
        }
    }
}

impl SolveReport {
    pub(super) fn converged(&self) -> bool {
        self.stop == StopReason::Converged
    }

    /// Returns this report with the iterations and operator applications of `other` added.
    pub fn with_work_of(mut self, other: &Self) -> Self {
        self.add_work_of(other);
        self
    }

    /// Adds the iterations and operator applications of `other`.
    pub fn add_work_of(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.applications += other.applications;
    }

    /// Report of this stage and the next stage: iterations and applications of both, outcome of the next stage.
    pub(super) fn joined_with(self, next: Self) -> Self {
        let next = next.with_work_of(&self);
        let method = if self.method == next.method {
            self.method
        } else {
            format!("{}, {}", self.method, next.method)
        };
        Self { method, ..next }
    }

    /// Report of this solve and its continuation `next` by the solver `name`. The outcome is the outcome of `next`.
    pub(super) fn followed_by(self, name: &str, next: Self) -> Self {
        let next = next.with_work_of(&self);
        let method = if self.method.is_empty() {
            name.to_owned()
        } else {
            let (iterations, residual) = (self.iterations, self.residual);
            let done = format!("after {iterations} iterations at {residual:.1e}");
            format!("{} (no progress {done}), then {name}", self.method)
        };
        Self { method, ..next }
    }
}
