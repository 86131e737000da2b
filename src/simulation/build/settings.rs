//! Operator and solver settings of a plan.

use crate::bem::half_space::CrossBlocks;
use crate::contact::SolverOptions;
use crate::coupling::HalfSpaceOperators;
use crate::frame::ContactFrame;
use crate::omitted::OmittableWork;
use crate::scene::plan::Plan;

pub(super) fn operators(plan: &Plan, frame: &ContactFrame) -> HalfSpaceOperators {
    let summed = plan.solver.skip.allowed_skips().allows(OmittableWork::SecondHalfSpace);
    HalfSpaceOperators { cross: cross_blocks(plan, frame), summed }
}

/// Whether half-space operators on `frame` omit vanishing blocks (on grids) or entries between distant cells (on other
/// frames).
pub(crate) fn cross_blocks(plan: &Plan, frame: &ContactFrame) -> CrossBlocks {
    let skip =
        if frame.grid.is_some() { OmittableWork::VanishingBlocks } else { OmittableWork::DistantEntries };
    if plan.solver.skip.allowed_skips().allows(skip) { CrossBlocks::SkipVanishing } else { CrossBlocks::Keep }
}

pub(crate) fn options(plan: &Plan) -> SolverOptions {
    SolverOptions {
        tolerance: plan.solver.tolerance,
        method: plan.solver.method,
        max_iterations: plan.solver.max_iterations,
        skip: plan.solver.skip.allowed_skips(),
    }
}
