//! Controls along a step: totals at its end, reached linearly from the state before.

use nalgebra::Vector3;

use crate::contact::{NormalControl, TangentialControl};

use super::model::Prepared;
use super::step::{Normal, Step, Tangential};

/// Controls in force: what a step does not name stays as it was (an approach an approach, a force a force).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Held {
    pub normal: Normal,
    pub tangential: Tangential,
}

impl Held {
    /// Prescribed force on body 1, 0 along directions without.
    fn force(&self) -> Vector3<f64> {
        let [x, y] = if let Tangential::Force(force) = self.tangential { force } else { [0.0; 2] };
        let n = if let Normal::Force(force) = self.normal { -force } else { 0.0 };
        Vector3::new(x, y, n)
    }
}

/// The controls of one increment and the rigid motion it starts from, (x, y, n).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Controls {
    pub rigid: [f64; 3],
    pub normal: NormalControl,
    pub tangential: TangentialControl,
}

/// A step's path from where it starts to what it prescribes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Path {
    /// Rigid motion at the start.
    pub rigid: [f64; 3],
    /// Prescribed force on body 1 at the start, (x, y, n): what the contact carries, and along directions in which the
    /// bodies float, where it carries their own loads too, what was prescribed before.
    pub force: [f64; 3],
    /// Approach at which the first cell closes.
    pub first_touch: f64,
    /// What is prescribed at the end.
    pub end: Held,
}

impl Path {
    /// The path of `step` from a start (rigid motion, force of the contact), with `held` in force before it.
    pub fn new(step: &Step, held: Held, (rigid, carried): ([f64; 3], [f64; 3]), prepared: &Prepared) -> Self {
        let carried = Vector3::from(carried);
        let force = carried + prepared.free_part(held.force() - carried);
        let end = Held {
            normal: step.normal.unwrap_or(held.normal),
            tangential: step.tangential.unwrap_or(held.tangential),
        };
        Self { rigid, force: force.into(), first_touch: prepared.first_touch, end }
    }

    /// Controls at `fraction` of the path; `now` is the present rigid motion, the guess for what is free.
    pub fn at(&self, fraction: f64, now: [f64; 3]) -> Controls {
        let between = |from: f64, to: f64| from + fraction * (to - from);
        let mut rigid = now;
        let normal = match self.end.normal {
            Normal::Approach(depth) => {
                rigid[2] = between(self.rigid[2], self.first_touch - depth);
                NormalControl::Approach
            }
            Normal::Force(force) => NormalControl::Force(between(-self.force[2], force)),
        };
        let tangential = match self.end.tangential {
            Tangential::Shift(shift) => {
                rigid[0] = between(self.rigid[0], shift[0]);
                rigid[1] = between(self.rigid[1], shift[1]);
                TangentialControl::Shift
            }
            // Reported forces act on body 1, the solver's on body 2.
            Tangential::Force(force) => TangentialControl::Force([
                -between(self.force[0], force[0]),
                -between(self.force[1], force[1]),
            ]),
        };
        Controls { rigid, normal, tangential }
    }
}
