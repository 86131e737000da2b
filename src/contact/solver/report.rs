//! What a solve did and why it ended.

use super::super::projection::LossOfEquilibrium;

/// Why a solve ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The natural residual met the tolerance.
    Converged,
    /// The iteration limit.
    Iterations,
    /// No equilibrium: the tangential force is beyond friction.
    GrossSliding,
    /// No equilibrium: the loads take the bodies apart or tip one off, or act tangentially while nothing is in contact.
    ContactLost,
    /// The watcher asked for it.
    Interrupted,
    /// Each solution converged, but the cells that stick through a fretting cycle changed from one to the next.
    StickZoneNotConverged,
    /// A traction or a gap was not a number.
    NotFinite,
}

/// What a solve did.
#[derive(Debug, Clone, PartialEq)]
pub struct SolveReport {
    /// Why it ended.
    pub stop: StopReason,
    /// Natural residual of the state left in the iterate.
    pub residual: f64,
    /// Iterations.
    pub iterations: usize,
    /// Operator applications.
    pub applications: usize,
    /// What could not be held, where that is why it ended.
    pub loss_of_equilibrium: Option<LossOfEquilibrium>,
    /// The method, and those before it with why they were left.
    pub method: String,
}

/// Nothing done yet.
impl Default for SolveReport {
    fn default() -> Self {
        Self {
            stop: StopReason::Iterations,
            residual: f64::INFINITY,
            iterations: 0,
            applications: 0,
            loss_of_equilibrium: None,
            method: String::new(),
        }
    }
}

impl SolveReport {
    /// Whether it met its tolerance.
    pub(super) fn converged(&self) -> bool {
        self.stop == StopReason::Converged
    }

    /// This report with the iterations and operator applications of another one added.
    pub fn with_work_of(mut self, other: &Self) -> Self {
        self.add_work_of(other);
        self
    }

    /// Adds the iterations and operator applications of another report.
    pub fn add_work_of(&mut self, other: &Self) {
        self.iterations += other.iterations;
        self.applications += other.applications;
    }

    /// This report with that of what was solved next to it.
    pub(super) fn joined_with(self, next: Self) -> Self {
        let next = next.with_work_of(&self);
        let method = if self.method == next.method {
            self.method
        } else {
            format!("{}, {}", self.method, next.method)
        };
        Self { method, ..next }
    }

    /// This report with that of the solver `name`, which went on after it.
    pub(super) fn followed_by(self, name: &str, next: Self) -> Self {
        let next = next.with_work_of(&self);
        let method = if self.method.is_empty() {
            name.to_owned()
        } else {
            let (iterations, residual) = (self.iterations, self.residual);
            let done = format!("after {iterations} iterations at {residual:.1e}");
            format!("{} (no gain {done}), then {name}", self.method)
        };
        Self { method, ..next }
    }
}
