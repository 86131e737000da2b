//! The settings of operators and solvers that a plan asks for.

use crate::bem::half_space::CrossBlocks;
use crate::contact::{Method, SolverOptions};
use crate::coupling::{self, HalfSpaceOperators};
use crate::frame::ContactFrame;
use crate::omitted::OmittableWork;
use crate::scene::plan::Plan;
use crate::scene::spec::solver;

/// How the bodies are tied to the frame.
pub(super) fn coupling_method(plan: &Plan) -> coupling::Coupling {
    match plan.solver.coupling {
        solver::Coupling::Schur => coupling::Coupling::Schur,
        solver::Coupling::Block => coupling::Coupling::Block,
    }
}

/// How the operators of half-spaces on `frame` are made.
pub(super) fn operators(plan: &Plan, frame: &ContactFrame) -> HalfSpaceOperators {
    let summed = plan.solver.skip.allowed_skips().allows(OmittableWork::SecondHalfSpace);
    HalfSpaceOperators { cross: cross_blocks(plan, frame), summed }
}

/// Whether half-space operators on `frame` leave out what vanishes or is distant.
pub(in crate::simulation) fn cross_blocks(plan: &Plan, frame: &ContactFrame) -> CrossBlocks {
    let skip =
        if frame.grid.is_some() { OmittableWork::VanishingBlocks } else { OmittableWork::DistantEntries };
    if plan.solver.skip.allowed_skips().allows(skip) { CrossBlocks::SkipVanishing } else { CrossBlocks::Keep }
}

/// The solver settings of a plan.
pub(in crate::simulation) fn options(plan: &Plan) -> SolverOptions {
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
        skip: plan.solver.skip.allowed_skips(),
    }
}
