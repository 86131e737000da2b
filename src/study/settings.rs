//! The settings of operators and solvers that a plan asks for.

use crate::bem::half_space::CrossBlocks;
use crate::contact::{Method, SolverOptions};
use crate::coupling::{self, HalfSpaceOperators};
use crate::frame::ContactFrame;
use crate::linalg::precision::Precision;
use crate::scene::keys::solver;
use crate::scene::plan::Plan;
use crate::skip::Skip;

/// How the bodies are tied to the frame.
pub(super) fn way(plan: &Plan) -> coupling::Coupling {
    match plan.solver.coupling {
        solver::Coupling::Schur => coupling::Coupling::Schur,
        solver::Coupling::Block => coupling::Coupling::Block,
    }
}

/// How the operators of half-spaces on `frame` are made.
pub(super) fn operators<'p>(plan: &'p Plan, frame: &ContactFrame) -> HalfSpaceOperators<'p> {
    let summed = plan.solver.skip.skips().has(Skip::SecondHalfSpace);
    HalfSpaceOperators { cross: cross(plan, frame), summed, kernels: plan.kernels.as_deref() }
}

/// Whether half-space operators on `frame` leave out what vanishes or is distant.
pub(super) fn cross(plan: &Plan, frame: &ContactFrame) -> CrossBlocks {
    let skip = if frame.grid.is_some() { Skip::VanishingBlocks } else { Skip::DistantEntries };
    if plan.solver.skip.skips().has(skip) { CrossBlocks::SkipVanishing } else { CrossBlocks::Keep }
}

/// The solver settings of a plan.
pub(super) fn options(plan: &Plan) -> SolverOptions {
    SolverOptions {
        tolerance: plan.solver.tolerance,
        method: match plan.solver.method {
            solver::Method::Auto => Method::Auto,
            solver::Method::Newton => Method::Newton,
            solver::Method::Cg => Method::ConjugateGradients,
            solver::Method::Bb => Method::BarzilaiBorwein,
            solver::Method::GaussSeidel => Method::GaussSeidel,
            solver::Method::Uzawa => Method::Uzawa,
        },
        max_iterations: plan.solver.max_iterations,
        skip: plan.solver.skip.skips(),
        precision: match plan.solver.precision {
            solver::Precision::Mixed => Precision::Single,
            solver::Precision::Double => Precision::Double,
        },
    }
}
