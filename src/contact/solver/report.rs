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
    /// How equilibrium was lost, if the solve ended for this reason.
    pub loss_of_equilibrium: Option<LossOfEquilibrium>,
    /// Course of the solve, if it ended with [`StopReason::Iterations`].
    pub stagnation: Option<Stagnation>,
    /// Name of the method. Methods that were tried before precede it, each with its iterations and residual. A comma separates the
    /// methods of two stages.
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

    /// Adds the iterations and operator applications of another report.
    pub fn with_work_of(mut self, other: &Self) -> Self {
        self.add_work_of(other);
        self
    }

    /// As [`Self::with_work_of`], in place.
    pub fn add_work_of(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.applications += other.applications;
    }

    /// Combines this report with the report of the next stage, whose outcome it keeps.
    pub(super) fn joined_with(self, next: Self) -> Self {
        let next = next.with_work_of(&self);
        let method = if self.method == next.method {
            self.method
        } else {
            format!("{}, {}", self.method, next.method)
        };
        Self { method, ..next }
    }

    /// As [`Self::joined_with`], for the solver `name` that continued the solve.
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
