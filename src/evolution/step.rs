//! What a step prescribes.

use schemars::JsonSchema;
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
    pub jumps: JumpPolicy,
    /// How a jump is integrated.
    pub integrator: Integrator,
}

/// Motion of body 2 in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CycleMotion {
    /// To and fro, or round an ellipse, about where it is at the start of the step.
    ClosedPath(ClosedPath),
    /// Steady sliding along a direction from the frame's x, radians.
    Sliding {
        /// The direction.
        angle: f64,
    },
}

/// A closed path of displacements or tangential forces about those at the start of the step, begun at its + end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedPath {
    /// What follows the path.
    pub drive: Drive,
    /// Half-axes: along `angle`, and a quarter turn to the left of it (0 for a line), mm or N.
    pub amplitude: [f64; 2],
    /// Direction from the frame's x, radians.
    pub angle: f64,
    /// Increments per stroke, half a cycle, between the ends that are solved together.
    pub increments: usize,
    /// Resolved cycles, which show what wears between the reversal points; `None` if there are none.
    pub resolved_cycles: Option<ResolvedCycleSettings>,
}

/// Cycles whose strokes are taken in many increments, one after the other, beside those whose reversal points are solved together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResolvedCycleSettings {
    /// Relative tolerance of the wear of a cycle (largest of volume and root-mean-square depth), to which strokes are refined.
    pub tolerance: f64,
    /// What they are used for.
    pub correction: Correction,
    /// Estimated relative errors of the wear above this are warned of.
    pub error_warning: f64,
}

/// What resolved cycles change.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Correction {
    /// Wear is corrected, by a new resolved cycle wherever the slip has changed.
    Always,
    /// The same, but not while all of the contact slides and the first resolved cycle agrees within the tolerance.
    WhereNeeded,
    /// Wear stays as it is; one resolved cycle at the start of the step measures its error.
    Never,
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
const TYPICAL_CONTROLLED_JUMPS: usize = 6;

impl Cycles {
    /// Farthest that body 2 is moved from where it is at the start of the step, mm; `None` where forces move it.
    pub fn reach(&self) -> Option<f64> {
        match &self.motion {
            CycleMotion::ClosedPath(closed) if closed.drive == Drive::Force => None,
            CycleMotion::ClosedPath(closed) => Some(closed.amplitude[0].max(closed.amplitude[1])),
            CycleMotion::Sliding { .. } => Some(0.0),
        }
    }

    /// Cycles that are usually solved: those of the stages of all jumps, and the first strokes before them.
    pub fn expected_solves(&self, wear: bool) -> usize {
        let jumps = match self.jumps {
            JumpPolicy::Number(jumps) => jumps,
            JumpPolicy::Tolerance(_) if wear => TYPICAL_CONTROLLED_JUMPS,
            JumpPolicy::Tolerance(_) => 1,
        };
        let stages = if self.integrator == Integrator::Sdirk2 { 2 } else { 1 };
        2 + stages * jumps
    }

    /// Contact problems that are solved together in a stage: the ends of a cycle.
    pub fn n_path_points(&self) -> usize {
        match &self.motion {
            CycleMotion::ClosedPath(closed) => 2 * closed.increments,
            CycleMotion::Sliding { .. } => 1,
        }
    }
}

impl ClosedPath {
    /// Offsets along x, y from the centre at the ends of the increments of a cycle, the + end first; equal increments.
    pub fn offsets(&self) -> Vec<[f64; 2]> {
        self.offsets_at(|part| part)
    }

    /// The same with graded increments of a line where the displacement is prescribed: increment k of K ends at (k/K)^m of its stroke, so
    /// that increments are short after each reversal, where slip spreads over the contact. `transition` (0 to 1) is the share of the stroke
    /// in which it does so: m = max(2, log2(1/transition)) puts the first of two increments at its end.
    pub fn graded_offsets(&self, transition: f64) -> Vec<[f64; 2]> {
        let graded = self.drive == Drive::Shift && self.amplitude[1] == 0.0;
        let exponent = transition.recip().log2().max(2.0);
        self.offsets_at(|part| if graded { part.powf(exponent) } else { part })
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
pub enum JumpPolicy {
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

/// Time integration of wear over a jump of many cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Integrator {
    /// Implicit, second order, L-stable (stable for jumps of any length).
    #[default]
    Sdirk2,
    /// Implicit, first order.
    BackwardEuler,
    /// Explicit, first order; stable for small jumps only.
    Explicit,
}

/// Place of a step among the load points of a history.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HistoryRow {
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
    pub history_row: Option<HistoryRow>,
    /// Steady rolling instead of a monotone step.
    pub rolling: Option<Rolling>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Truth: increments begin at one reversal point and end at the next, each further along; the first of two ends where the transition
    /// does, or at a quarter of the stroke.
    #[test]
    fn graded_increments() {
        let path = |increments: usize| ClosedPath {
            drive: Drive::Shift,
            amplitude: [2.0, 0.0],
            angle: 0.0,
            increments,
            resolved_cycles: None,
        };
        for (transition, first) in [(1.0, 0.25), (0.25, 0.25), (0.05, 0.05)] {
            let offsets = path(2).graded_offsets(transition);
            assert!((offsets[1][0] - (2.0 - 4.0 * first)).abs() < 1e-14, "{offsets:?}");
            let offsets = path(8).graded_offsets(transition);
            assert_eq!((offsets.len(), offsets[0][0], offsets[8][0]), (16, 2.0, -2.0));
            assert!(offsets[..9].windows(2).all(|pair| pair[1][0] < pair[0][0]), "{offsets:?}");
            assert!((0..8).all(|k| offsets[k + 8][0] == -offsets[k][0]), "{offsets:?}");
        }
    }
}
