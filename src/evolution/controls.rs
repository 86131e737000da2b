//! Controls of a step: prescribed motions and loads of body 2. They change linearly from the state before the step to
//! the values prescribed for its end.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::contact::{NormalControl, TangentialControl};
use crate::evolution::model::PreparedModel;
use crate::evolution::step::{Normal, Spin, Step, Tangential, Tilt};

/// Controls of the current step. A new step replaces the controls that it prescribes and keeps the others.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct ActiveControls {
    pub normal: Normal,
    pub tangential: Tangential,
    pub tilt: Tilt,
    pub spin: Spin,
}

impl ActiveControls {
    pub fn at_rest(normal: Normal) -> Self {
        Self {
            normal,
            tangential: Tangential::Shift([0.0; 2]),
            tilt: Tilt::Rotation([0.0; 2]),
            spin: Spin::Twist(0.0),
        }
    }

    fn after(self, step: &Step) -> Self {
        Self {
            normal: step.normal.unwrap_or(self.normal),
            tangential: step.tangential.unwrap_or(self.tangential),
            tilt: step.tilt.unwrap_or(self.tilt),
            spin: step.spin.unwrap_or(self.spin),
        }
    }

    /// Prescribed force on body 1, N; 0 along directions without a prescribed force.
    fn force(&self) -> Vector3<f64> {
        let [x, y] = if let Tangential::Force(force) = self.tangential { force } else { [0.0; 2] };
        let n = if let Normal::Force(force) = self.normal { -force } else { 0.0 };
        Vector3::new(x, y, n)
    }

    /// Prescribed normal force and moments of these controls. The tangential displacement counts as given, so a
    /// prescribed tangential force is left out.
    pub fn loads_at_shift(&self) -> PrescribedLoads {
        let normal = match self.normal {
            Normal::Approach(_) => NormalControl::Approach,
            Normal::Force(force) => NormalControl::Force(force),
        };
        let mut moment = [None; 3];
        if let Tilt::Moment([x, y]) = self.tilt {
            (moment[0], moment[1]) = (Some(-x), Some(-y));
        }
        if let Spin::Moment(n) = self.spin {
            moment[2] = Some(-n);
        }
        PrescribedLoads { normal, tangential: TangentialControl::Shift, moment, phase: 0.0 }
    }
}

/// Prescribed forces and moments. Along directions without a prescribed load, the motion is prescribed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PrescribedLoads {
    pub normal: NormalControl,
    pub tangential: TangentialControl,
    /// Moments on body 2 about the axes x, y, n through the frame's origin, N mm; `None` where the rotation is given.
    pub moment: [Option<f64>; 3],
    /// Phase of the cyclic loads of the bodies, from -1 to 1 at the + reversal point. It multiplies their amplitudes.
    pub phase: f64,
}

impl PrescribedLoads {
    pub fn any(&self) -> bool {
        let forced = matches!(self.normal, NormalControl::Force(_))
            || matches!(self.tangential, TangentialControl::Force(_));
        forced || self.prescribes_moment()
    }

    pub fn prescribes_moment(&self) -> bool {
        self.moment.iter().any(Option::is_some)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct IncrementControls {
    /// Displacement of body 2 along x, y, n, mm; an initial guess where a force is prescribed.
    pub rigid: [f64; 3],
    /// Rotation of body 2 about x, y, n, radians; an initial guess where a moment is prescribed.
    pub turn: [f64; 3],
    pub loads: PrescribedLoads,
}

/// Rigid motion of body 2 (mm, radians) and resultants on body 1 (N, N mm), in the frame's axes.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct LoadPathStart {
    pub rigid: [f64; 3],
    pub turn: [f64; 3],
    pub force: [f64; 3],
    pub moment: [f64; 3],
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct LoadPath {
    /// State at the start of the path. `force` is the contact force on body 1, except along directions in which a body
    /// is unconstrained. Along these directions the contact force also balances loads of the bodies, so `force` is the
    /// force prescribed by the earlier controls.
    start: LoadPathStart,
    first_touch: f64,
    pub end: ActiveControls,
}

impl LoadPath {
    /// Returns the path of `step`. `start` is the state before the step, with the contact force on body 1. `held` are
    /// the controls before the step.
    pub fn new(
        step: &Step,
        held: ActiveControls,
        mut start: LoadPathStart,
        prepared: &PreparedModel,
    ) -> Self {
        let carried = Vector3::from(start.force);
        start.force = (carried + prepared.free_part(held.force() - carried)).into();
        Self { start, first_touch: prepared.first_touch, end: held.after(step) }
    }

    /// Force on body 1 at the start of the path, N (see [`Self::start`]).
    pub fn start_force(&self) -> [f64; 3] {
        self.start.force
    }

    /// Returns this path after the approach at first touch has increased by `by` (mm). The start of the path moves by
    /// the same distance along n.
    pub fn with_later_first_touch(mut self, by: f64) -> Self {
        self.first_touch += by;
        self.start.rigid[2] += by;
        self
    }

    /// Controls at `fraction` (0 to 1) of the path. The translation `rigid` and the rotation `turn` are initial
    /// guesses; the path replaces their prescribed components.
    pub fn at(&self, fraction: f64, mut rigid: [f64; 3], mut turn: [f64; 3]) -> IncrementControls {
        // At the end of the path, returns exactly the prescribed value, without rounding error.
        let between = |from: f64, to: f64| if fraction == 1.0 { to } else { from + fraction * (to - from) };
        let start = &self.start;
        let normal = match self.end.normal {
            Normal::Approach(depth) => {
                rigid[2] = between(start.rigid[2], self.first_touch - depth);
                NormalControl::Approach
            }
            Normal::Force(force) => NormalControl::Force(between(-start.force[2], force)),
        };
        let tangential = match self.end.tangential {
            Tangential::Shift(shift) => {
                (0..2).for_each(|k| rigid[k] = between(start.rigid[k], shift[k]));
                TangentialControl::Shift
            }
            // Scene and results contain forces and moments on body 1. The solver needs the opposite ones, on body 2.
            Tangential::Force(force) => {
                TangentialControl::Force([0, 1].map(|k| -between(start.force[k], force[k])))
            }
        };
        let mut moment = [None; 3];
        match self.end.tilt {
            Tilt::Rotation(angle) => (0..2).for_each(|k| turn[k] = between(start.turn[k], angle[k])),
            Tilt::Moment(m) => (0..2).for_each(|k| moment[k] = Some(-between(start.moment[k], m[k]))),
        }
        match self.end.spin {
            Spin::Twist(angle) => turn[2] = between(start.turn[2], angle),
            Spin::Moment(m) => moment[2] = Some(-between(start.moment[2], m)),
        }
        IncrementControls { rigid, turn, loads: PrescribedLoads { normal, tangential, moment, phase: 0.0 } }
    }
}
