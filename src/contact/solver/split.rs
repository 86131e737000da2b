//! Pressures first, then what happens in the surface, of pairs of bodies in which neither moves the gap of the other: equal
//! bodies, incompressible ones on rigid ones.
//!
//! Pressures that do not change cost one product with the normal part; the tangential equations are those of a given limit of
//! friction in every cell, with two components in place of three, only in the cells in contact.
//!
//! # Source
//! Johnson 1985, Contact Mechanics, section 7.2: the normal and the tangential problem of similar bodies are independent.

use super::super::{End, Increment, Iterate, Pressures, TangentialControl};
use super::{Method, SolveReport, SolverOptions, Stop, Watch};
use crate::skip::Skip;

/// Share of the tolerance that each part may use: an error of the pressures is one of the limits as well.
const PRESSURES: f64 = 0.2;
const SURFACE: f64 = 0.7;

/// How each part is solved: the increment, the state it is in, its settings, its watch.
type Inner<'a> = dyn FnMut(&Increment, &mut Iterate, &SolverOptions, &mut Watch) -> SolveReport + 'a;

/// Whether the increment falls apart.
pub(super) fn suits(problem: &Increment, options: &SolverOptions) -> bool {
    let [end] = problem.ends.as_slice() else { return false };
    let laws = problem.friction.is_some() && problem.wear.is_none();
    let level = problem.rigid_axes.is_none() && end.balance.is_none();
    let whole = problem.pressures == Pressures::Unknown;
    options.skip.has(Skip::NormalComponents)
        && options.method == Method::Auto
        && laws
        && level
        && whole
        && problem.flexibility.tangential().is_some()
}

/// The increment without friction, in which nothing holds body 2 along the surface.
pub(super) fn without_friction<'p>(problem: &Increment<'p>) -> Increment<'p> {
    let bare = |end: &End| End { tangential: TangentialControl::Shift, ..end.clone() };
    let ends = problem.ends.iter().map(bare).collect();
    Increment { friction: None, scales: problem.scales.clone(), ends, ..*problem }
}

/// Solves from the state in `it`.
pub(super) fn solve(
    problem: &Increment,
    it: &mut Iterate,
    options: &SolverOptions,
    watch: &mut Watch,
    inner: &mut Inner,
) -> SolveReport {
    let pressed = without_friction(problem);
    let surface = 2 * problem.n();
    let tangential = it.hatted[..surface].to_vec();
    it.hatted[..surface].fill(0.0);
    let part = SolverOptions { tolerance: PRESSURES * options.tolerance, ..*options };
    let first = inner(&pressed, it, &part, watch);
    it.hatted[..surface].copy_from_slice(&tangential);
    if first.stop != Stop::Converged {
        return first;
    }
    let sheared = Increment {
        pressures: Pressures::Given,
        scales: problem.scales.clone(),
        ends: problem.ends.clone(),
        ..*problem
    };
    let max_iterations = options.max_iterations.saturating_sub(first.iterations);
    let part = SolverOptions { tolerance: SURFACE * options.tolerance, max_iterations, ..*options };
    let mut told = |iterations: usize, residual: f64| watch(first.iterations + iterations, residual);
    let second = inner(&sheared, it, &part, &mut told);
    first.and(second)
}
