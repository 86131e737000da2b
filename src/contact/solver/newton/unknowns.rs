//! Unknowns of a Newton step: the states of the cells in contact, and the rigid motions that follow from prescribed forces.

use std::ops::Range;

use nalgebra::{Matrix2, Vector2};

use super::super::super::balance::{MOTION_COMPONENTS, RigidMotion};
use super::super::super::{
    ContactState, Increment, NormalControl, Pressures, SlipReference, TangentialControl,
};

/// Lower bound on the factor β of the radial return in a slipping cell. β is the pressure divided by the magnitude of the augmented
/// tangential traction.
const MIN_BETA: f64 = 1e-3;

/// Slip along a fixed direction is rounding if it is at most this share of the slip.
const MAX_FIXED_SLIP_SHARE: f64 = 1e-9;

/// Entry for the missing compliance of sticking cells along fixed directions, relative to the local compliance. The
/// slip left after a step is this share of the slip that the change of the traction would cause at the local
/// compliance.
pub(super) const FIXED_ENTRY: f64 = 1e-6;

/// State of a cell in contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum CellStatus {
    /// Only the pressure of the cell is unknown.
    PressureOnly,
    /// Pressure and both tangential tractions are unknown.
    Stick,
    /// Pressure and the tangential traction perpendicular to the slip direction are unknown.
    Slip {
        /// Direction of the augmented tangential traction q̂ - c_t Δĝ_t, a unit vector.
        direction: [f64; 2],
        /// (1 - β) / β, with β the factor of the radial return.
        beta_ratio: f64,
        /// Entry that is added for the missing compliance perpendicular to the slip, where supports fix this direction.
        fixed_entry: f64,
    },
    /// The pressure is unknown, and the tangential traction is the pressure times `direction`, because the slip is prescribed.
    PrescribedSlip {
        /// Direction opposite to the slip, a unit vector.
        direction: [f64; 2],
    },
}

/// A cell in contact.
#[derive(Debug, Clone, Copy)]
pub(super) struct ActiveCell {
    pub end: usize,
    pub cell: usize,
    /// Index of the first tangential unknown of the cell.
    pub tangential_row: usize,
    /// Index of the pressure of the cell; `None` if pressures are given.
    pub pressure_row: Option<usize>,
    pub state: CellStatus,
}

impl ActiveCell {
    /// Indices of the unknown tractions of the cell.
    pub fn unknowns(&self) -> Range<usize> {
        let tangential = match self.state {
            CellStatus::PressureOnly | CellStatus::PrescribedSlip { .. } => 0,
            CellStatus::Slip { .. } => 1,
            CellStatus::Stick => 2,
        };
        self.tangential_row..self.tangential_row + tangential + usize::from(self.pressure_row.is_some())
    }
}

/// Unknown rigid motion of a path point.
#[derive(Debug, Clone, Copy)]
pub(super) struct FreeMotion {
    pub end: usize,
    pub motion: RigidMotion,
    /// Prescribed work of the tractions on a unit of the motion.
    pub work: f64,
}

/// Returns the cells in contact with the states that follow from their augmented variables, and the number of unknown tractions.
pub(super) fn active_cells(problem: &Increment, it: &ContactState) -> (Vec<ActiveCell>, usize) {
    let mut active = Vec::new();
    let mut tractions = 0;
    for end in 0..problem.path_points.len() {
        for cell in 0..problem.n() {
            let Some(state) = state(problem, it, end, cell) else { continue };
            let mut found = ActiveCell { end, cell, tangential_row: tractions, pressure_row: None, state };
            if problem.pressures == Pressures::Unknown {
                found.pressure_row = Some(found.unknowns().end);
            }
            tractions = found.unknowns().end;
            active.push(found);
        }
    }
    (active, tractions)
}

/// State of a cell according to its augmented variables; `None` if the cell is open.
fn state(problem: &Increment, it: &ContactState, end: usize, cell: usize) -> Option<CellStatus> {
    let n = problem.n();
    let base = end * 3 * n + cell;
    let p = it.scaled[base + 2 * n];
    let wear = problem.implicit_passes * it.wear_per_pressure[end * n + cell];
    let radius = match problem.pressures {
        Pressures::Given => p,
        Pressures::Unknown => p - it.gap[base + 2 * n] / (1.0 / problem.scales.c_normal[cell] + wear),
    };
    if radius <= 0.0 {
        return None;
    }
    if problem.friction.is_none() {
        return Some(CellStatus::PressureOnly);
    }
    let q = [it.scaled[base], it.scaled[base + n]];
    let slip = [it.gradient[base], it.gradient[base + n]];
    if let SlipReference::Prescribed(_) = problem.path_points[end].reference {
        return Some(prescribed_slip(q, slip, radius));
    }
    let c = problem.scales.c_tangential[cell];
    let y = [q[0] - c * slip[0], q[1] - c * slip[1]];
    let size = (y[0] * y[0] + y[1] * y[1]).sqrt();
    if size <= radius {
        return Some(CellStatus::Stick);
    }
    let beta = (p / size).clamp(MIN_BETA, 1.0);
    let beta_ratio = (1.0 - beta) / beta;
    let (mut direction, mut fixed_entry) = ([y[0] / size, y[1] / size], 0.0);
    let fixed = problem.scales.fixed_directions.get(cell);
    if let Some(fixed) = fixed.filter(|fixed| **fixed != Matrix2::zeros()) {
        (direction, fixed_entry) = match free_direction(fixed, y, slip) {
            Some(free) => (free, share_along(fixed, perpendicular(free))),
            None => (direction, turn_bound(fixed, direction, q, [p.max(0.0), beta_ratio])),
        };
    }
    Some(CellStatus::Slip { direction, beta_ratio, fixed_entry })
}

/// Squared length e·F e of the projection of the unit vector `e` on the fixed directions, with the projector F
/// (`fixed`).
fn share_along(fixed: &Matrix2<f64>, e: [f64; 2]) -> f64 {
    let e = Vector2::from(e);
    e.dot(&(fixed * e))
}

/// Entry for the missing compliance of a slipping cell perpendicular to `direction`, for the traction `q` and the
/// pressure p. If the perpendicular direction is fixed, the row contains `beta_ratio` alone. A small `beta_ratio` would
/// then turn the traction too far. The result is the smallest entry for which the perpendicular traction after the step
/// is at most p.
fn turn_bound(fixed: &Matrix2<f64>, direction: [f64; 2], q: [f64; 2], [p, beta_ratio]: [f64; 2]) -> f64 {
    let left = perpendicular(direction);
    let sideways = (q[0] * left[0] + q[1] * left[1]).abs();
    let least = (sideways - p * beta_ratio) / (p + sideways);
    share_along(fixed, left) * if least > FIXED_ENTRY { least } else { FIXED_ENTRY }
}

/// State of a cell in contact with the traction `q` and the prescribed slip `slip`. Without slip, the traction keeps its value or
/// returns to the friction limit `limit`.
fn prescribed_slip(q: [f64; 2], slip: [f64; 2], limit: f64) -> CellStatus {
    let (slips, carried) = (slip[0].hypot(slip[1]), q[0].hypot(q[1]));
    if slips > 0.0 {
        CellStatus::PrescribedSlip { direction: slip.map(|part| -part / slips) }
    } else if carried > limit {
        CellStatus::PrescribedSlip { direction: q.map(|part| part / carried) }
    } else {
        CellStatus::PressureOnly
    }
}

/// Direction of the augmented tangential traction `y` without its components along `fixed` directions. `None` if the
/// bodies slip along fixed directions, or if `y` has only components along them.
///
/// Tractions along fixed directions have no effect on the slip, so that their rounding errors would turn `y`.
fn free_direction(fixed: &Matrix2<f64>, y: [f64; 2], slip: [f64; 2]) -> Option<[f64; 2]> {
    let (y, slip) = (Vector2::from(y), Vector2::from(slip));
    let free = y - fixed * y;
    let slips = (fixed * slip).norm() > MAX_FIXED_SLIP_SHARE * slip.norm();
    (!slips && free.norm() > MAX_FIXED_SLIP_SHARE * y.norm()).then(|| (free / free.norm()).into())
}

/// Unknown rigid motions of a path point, with the works that its controls or its balance prescribe.
pub(super) fn free_motions(problem: &Increment, index: usize) -> Vec<FreeMotion> {
    let end = &problem.path_points[index];
    let unit = |component: usize| {
        let mut motion = [0.0; MOTION_COMPONENTS];
        motion[component] = 1.0;
        motion
    };
    if let Some(balance) = &end.balance {
        return balance.constraints().map(|(motion, work)| FreeMotion { end: index, motion, work }).collect();
    }
    let mut free = Vec::new();
    if let TangentialControl::Force(force) = end.tangential {
        free.extend([0, 1].map(|axis| FreeMotion { end: index, motion: unit(axis), work: force[axis] }));
    }
    if let (NormalControl::Force(force), Pressures::Unknown) = (end.normal, problem.pressures) {
        free.push(FreeMotion { end: index, motion: unit(2), work: force });
    }
    free
}

/// The direction perpendicular to `e`, 90 degrees to its left.
pub(super) fn perpendicular(e: [f64; 2]) -> [f64; 2] {
    [-e[1], e[0]]
}
