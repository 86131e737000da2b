//! Test for gross sliding: whether friction carries a prescribed tangential force while every cell slips opposite to it.
//!
//! It applies to unknown pressures with friction, to path points without balance, and if wear is not implicit. The friction limit
//! of a scaled tangential force is the normal force.

use super::super::super::balance::LossOfEquilibrium;
use super::super::super::{
    ContactState, Increment, NormalControl, PathPoint, Pressures, SlipReference, TangentialControl,
};
use super::super::control::{PartSolver, SolveControl};
use super::super::report::SolveReport;

/// Largest number of iterations of the test.
const MAX_ITERATIONS: usize = 500;

/// Share of the friction limit from which a prescribed force counts as gross sliding.
const LIMIT_SHARE: f64 = 1.0 - 1e-12;

/// Returns whether a prescribed normal force is too small for the tangential force of its path point.
pub(super) fn is_certain(problem: &Increment) -> bool {
    (0..problem.path_points.len()).any(|end| {
        match (scaled_force(problem, end), problem.path_points[end].normal) {
            (Some(force), NormalControl::Force(normal)) => force[0].hypot(force[1]) > normal.max(0.0),
            _ => false,
        }
    })
}

/// Result of the test.
pub(super) enum Verdict {
    /// A force reaches the friction limit.
    Slides(LossOfEquilibrium),
    /// Friction carries every force.
    Carried,
    /// The test does not apply, or the pressures in sliding did not converge or are zero.
    Unknown,
}

/// Tests the path points with a prescribed tangential force until one slides. Its pressures are solved while every cell slips
/// opposite to the force. Writes the tractions and the approach of a sliding path point into `it`.
///
/// Adds the work of the solves to `report`.
pub(super) fn test(
    problem: &Increment,
    it: &mut ContactState,
    control: &mut SolveControl,
    solver: PartSolver,
    report: &mut SolveReport,
) -> Verdict {
    let mut all = Verdict::Carried;
    let mut forces = 0;
    for end in 0..problem.path_points.len() {
        let Some(force) = scaled_force(problem, end) else { continue };
        forces += 1;
        match test_path_point(problem, it, (end, force), control, solver, report) {
            Verdict::Carried => {}
            Verdict::Unknown => all = Verdict::Unknown,
            slides @ Verdict::Slides(_) => return slides,
        }
    }
    if forces == 0 { Verdict::Unknown } else { all }
}

/// Scaled tangential force that path point `end` prescribes; `None` if the force is zero or the test does not apply. With implicit
/// wear, the gap depends on the distance of sliding.
fn scaled_force(problem: &Increment, end: usize) -> Option<[f64; 2]> {
    let (point, hat) = (&problem.path_points[end], problem.friction_scaling()?);
    let implicit_wear = problem.wear.is_some() && problem.implicit_passes > 0.0;
    match point.tangential {
        TangentialControl::Force(force)
            if force != [0.0; 2]
                && point.balance.is_none()
                && problem.pressures == Pressures::Unknown
                && !implicit_wear =>
        {
            Some(hat.scaled_traction(force))
        }
        _ => None,
    }
}

fn test_path_point(
    problem: &Increment,
    it: &mut ContactState,
    (end, force): (usize, [f64; 2]),
    control: &mut SolveControl,
    solver: PartSolver,
    report: &mut SolveReport,
) -> Verdict {
    let n = problem.n();
    let Some(hat) = problem.friction_scaling() else { return Verdict::Unknown };
    let point = &problem.path_points[end];
    let size = force[0].hypot(force[1]);
    if matches!(point.normal, NormalControl::Force(normal) if size < LIMIT_SHARE * normal) {
        return Verdict::Carried;
    }
    let slip = hat.physical_slip(force.map(|part| -part));
    let slips = [vec![slip[0]; n], vec![slip[1]; n]].concat();
    let sliding = Increment {
        wear: None,
        scales: problem.scales.clone(),
        path_points: vec![PathPoint {
            tangential: TangentialControl::Shift,
            balance: None,
            reference: SlipReference::Prescribed(slips),
            ..point.clone()
        }],
        ..*problem
    };
    let planes = 3 * n * end..3 * n * (end + 1);
    let mut state = ContactState::new(n, vec![it.rigid_motion[end]]);
    state.mode_amplitudes = vec![it.mode_amplitudes[end]];
    state.scaled.copy_from_slice(&it.scaled[planes.clone()]);
    let solved = solver(&sliding, &mut state, &mut control.auxiliary(report.iterations, MAX_ITERATIONS));
    report.add_work_of(&solved);
    let pressures = &state.scaled[2 * n..];
    let limit: f64 = pressures.iter().zip(problem.areas).map(|(p, area)| p * area).sum();
    if !solved.converged() || limit == 0.0 {
        return Verdict::Unknown;
    }
    if size < LIMIT_SHARE * limit {
        return Verdict::Carried;
    }
    it.scaled[planes].copy_from_slice(&state.scaled);
    it.rigid_motion[end][2] = state.rigid_motion[0][2];
    Verdict::Slides(LossOfEquilibrium::by_sliding(&hat, force, limit))
}
