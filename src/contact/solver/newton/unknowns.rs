//! What is unknown in a Newton step: the states of the cells in contact, and the rigid motions that prescribed forces leave free.

use super::super::super::balance::{COMPONENTS, Motion};
use super::super::super::{Increment, Iterate, NormalControl, Pressures, TangentialControl};

/// Least β of a slipping cell.
const LEAST_BETA: f64 = 1e-3;

/// State of a cell in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum State {
    /// Only its pressure is unknown.
    Bare,
    /// Pressure and both tangential tractions.
    Stick,
    /// Pressure, and the traction across the direction of slip.
    Slip {
        /// Direction of the tangential traction.
        along: [f64; 2],
        /// (1 - β) / β, β the shortening by the radial return.
        turning: f64,
    },
}

/// A cell in contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct Active {
    pub end: usize,
    pub cell: usize,
    /// Where its tangential unknowns begin.
    pub first: usize,
    /// Where its pressure is, if it is unknown.
    pub pressure: Option<usize>,
    pub state: State,
}

/// A rigid motion to be found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Free {
    pub end: usize,
    pub motion: Motion,
    /// What the tractions have to do on it.
    pub work: f64,
}

/// The cells in contact by their augmented variables, and the number of their unknown tractions.
pub(super) fn in_contact(problem: &Increment, it: &Iterate) -> (Vec<Active>, usize) {
    let mut active = Vec::new();
    let mut tractions = 0;
    for end in 0..problem.ends.len() {
        for cell in 0..problem.n() {
            let Some(state) = state(problem, it, end, cell) else { continue };
            let first = tractions;
            tractions += match state {
                State::Bare => 0,
                State::Slip { .. } => 1,
                State::Stick => 2,
            };
            let pressure = (problem.pressures == Pressures::Unknown).then_some(tractions);
            tractions += usize::from(pressure.is_some());
            active.push(Active { end, cell, first, pressure, state });
        }
    }
    (active, tractions)
}

/// State of a cell by its augmented variables; `None` if it is open.
fn state(problem: &Increment, it: &Iterate, end: usize, cell: usize) -> Option<State> {
    let n = problem.n();
    let base = end * 3 * n + cell;
    let p = it.hatted[base + 2 * n];
    let wear = problem.repeats * it.wear_path[end * n + cell];
    let radius = match problem.pressures {
        Pressures::Given => p,
        Pressures::Unknown => p - it.gap[base + 2 * n] / (1.0 / problem.scales.c_normal[cell] + wear),
    };
    if radius <= 0.0 {
        return None;
    }
    if problem.friction.is_none() {
        return Some(State::Bare);
    }
    let c = problem.scales.c_tangential[cell];
    let y = [it.hatted[base] - c * it.gradient[base], it.hatted[base + n] - c * it.gradient[base + n]];
    let size = (y[0] * y[0] + y[1] * y[1]).sqrt();
    if size <= radius {
        return Some(State::Stick);
    }
    let beta = (p / size).clamp(LEAST_BETA, 1.0);
    Some(State::Slip { along: [y[0] / size, y[1] / size], turning: (1.0 - beta) / beta })
}

/// The motions that the controls of an end leave free.
pub(super) fn free_motions(problem: &Increment, index: usize) -> Vec<Free> {
    let end = &problem.ends[index];
    let unit = |component: usize| {
        let mut motion = [0.0; COMPONENTS];
        motion[component] = 1.0;
        motion
    };
    if let Some(balance) = &end.balance {
        return balance.wanted().map(|(motion, work)| Free { end: index, motion, work }).collect();
    }
    let mut free = Vec::new();
    if let TangentialControl::Force(force) = end.tangential {
        free.extend([0, 1].map(|axis| Free { end: index, motion: unit(axis), work: force[axis] }));
    }
    if let TangentialControl::Along { axis, force } = end.tangential {
        free.push(Free { end: index, motion: unit(axis), work: force });
    }
    if let (NormalControl::Force(force), Pressures::Unknown) = (end.normal, problem.pressures) {
        free.push(Free { end: index, motion: unit(2), work: force });
    }
    free
}
