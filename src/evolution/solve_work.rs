//! Work of contact solutions: numbers of solves, iterations and operator applications.

use std::ops::{AddAssign, Sub};

use serde::{Deserialize, Serialize};

use crate::contact::solver::SolveReport;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub(super) struct SolveWork {
    pub solves: usize,
    pub iterations: usize,
    pub applications: usize,
}

impl SolveWork {
    pub fn of(report: &SolveReport) -> Self {
        Self { solves: 1, iterations: report.iterations, applications: report.applications }
    }
}

impl AddAssign for SolveWork {
    fn add_assign(&mut self, other: Self) {
        self.solves += other.solves;
        self.iterations += other.iterations;
        self.applications += other.applications;
    }
}

impl Sub for SolveWork {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            solves: self.solves - other.solves,
            iterations: self.iterations - other.iterations,
            applications: self.applications - other.applications,
        }
    }
}
