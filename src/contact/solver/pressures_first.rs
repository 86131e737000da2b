//! Pressures first, then what happens in the surface, of pairs of bodies in which neither moves the gap of the other: equal
//! bodies, incompressible ones on rigid ones.
//!
//! Pressures that do not change cost one product with the normal part; the tangential equations are those of a given limit of
//! friction in every cell, with two components in place of three, only in the cells in contact.
//!
//! # Source
//! Johnson 1985, Contact Mechanics, section 7.2: the normal and the tangential problem of similar bodies are independent.

use super::super::{ContactState, Increment, PathPoint, Pressures, TangentialControl};
use super::{IterationCallback, Method, SolveReport, SolverOptions, StopReason};
use crate::omitted::OmittableWork;

/// Share of the tolerance that each part may use: an error of the pressures is one of the limits as well.
const PRESSURE_TOLERANCE_SHARE: f64 = 0.2;
const TANGENTIAL_TOLERANCE_SHARE: f64 = 0.7;

/// How each part is solved: the increment, the state it is in, its settings, its watch.
type InnerSolver<'a> =
    dyn FnMut(&Increment, &mut ContactState, &SolverOptions, &mut IterationCallback) -> SolveReport + 'a;

/// Whether the increment falls apart.
pub(super) fn is_applicable(problem: &Increment, options: &SolverOptions) -> bool {
    let [end] = problem.path_points.as_slice() else { return false };
    let laws = problem.friction.is_some() && problem.wear.is_none();
    let level = problem.rigid_axes.is_none() && end.balance.is_none();
    let whole = problem.pressures == Pressures::Unknown;
    options.skip.allows(OmittableWork::NormalComponents)
        && options.method == Method::Auto
        && laws
        && level
        && whole
        && problem.flexibility.tangential().is_some()
}

/// The increment without friction, in which nothing holds body 2 along the surface.
pub(super) fn without_friction<'p>(problem: &Increment<'p>) -> Increment<'p> {
    let bare = |end: &PathPoint| PathPoint { tangential: TangentialControl::Shift, ..end.clone() };
    let path_points = problem.path_points.iter().map(bare).collect();
    Increment { friction: None, scales: problem.scales.clone(), path_points, ..*problem }
}

/// Solves from the state in `it`.
pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    options: &SolverOptions,
    watch: &mut IterationCallback,
    inner: &mut InnerSolver,
) -> SolveReport {
    let pressed = without_friction(problem);
    let surface = 2 * problem.n();
    let tangential = it.scaled[..surface].to_vec();
    it.scaled[..surface].fill(0.0);
    let part = SolverOptions { tolerance: PRESSURE_TOLERANCE_SHARE * options.tolerance, ..*options };
    let first = inner(&pressed, it, &part, watch);
    it.scaled[..surface].copy_from_slice(&tangential);
    if first.stop != StopReason::Converged {
        return first;
    }
    let sheared = Increment {
        pressures: Pressures::Given,
        scales: problem.scales.clone(),
        path_points: problem.path_points.clone(),
        ..*problem
    };
    let max_iterations = options.max_iterations.saturating_sub(first.iterations);
    let part = SolverOptions {
        tolerance: TANGENTIAL_TOLERANCE_SHARE * options.tolerance,
        max_iterations,
        ..*options
    };
    let mut told = |iterations: usize, residual: f64| watch(first.iterations + iterations, residual);
    let second = inner(&sheared, it, &part, &mut told);
    first.joined_with(second)
}
