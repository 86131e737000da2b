//! What a step prescribes.

use serde::{Deserialize, Serialize};

/// Normal control: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Normal {
    /// Motion of body 2 towards body 1, mm, 0 = first touch of the undeformed surfaces.
    Approach(f64),
    /// Normal force on body 1, compression positive.
    Force(f64),
}

/// Tangential control: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tangential {
    /// Displacement of body 2 along the frame's x, y, mm.
    Shift([f64; 2]),
    /// Tangential force on body 1 along the frame's x, y.
    Force([f64; 2]),
}

/// Control of the rotation of body 2 about the frame's x and y through its centre: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Tilt {
    /// Small rotation about x, y, radians.
    Rotation([f64; 2]),
    /// Moment on body 1 about x, y; the rotation is found.
    Moment([f64; 2]),
}

/// Control of the rotation of body 2 about n through the frame's centre: totals at the end of the step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Spin {
    /// Small rotation, radians.
    Twist(f64),
    /// Moment on body 1; the twist is found.
    Moment(f64),
}

/// Wear by many passes of one motion, taken in jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cycles {
    /// Number of cycles; the distance of steady sliding, mm.
    pub count: f64,
    /// What happens in each.
    pub motion: CycleMotion,
    /// How many are taken at once.
    pub jumps: Jumps,
    /// How a jump is integrated.
    pub integrator: Integrator,
    /// Whether explicit jumps may be longer than is stable.
    pub beyond_critical: bool,
}

/// Motion of body 2 in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CycleMotion {
    /// To and fro, or round an ellipse, about where it is at the start of the step.
    Closed(Closed),
    /// Steady sliding along a direction from the frame's x, radians.
    Sliding {
        /// The direction.
        angle: f64,
    },
}

/// A closed path of displacements or tangential forces about those at the start of the step, begun at its + end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closed {
    /// What follows the path.
    pub drive: Drive,
    /// Half-axes: along `angle`, and a quarter turn to the left of it (0 for a line), mm or N.
    pub amplitude: [f64; 2],
    /// Direction from the frame's x, radians.
    pub angle: f64,
    /// Increments per stroke, half a cycle, between the ends that are solved together.
    pub increments: usize,
    /// Relative tolerance to which cycles in more increments say, now and then, what wears between the ends; `None` if none do.
    pub resolve: Option<f64>,
}

/// What is prescribed of a closed path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Drive {
    /// The displacement of body 2.
    Shift,
    /// The tangential force on body 1.
    Force,
}

/// Jumps by the estimated error, usually.
const CONTROLLED_JUMPS: usize = 6;

impl Cycles {
    /// Farthest that body 2 is moved from where it is at the start of the step, mm; `None` where forces move it.
    pub fn reach(&self) -> Option<f64> {
        match &self.motion {
            CycleMotion::Closed(closed) if closed.drive == Drive::Force => None,
            CycleMotion::Closed(closed) => Some(closed.amplitude[0].max(closed.amplitude[1])),
            CycleMotion::Sliding { .. } => Some(0.0),
        }
    }

    /// Cycles that are usually solved: those of the stages of all jumps, and the first strokes before them.
    pub fn usual_solves(&self, wear: bool) -> usize {
        let jumps = match self.jumps {
            Jumps::Number(jumps) => jumps,
            Jumps::Tolerance(_) if wear => CONTROLLED_JUMPS,
            Jumps::Tolerance(_) => 1,
        };
        let stages = if self.integrator == Integrator::Sdirk2 { 2 } else { 1 };
        2 + stages * jumps
    }

    /// Contact problems that are solved together in a stage: the ends of a cycle.
    pub fn ends(&self) -> usize {
        match &self.motion {
            CycleMotion::Closed(closed) => 2 * closed.increments,
            CycleMotion::Sliding { .. } => 1,
        }
    }
}

impl Closed {
    /// Offsets along x, y from the centre at the ends of the increments of a cycle, the + end first; equal increments.
    pub fn offsets(&self) -> Vec<[f64; 2]> {
        self.offsets_at(|part| part)
    }

    /// The same with increments of a line that begin short and grow in proportion to their number where the displacement is
    /// prescribed: just after the reversal slip spreads over the contact.
    pub fn graded_offsets(&self) -> Vec<[f64; 2]> {
        let graded = self.drive == Drive::Shift && self.amplitude[1] == 0.0;
        self.offsets_at(|part| if graded { part * part } else { part })
    }

    /// Offsets at the parts `of` 1/K, 2/K, .. 1 of both strokes.
    fn offsets_at(&self, of: impl Fn(f64) -> f64) -> Vec<[f64; 2]> {
        let k = self.increments as f64;
        let (s, c) = self.angle.sin_cos();
        let offset = |end: usize| {
            let at = end as f64;
            let [along, left] = if self.amplitude[1] == 0.0 {
                let back = end > self.increments;
                let along = self.amplitude[0] * (1.0 - 2.0 * of(if back { at - k } else { at } / k));
                [if back { -along } else { along }, 0.0]
            } else {
                let (sin, cos) = (std::f64::consts::PI * at / k).sin_cos();
                [self.amplitude[0] * cos, self.amplitude[1] * sin]
            };
            [along * c - left * s, along * s + left * c]
        };
        (0..2 * self.increments).map(offset).collect()
    }
}

/// How many cycles are taken at once.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Jumps {
    /// So many jumps of equal length.
    Number(usize),
    /// As many as keep the estimated error of the worn depth below a share of the largest.
    Tolerance(f64),
}

/// Steady rolling of the contact over both bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rolling {
    /// Direction in which the contact moves over the bodies, in quarter turns from the frame's x towards its y.
    pub quarter_turns: u8,
    /// Rigid slip of body 2 over body 1 per rolled distance, along the direction of rolling and to its left.
    pub creepage: [f64; 2],
    /// Rotation of body 2 relative to body 1 about the normal per rolled distance, 1/mm.
    pub spin: f64,
    /// Rolled distance, for wear and dissipation, mm.
    pub distance: f64,
}

/// Time integration of wear over a cycle jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Integrator {
    /// L-stable, second order, slip path taken at every stage.
    Sdirk2,
    /// Implicit, first order.
    BackwardEuler,
    /// Explicit Euler, first order, stable only below a critical jump.
    Explicit,
}

/// Place of a step among the load points of a history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Its number, from 0.
    pub index: usize,
    /// Number of load points.
    pub count: usize,
}

/// One load step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Name, for results.
    pub name: String,
    /// Normal control; `None` keeps what held before.
    pub normal: Option<Normal>,
    /// Tangential control; `None` keeps what held before.
    pub tangential: Option<Tangential>,
    /// Rotation about x, y or its moment; `None` keeps what held before.
    pub tilt: Option<Tilt>,
    /// Rotation about n or its moment; `None` keeps what held before.
    pub spin: Option<Spin>,
    /// Number of load increments.
    pub increments: usize,
    /// Whether friction acts in this step.
    pub friction: bool,
    /// Whether wear acts in this step.
    pub wear: bool,
    /// Fretting cycles or steady sliding instead of a monotone step.
    pub cycles: Option<Cycles>,
    /// Which load point of a history it is; its increments are numbered on from those before.
    pub row: Option<Row>,
    /// Steady rolling instead of a monotone step.
    pub rolling: Option<Rolling>,
}
