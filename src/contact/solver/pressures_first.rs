//! Solves for the pressures first and for the tangential tractions afterwards.
//!
//! Applies to pairs of bodies whose normal and tangential problems do not couple: bodies of equal elastic constants, or
//! incompressible bodies on rigid bodies. The pressures give the friction limit of every cell in the tangential
//! problem.
//!
//! # Source
//! Johnson 1985, Contact Mechanics, section 7.2: the normal and the tangential problem of similar bodies are independent.

use super::super::{ContactState, Increment, PathPoint, Pressures, TangentialControl};
use super::control::{Method, PartSolver, SolveControl, SolverOptions};
use super::report::{SolveReport, StopReason};
use crate::omitted::OmittableWork;

/// Tolerance of the pressures, relative to the tolerance of the increment. Errors of the pressures are also errors of
/// the friction limits.
const PRESSURE_TOLERANCE_SHARE: f64 = 0.2;
/// Tolerance of the tangential tractions, relative to the tolerance of the increment.
const TANGENTIAL_TOLERANCE_SHARE: f64 = 0.7;

/// Returns whether the normal and the tangential problem are solved one after the other.
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

/// The increment without friction and without prescribed tangential forces.
pub(super) fn without_friction<'p>(problem: &Increment<'p>) -> Increment<'p> {
    let bare = |end: &PathPoint| PathPoint { tangential: TangentialControl::Shift, ..end.clone() };
    let path_points = problem.path_points.iter().map(bare).collect();
    Increment { friction: None, scales: problem.scales.clone(), path_points, ..*problem }
}

pub(super) fn solve(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    solver: PartSolver,
) -> SolveReport {
    let pressed = without_friction(problem);
    let surface = 2 * problem.n();
    let tangential = it.scaled[..surface].to_vec();
    it.scaled[..surface].fill(0.0);
    let mut part = control.auxiliary(0, usize::MAX);
    part.options.tolerance *= PRESSURE_TOLERANCE_SHARE;
    let first = solver(&pressed, it, &mut part);
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
    let mut part = control.rest(first.iterations);
    part.options.tolerance *= TANGENTIAL_TOLERANCE_SHARE;
    let second = solver(&sheared, it, &mut part);
    first.joined_with(second)
}
